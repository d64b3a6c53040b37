//! Arduino sketches and libraries on this host: the core of `crates/i2c-emulation/arduino`, compiled by g++, on the real
//! `grideye emulate`.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

mod example;
mod frames;
mod kit;
mod wire;
