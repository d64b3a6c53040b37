//! Any combination of sensor options from the bits of a number, for tests that try all of them.

use amg8833_emulator::{
    AfterWake, AverageReadback, Drift, DriftCurve, InitialReset, InterruptFlag, InterruptOutput,
    Options, OverflowFlag, PastTheEnd, SleepImage, StandBy, StatusClear, ThermistorUpdate,
    UnspecifiedBits, WarmUp, ZeroLevels,
};
use std::time::Duration;

static CURVE: [(Duration, i32); 3] = [
    (Duration::from_secs(1), 100_000),
    (Duration::from_secs(20), -400_000),
    (Duration::from_secs(300), 10_000),
];

/// Removes and returns the lowest digit in this base.
fn digit(bits: &mut u64, base: u64) -> u64 {
    let digit = *bits % base;
    *bits /= base;
    digit
}

fn either<T>(bits: &mut u64, first: T, second: T) -> T {
    if digit(bits, 2) == 0 { first } else { second }
}

/// Each value of each option occurs for some `bits`.
pub(crate) fn any_options(mut bits: u64, clock_error_ppm: i32) -> Options {
    let bits = &mut bits;
    Options {
        clock_error_ppm,
        clock_drift: match digit(bits, 4) {
            0 => Drift::PpmPerHour(clock_error_ppm.wrapping_mul(3)),
            1 => DriftCurve::new(&CURVE).map_or(Drift::None, Drift::Curve),
            _ => Drift::None,
        },
        phase: Duration::from_millis(digit(bits, 1_000)),
        silent_start: either(bits, false, true),
        interrupt_flag: either(
            bits,
            InterruptFlag::FollowsFrames,
            InterruptFlag::HoldsUntilCleared,
        ),
        status_clear: either(bits, StatusClear::Flags, StatusClear::FlagsAndTable),
        initial_reset: either(
            bits,
            InitialReset::HoldsSettings,
            InitialReset::RestoresDefaults,
        ),
        sleep_image: match digit(bits, 3) {
            0 => SleepImage::ModeAndSign,
            1 => SleepImage::Zero,
            _ => SleepImage::ModeByTurns,
        },
        average_readback: either(bits, AverageReadback::Setting, AverageReadback::Zero),
        thermistor_overflow_flag: either(bits, false, true),
        freezes_on_fast_wake: either(bits, false, true),
        warm_up: either(bits, WarmUp::TwoTicks, WarmUp::TwoFrames),
        after_wake: either(bits, AfterWake::HoldsRegisters, AfterWake::Undefined),
        stand_by: match digit(bits, 3) {
            0 => StandBy::Interrupts,
            1 => StandBy::NoInterrupts,
            _ => StandBy::Missing,
        },
        thermistor_at_power_on: either(bits, 0x000, 0xFFFF),
        thermistor_update: either(
            bits,
            ThermistorUpdate::WithFrame,
            ThermistorUpdate::EveryTick,
        ),
        overflow_flag: either(bits, OverflowFlag::Saturation, OverflowFlag::WordFff),
        zero_levels: either(bits, ZeroLevels::Compared, ZeroLevels::AlwaysTrip),
        interrupt_output: either(bits, InterruptOutput::OpenDrain, InterruptOutput::PushPull),
        unspecified_bits: either(bits, UnspecifiedBits::Zero, UnspecifiedBits::Ones),
        past_the_end: either(bits, PastTheEnd::Wraps, PastTheEnd::Stays),
        catch_up_frames_max: [None, Some(0), Some(1), Some(20)]
            [usize::try_from(digit(bits, 4)).unwrap_or(0)],
    }
}

/// The 256 registers after power-on with these options, which every power cycle must restore.
pub(crate) fn power_on_image(options: &Options) -> Vec<u8> {
    let ones = options.unspecified_bits == UnspecifiedBits::Ones;
    let mut image: Vec<u8> = (0..=255_u8)
        .map(|register| {
            let word = (0x08..=0x0F).contains(&register) || register >= 0x80;
            if ones && word && register % 2 == 1 {
                0xF0
            } else {
                0
            }
        })
        .collect();
    let [low, high] = (options.thermistor_at_power_on & 0x0FFF).to_le_bytes();
    image[0x0E] |= low;
    image[0x0F] |= high;
    image
}
