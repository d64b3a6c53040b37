//! Unknowns of a scene: numbers of its file that a recording is to tell, each `[[fit]]` with a `key` and `bounds`.
//!
//! A scene with unknowns can be simulated as it stands; [`with_values`] changes the numbers and no other byte.

use crate::text::Place;
use std::ops::Range;

/// Unknowns of a scene at most: more than a recording of 64 pixels tells apart.
pub const FITS_MAX: usize = 16;

/// The time of the scene at the recording's first frame, seconds: the one unknown that does not stand in the file.
pub const RECORDING_START: &str = "recording.start_s";

/// One unknown.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Fit {
    /// What is unknown, as the file spells it: `room.ambient_c`, `sensor.ceiling.position_mm.x`, [`RECORDING_START`].
    pub key: String,
    /// Where the file says so.
    pub place: Place,
    /// The least and the greatest value, in the key's own unit.
    pub bounds: [f64; 2],
    /// The value that stands in the file; for [`RECORDING_START`] the value nearest to 0 inside the bounds.
    pub value: f64,
    /// Where the value stands in the text, in bytes; `None` for [`RECORDING_START`].
    pub value_span: Option<Range<usize>>,
    /// The byte at which the line of the table's `key` begins: where a remark on it can be put.
    pub remark_at: usize,
}

/// The file's text with these numbers in the places of its unknowns; one number for each, in their order.
///
/// # Panics
/// If `fits` are not those of this text.
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
