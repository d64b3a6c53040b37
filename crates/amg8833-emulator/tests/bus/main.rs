//! Public tests of the emulated bus: the driver, other traits, a multiplexer, fault scripts, traces, and random input.
#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

#[path = "../common/any_options.rs"]
mod any_options;
mod conformance_table;
mod converse;
mod driver;
mod fuzz;
mod hal;
mod mux;
#[path = "../common/random.rs"]
mod random;
mod script;
mod tearing;
mod trace;
