//! Recording and wire formats.

mod text;

pub mod record;
pub mod wire;

pub use record::{
    COUNT_MAX, ClockState, NAME_CHARS_MAX, NameError, Record, Stamp, StreamId, check_name,
};
