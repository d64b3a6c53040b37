//! Unknowns of a scene: numbers of its file that are to be found from a recording, each between two bounds.
//!
//! ```text
//! [[fit]]
//! key = "sensor.ceiling.elevation_deg"      # the number in the file is where the search starts
//! bounds = [80, 90]
//! ```
//!
//! A scene with `[[fit]]` tables is a scene like any other: who does not look for the unknowns takes the numbers as
//! they stand. [`with_values`] puts other numbers in their places and leaves every other byte of the file alone.
//!
//! ```
//! use grideye_scene::{Scene, fit};
//! use std::collections::BTreeMap;
//!
//! let text = "[room]\nsize_mm = [4000, 6000, 2700]\nambient_c = 20 # guessed\n\n\
//!             [[fit]]\nkey = \"room.ambient_c\"\nbounds = [15, 25]\n";
//! let loaded = Scene::parse(text, "room.toml", &BTreeMap::new())?;
//! assert_eq!((loaded.fits[0].value, loaded.fits[0].bounds), (20.0, [15.0, 25.0]));
//! assert!(fit::with_values(text, &loaded.fits, &[21.5]).contains("ambient_c = 21.5 # guessed"));
//! # Ok::<(), grideye_scene::SceneError>(())
//! ```

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
