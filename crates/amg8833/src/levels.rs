//! Interrupt levels: the temperatures at which a pixel enters and leaves the interrupt table.

use core::error::Error;
use core::fmt;
use grideye_frame::word::{self, OutOfRange};
use grideye_frame::{Celsius, PixelWord};

/// When a pixel enters and leaves the interrupt table (AMG88 spec §4-11-8).
///
/// [`InterruptMode`](crate::InterruptMode) selects the compared value: the pixel's temperature or its change since the
/// previous frame. A pixel enters above `upper` or below `lower`. It leaves at `upper − hysteresis` or below, and
/// `lower + hysteresis` or above.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct InterruptLevels {
    pub(crate) upper: PixelWord,
    pub(crate) lower: PixelWord,
    pub(crate) hysteresis: PixelWord,
}

impl InterruptLevels {
    /// Levels that no pixel can pass: +511.75 °C and −512 °C.
    ///
    /// They differ from the power-on levels (0 °C), so reading them back reveals a sensor that lost its supply.
    pub const NEVER: Self = Self {
        upper: PixelWord(0x7FF),
        lower: PixelWord(0x800),
        hysteresis: PixelWord(0x000),
    };

    /// Levels that every temperature above −512 °C passes: in absolute mode each measurement sets the interrupt flag, also
    /// one that equals the last. They differ from the power-on levels too.
    pub const ALWAYS: Self = Self {
        upper: PixelWord(0x800),
        ..Self::NEVER
    };

    /// Levels in degrees, each rounded to the nearest quarter ([`word::pixel_word`]).
    ///
    /// # Errors
    /// [`InvalidLevels`] if a temperature does not fit its register, `lower` is above `upper`, or `hysteresis` is
    /// negative or exceeds the magnitude of a level (AMG88 spec §4-11-8).
    pub fn new(upper: Celsius, lower: Celsius, hysteresis: Celsius) -> Result<Self, InvalidLevels> {
        let levels = Self {
            upper: word::pixel_word(upper).map_err(InvalidLevels::Upper)?,
            lower: word::pixel_word(lower).map_err(InvalidLevels::Lower)?,
            hysteresis: word::pixel_word(hysteresis).map_err(InvalidLevels::Hysteresis)?,
        };
        levels.check()?;
        Ok(levels)
    }

    /// The upper level: a pixel above it enters the table.
    #[must_use]
    pub fn upper(&self) -> Celsius {
        word::pixel_celsius(self.upper)
    }

    /// The lower level: a pixel below it enters the table.
    #[must_use]
    pub fn lower(&self) -> Celsius {
        word::pixel_celsius(self.lower)
    }

    /// How far inside the levels a pixel must return to leave the table.
    #[must_use]
    pub fn hysteresis(&self) -> Celsius {
        word::pixel_celsius(self.hysteresis)
    }

    fn check(&self) -> Result<(), InvalidLevels> {
        let (upper, lower, hysteresis) = (self.upper(), self.lower(), self.hysteresis());
        if lower > upper {
            return Err(InvalidLevels::LowerAboveUpper(lower, upper));
        }
        if hysteresis < Celsius::new(0.0) {
            return Err(InvalidLevels::HysteresisNegative(hysteresis));
        }
        for level in [upper, lower] {
            if hysteresis.get() > level.get().abs() {
                return Err(InvalidLevels::HysteresisAboveLevel(hysteresis, level));
            }
        }
        Ok(())
    }
}

impl fmt::Display for InterruptLevels {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "above {} or below {} °C with {} °C of hysteresis",
            self.upper(),
            self.lower(),
            self.hysteresis()
        )
    }
}

/// Interrupt levels that the sensor cannot hold or does not work with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum InvalidLevels {
    /// The upper level does not fit its register.
    Upper(OutOfRange),
    /// The lower level does not fit its register.
    Lower(OutOfRange),
    /// The hysteresis does not fit its register.
    Hysteresis(OutOfRange),
    /// The lower level is above the upper one.
    LowerAboveUpper(Celsius, Celsius),
    /// The hysteresis is below 0.
    HysteresisNegative(Celsius),
    /// The hysteresis exceeds a level (AMG88 spec §4-11-8).
    HysteresisAboveLevel(Celsius, Celsius),
}

impl fmt::Display for InvalidLevels {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Upper(out_of_range) => write!(formatter, "upper interrupt level: {out_of_range}"),
            Self::Lower(out_of_range) => write!(formatter, "lower interrupt level: {out_of_range}"),
            Self::Hysteresis(out_of_range) => write!(formatter, "hysteresis: {out_of_range}"),
            Self::LowerAboveUpper(lower, upper) => write!(
                formatter,
                "lower interrupt level above the upper one: expected at most {upper} °C, found {lower} °C"
            ),
            Self::HysteresisNegative(found) => write!(
                formatter,
                "negative hysteresis: expected 0 °C or more, found {found} °C"
            ),
            Self::HysteresisAboveLevel(hysteresis, level) => write!(
                formatter,
                "hysteresis larger than a level: expected at most {} °C for the level of {level} °C, found {hysteresis} °C",
                level.get().abs()
            ),
        }
    }
}

impl Error for InvalidLevels {}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    fn levels(upper: f32, lower: f32, hysteresis: f32) -> Result<InterruptLevels, InvalidLevels> {
        InterruptLevels::new(
            Celsius::new(upper),
            Celsius::new(lower),
            Celsius::new(hysteresis),
        )
    }

    #[test]
    fn the_rows_of_the_specification_give_their_words() {
        let levels = levels(30.0, -10.0, 1.0).unwrap();
        let words = [levels.upper, levels.lower, levels.hysteresis];
        assert_eq!(words, [0x078, 0xFD8, 0x004].map(PixelWord));
        let degrees = [levels.upper(), levels.lower(), levels.hysteresis()];
        assert_eq!(degrees, [30.0, -10.0, 1.0].map(Celsius::new));
    }

    #[test]
    fn the_levels_that_nothing_passes_are_the_ends_of_the_range() {
        assert_eq!(levels(511.75, -512.0, 0.0), Ok(InterruptLevels::NEVER));
    }

    #[test]
    fn a_hysteresis_up_to_the_smaller_level_is_taken_and_more_is_refused() {
        assert!(levels(30.0, 20.0, 20.0).is_ok());
        assert!(levels(30.0, 0.0, 0.0).is_ok());
        assert!(levels(30.0, 0.0, 0.25).is_err());
        let above = |hysteresis, level| {
            let (hysteresis, level) = (Celsius::new(hysteresis), Celsius::new(level));
            Err(InvalidLevels::HysteresisAboveLevel(hysteresis, level))
        };
        assert_eq!(levels(30.0, 20.0, 20.25), above(20.25, 20.0));
        assert_eq!(levels(1.0, -2.0, 1.25), above(1.25, 1.0));
        let negative = InvalidLevels::HysteresisNegative(Celsius::new(-0.25));
        assert_eq!(levels(30.0, 20.0, -0.25), Err(negative));
    }

    #[test]
    fn the_lower_level_may_meet_the_upper_one_but_not_pass_it() {
        assert!(levels(20.0, 20.0, 0.0).is_ok());
        let (lower, upper) = (Celsius::new(20.25), Celsius::new(20.0));
        let above = InvalidLevels::LowerAboveUpper(lower, upper);
        assert_eq!(levels(20.0, 20.25, 0.0), Err(above));
    }

    #[test]
    fn a_level_out_of_range_says_which_one_it_is() {
        for (upper, lower, hysteresis, message) in [
            (
                600.0,
                0.0,
                0.0,
                "upper interrupt level: temperature out of range: expected -512 to 511.75 °C, found 600 °C",
            ),
            (0.0, -600.0, 0.0, "lower interrupt level: "),
            (0.0, 0.0, f32::NAN, "hysteresis: "),
            (
                30.0,
                -5.0,
                6.0,
                "hysteresis larger than a level: expected at most 5 °C for the level of -5 °C, found 6 °C",
            ),
        ] {
            let error = levels(upper, lower, hysteresis).unwrap_err().to_string();
            assert!(error.starts_with(message), "{error}");
        }
    }
}
