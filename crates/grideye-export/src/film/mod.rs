//! Frames of one sensor as files; the file extension selects the format.
//!
//! | extension | holds |
//! |---|---|
//! | `.csv` | a recording for 8 x 8 frames, in the sensor's own steps; otherwise a table of degrees |
//! | `.npz` | arrays for numpy: `frames`, `time_s`, `thermistor_c`, `metadata` |
//! | `.png` | frames side by side on one color scale |
//! | `.gif` | the same one after another, as fast as they were measured |

mod arrays;
mod csv;
mod moving;
mod sheet;
mod source;

pub use moving::write as write_gif;
pub use sheet::write as write_png;
pub use source::Film;

use crate::error::ExportError;
use std::io::Write;

/// Writes the frames of a film, calls back after each, and returns a description of the result.
pub type FilmFormat = fn(&Film<'_>, &mut dyn Write, &dyn Fn()) -> Result<String, ExportError>;

/// The extensions that [`format()`] knows, for a hint.
pub const ENDS: &str = ".csv, .npz, .png or .gif";

/// The writer for this extension; `None` if unknown.
#[must_use]
pub fn format(film: &Film<'_>, extension: &str) -> Option<FilmFormat> {
    Some(match extension {
        "csv" if film.is_recording() => csv::recording,
        "csv" => csv::table,
        "npz" => arrays::write,
        "png" => sheet::write,
        "gif" => moving::write,
        _ => return None,
    })
}
