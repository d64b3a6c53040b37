//! Settings and limits of a comparison, and the checks of its input.

use crate::error::{Side, ValidatorError, check_setting};
use crate::frames::{Protocol, RealFrame, Shape, SimulatedFrame};
use crate::metrics::Binning;
use crate::numbers::count;
use crate::thresholds::Thresholds;
use serde::Serialize;

/// Most frames per side.
pub const FRAMES_MAX: usize = 1_000;
/// Most random pixel orders.
pub const SHUFFLES_MAX: usize = 10_000;
/// Most pairs scored for each random order; more are thinned evenly.
pub const SHUFFLED_PAIRS_MAX: usize = 100;
/// Most pairs for measures of places, overlaps and structure; more are thinned evenly.
pub const PLACED_PAIRS_MAX: usize = 10_000;
/// Images of sensor noise that make that floor.
pub const NOISE_IMAGES: usize = 20;
/// Most threads.
pub const THREADS_MAX: usize = 64;
/// Most pairs of frames kept for the report.
pub const FILM_FRAMES_MAX: usize = 6;

/// How to compare.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Settings {
    #[serde(skip)]
    pub protocol: Protocol,
    /// Ambient temperature of the scene and of the blank frame, °C.
    pub ambient_c: f64,
    /// The sensor's step, °C, above zero.
    pub step_c: f64,
    /// Bins of the second set of entropies; the first always has the paper's 256 gray levels.
    pub binning: Binning,
    /// Full horizontal and vertical field of view, radians, below π: converts a centroid's error to degrees.
    pub field_of_view_rad: Option<[f64; 2]>,
    /// Noise of the sensor if the recording has no repeat, °C.
    pub noise_sigma_c: f64,
    /// Frames between a real frame and its repeat; only printed, since the caller picks the frames.
    pub lag_frames: usize,
    /// Random orders of the simulated pixels, up to [`SHUFFLES_MAX`].
    pub shuffles: usize,
    /// Seed of the orders and of the images of noise.
    pub seed: u64,
    /// Threads, 1 to [`THREADS_MAX`]; any number gives the same result.
    #[serde(skip)]
    pub threads: usize,
    pub thresholds: Thresholds,
}

impl Settings {
    /// Defaults: noise 0.24 °C (median of AMG88xx units at 10 Hz), repeat 3 frames later, 200 orders, one thread.
    #[must_use]
    pub fn new(protocol: Protocol, ambient_c: f64, step_c: f64) -> Self {
        Self {
            protocol,
            ambient_c,
            step_c,
            binning: Binning::Step { width_c: step_c },
            field_of_view_rad: None,
            noise_sigma_c: NOISE_SIGMA_C,
            lag_frames: 3,
            shuffles: 200,
            seed: 0,
            threads: 1,
            thresholds: Thresholds::default(),
        }
    }

    /// How far above the background a pixel is warm, for noise `sigma_c`.
    pub(crate) fn warm_above(&self, sigma_c: f64) -> f64 {
        (self.thresholds.warm_sigma * sigma_c).max(WARM_STEPS_MIN * self.step_c)
    }
}

const NOISE_SIGMA_C: f64 = 0.24;
/// Steps that a warm pixel must stand out by, however little noise there is.
const WARM_STEPS_MIN: f64 = 2.0;

pub(crate) fn check_settings(settings: &Settings) -> Result<(), ValidatorError> {
    let above_zero =
        |name, what, value: f64| check_setting(value.is_finite() && value > 0.0, name, what, value);
    let is_angle = |angle: f64| angle > 0.0 && angle < std::f64::consts::PI;
    let width_c = match settings.binning {
        Binning::Step { width_c } => width_c,
        _ => 1.0,
    };
    let [across, down] = settings.field_of_view_rad.unwrap_or([1.0; 2]);
    let angle = if is_angle(across) { down } else { across };
    let (threads, shuffles, ambient_c) = (settings.threads, settings.shuffles, settings.ambient_c);
    let has_threads = (1..=THREADS_MAX).contains(&threads);
    let has_shuffles = (1..=SHUFFLES_MAX).contains(&shuffles);
    let (threads, shuffles) = (count(threads), count(shuffles));
    let (degrees, deviation) = ("a temperature in degrees", "a deviation above zero");
    let (half_turn, width) = (
        "an angle above 0 and below a half turn",
        "a width above zero",
    );
    let (few, many) = ("a number from 1 to 64", "a number from 1 to 10000");
    check_setting(ambient_c.is_finite(), "ambient_c", degrees, ambient_c)?;
    above_zero("step_c", width, settings.step_c)?;
    above_zero("noise_sigma_c", deviation, settings.noise_sigma_c)?;
    check_setting(is_angle(angle), "field_of_view_rad", half_turn, angle)?;
    above_zero("binning", width, width_c)?;
    check_setting(has_threads, "threads", few, threads)?;
    check_setting(has_shuffles, "shuffles", many, shuffles)
}

pub(crate) fn check_frames(
    shape: Shape,
    real: &[RealFrame],
    simulated: &[SimulatedFrame],
    protocol: Protocol,
) -> Result<(), ValidatorError> {
    check_number(Side::Real, real.len())?;
    check_number(Side::Simulated, simulated.len())?;
    if protocol == Protocol::Dynamic && real.len() != simulated.len() {
        return Err(ValidatorError::Unpaired {
            real: real.len(),
            simulated: simulated.len(),
        });
    }
    for (index, frame) in real.iter().enumerate() {
        check_frame(shape, Side::Real, index, &frame.celsius)?;
        if let Some(later) = &frame.later {
            check_frame(shape, Side::Real, index, later)?;
        }
    }
    for (index, frame) in simulated.iter().enumerate() {
        check_frame(shape, Side::Simulated, index, &frame.celsius)?;
        check_frame(shape, Side::Simulated, index, &frame.noise_free)?;
        let truth = frame.truth.as_ref().map_or(shape.pixels(), Vec::len);
        check_size(shape, Side::Simulated, index, truth)?;
    }
    Ok(())
}

fn check_number(side: Side, found: usize) -> Result<(), ValidatorError> {
    match found {
        0 => Err(ValidatorError::NoFrames { side }),
        1..=FRAMES_MAX => Ok(()),
        _ => Err(ValidatorError::TooManyFrames {
            side,
            limit: FRAMES_MAX,
            found,
        }),
    }
}

fn check_frame(
    shape: Shape,
    side: Side,
    index: usize,
    celsius: &[f64],
) -> Result<(), ValidatorError> {
    check_size(shape, side, index, celsius.len())?;
    match celsius.iter().position(|value| !value.is_finite()) {
        Some(pixel) => Err(ValidatorError::NotFinite { side, index, pixel }),
        None => Ok(()),
    }
}

fn check_size(shape: Shape, side: Side, index: usize, found: usize) -> Result<(), ValidatorError> {
    let expected = shape.pixels();
    if found == 0 || found != expected {
        return Err(ValidatorError::FrameSize {
            side,
            index,
            expected,
            found,
        });
    }
    Ok(())
}
