//! The vocabulary of grideye-hil: what a frame of an 8 x 8 thermopile array is, in degrees and as the bus said it.
//!
//! ```text
//!            front view (lens at the top edge)        index = number - 1, row-major in register order
//!            57 58 59 60 61 62 63 64                  PixelIndex::new(0)  = pixel 1, the first pair of registers
//!            ..                                       PixelIndex::new(63) = pixel 64, the last
//!             1  2  3  4  5  6  7  8
//! ```
//!
//! Degrees ([`Celsius`], [`Frame`]) and raw words ([`PixelWord`], [`ThermistorWord`], [`RawFrame`]) are different
//! types, and nothing in this crate turns one into the other: what a word means is the business of the driver
//! (`amg8833`) and of the emulator (`amg8833-emulator`), each from the datasheet and each on its own.
//!
//! ```
//! use grideye_frame::{Celsius, Frame, NoData, PixelIndex, Reading};
//!
//! let mut frame = Frame::uniform(Celsius::new(20.0));
//! let centre = PixelIndex::from_number(28).unwrap();
//! frame.pixels[centre.as_usize()] = Celsius::new(31.25);
//! assert_eq!((centre.row(), centre.column()), (3, 3));
//!
//! let reading: Reading<Frame> = Reading::NoData(NoData::Nack);
//! assert_eq!(reading.frame(), None);
//! assert_eq!(NoData::Nack.name(), "nack");
//! ```
#![no_std]

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
