//! What a scene does not know exactly: each `[[uncertain]]` table names a key and the law of its value, any value between
//! `bounds` or with `sd` a normal law, cut at the bounds.
//!
//! A scene with such tables can be simulated unchanged; [`with_values`] replaces the numbers and no other byte.

use grideye_text::Place;
use std::ops::Range;

/// Limit on the numbers that a calibration finds: more than a recording of 64 pixels can distinguish.
pub const FITTED_MAX: usize = 16;

/// The scene time at the recording's first frame, seconds: no number of the file.
pub const RECORDING_START: &str = "recording.start_s";

/// Bounds that nobody gave are this many standard deviations from the mean.
pub const SDS_MAX: f64 = 4.0;

/// One `[[uncertain]]` table.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Uncertain {
    /// The key as spelled in the file: `room.ambient_c`, `sensor.ceiling.position_mm.x`, `agent.anna.aside_m`.
    pub key: String,
    /// Where the file marks it.
    pub place: Place,
    /// The lowest and the highest value, in the key's own unit.
    pub bounds: [f64; 2],
    /// A normal law of the value, known before the recording; cut at the bounds. `None`: any value between them.
    pub law: Option<Normal>,
    /// What a calibration left unknown of it: a standard deviation around the value in the file.
    pub found_sd: Option<f64>,
    /// Whether the law's mean is the value in the file: whoever replaces the value must write the mean out.
    pub is_mean_the_value: bool,
    /// Whether a calibration finds it: a number of the file, or [`RECORDING_START`] within given bounds. The others
    /// only say how far the scene may be from the room and still be right.
    pub is_fitted: bool,
    /// The correlation time of `agent.NAME.wander_m`, seconds.
    pub over_s: Option<f64>,
    /// The value in the file; for keys without a number in the file, the value nearest to 0 within the bounds.
    pub value: f64,
    /// The byte range of the value in the text; `None` for keys without a number in the file.
    pub value_span: Option<Range<usize>>,
    /// The byte where the line of the table's `key` starts, for inserting a comment.
    pub remark_at: usize,
}

/// A normal law, in the key's own unit.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Normal {
    pub mean: f64,
    pub sd: f64,
}

impl Normal {
    /// The value below which a share of the law is, 0 to 1, when cut at these bounds; the same on every machine.
    #[must_use]
    pub fn quantile(self, [low, high]: [f64; 2], share: f64) -> f64 {
        let below = |value: f64| {
            let sds = (value - self.mean) / self.sd;
            0.5 * libm::erfc(-sds * std::f64::consts::FRAC_1_SQRT_2)
        };
        if share <= 0.0 {
            return low;
        }
        if share >= 1.0 {
            return high;
        }
        let sought = below(low) + share * (below(high) - below(low));
        let (mut under, mut over) = (low, high);
        // Each step gains one bit of 53.
        for _ in 0..60 {
            let middle = under + 0.5 * (over - under);
            if below(middle) < sought {
                under = middle;
            } else {
                over = middle;
            }
        }
        over
    }
}

impl Uncertain {
    /// What is known of the value now: what a calibration left open around it, no wider than the law before it.
    #[must_use]
    pub fn known(&self) -> Option<Normal> {
        let found = self.found_sd.zip(self.law).map(|(sd, law)| Normal {
            mean: self.value,
            sd: sd.min(law.sd),
        });
        found.or(self.law)
    }
}

/// What a key without a number in the file says of the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Claim<'k> {
    /// When the recording starts.
    Start,
    /// Where the agent of this name is, or `*`: all agents.
    Aside(&'k str),
    /// How it moves about its way.
    Wander(&'k str),
    /// Its warmth over the room.
    Contrast(&'k str),
    /// The difference of each pixel, of unit and room.
    Background,
}

impl<'k> Claim<'k> {
    pub(crate) fn of(key: &'k str) -> Option<Self> {
        match key {
            RECORDING_START => return Some(Self::Start),
            "room.background_c" => return Some(Self::Background),
            _ => {}
        }
        let (name, last) = key.strip_prefix("agent.")?.rsplit_once('.')?;
        Some(match last {
            "aside_m" => Self::Aside(name),
            "wander_m" => Self::Wander(name),
            "contrast" => Self::Contrast(name),
            _ => return None,
        })
    }
}

/// Laws for people whose table gives none, by the end of their key, as far as the mean is within the bounds:
/// stature of adults of both sexes (ANSUR II, US Army 2012: 1756 and 1628 mm, sd 69 and 64, together 92), girth (waist and
/// chest of the same, sd 8 to 12 %), and clothing indoors (ISO 9920: 0.5 clo in summer, 1 in winter, 2 in a coat).
pub(crate) const OF_PEOPLE: [(&str, Normal); 3] = [
    (
        ".person.height_mm",
        Normal {
            mean: 1700.0,
            sd: 100.0,
        },
    ),
    (".person.build", Normal { mean: 1.0, sd: 0.1 }),
    (".person.clothing", Normal { mean: 1.0, sd: 0.5 }),
];

/// The file's text with its numbers replaced by these, one for each of `uncertain`, in order.
///
/// # Panics
/// If `uncertain` belong to another text.
#[must_use]
pub fn with_values(text: &str, uncertain: &[Uncertain], values: &[f64]) -> String {
    let mut edits: Vec<(Range<usize>, String)> = uncertain
        .iter()
        .zip(values)
        .filter_map(|(one, value)| Some((one.value_span.clone()?, value.to_string())))
        .collect();
    edits.sort_by_key(|(span, _)| std::cmp::Reverse(span.start));
    let mut text = text.to_owned();
    for (span, number) in edits {
        text.replace_range(span, &number);
    }
    text
}
