//! Frames of one sensor as files: the format is told by the name's end.
//!
//! | ends with | holds |
//! |---|---|
//! | `.csv` | a recording of 8 x 8 frames in the sensor's own steps; of any other resolution a table of degrees |
//! | `.npz` | arrays for numpy: `frames`, `time_s`, `thermistor_c`, `metadata` |
//! | `.png` | frames side by side on one scale of colors |
//! | `.gif` | the same one after the other, as fast as they were taken |

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

/// Writes the frames of a film, calls back after each, and returns what was written.
pub type FilmFormat = fn(&Film<'_>, &mut dyn Write, &dyn Fn()) -> Result<String, ExportError>;

/// The ends of names that [`format()`] knows, for a hint.
pub const ENDS: &str = ".csv, .npz, .png or .gif";

/// How a film is written to a file whose name ends so; nothing if that is not known.
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
