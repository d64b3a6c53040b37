//! The pixels of the array, and how often it measures them.

use core::time::Duration;

/// Rows of the array (AMG88 spec §4-5-1).
pub const ROWS: usize = 8;

/// Columns of the array (AMG88 spec §4-5-1).
pub const COLUMNS: usize = 8;

/// Pixels of the array.
pub const PIXELS: usize = ROWS * COLUMNS;

/// From one measurement of the array to the next, nominal, at either frame rate (AMG88 spec §4-11-3).
pub const TICK: Duration = Duration::from_millis(100);

/// The place of one pixel: 0 to 63 in code, 1 to 64 in prose as the datasheet numbers them (AMG88 spec §4-5-1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PixelIndex(u8);

impl PixelIndex {
    /// From an index of 0 to 63; `None` beyond.
    #[must_use]
    pub fn new(index: usize) -> Option<Self> {
        if index >= PIXELS {
            return None;
        }
        u8::try_from(index).ok().map(Self)
    }

    /// From the datasheet's number of 1 to 64; `None` otherwise.
    #[must_use]
    pub fn from_number(number: usize) -> Option<Self> {
        Self::new(number.checked_sub(1)?)
    }

    /// Every pixel, from 1 to 64, in register order.
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

#[cfg(test)]
mod tests {
    use super::*;

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
        let place = |number| PixelIndex::from_number(number).map(|p| (p.row(), p.column()));
        assert_eq!(place(1), Some((0, 0)));
        assert_eq!(place(8), Some((0, 7)));
        assert_eq!(place(57), Some((7, 0)));
        assert_eq!(place(64), Some((7, 7)));
    }
}
