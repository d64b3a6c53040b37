//! The emulated sensor from outside, line by line against the reference on the sensor and its datasheet.
#![expect(
    clippy::unwrap_used,
    reason = "the helpers of a test fail it by panicking"
)]

mod atomicity;
mod conformance;
mod faults;
mod interrupts;
mod properties;
mod support;
mod timing;
