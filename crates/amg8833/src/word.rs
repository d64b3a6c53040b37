//! What a register word means in degrees, and back: the only place of this crate that knows a scale or a sign bit.
//!
//! | quantity | format | step | range |
//! |---|---|---|---|
//! | pixel, interrupt level, hysteresis | 12 bits, two's complement (AMG88 spec §4-11-8, §4-11-11) | 0.25 °C | −512 to +511.75 °C |
//! | thermistor | 12 bits, sign and magnitude (AMG88 spec §4-11-9) | 0.0625 °C | −127.9375 to +127.9375 °C |
//!
//! The ranges are those of the formats. The part itself is specified for less (an AMG8833 for 0 to 80 °C, AMG88
//! spec §4-3), but reads on beyond it without clamping, so nothing is refused that the word can hold.
//!
//! Bits 7:4 of every high byte are unspecified (`-` in the register tables of AMG88 spec §4-11-9 and §4-11-11):
//! decoding ignores them, encoding leaves them 0.

use core::error::Error;
use core::fmt;
use grideye_frame::{Celsius, Frame, PixelWord, RawFrame, ThermistorWord};

/// One step of a pixel, an interrupt level or a hysteresis (AMG88 spec §4-11-8, §4-11-11).
pub const PIXEL_STEP: Celsius = Celsius::new(0.25);
/// The lowest temperature that a pixel word can hold, 0x800 (AMG88 spec §4-11-11).
pub const PIXEL_LOWEST: Celsius = Celsius::new(-512.0);
/// The highest temperature that a pixel word can hold, 0x7FF (AMG88 spec §4-11-11).
pub const PIXEL_HIGHEST: Celsius = Celsius::new(511.75);
/// One step of the thermistor (AMG88 spec §4-11-9).
pub const THERMISTOR_STEP: Celsius = Celsius::new(0.0625);
/// The lowest temperature that a thermistor word can hold, 0xFFF (AMG88 spec §4-11-9).
pub const THERMISTOR_LOWEST: Celsius = Celsius::new(-127.9375);
/// The highest temperature that a thermistor word can hold, 0x7FF (AMG88 spec §4-11-9).
pub const THERMISTOR_HIGHEST: Celsius = Celsius::new(127.9375);

/// The bits of a word that carry a value: the other four are unspecified.
const VALUE_BITS: u16 = 0x0FFF;
/// Bits to shift so that the sign bit of a 12-bit number meets the sign bit of an `i16`.
const SIGN_SHIFT: u32 = 4;
/// The thermistor's sign: bit 3 of its high byte (AMG88 spec §4-11-9).
const THERMISTOR_SIGN: u16 = 0x0800;
/// The thermistor's magnitude, 11 bits (AMG88 spec §4-11-9).
const THERMISTOR_MAGNITUDE: u16 = 0x07FF;

/// The temperature of a pixel: every 16-bit word has one.
#[must_use]
pub fn pixel_celsius(word: PixelWord) -> Celsius {
    Celsius::new(f32::from(pixel_steps(word)) * PIXEL_STEP.get())
}

/// The temperature of a pixel in whole steps of [`PIXEL_STEP`], −2048 to 2047: for those who pass on many.
#[must_use]
pub fn pixel_steps(word: PixelWord) -> i16 {
    sign_extended(word.0)
}

/// The chip's own temperature: every 16-bit word has one, 0x800 being −0.0 °C.
#[must_use]
pub fn thermistor_celsius(word: ThermistorWord) -> Celsius {
    let magnitude = f32::from(word.0 & THERMISTOR_MAGNITUDE) * THERMISTOR_STEP.get();
    Celsius::new(if is_negative(word) {
        -magnitude
    } else {
        magnitude
    })
}

/// The chip's own temperature in whole steps of [`THERMISTOR_STEP`], −2047 to 2047; 0x800 and 0x000 are both 0.
#[must_use]
pub fn thermistor_steps(word: ThermistorWord) -> i16 {
    // Eleven bits fit.
    let magnitude = i16::try_from(word.0 & THERMISTOR_MAGNITUDE).unwrap_or(i16::MAX);
    if is_negative(word) {
        -magnitude
    } else {
        magnitude
    }
}

/// The pixel word nearest to a temperature, halves away from zero. Interrupt levels are made by it too.
///
/// # Errors
///
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
/// The sign of the temperature is kept even where the magnitude rounds to 0, so that every word comes back from its
/// own temperature: −0.0 °C is 0x800.
///
/// # Errors
///
/// [`OutOfRange`] below −127.9375 °C, above +127.9375 °C, and for not-a-number.
pub fn thermistor_word(celsius: Celsius) -> Result<ThermistorWord, OutOfRange> {
    in_range(celsius, THERMISTOR_LOWEST, THERMISTOR_HIGHEST)?;
    let magnitude = nearest_step(celsius, THERMISTOR_STEP).unsigned_abs();
    let sign = if celsius.get().is_sign_negative() {
        THERMISTOR_SIGN
    } else {
        0
    };
    Ok(ThermistorWord(sign | magnitude))
}

/// A frame in degrees from what the bus said.
#[must_use]
pub fn frame(raw: &RawFrame) -> Frame {
    Frame {
        thermistor: thermistor_celsius(raw.thermistor),
        pixels: raw.pixels.map(pixel_celsius),
    }
}

/// The word of an interrupt level as read back, without the unspecified bits, so that it compares with the one written.
pub(crate) const fn level(word: u16) -> PixelWord {
    PixelWord(word & VALUE_BITS)
}

/// A temperature that the word of its register cannot hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutOfRange {
    /// The temperature asked for.
    pub found: Celsius,
    /// The lowest temperature that the word holds.
    pub lowest: Celsius,
    /// The highest temperature that the word holds.
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
    // Not-a-number is in no range, so it is refused here as well.
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
    // Both steps are powers of two: the division is exact, and so is the remainder.
    let steps = celsius.get() / step.get();
    #[expect(
        clippy::as_conversions,
        clippy::cast_possible_truncation,
        reason = "the fraction is to be cut off, and the range check keeps the rest within 12 bits"
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
    use grideye_frame::PIXELS;
    use proptest::prelude::*;

    /// Every row printed for the pixels: AMG88 spec §4-11-11, and the 2011 edition §4-10(11).
    const PIXEL_ROWS: [(f32, u16); 7] = [
        (125.0, 0x1F4),
        (25.0, 0x064),
        (0.25, 0x001),
        (0.0, 0x000),
        (-0.25, 0xFFF),
        (-25.0, 0xF9C),
        (-55.0, 0xF24),
    ];

    /// Every row printed for the thermistor: AMG88 spec §4-11-9 (the first two), and the 2011 edition §4-10(9).
    const THERMISTOR_ROWS: [(f32, u16); 7] = [
        (127.9375, 0x7FF),
        (-59.6875, 0xBBB),
        (125.0, 0x7D0),
        (25.0, 0x190),
        (0.25, 0x004),
        (-0.25, 0x804),
        (-20.0, 0x940),
    ];

    /// The rows for interrupt levels: AMG88 spec §4-11-8.
    const LEVEL_ROWS: [(f32, u16); 3] = [(30.0, 0x078), (-5.0, 0xFEC), (-10.0, 0xFD8)];

    #[test]
    fn every_printed_pixel_and_level_row_holds_both_ways() {
        for (celsius, word) in PIXEL_ROWS.into_iter().chain(LEVEL_ROWS) {
            assert_eq!(pixel_celsius(PixelWord(word)), Celsius::new(celsius));
            assert_eq!(pixel_word(Celsius::new(celsius)), Ok(PixelWord(word)));
            let steps = pixel_steps(PixelWord(word));
            assert_eq!(Celsius::new(f32::from(steps) * 0.25), Celsius::new(celsius));
        }
    }

    #[test]
    fn every_printed_thermistor_row_holds_both_ways() {
        for (celsius, word) in THERMISTOR_ROWS {
            assert_eq!(
                thermistor_celsius(ThermistorWord(word)),
                Celsius::new(celsius)
            );
            assert_eq!(
                thermistor_word(Celsius::new(celsius)),
                Ok(ThermistorWord(word))
            );
            let steps = thermistor_steps(ThermistorWord(word));
            assert_eq!(
                Celsius::new(f32::from(steps) * 0.0625),
                Celsius::new(celsius)
            );
        }
    }

    #[test]
    fn the_thermistor_has_a_negative_zero() {
        let decoded = thermistor_celsius(ThermistorWord(0x800)).get();
        assert_eq!(decoded.to_bits(), (-0.0_f32).to_bits());
        assert_eq!(
            thermistor_word(Celsius::new(-0.0)),
            Ok(ThermistorWord(0x800))
        );
        assert_eq!(
            thermistor_word(Celsius::new(0.0)),
            Ok(ThermistorWord(0x000))
        );
    }

    #[test]
    fn the_unspecified_upper_four_bits_do_not_reach_the_value() {
        for upper in (0..=0xF_u16).map(|nibble| nibble << 12) {
            assert_eq!(pixel_celsius(PixelWord(upper | 0xF9C)), Celsius::new(-25.0));
            assert_eq!(pixel_celsius(PixelWord(upper | 0x1F4)), Celsius::new(125.0));
            assert_eq!(
                thermistor_celsius(ThermistorWord(upper | 0xBBB)),
                Celsius::new(-59.6875)
            );
            assert_eq!(
                thermistor_celsius(ThermistorWord(upper | 0x190)),
                Celsius::new(25.0)
            );
        }
    }

    #[test]
    fn every_word_comes_back_from_its_own_temperature() {
        for word in 0..=0xFFF {
            let pixel = PixelWord(word);
            assert_eq!(pixel_word(pixel_celsius(pixel)), Ok(pixel));
            let thermistor = ThermistorWord(word);
            assert_eq!(
                thermistor_word(thermistor_celsius(thermistor)),
                Ok(thermistor)
            );
        }
    }

    #[test]
    fn halves_go_away_from_zero_and_less_goes_back() {
        assert_eq!(pixel_word(Celsius::new(0.125)), Ok(PixelWord(0x001)));
        assert_eq!(pixel_word(Celsius::new(0.124)), Ok(PixelWord(0x000)));
        assert_eq!(pixel_word(Celsius::new(-0.125)), Ok(PixelWord(0xFFF)));
        assert_eq!(pixel_word(Celsius::new(-0.124)), Ok(PixelWord(0x000)));
        // The largest number below one half: adding one half to it in single precision would give 1.
        let below_half = Celsius::new(f32::from_bits(0.125_f32.to_bits() - 1));
        assert_eq!(pixel_word(below_half), Ok(PixelWord(0x000)));
        assert_eq!(
            thermistor_word(Celsius::new(-20.03)),
            Ok(ThermistorWord(0x940))
        );
    }

    #[test]
    fn the_ends_of_the_ranges_are_in_and_the_next_numbers_are_out() {
        assert_eq!(pixel_word(PIXEL_HIGHEST), Ok(PixelWord(0x7FF)));
        assert_eq!(pixel_word(PIXEL_LOWEST), Ok(PixelWord(0x800)));
        assert_eq!(
            thermistor_word(THERMISTOR_HIGHEST),
            Ok(ThermistorWord(0x7FF))
        );
        assert_eq!(
            thermistor_word(THERMISTOR_LOWEST),
            Ok(ThermistorWord(0xFFF))
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
    fn an_error_says_what_was_found_and_what_was_expected() {
        let error = pixel_word(Celsius::new(600.0)).unwrap_err();
        assert_eq!(
            std::format!("{error}"),
            "temperature out of range: expected -512 to 511.75 °C, found 600 °C"
        );
    }

    #[test]
    fn a_frame_is_decoded_word_by_word() {
        let mut pixels = [PixelWord(0x064); PIXELS];
        pixels[0] = PixelWord(0xFFF);
        pixels[63] = PixelWord(0x1F4);
        let decoded = frame(&RawFrame {
            thermistor: ThermistorWord(0x804),
            pixels,
        });
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
