//! Temperatures, words and frames.

use crate::pixel::PIXELS;
use core::fmt;

/// A temperature in degrees Celsius; single precision holds every value that the sensor can report exactly.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
pub struct Celsius(f32);

impl Celsius {
    /// Degrees Celsius as they are, not-a-number too.
    #[must_use]
    pub const fn new(celsius: f32) -> Self {
        Self(celsius)
    }

    /// The temperature as a number of degrees Celsius.
    #[must_use]
    pub const fn get(self) -> f32 {
        self.0
    }
}

impl fmt::Display for Celsius {
    /// Degrees without the unit; honours the precision asked for.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&self.0, formatter)
    }
}

/// One pixel register pair as the bus delivered it: all 16 bits, so that old recordings can be decoded again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct PixelWord(pub u16);

/// The thermistor's register pair as the bus delivered it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct ThermistorWord(pub u16);

/// One frame as the bus delivered it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct RawFrame {
    /// The thermistor's word, read right after the pixels.
    pub thermistor: ThermistorWord,
    /// The words of pixels 1 to 64, in register order.
    pub pixels: [PixelWord; PIXELS],
}

/// One frame in degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// The thermistor: the chip's own temperature, several degrees above the room's by self-heating.
    pub thermistor: Celsius,
    /// The temperatures of pixels 1 to 64, in register order.
    pub pixels: [Celsius; PIXELS],
}

impl Frame {
    /// A frame whose pixels and thermistor all have one temperature.
    #[must_use]
    pub const fn uniform(temperature: Celsius) -> Self {
        Self {
            thermistor: temperature,
            pixels: [temperature; PIXELS],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::format;

    #[test]
    fn degrees_are_written_exactly_or_as_precisely_as_asked_for() {
        let celsius = Celsius::new(-20.0625);
        assert_eq!(format!("{celsius}"), "-20.0625");
        assert_eq!(format!("{celsius:.1} {celsius:>9.2}"), "-20.1    -20.06");
    }

    #[test]
    fn a_uniform_frame_has_one_temperature_everywhere() {
        let frame = Frame::uniform(Celsius::new(21.5));
        assert_eq!(frame.thermistor, Celsius::new(21.5));
        assert_eq!(frame.pixels, [Celsius::new(21.5); PIXELS]);
    }
}
