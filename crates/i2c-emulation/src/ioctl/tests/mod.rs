//! The layer against a chip of 256 registers and a caller's memory that is a plain array.

mod bench;
mod calls;
mod modes;
mod smbus;
