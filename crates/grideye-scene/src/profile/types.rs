//! The contents of a profile: how one unit differs from a perfect sensor.

use grideye_frame::PIXELS;

/// The profiles in this library, by name: TOML texts of `scenes/profiles`.
pub const BUILT_IN: [(&str, &str); 3] = [
    (
        "ideal",
        include_str!("../../../../scenes/profiles/ideal.toml"),
    ),
    (
        "datasheet",
        include_str!("../../../../scenes/profiles/datasheet.toml"),
    ),
    (
        "linaige",
        include_str!("../../../../scenes/profiles/linaige.toml"),
    ),
];

/// Ticks between two cold frames: on several measured units, every fifth frame is colder over the whole image.
pub const CYCLE_TICKS: u64 = 5;

/// Limit on a profile's text, bytes; one with every map filled has under 4 kB.
pub const TEXT_BYTES_MAX: usize = 64 * 1024;

/// Limit on octaves of the slow wander: from an hour down to a few seconds, or from a minute to a tenth of a second.
pub const OCTAVES_MAX: u32 = 10;

/// Limit on characters in a profile's name.
pub const NAME_CHARACTERS_MAX: usize = 100;

/// How a unit differs from a perfect sensor, which is the default; [`parse`](Self::parse) checks each field's range.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// The unit's name, up to [`NAME_CHARACTERS_MAX`] characters; may be empty.
    pub name: String,
    /// White Gaussian noise of each pixel between 100 ms ticks: standard deviation, °C, 0 to 100.
    pub noise_sigma_c: [f64; PIXELS],
    /// Error shared by all pixels.
    pub common_mode: CommonMode,
    /// Error that does not change from frame to frame, in any room.
    pub fixed_pattern: FixedPattern,
    /// What the empty room of the measurement added to each pixel beside the pattern, °C, -100 to 100; `None` if
    /// unknown. It belongs to that room and mounting: [`apply`](Self::apply) leaves it out.
    pub background_c: Option<[f64; PIXELS]>,
    /// Error that changes over minutes and hours.
    pub warm_up: WarmUp,
    /// The chip's own thermometer.
    pub thermistor: Thermistor,
    /// Share of the ticks in which one pixel reads exactly 0.0 °C, 0 to 1.
    pub glitch_probability: f64,
    /// The sensor's oscillator.
    pub clock: ClockError,
}

/// Error shared by all pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CommonMode {
    /// Standard deviation of a slow wander of the whole image, °C, 0 to 100.
    pub sd_c: f64,
    /// Time after which the slowest wander's autocorrelation has dropped to 0.29, seconds, 0.1 to 10^6.
    pub correlation_s: f64,
    /// Wanders of equal variance, each twice as fast as the one before: 1 to [`OCTAVES_MAX`].
    pub octaves: u32,
    /// How much colder one tick in [`CYCLE_TICKS`] is, °C, 0 to 100. The seed decides which one.
    pub cycle_depth_c: f64,
}

/// Error that does not change from frame to frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixedPattern {
    /// Added to each pixel, °C, -100 to 100.
    pub offset_c: [f64; PIXELS],
    /// Standard deviation of another offset per pixel, drawn from the seed, °C, 0 to 100: other seeds are other units.
    pub spread_c: f64,
}

/// Error that changes over minutes and hours.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WarmUp {
    /// Error of all pixels at time 0, °C, -100 to 100; it decays exponentially.
    pub start_c: f64,
    /// Time in which that error falls to 37 %, seconds, 0.1 to 10^6; unused if `start_c` is 0.
    pub time_constant_s: f64,
    /// Endless drift of all pixels, °C per hour, -100 to 100.
    pub drift_c_per_hour: f64,
}

/// The chip's own thermometer, which self-heating keeps above the room.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Thermistor {
    /// Its final offset from the scene's ambient temperature, °C, -100 to 100.
    pub offset_c: f64,
    /// Standard deviation of its own noise, °C, 0 to 100.
    pub sigma_c: f64,
    /// Time in which the offset rises from 0 to 63 %, seconds, 0 to 10^6; 0 means at once.
    pub lag_s: f64,
}

/// The sensor's oscillator, for emulating its timing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ClockError {
    /// Error at time 0, parts per million, -500,000 to 500,000: -40,000 is 4 % slow.
    pub error_ppm: i32,
    /// Change of that error per hour, parts per million, -500,000 to 500,000.
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
            background_c: None,
            warm_up: WarmUp::default(),
            thermistor: Thermistor::default(),
            glitch_probability: 0.0,
            clock: ClockError::default(),
        }
    }
}
