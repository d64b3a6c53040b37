//! The byte sequences and waits that the blocking and async drivers send.

use crate::levels::InterruptLevels;
use crate::power::{PowerMode, UndefinedPowerMode};
use crate::register::{Register, average, power, reset};
use crate::settings::{Configuration, FrameRate, InterruptControl, MovingAverage, Settings};
use crate::timing;
use core::time::Duration;
use grideye_frame::{PIXELS, PixelWord, ThermistorWord};

/// Register address and value: the bytes that set one register.
pub(crate) type Write = [u8; 2];

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Step {
    Write(Write),
    WaitMs(u32),
}

/// From any mode to normal (AMG88 spec §4-11-1, §4-11-2).
pub(crate) const WAKE: [Step; 5] = [
    Step::Write(Register::PowerControl.set(power::NORMAL)),
    Step::WaitMs(milliseconds(timing::WAKE)),
    Step::Write(Register::Reset.set(reset::INITIAL)),
    Step::WaitMs(milliseconds(timing::INITIAL_RESET)),
    Step::Write(Register::Reset.set(reset::FLAGS)),
];

/// To sleep, with the wait until a wake is safe (AMG88 spec §4-11-1; [`timing::SLEEP_ENTRY`]).
pub(crate) const SLEEP: [Step; 2] = [
    Step::Write(Register::PowerControl.set(power::SLEEP)),
    Step::WaitMs(milliseconds(timing::SLEEP_ENTRY)),
];

/// The initial reset alone (AMG88 spec §4-11-2).
pub(crate) const INITIAL_RESET: [Step; 2] = [
    Step::Write(Register::Reset.set(reset::INITIAL)),
    Step::WaitMs(milliseconds(timing::INITIAL_RESET)),
];

pub(crate) const FLAG_RESET: Write = Register::Reset.set(reset::FLAGS);

const SETTINGS_WRITES: usize = 1 + AVERAGE_WRITES + LEVEL_WRITES + 1;
const AVERAGE_WRITES: usize = 5;
const LEVEL_WRITES: usize = 6;

/// Writes every setting, the interrupt last, so that its pin does not move while the levels change.
pub(crate) fn settings(settings: &Settings) -> [Write; SETTINGS_WRITES] {
    let mut writes = [interrupt(settings.interrupt); SETTINGS_WRITES];
    let average = moving_average(settings.moving_average);
    let before = [frame_rate(settings.frame_rate)].into_iter().chain(average);
    for (write, set) in writes
        .iter_mut()
        .zip(before.chain(levels(&settings.levels)))
    {
        *write = set;
    }
    writes
}

pub(crate) const fn power_mode(mode: PowerMode) -> Write {
    Register::PowerControl.set(mode.command())
}

pub(crate) const fn frame_rate(rate: FrameRate) -> Write {
    Register::FrameRate.set(rate.byte())
}

pub(crate) const fn interrupt(control: InterruptControl) -> Write {
    Register::InterruptControl.set(control.byte())
}

/// Without its key, a write to the moving average has no effect (AMG88 spec §4-11-7).
pub(crate) const fn moving_average(average: MovingAverage) -> [Write; AVERAGE_WRITES] {
    let [first, second, third] = average::UNLOCK;
    [
        Register::AverageKey.set(first),
        Register::AverageKey.set(second),
        Register::AverageKey.set(third),
        Register::Average.set(average.byte()),
        Register::AverageKey.set(average::LOCK),
    ]
}

/// Byte by byte: Panasonic's wire diagrams show no write of more than one register.
pub(crate) const fn levels(levels: &InterruptLevels) -> [Write; LEVEL_WRITES] {
    let [upper_low, upper_high] = levels.upper.0.to_le_bytes();
    let [lower_low, lower_high] = levels.lower.0.to_le_bytes();
    let [hysteresis_low, hysteresis_high] = levels.hysteresis.0.to_le_bytes();
    [
        Register::UpperLevelLow.set(upper_low),
        Register::UpperLevelHigh.set(upper_high),
        Register::LowerLevelLow.set(lower_low),
        Register::LowerLevelHigh.set(lower_high),
        Register::HysteresisLow.set(hysteresis_low),
        Register::HysteresisHigh.set(hysteresis_high),
    ]
}

/// The pixels from [`Register::Pixels`] on: two bytes each, low byte first (AMG88 spec §4-11-11).
pub(crate) fn pixels(bytes: &[u8; 2 * PIXELS]) -> [PixelWord; PIXELS] {
    let mut words = [PixelWord::default(); PIXELS];
    for (word, pair) in words.iter_mut().zip(bytes.chunks_exact(2)) {
        if let [low, high] = *pair {
            *word = PixelWord(u16::from_le_bytes([low, high]));
        }
    }
    words
}

/// The thermistor from [`Register::Thermistor`] on: two bytes, low byte first (AMG88 spec §4-11-9).
pub(crate) const fn thermistor(bytes: [u8; 2]) -> ThermistorWord {
    ThermistorWord(u16::from_le_bytes(bytes))
}

/// The levels from [`Register::UpperLevelLow`] on; unspecified upper bits are dropped (AMG88 spec §4-11-8).
pub(crate) const fn levels_from(bytes: [u8; 6]) -> InterruptLevels {
    InterruptLevels {
        upper: level(bytes[0], bytes[1]),
        lower: level(bytes[2], bytes[3]),
        hysteresis: level(bytes[4], bytes[5]),
    }
}

/// Decodes registers 0x00 to 0x0D, from [`Register::PowerControl`] to the hysteresis, read at once.
///
/// The read spans RST, SCLR and the reserved 0x06, as in other drivers: the datasheet warns only of writes to
/// unspecified registers (AMG88 spec §4-10).
pub(crate) fn configuration(bytes: [u8; 14]) -> Result<Configuration, UndefinedPowerMode> {
    let [
        power,
        _reset,
        frame_rate,
        interrupt,
        _status,
        _status_clear,
        _reserved,
        average,
        levels @ ..,
    ] = bytes;
    Ok(Configuration {
        power: PowerMode::from_byte(power)?,
        frame_rate: FrameRate::from_byte(frame_rate),
        moving_average: MovingAverage::from_byte(average),
        interrupt: InterruptControl::from_byte(interrupt),
        levels: levels_from(levels),
    })
}

/// The byte that fills a read buffer before the first and the second attempt.
///
/// If the last byte still holds the first value, the driver reads again over its complement. A sensor that really sent
/// that byte sends it again; only an untouched buffer shows both. Neither value is what an empty bus gives (0xFF or
/// 0x00).
pub(crate) const POISONS: [u8; 2] = [0xA5, 0x5A];

/// How many bytes of a poisoned buffer were delivered, up to the last one that changed.
pub(crate) fn delivered(bytes: &[u8], poison: u8) -> usize {
    let last = bytes.iter().rposition(|byte| *byte != poison);
    last.map_or(0, |last| last + 1)
}

/// A level register pair, low byte first, without the unspecified bits 7:4 of its high byte, so that it equals the word
/// written (AMG88 spec §4-11-8).
const fn level(low: u8, high: u8) -> PixelWord {
    PixelWord(u16::from_le_bytes([low, high & 0x0F]))
}

/// A wait in whole milliseconds. Every wait is far below `u32::MAX`.
const fn milliseconds(wait: Duration) -> u32 {
    #[expect(
        clippy::as_conversions,
        clippy::cast_possible_truncation,
        reason = "evaluated at compile time on the constants of `timing`, and checked by the tests below"
    )]
    let milliseconds = wait.as_millis() as u32;
    milliseconds
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn waits_are_those_of_the_specification() {
        let wait = |step: &Step| match step {
            Step::Write(_) => 0,
            Step::WaitMs(milliseconds) => *milliseconds,
        };
        let waits = |steps: &[Step]| steps.iter().map(wait).collect::<std::vec::Vec<_>>();
        assert_eq!(waits(&WAKE), [0, 50, 0, 2, 0]);
        assert_eq!(waits(&SLEEP), [0, 100]);
        assert_eq!(waits(&INITIAL_RESET), [0, 2]);
    }

    proptest! {
        #[test]
        fn the_delivered_part_of_a_buffer_is_found(bytes: [u8; 16], count in 0_usize..=16) {
            for poison in POISONS {
                let mut buffer = [poison; 16];
                buffer[..count].copy_from_slice(&bytes[..count]);
                let found = delivered(&buffer, poison);
                prop_assert!(found <= count);
                prop_assert!(buffer[found..].iter().all(|byte| *byte == poison));
                prop_assert!(found == 0 || buffer[found - 1] != poison);
            }
        }
    }
}
