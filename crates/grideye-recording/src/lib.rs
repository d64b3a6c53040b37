//! Recording and wire formats.

pub mod record;
pub mod wire;

pub use record::{ClockState, Record, Stamp, StreamId};
