//! Fault scripts: which fault, when, how long, how likely, on which sensor, from one seed.
//!
//! The same script on the same transactions injects the same faults: each rule draws from its own stream, by the number
//! of the transaction, byte or frame.
//!
//! ```
//! use amg8833_emulator::script::{Lasting, Rule, Script, When};
//! use amg8833_emulator::{Address, Bus, BusError, Fault, ManualClock};
//! use core::time::Duration;
//! use embedded_hal::i2c::I2c;
//! use grideye_frame::{Celsius, Frame};
//!
//! let clock = ManualClock::new();
//! let mut bus = Bus::with_sensor(&clock, Address::High, Frame::uniform(Celsius::new(20.0)));
//! let hang = Rule {
//!     when: When::At(Duration::from_millis(12_500)),
//!     lasting: Lasting::For(Duration::from_secs(2)),
//!     ..Rule::new(Fault::Hang)
//! };
//! bus.set_script(Script::new(7, vec![hang]).unwrap());
//! assert_eq!(bus.write(0x69, &[0x80]), Ok(()));
//! clock.set(Duration::from_secs(13));
//! assert_eq!(bus.write(0x69, &[0x80]), Err(BusError::Timeout));
//! ```

#[doc = include_str!("../scripts/README.md")]
pub mod format {}

#[cfg(feature = "script")]
mod parse;
mod rules;
mod run;

pub use rules::{
    EVERY_MIN, Lasting, Place, RULES_MAX, Rule, SCRIPT_BYTES_MAX, Script, ScriptError, When,
};
pub(crate) use run::{Changes, Running};
