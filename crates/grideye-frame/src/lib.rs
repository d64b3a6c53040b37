#![doc = include_str!("../README.md")]
#![no_std]

#[cfg(test)]
extern crate std;

mod calendar;
mod frame;
mod name;
mod named;
mod no_data;
pub mod word;

pub use calendar::{day_of, days_since_1970};
pub use frame::{
    COLUMNS, Celsius, Frame, PIXELS, PixelIndex, PixelWord, ROWS, RawFrame, RecordedFrame, TICK,
    ThermistorWord,
};
pub use name::{NAME_CHARS_MAX, NAME_RULE, is_name};
pub use no_data::{NoData, Reading, UnknownNoData};
