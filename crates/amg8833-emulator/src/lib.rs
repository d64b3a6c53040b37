#![doc = include_str!("../README.md")]
#![no_std]

#[cfg(feature = "alloc")]
extern crate alloc;

mod bus;
mod clock;
mod device;
mod fault;
mod measurement;
mod options;
mod registers;
mod shared;
mod source;
mod ticks;
mod word;

pub use bus::{Address, Bus, BusError, HANG_TIMEOUT, Traffic};
pub use clock::Clock;
#[cfg(target_has_atomic = "64")]
pub use clock::ManualClock;
pub use device::{
    Ack, CATCH_UP_FRAMES_MAX, Device, InterruptPin, Refusals, SILENT_START, SLEEP_MIN,
};
pub use fault::Fault;
pub use options::{
    AverageReadback, CLOCK_ERROR_PPM_MAX, InitialReset, InterruptFlag, Options, SleepImage,
    StatusClear,
};
pub use shared::{IntPin, PinError, SharedBus};
pub use source::FrameSource;
