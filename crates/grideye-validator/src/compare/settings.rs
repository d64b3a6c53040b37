//! Settings and limits of a comparison, and the checks of its input.

use crate::constants::{NOISE_SIGMA_C, WARM_STEPS_MIN};
use crate::error::{ValidatorError, check_setting};
use crate::frames::types::Pixels;
use crate::frames::{Protocol, RealFrame, SimulatedFrame};
use crate::numbers::count;
use crate::thresholds::Thresholds;
use serde::Serialize;

/// Most frames per side.
pub const FRAMES_MAX: usize = 1_000;
/// Most random pixel orders.
pub const SHUFFLES_MAX: usize = 10_000;
/// Most pairs scored for each random order; more are thinned evenly.
pub const SHUFFLED_PAIRS_MAX: usize = 100;
/// Most pairs of frames kept for the report.
pub const FILM_FRAMES_MAX: usize = 6;

/// How to compare.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Settings {
    #[serde(skip)]
    pub protocol: Protocol,
    /// The scene's model, as its file has it; empty without a scene.
    #[serde(skip)]
    pub model: &'static str,
    /// Ambient temperature of the scene and of the blank frame, °C.
    pub ambient_c: f64,
    /// The sensor's step, °C, above zero.
    pub step_c: f64,
    /// Noise of the sensor if the recording has no repeat, °C.
    pub noise_sigma_c: f64,
    /// Frames between a real frame and its repeat; only printed, since the caller picks the frames.
    pub lag_frames: usize,
    /// Random orders of the simulated pixels, up to [`SHUFFLES_MAX`].
    pub shuffles: usize,
    /// Seed of the orders.
    pub seed: u64,
    pub thresholds: Thresholds,
}

impl Settings {
    /// Defaults: noise 0.24 °C (median of AMG88xx units at 10 Hz), repeat 3 frames later, 200 orders.
    #[must_use]
    pub fn new(protocol: Protocol, ambient_c: f64, step_c: f64) -> Self {
        Self {
            protocol,
            model: "",
            ambient_c,
            step_c,
            noise_sigma_c: NOISE_SIGMA_C,
            lag_frames: 3,
            shuffles: 200,
            seed: 0,
            thresholds: Thresholds::default(),
        }
    }

    /// How far above the background a pixel is warm, for noise `sigma_c`.
    pub(crate) fn warm_above(&self, sigma_c: f64) -> f64 {
        (self.thresholds.warm_sigma * sigma_c).max(WARM_STEPS_MIN * self.step_c)
    }
}

pub(crate) fn check_settings(settings: &Settings) -> Result<(), ValidatorError> {
    let is_above_zero = |value: f64| value.is_finite() && value > 0.0;
    let (ambient_c, step_c, noise_c) =
        (settings.ambient_c, settings.step_c, settings.noise_sigma_c);
    let has_shuffles = (1..=SHUFFLES_MAX).contains(&settings.shuffles);
    let (width, many) = ("a width above zero", "a number from 1 to 10000");
    let (degrees, deviation) = ("a temperature in degrees", "a deviation above zero");
    check_setting(ambient_c.is_finite(), "ambient_c", degrees, ambient_c)?;
    check_setting(is_above_zero(step_c), "step_c", width, step_c)?;
    check_setting(is_above_zero(noise_c), "noise_sigma_c", deviation, noise_c)?;
    check_setting(has_shuffles, "shuffles", many, count(settings.shuffles))
}

pub(crate) fn check_frames(
    real: &[RealFrame],
    simulated: &[SimulatedFrame],
    protocol: Protocol,
) -> Result<(), ValidatorError> {
    check_number("real", real.len())?;
    check_number("simulated", simulated.len())?;
    if protocol == Protocol::Dynamic && real.len() != simulated.len() {
        return Err(ValidatorError::Refused(format!(
            "{} real frames cannot be paired with {} simulated frames\nhint: simulate one frame at the time of each real frame, or use the static protocol",
            real.len(),
            simulated.len()
        )));
    }
    for (index, frame) in real.iter().enumerate() {
        let later = frame.later.as_ref();
        check_finite("real", index, &frame.celsius)?;
        later.map_or(Ok(()), |later| check_finite("real", index, later))?;
    }
    for (index, frame) in simulated.iter().enumerate() {
        check_finite("simulated", index, &frame.celsius)?;
        check_finite("simulated", index, &frame.noise_free)?;
    }
    Ok(())
}

fn check_number(side: &str, found: usize) -> Result<(), ValidatorError> {
    match found {
        0 => Err(ValidatorError::no_frames(side)),
        1..=FRAMES_MAX => Ok(()),
        _ => Err(ValidatorError::Refused(format!(
            "{found} {side} frames, expected at most {FRAMES_MAX}\nhint: ask for fewer frames; they are chosen evenly over the recording"
        ))),
    }
}

fn check_finite(side: &str, index: usize, celsius: &Pixels) -> Result<(), ValidatorError> {
    match celsius.iter().position(|value| !value.is_finite()) {
        Some(pixel) => Err(ValidatorError::Refused(format!(
            "pixel index {pixel} of {side} frame {index} is not a finite number\nhint: leave the frame out; record a missing frame as missing, never as NaN"
        ))),
        None => Ok(()),
    }
}
