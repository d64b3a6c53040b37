//! How frames are compared, and the limits of a comparison.

use crate::frames::Protocol;
use crate::metrics::Binning;
use crate::thresholds::Thresholds;

/// Most frames a side that are compared at once.
pub const FRAMES_MAX: usize = 1_000;
/// Most random orders of the pixels.
pub const SHUFFLES_MAX: usize = 10_000;
/// Most pairs of frames that are scored again for each random order; more are thinned evenly.
pub const SHUFFLED_PAIRS_MAX: usize = 100;
/// Most pairs of frames of which places, overlaps and structure are looked at; more are thinned evenly. Only the static
/// protocol has as many.
pub const PLACED_PAIRS_MAX: usize = 10_000;
/// Images of the sensor's noise that make up that floor.
pub const NOISE_IMAGES: usize = 20;
/// Most threads that count at once.
pub const THREADS_MAX: usize = 64;
/// Most pairs of frames kept for the report.
pub const FILM_FRAMES_MAX: usize = 6;

/// How to compare.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Which frame meets which.
    pub protocol: Protocol,
    /// Ambient temperature of the scene in degrees: the blank frame is of this temperature.
    pub ambient_c: f64,
    /// The sensor's step in degrees, above zero.
    pub step_c: f64,
    /// The bins of the second set of entropies; the first has the paper's 256 grey levels always.
    pub binning: Binning,
    /// Full angles of view across and down, in radians, above 0 and below a half turn: with them a centroid's error is
    /// known in degrees.
    pub field_of_view_rad: Option<[f64; 2]>,
    /// Noise of the sensor in degrees, used where the recording has no repeat to measure it with.
    pub noise_sigma_c: f64,
    /// How many frames later a real frame's repeat is; only printed, the caller picks the frames.
    pub lag_frames: usize,
    /// Random orders of the simulated pixels, up to [`SHUFFLES_MAX`].
    pub shuffles: usize,
    /// Seed of those orders and of the images of noise.
    pub seed: u64,
    /// Threads that count pairs of frames, 1 to [`THREADS_MAX`]; the result is the same with any number.
    pub threads: usize,
    /// What the verdict is measured against.
    pub thresholds: Thresholds,
}

impl Settings {
    /// The defaults for a scene: 0.24 degrees of noise (the median of AMG88xx units at 10 Hz), repeat 3 frames later,
    /// 200 random orders, bins of the sensor's step, one thread.
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
}

impl Settings {
    /// From how far above the background on a pixel counts as warm where the noise is `sigma_c`.
    pub(crate) fn warm_above(&self, sigma_c: f64) -> f64 {
        (self.thresholds.warm_sigma * sigma_c).max(WARM_STEPS_MIN * self.step_c)
    }
}

const NOISE_SIGMA_C: f64 = 0.24;
/// Steps of the sensor that a warm pixel stands out by at least, however little noise there is.
const WARM_STEPS_MIN: f64 = 2.0;
