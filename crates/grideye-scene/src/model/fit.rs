//! Unknowns of a scene: numbers that a calibration finds from a recording, each a `[[fit]]` with a `key` and `bounds`.
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
    /// The value in the file; for [`RECORDING_START`], the value nearest to 0 within the bounds.
    pub value: f64,
    /// The byte range of the value in the text; `None` for [`RECORDING_START`].
    pub value_span: Option<Range<usize>>,
    /// The byte where the line of the table's `key` starts, for inserting a comment.
    pub remark_at: usize,
}

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
