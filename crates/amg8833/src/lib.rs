#![doc = include_str!("../README.md")]
#![no_std]

#[cfg(test)]
extern crate std;

mod address;
mod driver;
mod error;
mod levels;
mod pixel_set;
mod power;
mod protocol;
mod register;
mod settings;
mod status;
pub mod timing;

pub use address::{Address, UnknownAddress};
pub use driver::{asynch, blocking::Amg8833};
pub use error::Error;
pub use grideye_frame::word;
pub use levels::{InterruptLevels, InvalidLevels};
pub use pixel_set::PixelSet;
pub use power::{PowerMode, Standby, UndefinedPowerMode};
pub use settings::{
    Configuration, Deviation, FrameRate, InterruptControl, InterruptMode, MovingAverage, Settings,
};
pub use status::Status;
