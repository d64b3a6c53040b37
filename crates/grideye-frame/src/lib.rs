#![doc = include_str!("../README.md")]
#![no_std]

#[cfg(test)]
extern crate std;

mod name;
mod no_data;
mod pixel;
mod temperature;

pub use name::{NAME_CHARS_MAX, NAME_RULE, is_name};
pub use no_data::{NoData, Reading, UnknownNoData};
pub use pixel::{COLUMNS, PIXELS, PixelIndex, ROWS, TICK};
pub use temperature::{Celsius, Frame, PixelWord, RawFrame, ThermistorWord};
