//! What waits for the collector, and what the agent's threads share.

mod observed;
mod ring;
mod shared;
mod stream;

pub use observed::{Delivery, Observed, Seen};
pub use ring::Ring;
pub use shared::Shared;
pub use stream::{FAULT_KINDS_MAX, OTHER_FAULTS, OnDisk, RING_FULL, ROWS_DROPPED};
