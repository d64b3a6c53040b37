//! Records that wait for the collector, and everything else the agent's threads share.

mod ring;
mod shared;

pub use ring::{FAULT_KINDS_MAX, OTHER_FAULTS, RING_FULL, ROWS_DROPPED, Ring};
pub use shared::Shared;
pub(crate) use shared::{Delivery, Seen};
