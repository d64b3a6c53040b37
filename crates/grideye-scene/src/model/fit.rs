//! Unknowns of a scene: numbers that a calibration finds from a recording, each a `[[fit]]` with a `key` and a law of what
//! is known of it: any value between `bounds`, or with `sd` a normal law, cut at the bounds.
//!
//! A scene with unknowns can be simulated unchanged; [`with_values`] replaces the numbers and no other byte.

use crate::text::Place;
use std::ops::Range;

/// Limit on a scene's unknowns: more than a recording of 64 pixels can distinguish.
pub const FITS_MAX: usize = 16;

/// The scene time at the recording's first frame, seconds: the only unknown outside the file.
pub const RECORDING_START: &str = "recording.start_s";

/// One unknown.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Fit {
    /// The key as spelled in the file: `room.ambient_c`, `sensor.ceiling.position_mm.x`, [`RECORDING_START`].
    pub key: String,
    /// Where the file marks it.
    pub place: Place,
    /// The lowest and the highest value, in the key's own unit.
    pub bounds: [f64; 2],
    /// A normal law of the value, known before the recording; cut at the bounds. `None`: any value between them.
    pub law: Option<Normal>,
    /// Whether the law's mean is the value in the file: whoever replaces the value must write the mean out.
    pub is_mean_the_value: bool,
    /// The value in the file; for [`RECORDING_START`], the value nearest to 0 within the bounds.
    pub value: f64,
    /// The byte range of the value in the text; `None` for [`RECORDING_START`].
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

/// Laws for people whose `[[fit]]` gives none, by the end of their key, as far as the mean is within the bounds:
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

/// The file's text with its unknowns replaced by these numbers, one for each, in order.
///
/// # Panics
/// If `fits` belong to another text.
#[must_use]
pub fn with_values(text: &str, fits: &[Fit], values: &[f64]) -> String {
    let mut edits: Vec<(Range<usize>, String)> = fits
        .iter()
        .zip(values)
        .filter_map(|(fit, value)| Some((fit.value_span.clone()?, value.to_string())))
        .collect();
    edits.sort_by_key(|(span, _)| std::cmp::Reverse(span.start));
    let mut text = text.to_owned();
    for (span, number) in edits {
        text.replace_range(span, &number);
    }
    text
}
