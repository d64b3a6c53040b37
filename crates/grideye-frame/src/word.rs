//! Converts register words to degrees and back: the only module outside the emulator that knows a scale or a sign bit.
//!
//! | quantity | format | step | range |
//! |---|---|---|---|
//! | pixel, interrupt level, hysteresis | 12 bits, two's complement (AMG88 spec §4-11-8, §4-11-11) | 0.25 °C | −512 to +511.75 °C |
//! | thermistor | 12 bits, sign and magnitude (AMG88 spec §4-11-9) | 0.0625 °C | −127.9375 to +127.9375 °C |
//!
//! The part is specified for less (AMG8833: 0 to 80 °C, AMG88 spec §4-3) but reads beyond that. Bits 7:4 of every high
//! byte are unspecified (AMG88 spec §4-11-9, §4-11-11): decoding ignores them, encoding leaves them 0.

use crate::frame::{Celsius, Frame, PIXELS, PixelWord, RawFrame, ThermistorWord};
use core::error::Error;
use core::fmt;

/// One step of a pixel, an interrupt level or a hysteresis (AMG88 spec §4-11-8, §4-11-11).
pub const PIXEL_STEP: Celsius = Celsius::new(0.25);
/// The lowest temperature a pixel word can hold, 0x800 (AMG88 spec §4-11-11).
pub const PIXEL_LOWEST: Celsius = Celsius::new(-512.0);
/// The highest temperature a pixel word can hold, 0x7FF (AMG88 spec §4-11-11).
pub const PIXEL_HIGHEST: Celsius = Celsius::new(511.75);
/// One step of the thermistor (AMG88 spec §4-11-9).
pub const THERMISTOR_STEP: Celsius = Celsius::new(0.0625);
/// The lowest temperature a thermistor word can hold, 0xFFF (AMG88 spec §4-11-9).
pub const THERMISTOR_LOWEST: Celsius = Celsius::new(-127.9375);
/// The highest temperature a thermistor word can hold, 0x7FF (AMG88 spec §4-11-9).
pub const THERMISTOR_HIGHEST: Celsius = Celsius::new(127.9375);

/// The bits of a word that carry a value; the other four are unspecified.
const VALUE_BITS: u16 = 0x0FFF;
/// The shift that aligns the sign bit of a 12-bit number with that of an `i16`.
const SIGN_SHIFT: u32 = 4;
/// The thermistor's sign: bit 3 of its high byte (AMG88 spec §4-11-9).
const THERMISTOR_SIGN: u16 = 0x0800;
/// The thermistor's magnitude, 11 bits (AMG88 spec §4-11-9).
const THERMISTOR_MAGNITUDE: u16 = 0x07FF;

/// The temperature of a pixel, for any 16-bit word.
#[must_use]
pub fn pixel_celsius(word: PixelWord) -> Celsius {
    Celsius::new(f32::from(pixel_steps(word)) * PIXEL_STEP.get())
}

/// The temperature of a pixel in whole steps of [`PIXEL_STEP`], −2048 to 2047.
#[must_use]
pub fn pixel_steps(word: PixelWord) -> i16 {
    sign_extended(word.0)
}

/// The chip's own temperature, for any 16-bit word; 0x800 is −0.0 °C.
#[must_use]
pub fn thermistor_celsius(word: ThermistorWord) -> Celsius {
    let sign = if is_negative(word) { -1.0 } else { 1.0 };
    Celsius::new(sign * f32::from(word.0 & THERMISTOR_MAGNITUDE) * THERMISTOR_STEP.get())
}

/// The chip's own temperature in whole steps of [`THERMISTOR_STEP`], −2047 to 2047; 0x800 and 0x000 are both 0.
#[must_use]
pub fn thermistor_steps(word: ThermistorWord) -> i16 {
    // Eleven bits fit an `i16`.
    let magnitude = i16::try_from(word.0 & THERMISTOR_MAGNITUDE).unwrap_or(i16::MAX);
    let sign = if is_negative(word) { -1 } else { 1 };
    sign * magnitude
}

/// The pixel word nearest to a temperature, halves away from zero. Also encodes interrupt levels.
///
/// # Errors
/// [`OutOfRange`] below −512 °C, above +511.75 °C, and for not-a-number.
pub fn pixel_word(celsius: Celsius) -> Result<PixelWord, OutOfRange> {
    in_range(celsius, PIXEL_LOWEST, PIXEL_HIGHEST)?;
    let steps = nearest_step(celsius, PIXEL_STEP);
    Ok(PixelWord(
        u16::from_ne_bytes(steps.to_ne_bytes()) & VALUE_BITS,
    ))
}

/// The thermistor word nearest to a temperature, halves away from zero.
///
/// −0.0 °C is 0x800, so that every word survives a round trip through its temperature.
///
/// # Errors
/// [`OutOfRange`] below −127.9375 °C, above +127.9375 °C, and for not-a-number.
pub fn thermistor_word(celsius: Celsius) -> Result<ThermistorWord, OutOfRange> {
    in_range(celsius, THERMISTOR_LOWEST, THERMISTOR_HIGHEST)?;
    let magnitude = nearest_step(celsius, THERMISTOR_STEP).unsigned_abs();
    let negative = celsius.get().is_sign_negative();
    let sign = if negative { THERMISTOR_SIGN } else { 0 };
    Ok(ThermistorWord(sign | magnitude))
}

/// Converts a raw frame to degrees.
#[must_use]
pub fn frame(raw: &RawFrame) -> Frame {
    Frame {
        thermistor: thermistor_celsius(raw.thermistor),
        pixels: pixels(&raw.pixels),
    }
}

/// Converts the words of a frame's pixels to degrees.
#[must_use]
pub fn pixels(words: &[PixelWord; PIXELS]) -> [Celsius; PIXELS] {
    words.map(pixel_celsius)
}

/// A temperature its register word cannot hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutOfRange {
    /// The temperature requested.
    pub found: Celsius,
    /// The lowest temperature the word can hold.
    pub lowest: Celsius,
    /// The highest temperature the word can hold.
    pub highest: Celsius,
}

impl fmt::Display for OutOfRange {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "temperature out of range: expected {} to {} °C, found {} °C",
            self.lowest, self.highest, self.found
        )
    }
}

impl Error for OutOfRange {}

fn in_range(found: Celsius, lowest: Celsius, highest: Celsius) -> Result<(), OutOfRange> {
    // No range contains not-a-number.
    if (lowest..=highest).contains(&found) {
        Ok(())
    } else {
        Err(OutOfRange {
            found,
            lowest,
            highest,
        })
    }
}

const fn is_negative(word: ThermistorWord) -> bool {
    word.0 & THERMISTOR_SIGN != 0
}

/// The 12-bit two's complement number in the lower bits of a word.
fn sign_extended(word: u16) -> i16 {
    i16::from_ne_bytes((word << SIGN_SHIFT).to_ne_bytes()) >> SIGN_SHIFT
}

/// The whole number of steps nearest to a temperature that is known to be in range.
fn nearest_step(celsius: Celsius, step: Celsius) -> i16 {
    // Both steps are powers of two, so division and remainder are exact.
    let steps = celsius.get() / step.get();
    #[expect(
        clippy::as_conversions,
        clippy::cast_possible_truncation,
        reason = "truncation drops the fraction, and the range check keeps the rest within 12 bits"
    )]
    let whole = steps as i16;
    let remainder = steps - f32::from(whole);
    if remainder >= 0.5 {
        whole + 1
    } else if remainder <= -0.5 {
        whole - 1
    } else {
        whole
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The decoded temperature, its encoding, and its steps in degrees.
    fn pixel(word: u16) -> (f32, u16, f32) {
        let (word, celsius) = (PixelWord(word), pixel_celsius(PixelWord(word)));
        let steps = f32::from(pixel_steps(word)) * 0.25;
        (celsius.get(), pixel_word(celsius).unwrap().0, steps)
    }

    fn thermistor(word: u16) -> (f32, u16, f32) {
        let (word, celsius) = (
            ThermistorWord(word),
            thermistor_celsius(ThermistorWord(word)),
        );
        let steps = f32::from(thermistor_steps(word)) * 0.0625;
        (celsius.get(), thermistor_word(celsius).unwrap().0, steps)
    }

    /// Every printed pixel row (AMG88 spec §4-11-11, 2011 edition §4-10(11)), then the three interrupt-level rows
    /// (AMG88 spec §4-11-8), each with every value of the unspecified upper four bits.
    #[test]
    fn every_printed_pixel_and_level_row_holds_both_ways() {
        let pixels = [(125.0, 0x1F4), (25.0, 0x064), (0.25, 0x001), (0.0, 0x000)];
        let below = [(-0.25, 0xFFF), (-25.0, 0xF9C), (-55.0, 0xF24)];
        let levels = [(30.0, 0x078), (-5.0, 0xFEC), (-10.0, 0xFD8)];
        for (celsius, word) in pixels.into_iter().chain(below).chain(levels) {
            for upper in 0..=0xF_u16 {
                assert_eq!(pixel(upper << 12 | word), (celsius, word, celsius));
            }
        }
    }

    /// Every printed thermistor row: AMG88 spec §4-11-9 (the first two) and the 2011 edition §4-10(9).
    #[test]
    fn every_printed_thermistor_row_holds_both_ways() {
        let rows = [
            (127.9375, 0x7FF),
            (-59.6875, 0xBBB),
            (125.0, 0x7D0),
            (25.0, 0x190),
        ];
        let near = [(0.25, 0x004), (-0.25, 0x804), (-20.0, 0x940)];
        for (celsius, word) in rows.into_iter().chain(near) {
            for upper in 0..=0xF_u16 {
                assert_eq!(thermistor(upper << 12 | word), (celsius, word, celsius));
            }
        }
    }

    #[test]
    fn the_thermistor_has_a_negative_zero() {
        let decoded = thermistor_celsius(ThermistorWord(0x800)).get();
        assert_eq!(decoded.to_bits(), (-0.0_f32).to_bits());
        for (celsius, word) in [(-0.0, 0x800), (0.0, 0x000), (-20.03, 0x940)] {
            let found = thermistor_word(Celsius::new(celsius));
            assert_eq!(found, Ok(ThermistorWord(word)), "{celsius}");
        }
    }

    #[test]
    fn every_word_comes_back_from_its_own_temperature() {
        for word in 0..=0xFFF {
            assert_eq!((pixel(word).1, thermistor(word).1), (word, word));
        }
    }

    #[test]
    fn halves_go_away_from_zero_and_less_goes_back() {
        // The largest number below one half: adding one half in single precision would give 1.
        let below_half = f32::from_bits(0.125_f32.to_bits() - 1);
        let rows = [
            (0.125, 0x001),
            (0.124, 0x000),
            (-0.125, 0xFFF),
            (-0.124, 0x000),
        ];
        for (celsius, word) in rows.into_iter().chain([(below_half, 0x000)]) {
            let found = pixel_word(Celsius::new(celsius));
            assert_eq!(found, Ok(PixelWord(word)), "{celsius}");
        }
    }

    #[test]
    fn the_ends_of_the_ranges_are_in_and_the_next_numbers_are_out() {
        let pixels = [PIXEL_HIGHEST, PIXEL_LOWEST].map(pixel_word);
        assert_eq!(pixels, [Ok(PixelWord(0x7FF)), Ok(PixelWord(0x800))]);
        let thermistors = [THERMISTOR_HIGHEST, THERMISTOR_LOWEST].map(thermistor_word);
        assert_eq!(
            thermistors,
            [0x7FF, 0xFFF].map(|word| Ok(ThermistorWord(word)))
        );
        for beyond in [511.8, -512.01, f32::INFINITY, f32::NEG_INFINITY, f32::NAN] {
            let error = pixel_word(Celsius::new(beyond)).unwrap_err();
            assert_eq!(error.found.get().to_bits(), beyond.to_bits());
            assert_eq!((error.lowest, error.highest), (PIXEL_LOWEST, PIXEL_HIGHEST));
        }
        for beyond in [127.94, -127.94, f32::INFINITY, f32::NEG_INFINITY, f32::NAN] {
            assert!(thermistor_word(Celsius::new(beyond)).is_err());
        }
    }

    #[test]
    fn a_frame_is_decoded_word_by_word() {
        let mut pixels = [PixelWord(0x064); PIXELS];
        (pixels[0], pixels[63]) = (PixelWord(0xFFF), PixelWord(0x1F4));
        let thermistor = ThermistorWord(0x804);
        let decoded = frame(&RawFrame { thermistor, pixels });
        assert_eq!(decoded.thermistor, Celsius::new(-0.25));
        assert_eq!(decoded.pixels[0], Celsius::new(-0.25));
        assert_eq!(decoded.pixels[1..63], [Celsius::new(25.0); 62]);
        assert_eq!(decoded.pixels[63], Celsius::new(125.0));
    }

    proptest! {
        #[test]
        fn a_pixel_is_at_most_half_a_step_from_what_was_asked_for(celsius in -512.0_f32..=511.75) {
            let word = pixel_word(Celsius::new(celsius)).unwrap();
            prop_assert!((pixel_celsius(word).get() - celsius).abs() <= 0.125);
            prop_assert_eq!(word.0 >> 12, 0);
        }

        #[test]
        fn a_thermistor_is_at_most_half_a_step_from_what_was_asked_for(celsius in -127.9375_f32..=127.9375) {
            let word = thermistor_word(Celsius::new(celsius)).unwrap();
            prop_assert!((thermistor_celsius(word).get() - celsius).abs() <= 0.03125);
            prop_assert_eq!(word.0 >> 12, 0);
        }

        #[test]
        fn any_bits_decode_to_a_temperature_in_range(word: u16) {
            prop_assert!((PIXEL_LOWEST..=PIXEL_HIGHEST).contains(&pixel_celsius(PixelWord(word))));
            prop_assert!((THERMISTOR_LOWEST..=THERMISTOR_HIGHEST).contains(&thermistor_celsius(ThermistorWord(word))));
        }
    }
}
