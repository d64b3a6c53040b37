//! The record: a sensor frame as kept, and its one binary layout.

pub mod layout;
mod packed;
mod types;

pub(crate) use types::CLOCK_STATES;
pub use types::{
    COUNT_MAX, ClockState, NameError, Record, Row, Stamp, StreamId, UnknownClockState, check_name,
};
