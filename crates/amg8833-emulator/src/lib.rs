//! An emulated Panasonic Grid-EYE AMG8833: the sensor's registers behind `embedded_hal::i2c::I2c`, with its timing, its
//! interrupts and its faults, for testing a driver without hardware.
//!
//! ```text
//!   a program          ┌──────── Bus ─────────┐   ┌─────────── Device ────────────┐
//!   for the sensor ────▶ START, bytes, STOP   ├───▶ pointer ▸ registers ◂ averages ◂──── FrameSource
//!                      │ counted, timed       │   │ 128 bytes that stand still    │     what it sees at time t
//!                      └──────────▲───────────┘   └───────────────┬───────────────┘
//!                               Clock: handed in                  └─▶ INT pin
//! ```
//!
//! ```
//! use amg8833_emulator::{Address, Bus, ManualClock};
//! use core::time::Duration;
//! use embedded_hal::i2c::I2c;
//! use grideye_frame::{Celsius, Frame};
//!
//! let clock = ManualClock::new();
//! let mut bus = Bus::with_sensor(&clock, Address::High, Frame::uniform(Celsius::new(-0.25)));
//! clock.advance(Duration::from_millis(100)); // the sensor's first frame
//! let mut pixels = [0; 128];
//! bus.write_read(0x69, &[0x80], &mut pixels)?;
//! assert_eq!(pixels[..2], [0xFF, 0x0F]); // pixel 1, low byte first
//! # Ok::<(), amg8833_emulator::BusError>(())
//! ```
//!
//! What the sensor sees is a [`FrameSource`]: a [`Frame`](grideye_frame::Frame), a closure of time, a scene, a
//! recording. The time comes from a [`Clock`]: a [`ManualClock`] goes through a day in a second, a real one makes the
//! sensor live. [`Options`] hold what differs between specimens and where the sources about the sensor disagree, each
//! with its default; a [`Fault`] breaks the sensor on command.
//!
//! The device was written from the datasheet and from what users of the hardware report. It shares nothing with any
//! driver, so that driver and device can disagree. "AMG88 spec" is Panasonic's specification of 2016 unless a year is
//! given. Where no source says anything, this is what the emulated sensor does:
//!
//! | matter | here |
//! |---|---|
//! | pointer past 0xFF | goes on at 0x00 |
//! | reserved and write-only registers | read 0x00; writes are acknowledged, without effect, and counted in [`Refusals`] |
//! | bits that are not specified | read 0 |
//! | unknown commands | keep the mode; never wedge |
//! | change of frame rate | the mean of ten starts anew, the old frame stays until then |
//! | first frame at 1 fps | ten ticks after power-on, eleven after an initial reset |
//! | stand-by | registers as in normal mode; first frame after a whole interval |
//! | sleep, then normal mode without a reset | the old frame stays until the next tick |
//! | difference mode, first frame | every difference is 0 |
//! | thermistor | belongs to the frame: renewed and averaged with the pixels |
//! | temperature that is not a number | 0x7FF with OVF_IRS |
//!
//! The feature `alloc`, off by default, adds clocks behind `Rc` and `Arc` and boxed sources.
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
