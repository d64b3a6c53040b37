//! The array's pixels, its timing, and its frames as temperatures and as raw words.

use core::fmt;
use core::time::Duration;

/// Rows of the array (AMG88 spec §4-5-1).
pub const ROWS: usize = 8;
/// Columns of the array (AMG88 spec §4-5-1).
pub const COLUMNS: usize = 8;
/// Pixels of the array.
pub const PIXELS: usize = ROWS * COLUMNS;
/// Nominal time from one measurement to the next, at either frame rate (AMG88 spec §4-11-3).
pub const TICK: Duration = Duration::from_millis(100);

/// One pixel: 0 to 63 in code, 1 to 64 in prose, as the datasheet numbers them (AMG88 spec §4-5-1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PixelIndex(u8);

impl PixelIndex {
    /// From an index of 0 to 63; `None` otherwise.
    #[must_use]
    pub fn new(index: usize) -> Option<Self> {
        let within = u8::try_from(index).ok().filter(|_| index < PIXELS);
        within.map(Self)
    }

    /// From the datasheet's number of 1 to 64; `None` otherwise.
    #[must_use]
    pub fn from_number(number: usize) -> Option<Self> {
        Self::new(number.checked_sub(1)?)
    }

    /// Every pixel in register order.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..PIXELS).filter_map(Self::new)
    }

    /// The datasheet's number, 1 to 64.
    #[must_use]
    pub const fn number(self) -> u8 {
        self.0 + 1
    }

    /// The index into an array of 64, 0 to 63.
    #[must_use]
    pub fn as_usize(self) -> usize {
        usize::from(self.0)
    }

    /// The row in register order, 0 to 7: pixels 1 to 8 are row 0.
    #[must_use]
    pub fn row(self) -> usize {
        self.as_usize() / COLUMNS
    }

    /// The column in register order, 0 to 7.
    #[must_use]
    pub fn column(self) -> usize {
        self.as_usize() % COLUMNS
    }
}

/// A temperature in degrees Celsius. Single precision represents every value of the sensor exactly.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
pub struct Celsius(f32);

impl Celsius {
    /// Accepts any value, including NaN.
    #[must_use]
    pub const fn new(celsius: f32) -> Self {
        Self(celsius)
    }

    /// Degrees Celsius.
    #[must_use]
    pub const fn get(self) -> f32 {
        self.0
    }
}

impl fmt::Display for Celsius {
    /// Degrees without the unit, in the requested precision.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&self.0, formatter)
    }
}

/// One pixel's register pair as read from the bus: all 16 bits, so that old recordings can be decoded again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct PixelWord(pub u16);

/// The thermistor's register pair as read from the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct ThermistorWord(pub u16);

/// One frame as read from the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct RawFrame {
    /// The thermistor's word, read immediately after the pixels.
    pub thermistor: ThermistorWord,
    /// The words of pixels 1 to 64, in register order.
    pub pixels: [PixelWord; PIXELS],
}

/// One frame as a record holds it: what the bus said, as far as it is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct RecordedFrame {
    /// The thermistor's word; `None` if whoever recorded did not keep it.
    pub thermistor: Option<ThermistorWord>,
    /// The words of pixels 1 to 64, in register order.
    pub pixels: [PixelWord; PIXELS],
}

impl From<RawFrame> for RecordedFrame {
    fn from(raw: RawFrame) -> Self {
        Self {
            thermistor: Some(raw.thermistor),
            pixels: raw.pixels,
        }
    }
}

/// One frame in degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// The chip's own temperature, several degrees above the room's because of self-heating.
    pub thermistor: Celsius,
    /// The temperatures of pixels 1 to 64, in register order.
    pub pixels: [Celsius; PIXELS],
}

impl Frame {
    /// A frame with one temperature in all pixels and the thermistor.
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
    fn numbers_run_from_1_to_64_in_rows_of_eight() {
        assert_eq!(PixelIndex::all().count(), 64);
        for (index, pixel) in PixelIndex::all().enumerate() {
            assert_eq!(usize::from(pixel.number()), index + 1);
            assert_eq!(pixel.row() * 8 + pixel.column(), index);
            assert_eq!(PixelIndex::from_number(index + 1), Some(pixel));
        }
        assert_eq!(PixelIndex::from_number(0), None);
        assert_eq!(PixelIndex::new(64), None);
    }

    #[test]
    fn corners_are_where_the_datasheet_draws_them() {
        for (number, corner) in [(1, (0, 0)), (8, (0, 7)), (57, (7, 0)), (64, (7, 7))] {
            let pixel = PixelIndex::from_number(number).unwrap();
            assert_eq!((pixel.row(), pixel.column()), corner);
        }
    }

    #[test]
    fn degrees_are_written_exactly_or_as_precisely_as_asked_for() {
        let celsius = Celsius::new(-20.0625);
        assert_eq!(format!("{celsius}"), "-20.0625");
        assert_eq!(format!("{celsius:.1} {celsius:>9.2}"), "-20.1    -20.06");
        let frame = Frame::uniform(celsius);
        assert_eq!(
            (frame.thermistor, frame.pixels),
            (celsius, [celsius; PIXELS])
        );
    }
}
