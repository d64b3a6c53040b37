//! How to calibrate, how far the work has come, what is found, and why nothing is.

use grideye_frame::PIXELS;
use grideye_scene::SceneError;
use grideye_scene::profile::Profile;
use serde::Serialize;

/// Frames that are looked at unless another number is asked for.
pub const FRAMES_DEFAULT: usize = 200;
/// The fewest frames from which anything is said.
pub const FRAMES_MIN: usize = 10;
/// The most frames that are looked at: the common part is weighted by a matrix of as many rows.
pub const FRAMES_MAX: usize = 1_000;
/// The most places to start from.
pub const STARTS_MAX: usize = 100;

/// How to calibrate. Every default can be left as it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Seed of the starts.
    pub seed: u64,
    /// Places to start from, 1 to [`STARTS_MAX`]; the first is the scene as it stands.
    pub starts: usize,
    /// Frames to look at, [`FRAMES_MIN`] to [`FRAMES_MAX`], chosen evenly; by default [`FRAMES_DEFAULT`].
    pub frames: Option<usize>,
    /// What is known of the sensor: its pattern is taken off, its common mode is believed.
    pub profile: Option<Profile>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            seed: 1,
            starts: 8,
            frames: None,
            profile: None,
        }
    }
}

/// One unknown, found.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the names say it")]
pub struct Estimate {
    pub key: String,
    /// Where the search began.
    pub start: f64,
    pub value: f64,
    /// Its standard uncertainty; `None` if the recording does not tell it, or it lies at a bound.
    #[serde(rename = "standard_uncertainty")]
    pub uncertainty: Option<f64>,
    /// Half the width of its 95 % interval; `None` likewise.
    pub half_width_95: Option<f64>,
    #[serde(rename = "degrees_of_freedom")]
    pub freedom: f64,
    pub bounds: [f64; 2],
    pub at_bound: bool,
}

/// What a recording says of a scene.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Calibration {
    /// The unknowns, in the order of the file.
    pub found: Vec<Estimate>,
    /// Correlation of the estimates, in the order of `found`; 0 for those without uncertainty.
    pub correlation: Vec<Vec<f64>>,
    /// What the reader must know.
    pub warnings: Vec<String>,
    /// Frames that were looked at.
    pub frames: usize,
    /// Frames of the recording that were read.
    pub frames_read: usize,
    /// Of these, torn ones and duplicates, which were left out.
    pub frames_left_out: usize,
    /// Root of the mean square of what the scene left over, °C: as it stood, and with what was found.
    pub rmse_c: [f64; 2],
    /// White noise of a pixel as read, °C; with the 0.072 °C of the sensor's rounding.
    pub noise_sigma_c: f64,
    /// What each pixel keeps, °C: what it showed too much, on the mean. With a profile, beyond the profile's.
    pub pattern_c: [f64; PIXELS],
    /// Standard deviation of that over the pixels, without the noise in it, °C.
    pub pattern_sd_c: f64,
    /// Standard deviation of what all pixels do together, °C.
    pub common_sd_c: f64,
    /// Starts, and how many of them came to the best end.
    pub starts: [usize; 2],
    /// Simulations of all frames that were looked at.
    pub evaluations: u64,
    /// The scene file with what was found, remarks at each `[[fit]]`; every other byte is as it was.
    pub scene: String,
}

/// Frames simulated with all their derivatives, and at most how many will be.
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

/// Why a scene could not be calibrated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages say what each is")]
pub enum CalibrateError {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error("the {which} bound {value} of `{key}` is no value that the scene may have: {source}")]
    Bound {
        key: String,
        which: &'static str,
        value: f64,
        source: Box<SceneError>,
    },
    #[error(
        "{origin} marks no unknown\nhint: add a [[fit]] table, key = \"room.ambient_c\" and bounds = [15, 30] for example; scenes/README.md describes them"
    )]
    NoUnknowns { origin: String },
    #[error(
        "sensor `{sensor}` has {columns} x {rows} pixels, and recordings have 8 x 8\nhint: choose another sensor of the scene"
    )]
    Resolution {
        sensor: String,
        columns: usize,
        rows: usize,
    },
    #[error(
        "{found} frames of the recording lie in the time of the scene, expected at least {needed}\nhint: record longer, or let recording.start_s say when the recording begins"
    )]
    TooFewFrames { found: usize, needed: usize },
    #[error(
        "the clock of the recording runs backwards at frame {seq}\nhint: keep the rows before or after it"
    )]
    TimeRunsBackwards { seq: u64 },
    #[error(
        "{found} frames were asked for, expected {least} to {most}\nhint: a few hundred hold all that there is to learn"
    )]
    Frames {
        found: usize,
        least: usize,
        most: usize,
    },
}
