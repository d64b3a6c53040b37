//! The verdict's thresholds and the source of each, from the built-in file or from one that the user names.

use crate::metrics::SENSOR_ACCURACY_C;
use crate::numbers::count;
use grideye_text::{Kind, Number, Refusal, Row, Rows, Style};
use serde::Serialize;
use toml::de::DeTable;

/// The file used unless another is named.
pub const SHIPPED: &str = include_str!("../thresholds.toml");
/// Its name in reports.
pub const SHIPPED_NAME: &str = "thresholds.toml (built in)";
/// Longest thresholds file, bytes.
pub const TEXT_BYTES_MAX: usize = 64 * 1024;

/// All thresholds, each with its source.
#[derive(Debug, Clone, PartialEq)]
pub struct ThresholdSet {
    /// The values.
    pub thresholds: Thresholds,
    /// Value and source of each, in the order of the built-in file.
    pub lines: Vec<ThresholdLine>,
}

/// One threshold and its source.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the names say it")]
pub struct ThresholdLine {
    pub key: &'static str,
    /// In the unit of the key's suffix (`_c` is °C); shares are 0 to 1.
    pub value: f64,
    /// Why this value, from the file.
    pub source: String,
    pub file: String,
}

impl ThresholdSet {
    /// The built-in thresholds.
    #[must_use]
    pub fn shipped() -> Self {
        let shipped = DeTable::parse(SHIPPED).ok();
        let source = |name| {
            let entry = shipped.as_ref()?.get_ref().get(name)?.get_ref();
            entry.get("source")?.get_ref().as_str().map(str::to_owned)
        };
        let lines = KEYS.iter().map(|key| ThresholdLine {
            key: key.name,
            value: (key.get)(&Thresholds::default()),
            source: source(key.name).unwrap_or_default(),
            file: SHIPPED_NAME.to_owned(),
        });
        Self {
            thresholds: Thresholds::default(),
            lines: lines.collect(),
        }
    }

    /// Reads a file named `origin` in messages. Keys it leaves out keep their built-in value.
    ///
    /// # Errors
    /// The first mistake, with line, column and key.
    pub fn parse(text: &str, origin: &str) -> Result<Self, Refusal> {
        grideye_text::read((origin, text), &STYLE, &ROWS, |table| {
            let mut set = Self::shipped();
            for (key, line) in KEYS.iter().zip(&mut set.lines) {
                let Some(entry) = table.table(key.name) else {
                    continue;
                };
                line.value = entry.number("value").unwrap_or(line.value);
                line.source = entry.text("source").unwrap_or_default().trim().to_owned();
                origin.clone_into(&mut line.file);
                (key.set)(&mut set.thresholds, line.value);
            }
            Ok(set)
        })
    }
}

const STYLE: Style = {
    let hint = "each threshold is a table with a number and a text, such as [offset_max_c], value = 2.5, source = \"why\"";
    Style {
        unknown: hint,
        missing: hint,
        mistyped: hint,
        no_toml: hint,
        bytes_max: (TEXT_BYTES_MAX, "is this a thresholds file?"),
        names_key: false,
        ..Style::EMPTY
    }
};

struct Key {
    name: &'static str,
    get: fn(&Thresholds) -> f64,
    set: fn(&mut Thresholds, f64),
}

macro_rules! thresholds {
    ($(#[doc = $doc:literal] $name:ident = $default:expr, ($low:expr, $high:expr);)+) => {
        /// The verdict's limits.
        #[derive(Debug, Clone, Copy, PartialEq, Serialize)]
        pub struct Thresholds {
            $(#[doc = $doc] pub $name: f64,)+
        }

        impl Default for Thresholds {
            fn default() -> Self {
                Self { $($name: $default),+ }
            }
        }

        const KEYS: &[Key] = &[$(Key {
            name: stringify!($name),
            get: |thresholds| thresholds.$name,
            set: |thresholds, value| thresholds.$name = value,
        }),+];

        /// The keys of a file of thresholds.
        pub static ROWS: Rows = Rows {
            rows: &[&[$(Row {
                key: stringify!($name),
                name_at: 0,
                kind: Kind::Table(&Rows {
                    rows: &[&[
                        Row {
                            key: concat!(stringify!($name), ".value"),
                            name_at: stringify!($name).len() + 1,
                            kind: Kind::Number(Number::Within($low, $high)),
                            unit: "",
                            told: "",
                            doc: "crates/grideye-validator/thresholds.toml has a good value for every key",
                        },
                        Row {
                            key: concat!(stringify!($name), ".source"),
                            name_at: stringify!($name).len() + 1,
                            kind: Kind::Text(|source| !source.trim().is_empty()),
                            unit: "",
                            told: "where the number comes from",
                            doc: "give the reason for this value: the report prints it",
                        },
                    ]],
                    required: &["value", "source"],
                    ..Rows::EMPTY
                }),
                unit: "",
                told: "",
                doc: $doc,
            }),+]],
            ..Rows::EMPTY
        };
    };
}

thresholds! {
    /// Share of right recordings that are refused.
    right_min = 0.015, (0.005, 0.5);
    /// Standard deviation of what unit and room add to each pixel if no profile knows it, °C.
    background_spread_c = 0.38, (0.0, 100.0);
    /// Standard deviation of the fixed pattern of a unit without a profile, °C.
    pattern_spread_c = 0.26, (0.0, 100.0);
    /// Largest common offset of a unit without a profile, °C.
    offset_max_c = SENSOR_ACCURACY_C, (0.0, 100.0);
    /// Standard deviation of the error of the scene's ambient temperature, °C.
    ambient_spread_c = 0.3, (0.0, 100.0);
    /// Largest drift against the scene however short the recording, °C, ...
    drift_max_c = 0.5, (0.0, 100.0);
    /// ... and for each minute of it, °C.
    drift_max_c_per_min = 0.15, (0.0, 100.0);
    /// A pixel is warm from this many sigmas of the sensor's noise above the background.
    warm_sigma = 4.0, (0.0, 100.0);
    /// Fewest real frames.
    frames_min = 2.0, (1.0, 1000.0);
    /// Largest share of right recordings by a sound unit that may fail each criterion.
    false_alarm_max = 0.001, (1e-12, 0.5);
    /// Largest relative error of the frame rate.
    rate_error_max = 0.1, (0.0, 10.0);
    /// Largest difference between pixels and thermistor, °C.
    thermistor_apart_max_c = 12.0, (0.0, 1000.0);
}

pub(crate) fn too_few(frames: usize, thresholds: &Thresholds) -> bool {
    count(frames) < thresholds.frames_min
}
