//! Options, progress, results and errors of a calibration.

use crate::names::named;
use grideye_frame::PIXELS;
use grideye_scene::profile::Profile;
use serde::Serialize;

/// Default of [`Options::frames`].
pub const FRAMES_DEFAULT: usize = 200;
/// Fewest frames for a calibration.
pub const FRAMES_MIN: usize = 10;
/// Most frames: the common mode's weight is a matrix with one row per frame.
pub const FRAMES_MAX: usize = 1_000;
/// Most starting points.
pub const STARTS_MAX: usize = 100;

named! {
    /// A half of the frames by time.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    #[expect(missing_docs, reason = "the names say it")]
    pub enum Half {
        First = "first";
        Second = "second";
    }
}

/// How to calibrate; the defaults suit most recordings.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Seed of the starting points.
    pub seed: u64,
    /// Most starting points, 1 to [`STARTS_MAX`]; the first is the scene as written. Fewer if the first four reach one end.
    pub starts: usize,
    /// Frames to use, [`FRAMES_MIN`] to [`FRAMES_MAX`], chosen evenly; [`FRAMES_DEFAULT`] by default.
    pub frames: Option<usize>,
    /// Fit to this half of the frames, so that a comparison can judge the scene by the other; `None` fits to all.
    pub half: Option<Half>,
    /// A profile of the sensor: its pattern is subtracted, its common mode replaces the estimate.
    pub profile: Option<Profile>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            seed: 1,
            starts: 8,
            frames: None,
            half: None,
            profile: None,
        }
    }
}

/// The value found for one unknown.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the names say it")]
pub struct Estimate {
    pub key: String,
    /// Its value in the scene.
    pub start: f64,
    pub value: f64,
    /// Standard uncertainty; `None` if the recording does not determine it, or at a bound.
    #[serde(rename = "standard_uncertainty")]
    pub uncertainty: Option<f64>,
    /// Half the width of the 95 % interval; `None` likewise.
    pub half_width_95: Option<f64>,
    #[serde(rename = "degrees_of_freedom")]
    pub freedom: f64,
    pub bounds: [f64; 2],
    pub at_bound: bool,
    /// What was known of it before the recording, if more than its bounds.
    pub law: Option<Law>,
    /// How much of the value comes from the recording and not from `law`, 0 to 1; `None` without uncertainty.
    pub from_recording: Option<f64>,
}

/// A normal law known before the recording.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Law {
    pub mean: f64,
    pub sd: f64,
}

/// What the recording determines, beyond laws and bounds.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Determined {
    /// How many combinations of unknowns: each counts by how much of it comes from the recording.
    pub combinations: f64,
    /// Unknowns with an effect and not at a bound.
    pub of: usize,
    /// How much of the least determined combination comes from the recording, 0 to 1.
    pub least_from_recording: f64,
    /// That combination: keys, coefficients, and the unit of each: what was known of the key, as a standard deviation.
    pub least: Vec<(String, f64, f64)>,
}

/// The result of a calibration.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Calibration {
    /// The unknowns, in file order.
    pub found: Vec<Estimate>,
    /// Correlation matrix of the estimates, in the order of `found`; 0 for those without uncertainty.
    pub correlation: Vec<Vec<f64>>,
    /// Which combinations of the unknowns the recording determines.
    pub determined: Determined,
    /// Reasons to doubt the result, each with a hint.
    pub warnings: Vec<String>,
    /// Frames used.
    pub frames: usize,
    /// The half of the frames that they were taken from; `None`: all.
    pub half: Option<Half>,
    /// Frames read from the recording.
    pub frames_read: usize,
    /// Frames left out as torn or duplicate.
    pub frames_left_out: usize,
    /// RMS residual with the scene as written, and with the values found, °C.
    pub rmse_c: [f64; 2],
    /// White noise per pixel as read, °C; includes 0.072 °C from rounding.
    pub noise_sigma_c: f64,
    /// Fixed pattern: mean excess of each pixel, °C. With a profile, beyond the profile's.
    pub pattern_c: [f64; PIXELS],
    /// Standard deviation of the pattern over the pixels, corrected for noise, °C.
    pub pattern_sd_c: f64,
    /// Standard deviation of the common mode, °C.
    pub common_sd_c: f64,
    /// Number of starts, and how many reached the best end.
    pub starts: [usize; 2],
    /// Number of simulations of all frames used.
    pub evaluations: u64,
    /// The scene file with the values found, a comment at each `[[uncertain]]` number and a `[[calibrated]]` table at its end; all
    /// other bytes are unchanged.
    pub scene: String,
}

/// Frames simulated with all derivatives so far, and the most there can be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Progress {
    pub done: u64,
    pub total: u64,
}

pub(crate) struct Pace<'a> {
    tell: &'a mut dyn FnMut(Progress),
    at: Progress,
    each: u64,
    ends: u64,
}

impl<'a> Pace<'a> {
    pub(crate) fn new(total: usize, tell: &'a mut dyn FnMut(Progress)) -> Self {
        let total = long(total);
        Self {
            tell,
            at: Progress { done: 0, total },
            each: 0,
            ends: 0,
        }
    }

    pub(crate) fn begin(&mut self, steps_max: usize, frames: usize) {
        self.each = long(frames);
        self.ends = self.at.done + long(steps_max) * self.each;
    }

    pub(crate) fn step(&mut self) {
        self.reach((self.at.done + self.each).min(self.ends));
    }

    pub(crate) fn end(&mut self) {
        self.reach(self.ends);
    }

    fn reach(&mut self, done: u64) {
        self.at.done = done;
        (self.tell)(self.at);
    }
}

fn long(number: usize) -> u64 {
    u64::try_from(number).unwrap_or(u64::MAX)
}
