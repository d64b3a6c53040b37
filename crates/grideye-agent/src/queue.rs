//! What waits for the collector, and what the agent's threads share.

mod ring;
mod shared;

pub use ring::{FAULT_KINDS_MAX, OTHER_FAULTS, OnDisk, RING_FULL, ROWS_DROPPED, Ring};
pub use shared::{Delivery, Observed, Seen, Shared};
