//! Recordings as files for other programs: the format is told by the name's end.
//!
//! | ends with | holds |
//! |---|---|
//! | `.csv` | this project's recording format, `recordings/README.md` |
//! | `.npz` | arrays for numpy (`recording/arrays.rs`) |
//! | `.parquet` | the columns of the recording format, typed (`recording/columns.rs`) |
//! | `.mcap` | messages of Foxglove's `RawImage` (`recording/messages.rs`) |
//! | `.png` | frames of one sensor side by side on one scale of colors |
//! | `.gif` | the same one after the other, as fast as they were read |

mod arrays;
mod columns;
mod messages;
mod pictures;
mod rows;

pub use rows::{Out, Rows};

use crate::error::ExportError;
use crate::film;
use grideye_recording::csv::Writer;

/// Writes rows, and returns what was written.
pub type Format = fn(Rows<'_>, &mut dyn Out) -> Result<String, ExportError>;

/// The ends of names that [`format()`] knows, for a hint.
pub const ENDS: &str = ".csv, .npz, .parquet, .mcap, .png or .gif";

/// The formats that [`format()`] knows, by the end of a file's name.
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

/// How a file is written whose name ends so; nothing if that is not known.
#[must_use]
pub fn format(extension: &str) -> Option<Format> {
    let format = FORMATS.iter().find(|(name, _)| *name == extension);
    format.map(|(_, format)| *format)
}

fn text(rows: Rows<'_>, out: &mut dyn Out) -> Result<String, ExportError> {
    let mut writer = Writer::new(out)?;
    for row in rows {
        writer.write(&row?)?;
    }
    let written = writer.rows();
    writer.finish()?;
    Ok(format!("{written} rows"))
}
