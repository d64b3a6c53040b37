//! Simulated frames as files: the format is told by the name's end.
//!
//! | ends with | holds |
//! |---|---|
//! | `.csv` | a recording of 8 x 8 frames in the sensor's own steps; of any other resolution a table of degrees |
//! | `.npz` | arrays for numpy: `frames`, `time_s`, `thermistor_c`, `metadata` |
//! | `.png` | frames side by side on one scale of colours |
//! | `.gif` | the same one after the other, as fast as they were taken |

mod csv;
mod font;
mod moving;
pub(crate) mod npz;
pub(crate) mod parquet;
mod picture;
pub(crate) mod raster;
pub(crate) mod recording;
mod sheet;
pub(crate) mod still;
mod tiles;

use crate::exit::bad_input;
use crate::{files, progress};
use anyhow::{Result, anyhow};
use grideye_frame::Celsius;
use grideye_scene::Image;
use std::io::Write;
use std::path::Path;
use std::time::Duration;

/// Frames of one sensor that can be made again at will, so that no format has to hold them all.
pub(crate) struct Film<'a> {
    pub(crate) scene: String,
    pub(crate) sensor: &'a str,
    pub(crate) seed: u64,
    pub(crate) columns: usize,
    pub(crate) rows: usize,
    pub(crate) frames: u32,
    pub(crate) sampling_hz: f64,
    pub(crate) ambient: Celsius,
    /// The frame of that number, from 0, and when it was taken.
    pub(crate) frame: &'a dyn Fn(u32) -> (Duration, Image),
}

/// Writes the frames of a film, calls back after each, and says what was written.
type Format = fn(&Film<'_>, &mut dyn Write, &dyn Fn()) -> Result<String>;

/// Writes the film in the format that the name of the file asks for.
pub(crate) fn write(film: &Film<'_>, out: &Path) -> Result<()> {
    let extension = out.extension().and_then(|extension| extension.to_str());
    let format: Format = match extension {
        Some("csv") if csv::is_recording(film) => csv::recording,
        Some("csv") => csv::table,
        Some("npz") => npz::write,
        Some("png") => sheet::write,
        Some("gif") => moving::write,
        _ => {
            return Err(bad_input(anyhow!(
                "cannot tell what to write from the name {}\nhint: end it with .csv, .npz, .png or .gif",
                out.display()
            )));
        }
    };
    let bar = progress::bar(u64::from(film.frames), "simulating");
    let mut written = String::new();
    files::write_whole(out, |file| {
        written = format(film, file, &|| bar.inc(1))?;
        Ok(())
    })?;
    bar.finish_and_clear();
    progress::say(&format!("wrote {written} to {}", out.display()));
    Ok(())
}

/// What is said behind the number of pictures where not every frame is one.
fn left_out(step: u32, frames: u32) -> String {
    if step > 1 {
        format!(", every {step}. of {frames},")
    } else {
        String::new()
    }
}

/// Writes images of one size side by side, on one scale of colours (.png).
pub(crate) fn write_tiles(images: &[&Image], out: &Path) -> Result<()> {
    if out.extension().is_none_or(|extension| extension != "png") {
        return Err(bad_input(anyhow!(
            "cannot tell what to write from the name {}\nhint: end it with .png",
            out.display()
        )));
    }
    files::write_whole(out, |file| tiles::write(images, file))
}
