//! The verdict's thresholds and the source of each, from the built-in file or from one that the user names.

use crate::metrics::SENSOR_ACCURACY_C;
use crate::numbers::count;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::Range;
use toml::Spanned;

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

/// Why a thresholds file was rejected.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages say what each is")]
pub enum ThresholdError {
    #[error("{file}:{line}:{column}: {message}\nhint: {hint}")]
    Malformed {
        file: String,
        line: usize,
        column: usize,
        message: String,
        hint: String,
    },
    #[error(
        "{file}: {found} bytes of text, expected at most {TEXT_BYTES_MAX}\nhint: is this a thresholds file?"
    )]
    TooLong { file: String, found: usize },
}

impl ThresholdSet {
    /// The built-in thresholds.
    #[must_use]
    pub fn shipped() -> Self {
        let lines = KEYS.iter().map(|key| ThresholdLine {
            key: key.name,
            value: (key.get)(&Thresholds::default()),
            source: shipped_source(key.name),
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
    /// [`ThresholdError`] with line, column and key.
    pub fn parse(text: &str, origin: &str) -> Result<Self, ThresholdError> {
        if text.len() > TEXT_BYTES_MAX {
            return Err(ThresholdError::TooLong {
                file: origin.to_owned(),
                found: text.len(),
            });
        }
        let file = File { origin, text };
        let mut entries: Entries = toml::from_str(text).map_err(|error| file.malformed(&error))?;
        let mut set = Self::shipped();
        for (key, line) in KEYS.iter().zip(&mut set.lines) {
            if let Some(entry) = entries.remove(key.name) {
                file.take(key, &entry.into_inner(), &mut set.thresholds, line)?;
            }
        }
        match entries.iter().next() {
            Some((name, entry)) => Err(file.unknown(name, entry.span())),
            None => Ok(set),
        }
    }
}

type Entries = BTreeMap<String, Spanned<Entry>>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    value: Spanned<f64>,
    source: Spanned<String>,
}

struct Key {
    name: &'static str,
    range: (f64, f64),
    get: fn(&Thresholds) -> f64,
    set: fn(&mut Thresholds, f64),
}

macro_rules! thresholds {
    ($(#[doc = $doc:literal] $name:ident = $default:expr, $range:expr;)+) => {
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
            range: $range,
            get: |thresholds| thresholds.$name,
            set: |thresholds, value| thresholds.$name = value,
        }),+];
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
    drift_max_c = 1.0, (0.0, 100.0);
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

fn shipped_source(name: &str) -> String {
    let entries: Entries = toml::from_str(SHIPPED).unwrap_or_default();
    entries
        .get(name)
        .map(|entry| entry.get_ref().source.get_ref().clone())
        .unwrap_or_default()
}

struct File<'a> {
    origin: &'a str,
    text: &'a str,
}

impl File<'_> {
    fn take(
        &self,
        key: &Key,
        entry: &Entry,
        thresholds: &mut Thresholds,
        line: &mut ThresholdLine,
    ) -> Result<(), ThresholdError> {
        let (name, value, (least, most)) = (key.name, *entry.value.get_ref(), key.range);
        if !(least..=most).contains(&value) {
            let message = format!("`{name}.value` is {value}, expected {least} to {most}");
            let hint = "crates/grideye-validator/thresholds.toml has a good value for every key";
            return Err(self.refused(entry.value.span(), message, hint));
        }
        let source = entry.source.get_ref().trim();
        if source.is_empty() {
            let message = format!("`{name}.source` is empty, expected where the number comes from");
            let hint = "give the reason for this value: the report prints it";
            return Err(self.refused(entry.source.span(), message, hint));
        }
        (key.set)(thresholds, value);
        *line = ThresholdLine {
            key: name,
            value,
            source: source.to_owned(),
            file: self.origin.to_owned(),
        };
        Ok(())
    }

    fn unknown(&self, name: &str, span: Range<usize>) -> ThresholdError {
        let known: Vec<&str> = KEYS.iter().map(|key| key.name).collect();
        let hint = format!("the thresholds are {}", known.join(", "));
        self.refused(span, format!("`{name}` is not a threshold"), &hint)
    }

    fn malformed(&self, error: &toml::de::Error) -> ThresholdError {
        let message = error.message().trim_end().replace('\n', ", ");
        self.refused(
            error.span().unwrap_or_default(),
            message.replace("expected f64", "expected a number"),
            "each threshold is a table with a number and a text, such as [offset_max_c], value = 2.5, source = \"why\"",
        )
    }

    fn refused(&self, span: Range<usize>, message: String, hint: &str) -> ThresholdError {
        let before = self.text.get(..span.start).unwrap_or(self.text);
        let line_start = before.rfind('\n').map_or(0, |end| end + 1);
        ThresholdError::Malformed {
            file: self.origin.to_owned(),
            line: before.matches('\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
            message,
            hint: hint.to_owned(),
        }
    }
}

pub(crate) fn too_few(frames: usize, thresholds: &Thresholds) -> bool {
    count(frames) < thresholds.frames_min
}
