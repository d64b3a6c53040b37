#![doc = include_str!("../README.md")]
#![no_std]

#[cfg(test)]
extern crate std;

mod no_data;
mod pixel;
mod temperature;

pub use no_data::{NoData, Reading, UnknownNoData};
pub use pixel::PixelIndex;
pub use temperature::{Celsius, Frame, PixelWord, RawFrame, ThermistorWord};

/// Rows of the array (AMG88 spec §4-5-1).
pub const ROWS: usize = 8;
/// Columns of the array (AMG88 spec §4-5-1).
pub const COLUMNS: usize = 8;
/// Pixels of the array.
pub const PIXELS: usize = ROWS * COLUMNS;
