//! A film as arrays for numpy.
//!
//! | array | type | shape | holds |
//! |---|---|---|---|
//! | `frames` | float32 | (N, rows, columns) | °C, row 0 at the top, not rounded to the sensor's steps |
//! | `time_s` | float64 | (N) | seconds since the scene's start |
//! | `thermistor_c` | float32 | (N) | °C, the room's temperature |
//! | `metadata` | str | () | JSON: scene, sensor, seed, sampling_hz, program |

use super::source::Film;
use crate::error::ExportError;
use crate::npz::{ARCHIVE_BYTES_MAX, Archive, single};
use std::io::Write;

/// A generous allowance for headers, names and metadata.
const ARCHIVE_EXTRA: u64 = 1 << 20;

pub(super) fn write(
    film: &Film<'_>,
    out: &mut dyn Write,
    tick: &dyn Fn(),
) -> Result<String, ExportError> {
    let count = usize::try_from(film.frames)?;
    check_size(film.frames.into(), u64::try_from(film.columns * film.rows)?)?;
    let mut archive = Archive::new(out);
    let mut times_s = Vec::new();
    let celsius = (0..film.frames).flat_map(|index| {
        let (time, frame) = (film.frame)(index);
        times_s.push(time.as_secs_f64().to_le_bytes());
        tick();
        frame
            .into_iter()
            .map(|celsius| single(celsius).to_le_bytes())
    });
    archive.array(
        "frames.npy",
        "<f4",
        &[count, film.rows, film.columns],
        celsius,
    )?;
    archive.array("time_s.npy", "<f8", &[count], times_s)?;
    let ambient = film.ambient.get().to_le_bytes();
    let ambient = std::iter::repeat_n(ambient, count);
    archive.array("thermistor_c.npy", "<f4", &[count], ambient)?;
    archive.texts("metadata.npy", &[], &[metadata(film)])?;
    archive.finish()?;
    Ok(format!("{count} frames"))
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
        let (_, fits) = error.rsplit_once("at most ").unwrap();
        let fits: u64 = fits.split(' ').next().unwrap().parse().unwrap();
        check_size(fits, 64).unwrap();
        check_size(fits + 1, 64).unwrap_err();
        assert!(fits * (64 * 4 + 12) < 1 << 32);
    }
}
