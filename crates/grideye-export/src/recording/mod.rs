//! Recordings and simulated frames as files for other programs; the file extension selects the format.
//!
//! | extension | holds |
//! |---|---|
//! | `.csv` | this project's recording format, `recordings/README.md`; of other than 8 x 8 pixels, a table of degrees |
//! | `.npz` | arrays for numpy (`recording/arrays.rs`) |
//! | `.parquet` | the columns of the recording format, typed (`recording/columns.rs`) |
//! | `.mcap` | messages of ROS 2 (`recording/messages.rs`) |
//! | `.png` | frames of one sensor side by side on one color scale |
//! | `.gif` | the same one after another, as fast as they were read |

mod arrays;
mod columns;
mod frames;
mod messages;
mod moving;
mod rows;
mod sheet;
mod text;

pub use rows::{Out, Row, Rows};

use crate::error::ExportError;

/// Writes rows, and returns a description of the result.
pub type Format = fn(Rows<'_>, &mut dyn Out) -> Result<String, ExportError>;

/// The extensions that [`format()`] knows, for a hint.
pub const ENDS: &str = ".csv, .npz, .parquet, .mcap, .png or .gif";

const FORMATS: [(&str, Format); 6] = [
    ("csv", text::write),
    ("npz", arrays::write),
    ("parquet", columns::write),
    ("mcap", messages::write),
    ("png", sheet::write),
    ("gif", moving::write),
];

/// The writer for this extension; `None` if unknown.
#[must_use]
pub fn format(extension: &str) -> Option<Format> {
    let format = FORMATS.iter().find(|(name, _)| *name == extension);
    format.map(|(_, format)| *format)
}
