#![doc = include_str!("../README.md")]
//!
//! | address | register (AMG88 spec §4-11-1 to 4-11-11) | methods |
//! |---|---|---|
//! | 0x00 | power control | `wake`, `sleep`, `standby`, `power_mode` |
//! | 0x01 | reset | `init`, `wake`, `initial_reset`, `flag_reset` |
//! | 0x02 | frame rate | `set_frame_rate`, `frame_rate` |
//! | 0x03 | interrupt control | `set_interrupt`, `interrupt` |
//! | 0x04, 0x05 | status, status clear | `status`, `clear_flags` |
//! | 0x07, 0x1F | moving average and its key | `set_moving_average`, `moving_average` |
//! | 0x08 to 0x0D | interrupt levels, hysteresis | `set_interrupt_levels`, `interrupt_levels` |
//! | 0x0E, 0x0F | thermistor | `read_thermistor`, `read_frame` |
//! | 0x10 to 0x17 | interrupt table | `interrupt_table` |
//! | 0x80 to 0xFF | pixels | `read_pixels`, `read_frame` |
//! | 0x00 to 0x0D | all settings at once | `configuration` |
//!
//! "AMG88 spec" is Panasonic's reference specification of the AMG88 series of 4 February 2016. Where the edition of 30 August
//! 2011 differs or says more, the docs name it.
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
