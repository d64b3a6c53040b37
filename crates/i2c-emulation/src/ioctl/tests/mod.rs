//! Tests of the layer against a chip of 256 registers and a caller with an array as memory.

mod bench;
mod calls;
mod modes;
mod smbus;
