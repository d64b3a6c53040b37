//! What brings a batch to the collector, how much goes in one post, and how long a failure is waited for.

use grideye_recording::wire::{Acknowledgement, Batch};
use std::time::Duration;

/// Records in one live post at most, those of all sensors together: about 50 kB.
pub const BATCH_RECORDS_MAX: usize = 200;
/// Records in one post of the backlog at most: about 240 kB.
pub const BACKLOG_RECORDS_MAX: usize = 1000;
/// How often the account is posted when there is nothing else to say.
pub const HEARTBEAT_EVERY: Duration = Duration::from_secs(5);
/// The shortest pause after a failure.
pub const BACK_OFF_MIN: Duration = Duration::from_millis(500);
/// The longest pause after a failure of its own choice.
pub const BACK_OFF_MAX: Duration = Duration::from_secs(60);
/// The longest pause that a collector may ask for with `Retry-After`.
pub const RETRY_AFTER_MAX: Duration = Duration::from_secs(300);
/// How long what the collector forbids of an earlier run is held before it is tried again.
pub const HELD_FOR: Duration = Duration::from_secs(600);
/// The count of posts of an earlier run that the collector forbade.
pub const BACKLOG_FORBIDDEN: &str = "backlog-forbidden";

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
    /// The collector will never take this body: status 400, 409, 413 or 422, and the beginning of what it said.
    Refused(u16, String),
    /// The collector does not let this agent send that, and stored nothing: status 401 or 403, and what it said.
    Forbidden(u16, String),
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
