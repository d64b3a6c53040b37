//! Public tests of the emulated sensor, line by line against the reference on the sensor and its datasheet.
#![expect(
    clippy::unwrap_used,
    reason = "the helpers of a test fail it by panicking"
)]

#[path = "../common/any_options.rs"]
mod any_options;
mod atomicity;
mod conformance;
mod events;
mod faults;
mod interrupts;
mod power;
mod properties;
mod resets;
mod spoiled;
mod support;
mod timing;
mod wire;
