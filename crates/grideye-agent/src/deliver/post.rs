//! What brings a batch to the collector, and what became of it.

use grideye_recording::wire::{Acknowledgement, Batch};
use std::time::Duration;

/// Who brings a batch to the collector.
pub trait Post {
    /// Posts a batch, within this time.
    fn post(&mut self, batch: &Batch, timeout: Duration) -> Posted;
}

/// What became of one post.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Posted {
    /// The collector has it on disk.
    Durable(Acknowledgement),
    /// The collector will never take this body.
    Refused {
        /// The answer's status: 400, 409, 413 or 422.
        status: u16,
        /// The beginning of what it said.
        said: String,
    },
    /// The collector knows this agent, or does not, and does not let it send that: nothing was stored.
    Forbidden {
        /// The answer's status: 401 or 403.
        status: u16,
        /// The beginning of what it said.
        said: String,
    },
    /// Anything else: try again later.
    Later {
        /// What happened, and what to do about it.
        why: String,
        /// The pause that the collector asked for.
        retry_after: Option<Duration>,
        /// Whether it is certain that nothing was stored.
        is_unstored: bool,
    },
}
