//! Frames and recordings under the name that the user gave: its end chooses the format.

use crate::exit::bad_input;
use crate::{files, progress};
use anyhow::Result;
use grideye_export::film::{self, Film};
use grideye_export::recording::{self, Rows};
use grideye_export::{ExportError, tiles};
use grideye_scene::Image;
use std::path::Path;

/// Writes the film in the format of the file's extension.
pub(crate) fn write_film(film: &Film<'_>, out: &Path) -> Result<()> {
    let format = files::end(out).and_then(|end| film::format(film, end));
    let format = format.ok_or_else(|| files::unknown_end(out, film::ENDS))?;
    if files::end(out) == Some("csv") && !film.is_recording() {
        progress::say(&format!(
            "a recording holds 8 x 8 pixels, and {} has {} x {}: writing a table of degrees instead",
            film.sensor, film.columns, film.rows
        ));
    }
    let bar = progress::bar(u64::from(film.frames), "simulating");
    let mut written = String::new();
    files::write_whole(out, |file| {
        written = format(film, file, &|| bar.inc(1)).map_err(blamed)?;
        Ok(())
    })?;
    bar.finish_and_clear();
    progress::say(&format!("wrote {written} to {}", out.display()));
    Ok(())
}

/// Writes a recording's rows in the format of the file's extension.
pub(crate) fn write_recording(rows: Rows<'_>, [input, out]: [&Path; 2]) -> Result<()> {
    let format = files::end(out).and_then(recording::format);
    let format = format.ok_or_else(|| files::unknown_end(out, recording::ENDS))?;
    let mut written = String::new();
    files::write_whole(out, |file| {
        written = format(rows, file).map_err(|error| match error {
            // It names file and line.
            ExportError::Row(_) => blamed(error),
            _ => blamed(error).context(input.display().to_string()),
        })?;
        Ok(())
    })?;
    progress::say(&format!("wrote {written} to {}", out.display()));
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
