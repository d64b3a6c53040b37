use core::time::Duration;

/// Beyond this, in parts per million either way, [`Options::clock_error_ppm`] has no further effect: 50 %.
pub const CLOCK_ERROR_PPM_MAX: i32 = 500_000;

/// How one specimen of the sensor behaves, where specimens differ, and where the sources about them disagree.
///
/// The default is a sensor with an exact clock that behaves as most of its users have seen it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// How far the sensor's own clock is off, in parts per million: -40,000 is 4 % slow, that is 9.6 frames a second.
    /// Default 0. One real sensor was measured at -42,000 to -44,000.
    pub clock_error_ppm: i32,
    /// How long after power-on the sensor's clock starts; the first tick comes one period (100 ms) later. Default 0.
    pub phase: Duration,
    /// Whether the sensor leaves its address unacknowledged for the first 50 ms after power-on (AMG88 spec §4-4,
    /// "typ."). Default off, so that a test need not wait.
    pub silent_start: bool,
    /// When the interrupt flag and table fall back. Default [`InterruptFlag::FollowsFrames`].
    pub interrupt_flag: InterruptFlag,
    /// What a write to the status clear register (0x05) clears. Default [`StatusClear::Flags`].
    pub status_clear: StatusClear,
    /// What an initial reset (0x3F) does to the settings. Default [`InitialReset::HoldsSettings`].
    pub initial_reset: InitialReset,
    /// What the registers read in sleep mode. Default [`SleepImage::ModeAndSign`].
    pub sleep_image: SleepImage,
    /// What the moving average register (0x07) reads. Default [`AverageReadback::Setting`].
    pub average_readback: AverageReadback,
    /// Whether an overflow of the thermistor sets bit 3 of the status register (OVF_THS). The specification of 2011 has
    /// that bit, those of 2016 and 2021 do not. Default off.
    pub thermistor_overflow_flag: bool,
    /// Whether the registers stay as they are for good when the sensor is woken within 100 ms of being sent to sleep.
    /// Seen by the authors of the Linux driver, which therefore waits. Default off.
    pub freezes_on_fast_wake: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            clock_error_ppm: 0,
            phase: Duration::ZERO,
            silent_start: false,
            interrupt_flag: InterruptFlag::FollowsFrames,
            status_clear: StatusClear::Flags,
            initial_reset: InitialReset::HoldsSettings,
            sleep_image: SleepImage::ModeAndSign,
            average_readback: AverageReadback::Setting,
            thermistor_overflow_flag: false,
            freezes_on_fast_wake: false,
        }
    }
}

/// When the interrupt flag (INTF), the interrupt table and with them the INT pin fall back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InterruptFlag {
    /// With every frame: they say what the newest frame says, with hysteresis. As users report from the hardware.
    FollowsFrames,
    /// Only when cleared. As AMG88 spec §4-11-5 words it ("the state of the flag ON holds until reset").
    HoldsUntilCleared,
}

/// What a write to the status clear register (0x05) clears.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StatusClear {
    /// The selected flags. As the register's text says (AMG88 spec §4-11-6), and two users of the hardware.
    Flags,
    /// The selected flags, and with INTCLR the interrupt table. As the table of resets says (AMG88 spec §4-11-2).
    FlagsAndTable,
}

/// What an initial reset (0x3F) does to mode, rate, interrupt control, moving average, levels and hysteresis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InitialReset {
    /// They stay. As the table of resets says (AMG88 spec of 2016, §4-11-2).
    HoldsSettings,
    /// They return to 0x00. As the specification of 2011 words it ("returns to initial setting", §4-10(2)).
    RestoresDefaults,
}

/// What the registers read in sleep mode, about which the specification says only that it is invalid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SleepImage {
    /// 0x00, except the mode (0x00), which reads 0x10, and the thermistor's high byte (0x0F), which reads 0x80. Joins
    /// what different drivers expect.
    ModeAndSign,
    /// 0x00 everywhere.
    Zero,
}

/// What the moving average register (0x07) reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AverageReadback {
    /// Bit 5 as it is set. As the register's description says (AMG88 spec §4-11-7).
    Setting,
    /// 0x00, whatever is set.
    Zero,
}
