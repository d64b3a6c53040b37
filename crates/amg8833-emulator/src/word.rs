//! Converts temperatures to register words: AMG88 spec §4-11-9 (thermistor), §4-11-11 (pixels), §4-11-8 (levels).

use grideye_frame::PIXELS;

/// The largest magnitude of both formats: eleven bits.
const MAGNITUDE_MAX: i32 = 0x7FF;
/// The twelve bits that carry a value; the upper four of a pair of registers are unspecified and read 0.
const VALUE_BITS: u16 = 0xFFF;
/// Bit 11: the thermistor's sign, and the sign of the pixels' two's complement.
const SIGN: u16 = 0x800;

/// A register word, and whether the value exceeded the word's range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Word {
    pub(crate) bits: u16,
    pub(crate) overflow: bool,
}

/// A frame as the registers hold it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Words {
    pub(crate) pixels: [u16; PIXELS],
    pub(crate) thermistor: u16,
    pub(crate) pixel_overflow: bool,
    pub(crate) thermistor_overflow: bool,
}

/// 12-bit two's complement in steps of a quarter degree, nearest step, saturating at -512.00 and +511.75.
pub(crate) fn pixel(celsius: f64) -> Word {
    let (steps, overflow) = steps(celsius, 4.0, -MAGNITUDE_MAX - 1);
    Word {
        bits: u16::try_from(steps & i32::from(VALUE_BITS)).unwrap_or(0),
        overflow,
    }
}

/// Sign and magnitude in sixteenths of a degree, saturating. Only minus zero itself becomes 0x800, as recordings have
/// it.
pub(crate) fn thermistor(celsius: f64) -> Word {
    let (steps, overflow) = steps(celsius, 16.0, -MAGNITUDE_MAX);
    let magnitude = u16::try_from(steps.unsigned_abs()).unwrap_or(0);
    let negative = steps < 0 || (celsius == 0.0 && celsius.is_sign_negative());
    let sign = if negative { SIGN } else { 0 };
    let bits = sign | magnitude;
    Word { bits, overflow }
}

/// The steps of a pixel word or of an interrupt level, -2048 to 2047.
pub(crate) fn signed(bits: u16) -> i16 {
    let value = bits & VALUE_BITS;
    let above = if value & SIGN == 0 { 0 } else { !VALUE_BITS };
    i16::from_ne_bytes((value | above).to_ne_bytes())
}

/// Whole steps, and whether they were clamped to the range. Not-a-number becomes the upper end.
fn steps(celsius: f64, steps_per_degree: f64, least: i32) -> (i32, bool) {
    if celsius.is_nan() {
        return (MAGNITUDE_MAX, true);
    }
    let nearest = rounded(celsius * steps_per_degree);
    let held = nearest.clamp(least, MAGNITUDE_MAX);
    (held, held != nearest)
}

/// Nearest whole number, halves away from zero; clamped to the range of `i32`.
fn rounded(value: f64) -> i32 {
    let half = if value < 0.0 { -0.5 } else { 0.5 };
    #[expect(
        clippy::as_conversions,
        clippy::cast_possible_truncation,
        reason = "the fraction must go, and far values must saturate"
    )]
    let whole = (value + half) as i32;
    whole
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(of: fn(f64) -> Word, overflow: bool, rows: &[(f64, u16)]) {
        for (celsius, bits) in rows {
            let word = of(*celsius);
            assert_eq!((word.bits, word.overflow), (*bits, overflow), "{celsius}");
        }
    }

    /// AMG88 spec §4-11-11 (2016) and §4-10(11) (2011), every printed row.
    #[test]
    fn pixels_of_the_datasheet() {
        let rows = [
            (125.0, 0x1F4),
            (25.0, 0x064),
            (0.25, 0x001),
            (0.0, 0x000),
            (-0.25, 0xFFF),
            (-25.0, 0xF9C),
            (-55.0, 0xF24),
        ];
        check(pixel, false, &rows);
    }

    /// AMG88 spec of 2011, §4-10(9), and of 2016, §4-11-9, every printed row.
    #[test]
    fn thermistor_of_the_datasheet() {
        let rows = [
            (127.9375, 0x7FF),
            (125.0, 0x7D0),
            (25.0, 0x190),
            (0.25, 0x004),
            (0.0, 0x000),
            (-0.25, 0x804),
            (-20.0, 0x940),
            (-59.6875, 0xBBB),
        ];
        check(thermistor, false, &rows);
    }

    /// AMG88 spec §4-11-8: levels have the format of the pixels.
    #[test]
    fn levels_of_the_datasheet() {
        check(
            pixel,
            false,
            &[(30.0, 0x078), (-5.0, 0xFEC), (-10.0, 0xFD8)],
        );
    }

    /// Reference section 2.7: saturate at 0x7FF and 0x800 with an overflow.
    #[test]
    fn words_saturate() {
        let (above, below) = (f64::INFINITY, f64::NEG_INFINITY);
        let ends = [
            (511.75, 0x7FF),
            (511.87, 0x7FF),
            (-512.0, 0x800),
            (-512.12, 0x800),
        ];
        check(pixel, false, &ends);
        let beyond = [
            (511.875, 0x7FF),
            (-512.125, 0x800),
            (above, 0x7FF),
            (below, 0x800),
        ];
        check(pixel, true, &beyond);
        check(pixel, true, &[(f64::NAN, 0x7FF)]);
        check(thermistor, false, &[(-127.9375, 0xFFF)]);
        check(
            thermistor,
            true,
            &[(128.0, 0x7FF), (-128.0, 0xFFF), (f64::NAN, 0x7FF)],
        );
    }

    #[test]
    fn nearest_step_and_no_negative_zero_by_rounding() {
        check(
            pixel,
            false,
            &[(20.124, 0x050), (20.126, 0x051), (-0.125, 0xFFF)],
        );
        check(pixel, false, &[(-0.124, 0x000), (-0.0, 0x000)]);
        check(thermistor, false, &[(-0.03, 0x000), (0.0, 0x000)]);
        check(thermistor, false, &[(-0.0, 0x800), (-0.032, 0x801)]);
    }

    #[test]
    fn every_pixel_word_means_its_own_steps() {
        for bits in 0..=VALUE_BITS {
            check(pixel, false, &[(f64::from(signed(bits)) / 4.0, bits)]);
        }
    }
}
