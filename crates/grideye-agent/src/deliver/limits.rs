//! How much goes in one post, how often, and how long a failure is waited for.

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
/// How long what is left of an earlier run is held before it is tried again, after the collector has forbidden it.
pub const HELD_FOR: Duration = Duration::from_secs(600);
/// Under which name it is counted that the collector forbids what is left of an earlier run.
pub const BACKLOG_FORBIDDEN: &str = "backlog-forbidden";
