//! What a profile holds: how one unit differs from a perfect sensor.

use crate::text::Refusal;
use grideye_frame::PIXELS;

/// Ticks from one cold frame to the next: one frame in five is colder over the whole image (measured on several units).
pub const CYCLE_TICKS: u64 = 5;

/// Bytes of a profile's text at most; one with every map filled has under 4 kB.
pub const TEXT_BYTES_MAX: usize = 64 * 1024;

/// Octaves of the slow wander at most: from an hour down to a few seconds, or from a minute to a tenth of a second.
pub const OCTAVES_MAX: u32 = 10;

/// Characters of a profile's name at most.
pub const NAME_CHARACTERS_MAX: usize = 100;

/// How a unit differs from a perfect sensor, the default; [`parse`](Self::parse) holds each field to its range.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// What the unit is called, up to [`NAME_CHARACTERS_MAX`] characters; may be empty.
    pub name: String,
    /// White Gaussian noise of each pixel from one 100 ms tick to the next: standard deviation, °C, 0 to 100.
    pub noise_sigma_c: [f64; PIXELS],
    /// What all pixels do together.
    pub common_mode: CommonMode,
    /// What does not change from frame to frame.
    pub fixed_pattern: FixedPattern,
    /// What changes over minutes and hours.
    pub warm_up: WarmUp,
    /// The chip's own thermometer.
    pub thermistor: Thermistor,
    /// Share of the ticks in which one pixel reads exactly 0.0 °C, 0 to 1.
    pub glitch_probability: f64,
    /// The sensor's oscillator.
    pub clock: ClockError,
}

/// What all pixels do together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CommonMode {
    /// Standard deviation of a slow wander of the whole image, °C, 0 to 100.
    pub sd_c: f64,
    /// Time after which the slowest wander is mostly forgotten (autocorrelation 0.29), seconds, 0.1 to 10^6.
    pub correlation_s: f64,
    /// Wanders of equal variance, each twice as quick as the one before: 1 to [`OCTAVES_MAX`].
    pub octaves: u32,
    /// By how much one tick in [`CYCLE_TICKS`] is colder, °C, 0 to 100. Which one, the seed decides.
    pub cycle_depth_c: f64,
}

/// What does not change from frame to frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixedPattern {
    /// Added to each pixel, °C, -100 to 100.
    pub offset_c: [f64; PIXELS],
    /// Standard deviation of one more offset a pixel, drawn from the seed, °C, 0 to 100: other seeds are other units.
    pub spread_c: f64,
}

/// What changes over minutes and hours.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WarmUp {
    /// Error of all pixels at time 0, °C, -100 to 100; it decays exponentially.
    pub start_c: f64,
    /// Time in which that error falls to 37 %, seconds, 0.1 to 10^6; without meaning where `start_c` is 0.
    pub time_constant_s: f64,
    /// Drift of all pixels that never ends, °C an hour, -100 to 100.
    pub drift_c_per_hour: f64,
}

/// The chip's own thermometer, which self-heating keeps above the room.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Thermistor {
    /// How far it is above the scene's ambient in the end, °C, -100 to 100.
    pub offset_c: f64,
    /// Standard deviation of its own noise, °C, 0 to 100.
    pub sigma_c: f64,
    /// Time in which the offset has risen to 63 %, from 0 at time 0, seconds, 0 to 10^6; 0 is at once.
    pub lag_s: f64,
}

/// The sensor's oscillator, for whoever emulates its timing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ClockError {
    /// How far it is off at time 0, parts per million, -500,000 to 500,000: -40,000 is 4 % slow.
    pub error_ppm: i32,
    /// How much that changes in an hour, parts per million, -500,000 to 500,000.
    pub drift_ppm_per_hour: i32,
}

impl Default for CommonMode {
    fn default() -> Self {
        Self {
            sd_c: 0.0,
            correlation_s: 0.0,
            octaves: 1,
            cycle_depth_c: 0.0,
        }
    }
}

impl Default for Profile {
    fn default() -> Self {
        Self {
            name: String::new(),
            noise_sigma_c: [0.0; PIXELS],
            common_mode: CommonMode::default(),
            fixed_pattern: FixedPattern {
                offset_c: [0.0; PIXELS],
                spread_c: 0.0,
            },
            warm_up: WarmUp::default(),
            thermistor: Thermistor::default(),
            glitch_probability: 0.0,
            clock: ClockError::default(),
        }
    }
}

/// Why a profile was refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ProfileError {
    /// What the file has is not what it may have.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// More text than any profile has.
    #[error(
        "{file}: {found} bytes of text, expected at most {limit}\nhint: is it a sensor profile at all?"
    )]
    TooLong {
        /// The file, as the caller named it.
        file: String,
        /// Bytes found.
        found: usize,
        /// The limit, [`TEXT_BYTES_MAX`].
        limit: usize,
    },
}
