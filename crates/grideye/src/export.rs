//! Frames and recordings under the name that the user gave: its end chooses the format.

use crate::exit::bad_input;
use crate::{files, progress};
use anyhow::Result;
use grideye_export::recording::{self, Rows};
use grideye_export::{ExportError, tiles};
use grideye_inputs::shown;
use grideye_scene::Image;
use std::path::Path;

/// Writes rows in the format of the file's extension; errors name what they were read from.
pub(crate) fn write(rows: Rows<'_>, out: &Path, input: Option<&Path>) -> Result<()> {
    let format = files::end(out).and_then(recording::format);
    let format = format.ok_or_else(|| files::unknown_end(out, recording::ENDS))?;
    let mut written = String::new();
    files::write_whole(out, |file| {
        written = format(rows, file).map_err(|error| match (&error, input) {
            // It names file and line.
            (ExportError::Row(_), _) | (_, None) => blamed(error),
            (_, Some(input)) => blamed(error).context(shown(input)),
        })?;
        Ok(())
    })?;
    progress::say(&format!("wrote {written} to {}", shown(out)));
    Ok(())
}

pub(crate) fn write_tiles(images: &[&Image], out: &Path) -> Result<()> {
    let size = images
        .first()
        .map_or((1, 1), |image| (image.columns, image.rows));
    let images = images.iter().zip(1..);
    let images = images.map(|(image, number)| (&*image.celsius, format!("{number}")));
    write_rows(&[images.collect()], size, out)
}

pub(crate) fn write_rows(
    rows: &[Vec<tiles::Tile<'_>>],
    size: (usize, usize),
    out: &Path,
) -> Result<()> {
    if files::end(out) != Some("png") {
        return Err(files::unknown_end(out, ".png"));
    }
    files::write_whole(out, |file| tiles::write(rows, size, file).map_err(blamed))
}

fn blamed(error: ExportError) -> anyhow::Error {
    match error.is_of_the_frames() {
        true => bad_input(error),
        false => error.into(),
    }
}
