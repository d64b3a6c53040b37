//! Recordings as files for other programs; the file extension selects the format.
//!
//! | extension | holds |
//! |---|---|
//! | `.csv` | this project's recording format, `recordings/README.md` |
//! | `.npz` | arrays for numpy (`recording/arrays.rs`) |
//! | `.parquet` | the columns of the recording format, typed (`recording/columns.rs`) |
//! | `.mcap` | Foxglove `RawImage` messages (`recording/messages.rs`) |
//! | `.png` | frames of one sensor side by side on one color scale |
//! | `.gif` | the same one after another, as fast as they were read |

mod arrays;
mod columns;
mod messages;
mod pictures;
mod rows;

pub use rows::{Out, Rows};

use crate::error::ExportError;
use crate::film;
use grideye_recording::csv::Writer;

/// Writes rows, and returns a description of the result.
pub type Format = fn(Rows<'_>, &mut dyn Out) -> Result<String, ExportError>;

/// The extensions that [`format()`] knows, for a hint.
pub const ENDS: &str = ".csv, .npz, .parquet, .mcap, .png or .gif";

const FORMATS: [(&str, Format); 6] = [
    ("csv", text),
    ("npz", arrays::write),
    ("parquet", columns::write),
    ("mcap", messages::write),
    ("png", |rows, out| {
        pictures::write(rows, out, film::write_png)
    }),
    ("gif", |rows, out| {
        pictures::write(rows, out, film::write_gif)
    }),
];

/// The writer for this extension; `None` if unknown.
#[must_use]
pub fn format(extension: &str) -> Option<Format> {
    let format = FORMATS.iter().find(|(name, _)| *name == extension);
    format.map(|(_, format)| *format)
}

fn text(rows: Rows<'_>, out: &mut dyn Out) -> Result<String, ExportError> {
    let mut writer = Writer::with_labels(out, rows.labels)?;
    for row in rows {
        writer.write(&row?)?;
    }
    let written = writer.rows();
    writer.finish()?;
    Ok(format!("{written} rows"))
}
