//! Why frames could not be compared.

use crate::frames::timeline::Apart;
use grideye_frame::{COLUMNS, ROWS};
use grideye_scene::Sensor;

/// Why frames could not be compared. A comparison without a result is [`CannotTell`](crate::Verdict::CannotTell)
/// instead.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages say what each is")]
pub enum ValidatorError {
    #[error("{0}")]
    Refused(String),
    #[error("stopped before there was a result")]
    Stopped,
    #[error(transparent)]
    Apart(#[from] Apart),
    #[error(transparent)]
    Scene(#[from] grideye_scene::SceneError),
}

impl ValidatorError {
    pub(crate) fn no_frames(side: &str) -> Self {
        Self::Refused(format!(
            "no {side} frame to compare\nhint: check that the recording has frames of this sensor and not only gaps"
        ))
    }
}

pub(crate) fn check_setting(
    is_met: bool,
    name: &str,
    expected: &str,
    found: f64,
) -> Result<(), ValidatorError> {
    match is_met {
        true => Ok(()),
        false => Err(ValidatorError::Refused(format!(
            "setting `{name}` is {found}, expected {expected}"
        ))),
    }
}

/// Checks that a sensor's frames can be compared with a recording.
pub(crate) fn check_resolution(sensor: &Sensor) -> Result<(), ValidatorError> {
    if (sensor.columns, sensor.rows) == (COLUMNS, ROWS) {
        return Ok(());
    }
    Err(ValidatorError::Refused(format!(
        "sensor `{}` of the scene has {} x {} pixels, the recording has 8 x 8\nhint: compare with an 8 x 8 sensor of the scene",
        sensor.name, sensor.columns, sensor.rows
    )))
}
