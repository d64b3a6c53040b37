//! Recordings as files for other programs: the format is told by the name's end.
//!
//! | ends with | holds |
//! |---|---|
//! | `.csv` | this project's recording format, `recordings/README.md` |
//! | `.npz` | arrays for numpy: see [`arrays`] |
//! | `.parquet` | the columns of the recording format, typed: see [`columns`] |
//! | `.mcap` | messages of Foxglove's `RawImage`: see [`messages`] |
//! | `.png` | frames of one sensor side by side on one scale of colours |
//! | `.gif` | the same one after the other, as fast as they were read |

mod arrays;
mod columns;
mod film;
mod messages;

use super::{moving, sheet};
use crate::exit::bad_input;
use crate::{files, progress};
use anyhow::{Result, anyhow};
use grideye_recording::Row;
use grideye_recording::csv::Writer;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// The rows of a recording, as they are read.
pub(crate) type Rows<'a> = &'a mut dyn Iterator<Item = Result<Row>>;

/// A file that is being written.
pub(crate) type Out<'a, 'b> = &'a mut BufWriter<&'b File>;

/// Writes rows, and says what was written.
pub(crate) type Format = fn(Rows<'_>, Out<'_, '_>) -> Result<String>;

/// The formats that [`write()`] knows, by the end of a file's name.
const FORMATS: [(&str, Format); 6] = [
    ("csv", text),
    ("npz", arrays::write),
    ("parquet", columns::write),
    ("mcap", messages::write),
    ("png", |rows, out| film::write(rows, out, sheet::write)),
    ("gif", |rows, out| film::write(rows, out, moving::write)),
];

/// How a file is written whose name ends so; nothing if that is not known.
pub(crate) fn format(extension: &str) -> Option<Format> {
    let format = FORMATS.iter().find(|(name, _)| *name == extension);
    format.map(|(_, format)| *format)
}

/// Writes the rows in the format that the name of the file asks for.
pub(crate) fn write(rows: Rows<'_>, out: &Path) -> Result<()> {
    let extension = out.extension().and_then(|extension| extension.to_str());
    let format = extension.and_then(format).ok_or_else(|| {
        bad_input(anyhow!(
            "cannot tell what to write from the name {}\nhint: end it with .csv, .npz, .parquet, .mcap, .png or .gif",
            out.display()
        ))
    })?;
    let mut written = String::new();
    files::write_whole(out, |file| {
        written = format(rows, file)?;
        Ok(())
    })?;
    progress::say(&format!("wrote {written} to {}", out.display()));
    Ok(())
}

fn text(rows: Rows<'_>, out: Out<'_, '_>) -> Result<String> {
    let mut writer = Writer::new(out)?;
    for row in rows {
        writer.write(&row?)?;
    }
    let written = writer.rows();
    writer.finish()?;
    Ok(format!("{written} rows"))
}
