//! Arrays for numpy of a film.
//!
//! | array | type | shape | holds |
//! |---|---|---|---|
//! | `frames` | float32 | (N, rows, columns) | °C, row 0 at the top, without the sensor's steps |
//! | `time_s` | float64 | (N) | seconds since the scene's start |
//! | `thermistor_c` | float32 | (N) | °C, the room's temperature |
//! | `metadata` | str | () | JSON: scene, sensor, seed, sampling_hz, program |

use super::source::Film;
use crate::error::ExportError;
use crate::npz::{ARCHIVE_BYTES_MAX, Archive, header, single};
use std::io::Write;

/// Headers, names and metadata, generously.
const ARCHIVE_EXTRA: u64 = 1 << 20;

/// Writes the archive frame by frame.
pub(super) fn write(
    film: &Film<'_>,
    out: &mut dyn Write,
    tick: &dyn Fn(),
) -> Result<String, ExportError> {
    let (columns, rows) = (size(film.columns)?, size(film.rows)?);
    let count = u64::from(film.frames);
    check_size(count, columns * rows)?;
    let mut archive = Archive::new(out);
    let shape = format!("({count}, {rows}, {columns})");
    archive.begin("frames.npy", &header("<f4", &shape))?;
    let mut times_s = Vec::new();
    for index in 0..film.frames {
        let (time, frame) = (film.frame)(index);
        times_s.push(time.as_secs_f64());
        for celsius in frame {
            archive.add(&single(celsius).to_le_bytes())?;
        }
        tick();
    }
    archive.end()?;
    archive.begin("time_s.npy", &header("<f8", &format!("({count},)")))?;
    for time_s in times_s {
        archive.add(&time_s.to_le_bytes())?;
    }
    archive.end()?;
    archive.begin("thermistor_c.npy", &header("<f4", &format!("({count},)")))?;
    for _ in 0..film.frames {
        archive.add(&film.ambient.get().to_le_bytes())?;
    }
    archive.end()?;
    let metadata = metadata(film);
    let characters = metadata.chars().count();
    archive.begin("metadata.npy", &header(&format!("<U{characters}"), "()"))?;
    for character in metadata.chars() {
        archive.add(&u32::from(character).to_le_bytes())?;
    }
    archive.end()?;
    archive.finish()?;
    Ok(format!("{count} frames"))
}

fn size(pixels: usize) -> Result<u64, ExportError> {
    Ok(u64::try_from(pixels)?)
}

fn check_size(frames: u64, pixels: u64) -> Result<(), ExportError> {
    let per_frame = pixels * 4 + 8 + 4;
    let frames_max = (ARCHIVE_BYTES_MAX - ARCHIVE_EXTRA) / per_frame;
    if frames <= frames_max {
        return Ok(());
    }
    Err(ExportError::LongFilm {
        frames,
        pixels,
        frames_max,
    })
}

fn metadata(film: &Film<'_>) -> String {
    serde_json::json!({
        "scene": film.scene,
        "sensor": film.sensor,
        "seed": film.seed,
        "sampling_hz": film.sampling_hz,
        "program": concat!("grideye ", env!("CARGO_PKG_VERSION")),
    })
    .to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_than_an_archive_holds_is_refused_with_the_number_that_fits() {
        assert!(check_size(16_100_000, 64).is_err());
        let error = format!("{:#}", check_size(u64::from(u32::MAX), 64).unwrap_err());
        let fits: u64 = error
            .rsplit("at most ")
            .next()
            .unwrap()
            .split(' ')
            .next()
            .unwrap()
            .parse()
            .unwrap();
        check_size(fits, 64).unwrap();
        check_size(fits + 1, 64).unwrap_err();
        assert!(fits * (64 * 4 + 12) < 1 << 32);
    }
}
