//! The behavior of an emulated sensor where the datasheet and parts in the field disagree.

use crate::device::ticks::Drift;
use core::time::Duration;

/// The default of [`Options::catch_up_frames_max`]: a little more than a day's frames.
pub const CATCH_UP_FRAMES_MAX: u64 = 1_000_000;

/// How one sensor behaves where sensors and sources disagree. The defaults are what most users saw, with an exact
/// clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Options {
    /// The sensor's clock error in parts per million: -40,000 is 9.6 frames per second. One real sensor had -43,000.
    pub clock_error_ppm: i32,
    /// How the clock error changes after power-on. Default [`Drift::None`].
    pub clock_drift: Drift,
    /// How long after power-on the sensor's clock starts; the first tick comes 100 ms later. Default 0.
    pub phase: Duration,
    /// Whether the sensor stays silent for the first 50 ms (AMG88 spec §4-4, "typ."). Default off.
    pub silent_start: bool,
    /// When the interrupt flag and table clear. Default [`InterruptFlag::FollowsFrames`].
    pub interrupt_flag: InterruptFlag,
    /// What a write to the status clear register (0x05) clears. Default [`StatusClear::Flags`].
    pub status_clear: StatusClear,
    /// What an initial reset (0x3F) does to the settings. Default [`InitialReset::HoldsSettings`].
    pub initial_reset: InitialReset,
    /// What the registers read in sleep mode. Default [`SleepImage::ModeAndSign`].
    pub sleep_image: SleepImage,
    /// What the moving average register (0x07) reads. Default [`AverageReadback::Setting`].
    pub average_readback: AverageReadback,
    /// Whether a thermistor overflow sets bit 3 of the status register (OVF_THS), as in the 2011 specification.
    pub thermistor_overflow_flag: bool,
    /// Whether the registers freeze when the sensor wakes within 100 ms, as the Linux driver's authors saw.
    pub freezes_on_fast_wake: bool,
    /// Which two frames to wait for after an initial reset. Default [`WarmUp::TwoTicks`].
    pub warm_up: WarmUp,
    /// What the registers read between the end of sleep and an initial reset. Default [`AfterWake::HoldsRegisters`].
    pub after_wake: AfterWake,
    /// What the stand-by modes do. Default [`StandBy::Interrupts`].
    pub stand_by: StandBy,
    /// The thermistor's word from power-on to the first frame, twelve bits: 0x000 in the 2011 specification.
    pub thermistor_at_power_on: u16,
    /// Whether the thermistor is part of the frame. Default [`ThermistorUpdate::WithFrame`].
    pub thermistor_update: ThermistorUpdate,
    /// What sets the overflow flags. Default [`OverflowFlag::Saturation`].
    pub overflow_flag: OverflowFlag,
    /// What levels and hysteresis of 0x000 mean. Default [`ZeroLevels::Compared`].
    pub zero_levels: ZeroLevels,
    /// What drives the INT pin without an interrupt. Default [`InterruptOutput::OpenDrain`].
    pub interrupt_output: InterruptOutput,
    /// What the upper four bits of words read, except in sleep: some drivers depend on [`UnspecifiedBits::Zero`].
    pub unspecified_bits: UnspecifiedBits,
    /// Where the pointer goes after 0xFF. Default [`PastTheEnd::Wraps`].
    pub past_the_end: PastTheEnd,
    /// The most frames to catch up at once, at least 1; `None` for [`CATCH_UP_FRAMES_MAX`].
    pub catch_up_frames_max: Option<u64>,
}

/// When the interrupt flag (INTF), the interrupt table, and with them the INT pin, clear.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum InterruptFlag {
    /// With every frame, with hysteresis, as users report from the hardware.
    #[default]
    FollowsFrames,
    /// Only when cleared by command: AMG88 spec §4-11-5 says "the state of the flag ON holds until reset".
    HoldsUntilCleared,
}

/// What a write to the status clear register (0x05) clears.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum StatusClear {
    /// The selected flags, according to the register's text (AMG88 spec §4-11-6) and two users of the hardware.
    #[default]
    Flags,
    /// The selected flags and, with INTCLR, the interrupt table, according to the table of resets (AMG88 spec §4-11-2).
    FlagsAndTable,
}

/// What an initial reset (0x3F) does to mode, rate, interrupt control, moving average, levels and hysteresis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum InitialReset {
    /// They stay, according to the table of resets (AMG88 spec of 2016, §4-11-2).
    #[default]
    HoldsSettings,
    /// They return to 0x00: the 2011 specification says "returns to initial setting" (§4-10(2)).
    RestoresDefaults,
}

/// What the registers read in sleep mode. The specification says only that it is invalid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SleepImage {
    /// 0x00, except 0x10 in the mode (0x00) and 0x80 in the thermistor's high byte (0x0F), as drivers expect.
    #[default]
    ModeAndSign,
    /// 0x00 everywhere.
    Zero,
    /// As [`SleepImage::ModeAndSign`], but the mode alternates between 0x10 and 0x00, as one driver's authors saw.
    ModeByTurns,
}

/// What the moving average register (0x07) reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AverageReadback {
    /// Bit 5 as set, according to the register's description (AMG88 spec §4-11-7).
    #[default]
    Setting,
    /// Always 0x00.
    Zero,
}

/// Which two frames to wait for after an initial reset (AMG88 spec §4-11-2).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WarmUp {
    /// Two frames of the array: 0.2 s at 10 fps, and 1.1 s at 1 fps, which needs a whole mean of ten.
    #[default]
    TwoTicks,
    /// Two frames in the registers: 0.2 s at 10 fps, 2 s at 1 fps, two intervals in stand-by.
    TwoFrames,
}

/// What the registers read between the end of sleep and an initial reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AfterWake {
    /// Their values from before, according to the table of resets (AMG88 spec of 2016, §4-11-2).
    #[default]
    HoldsRegisters,
    /// Anything ("undefined", AMG88 spec of 2016, §4-11-1); the sensor measures nothing until the initial reset.
    Undefined,
}

/// What the stand-by modes do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum StandBy {
    /// They measure and interrupts work, according to AMG88 spec of 2016, §4-11-4.
    #[default]
    Interrupts,
    /// They measure, but flag, table and pin do not change, according to the interface document of 2021.
    NoInterrupts,
    /// 0x20 and 0x21 are unknown commands: the interface document of 2021 lists neither.
    Missing,
}

/// Whether the thermistor is part of the frame. No source says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ThermistorUpdate {
    /// It updates and averages with the pixels, and stands still with them during a transaction.
    #[default]
    WithFrame,
    /// It updates with every tick, is never averaged, and may also update once within each transaction.
    EveryTick,
}

/// What sets the overflow flags OVF_IRS and OVF_THS.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum OverflowFlag {
    /// A value beyond the word's range, according to AMG88 spec of 2016, §4-11-5 ("A/D result overflowed").
    #[default]
    Saturation,
    /// The word 0xFFF, whatever its meaning, according to the 2011 specification, §4-10(5).
    WordFff,
}

/// What levels and hysteresis mean when all are 0x000.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ZeroLevels {
    /// Ordinary levels: any value but zero trips. In difference mode, a still scene without noise never does.
    #[default]
    Compared,
    /// Every pixel of every frame trips: INT as "data ready", as one driver's example uses it.
    AlwaysTrip,
}

/// What drives the INT pin while it is enabled without an interrupt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum InterruptOutput {
    /// Nothing; a pull-up takes it high, as in the reference circuits.
    #[default]
    OpenDrain,
    /// The sensor, to its supply, according to the pin's description ("VDD", AMG88 spec §4-7). Released while disabled.
    PushPull,
}

/// What the upper four bits of the high bytes of words read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum UnspecifiedBits {
    /// 0000.
    #[default]
    Zero,
    /// 1111, to find drivers that do not mask them.
    Ones,
}

/// Where the pointer goes after 0xFF.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PastTheEnd {
    /// To 0x00.
    #[default]
    Wraps,
    /// It stays at 0xFF.
    Stays,
}
