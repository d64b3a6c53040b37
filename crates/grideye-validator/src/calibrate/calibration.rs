//! From a scene with unknowns and a recording to their values.

use crate::calibrate::error::CalibrateError;
use crate::calibrate::frames::Frames;
use crate::calibrate::model::{Model, check_bounds};
use crate::calibrate::progress::{Pace, Progress};
use crate::calibrate::results;
use crate::calibrate::search::{FineSearch, from_several_starts, steps_in_frames};
use crate::calibrate::types::{Calibration, Options};
use grideye_frame::PIXELS;
use grideye_recording::Record;
use grideye_scene::{Files, Scene};
use std::time::Duration;

/// Finds the unknowns that a scene marks.
///
/// Time counts from the recording's first frame, which is second `recording.start_s` of the scene: 0 unless that is one
/// of the unknowns. Frames after the end of the scene's ways are left out, and so are torn frames and duplicates.
///
/// # Errors
/// [`CalibrateError`]: a scene that is refused or marks nothing, bounds that the scene may not have, a sensor of
/// another resolution, a clock that runs backwards, too few frames.
pub fn calibrate(
    records: &[Record],
    (text, origin): (&str, &str),
    files: &dyn Files,
    sensor: &str,
    options: &Options,
) -> Result<Calibration, CalibrateError> {
    calibrate_telling(records, (text, origin), files, sensor, options, &mut |_| ())
}

/// The same, and tells after every step of the search how far it has come.
///
/// # Errors
/// As [`calibrate`].
pub fn calibrate_telling(
    records: &[Record],
    (text, origin): (&str, &str),
    files: &dyn Files,
    sensor: &str,
    options: &Options,
    tell: &mut dyn FnMut(Progress),
) -> Result<Calibration, CalibrateError> {
    let loaded = Scene::parse(text, origin, files)?;
    if loaded.fits.is_empty() {
        return Err(CalibrateError::NoUnknowns {
            origin: origin.to_owned(),
        });
    }
    check_resolution(&loaded.scene, sensor)?;
    check_bounds((text, origin), &loaded.fits, files)?;
    let latest_s = loaded
        .fits
        .iter()
        .find(|fit| fit.key == grideye_scene::fit::RECORDING_START)
        .map_or(0.0, |fit| fit.bounds[1]);
    let end = (!loaded.scene.is_static()).then(|| {
        let end_s = (loaded.scene.duration().as_secs_f64() - latest_s).max(0.0);
        Duration::try_from_secs_f64(end_s).unwrap_or(Duration::MAX)
    });
    let frames = Frames::of(records, end, options)?;
    let pace = Pace::new(steps_in_frames(&frames, options), tell);
    let mut model = Model::new(text, origin, files, sensor, pace)?;
    let before = model.left_over(&model.start(), &frames)?;
    let (coarse, starts) = from_several_starts(&mut model, &frames, options)?;
    let fine = FineSearch::search(&mut model, &frames, coarse, options)?;
    Ok(results::calibration(
        (text, &loaded.fits, sensor),
        &model,
        &frames,
        &fine,
        &before,
        starts,
    ))
}

fn check_resolution(scene: &Scene, sensor: &str) -> Result<(), CalibrateError> {
    let sensor = scene.sensor(sensor)?;
    if sensor.columns * sensor.rows == PIXELS && sensor.columns == sensor.rows {
        return Ok(());
    }
    Err(CalibrateError::Resolution {
        sensor: sensor.name.clone(),
        columns: sensor.columns,
        rows: sensor.rows,
    })
}
