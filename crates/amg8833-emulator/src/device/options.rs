//! Where the datasheet and parts in the field disagree: what an emulated sensor does there.

use crate::device::ticks::Drift;
use core::time::Duration;

/// Where [`Options::catch_up_frames_max`] is open: a little more than a day's frames.
pub const CATCH_UP_FRAMES_MAX: u64 = 1_000_000;

/// How one sensor behaves where sensors and sources disagree; by default as most users have seen it, with an exact clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Options {
    /// How far the sensor's clock is off, in parts per million: -40,000 is 9.6 frames a second. One real sensor had -43,000.
    pub clock_error_ppm: i32,
    /// How that error changes from power-on on. Default [`Drift::None`].
    pub clock_drift: Drift,
    /// How long after power-on the sensor's clock starts; the first tick comes 100 ms later. Default 0.
    pub phase: Duration,
    /// Whether the sensor does not answer for the first 50 ms (AMG88 spec §4-4, "typ."). Default off.
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
    /// Whether an overflow of the thermistor sets bit 3 of the status register (OVF_THS), as in the specification of 2011.
    pub thermistor_overflow_flag: bool,
    /// Whether the registers freeze when the sensor is woken within 100 ms, as the Linux driver's authors saw.
    pub freezes_on_fast_wake: bool,
    /// Which two frames have to be awaited after an initial reset. Default [`WarmUp::TwoTicks`].
    pub warm_up: WarmUp,
    /// What the registers read between the end of sleep and an initial reset. Default [`AfterWake::HoldsRegisters`].
    pub after_wake: AfterWake,
    /// What the stand-by modes do. Default [`StandBy::Interrupts`].
    pub stand_by: StandBy,
    /// The thermistor's word from power-on to the first frame, twelve bits: 0x000 in the specification of 2011.
    pub thermistor_at_power_on: u16,
    /// Whether the thermistor belongs to the frame. Default [`ThermistorUpdate::WithFrame`].
    pub thermistor_update: ThermistorUpdate,
    /// What sets the overflow flags. Default [`OverflowFlag::Saturation`].
    pub overflow_flag: OverflowFlag,
    /// What levels and hysteresis of 0x000 mean. Default [`ZeroLevels::Compared`].
    pub zero_levels: ZeroLevels,
    /// What drives the INT pin while there is no interrupt. Default [`InterruptOutput::OpenDrain`].
    pub interrupt_output: InterruptOutput,
    /// What the upper four bits of words read, except in sleep: some drivers depend on [`UnspecifiedBits::Zero`].
    pub unspecified_bits: UnspecifiedBits,
    /// Where the pointer goes past 0xFF. Default [`PastTheEnd::Wraps`].
    pub past_the_end: PastTheEnd,
    /// The most frames, at least 1, that are made up for at once; `None` for [`CATCH_UP_FRAMES_MAX`].
    pub catch_up_frames_max: Option<u64>,
}

/// When the interrupt flag (INTF), the interrupt table and with them the INT pin fall back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum InterruptFlag {
    /// With every frame, with hysteresis. As users report from the hardware.
    #[default]
    FollowsFrames,
    /// Only when cleared. As AMG88 spec §4-11-5 words it ("the state of the flag ON holds until reset").
    HoldsUntilCleared,
}

/// What a write to the status clear register (0x05) clears.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum StatusClear {
    /// The selected flags. As the register's text says (AMG88 spec §4-11-6), and two users of the hardware.
    #[default]
    Flags,
    /// The selected flags, and with INTCLR the interrupt table. As the table of resets says (AMG88 spec §4-11-2).
    FlagsAndTable,
}

/// What an initial reset (0x3F) does to mode, rate, interrupt control, moving average, levels and hysteresis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum InitialReset {
    /// They stay. As the table of resets says (AMG88 spec of 2016, §4-11-2).
    #[default]
    HoldsSettings,
    /// They return to 0x00. As the specification of 2011 words it ("returns to initial setting", §4-10(2)).
    RestoresDefaults,
}

/// What the registers read in sleep mode, about which the specification says only that it is invalid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SleepImage {
    /// 0x00, except 0x10 in the mode (0x00), and 0x80 in the thermistor's high byte (0x0F): what drivers expect.
    #[default]
    ModeAndSign,
    /// 0x00 everywhere.
    Zero,
    /// As [`SleepImage::ModeAndSign`], but the mode reads 0x10 and 0x00 by turns, as one driver's authors saw.
    ModeByTurns,
}

/// What the moving average register (0x07) reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AverageReadback {
    /// Bit 5 as it is set. As the register's description says (AMG88 spec §4-11-7).
    #[default]
    Setting,
    /// 0x00, whatever is set.
    Zero,
}

/// Which two frames have to be awaited after an initial reset (AMG88 spec §4-11-2).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WarmUp {
    /// Two frames of the array: 0.2 s at 10 fps, and 1.1 s at 1 fps, where the mean of ten has to be whole.
    #[default]
    TwoTicks,
    /// Two frames in the registers: 0.2 s at 10 fps, 2 s at 1 fps, two intervals in stand-by.
    TwoFrames,
}

/// What the registers read between the end of sleep and an initial reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AfterWake {
    /// What they held before. As the table of resets says (AMG88 spec of 2016, §4-11-2).
    #[default]
    HoldsRegisters,
    /// Anything ("undefined", AMG88 spec of 2016, §4-11-1), and nothing is measured until the initial reset.
    Undefined,
}

/// What the stand-by modes do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum StandBy {
    /// They measure, and interrupts work. As AMG88 spec of 2016, §4-11-4.
    #[default]
    Interrupts,
    /// They measure, and the flag, the table and the pin stay as they were. As the interface document of 2021.
    NoInterrupts,
    /// 0x20 and 0x21 are unknown commands. As the interface document of 2021, which lists neither.
    Missing,
}

/// Whether the thermistor belongs to the frame, of which no source speaks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ThermistorUpdate {
    /// It is renewed and averaged with the pixels, and stands still with them during a transaction.
    #[default]
    WithFrame,
    /// It is renewed with every tick, never averaged, and also within a transaction, once in each.
    EveryTick,
}

/// What sets the overflow flags OVF_IRS and OVF_THS.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum OverflowFlag {
    /// A value beyond what the word holds. As AMG88 spec of 2016, §4-11-5 ("A/D result overflowed").
    #[default]
    Saturation,
    /// The word 0xFFF, whatever it means. As the specification of 2011 says, §4-10(5).
    WordFff,
}

/// What levels and hysteresis that all are 0x000 mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ZeroLevels {
    /// What they say: any value but zero trips. A still scene without noise never does in difference mode.
    #[default]
    Compared,
    /// Every pixel of every frame trips: INT as "data ready", as one driver's example uses it.
    AlwaysTrip,
}

/// What drives the INT pin while it is enabled and there is no interrupt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum InterruptOutput {
    /// Nothing; a pull-up takes it high. As the reference circuits have it.
    #[default]
    OpenDrain,
    /// The sensor, to its supply. As the pin's description says ("VDD", AMG88 spec §4-7). Released while not enabled.
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

/// Where the pointer goes past 0xFF.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PastTheEnd {
    /// To 0x00.
    #[default]
    Wraps,
    /// It stays at 0xFF.
    Stays,
}
