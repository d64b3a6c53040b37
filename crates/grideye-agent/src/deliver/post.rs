//! How a batch gets posted, how much fits in one post, and how long to wait after a failure.

use grideye_recording::wire::{Acknowledgement, Batch};
use std::time::Duration;

/// Maximum records per live post, all sensors together: about 50 kB.
pub const BATCH_RECORDS_MAX: usize = 200;
/// Maximum records per backlog post: about 240 kB.
pub const BACKLOG_RECORDS_MAX: usize = 1000;
/// How often to post the account if there is nothing else.
pub const HEARTBEAT_EVERY: Duration = Duration::from_secs(5);
/// Shortest pause after a failure.
pub const BACK_OFF_MIN: Duration = Duration::from_millis(500);
/// Longest pause after a failure, unless the collector asks for one.
pub const BACK_OFF_MAX: Duration = Duration::from_secs(60);
/// Longest pause that the collector may request with `Retry-After`.
pub const RETRY_AFTER_MAX: Duration = Duration::from_secs(300);
/// How long to hold back an earlier boot's records that the collector forbids before the next attempt.
pub const HELD_FOR: Duration = Duration::from_secs(600);
/// The count of forbidden posts of an earlier boot.
pub const BACKLOG_FORBIDDEN: &str = "backlog-forbidden";

/// The status for a body that is too large.
pub(super) const TOO_LARGE: u16 = 413;

/// Brings a batch to the collector.
pub trait Post {
    /// Posts a batch within this time.
    fn post(&mut self, batch: &Batch, timeout: Duration) -> Posted;
}

/// The outcome of one post.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Posted {
    /// The collector has stored it on disk.
    Durable(Acknowledgement),
    /// The collector will never accept one of these records, or anyone on the way accepts no body of this size
    /// (413): the status, and the start of the answer.
    Refused(u16, String),
    /// The collector does not allow this agent to send it and stored nothing: status 401 or 403, and the answer.
    Forbidden(u16, String),
    /// Anything else: retry later.
    Later {
        /// What happened and what to do.
        why: String,
        /// The pause that the collector asked for.
        retry_after: Option<Duration>,
        /// Whether certainly nothing was stored.
        is_unstored: bool,
    },
}
