//! Limits that several modules share.

use std::time::Duration;

/// Maximum size of the ring in frames: about 35 MB, 5.5 hours of one sensor at 10 Hz.
pub const RING_FRAMES_MAX: usize = 200_000;
/// Records younger than this go to the collector first, older ones when there is time.
pub const LIVE_FOR: Duration = Duration::from_secs(10);
/// Maximum ranges of acknowledged numbers that are kept of a stream.
pub const ACKNOWLEDGED_RANGES_MAX: usize = 1000;
/// How often the spooler looks for work, unless it syncs more often.
pub const LOOK_EVERY: Duration = Duration::from_millis(125);
/// How long the disk may take to sync under the stated [`Guarantee`](crate::config::Guarantee).
pub const SYNC_MAX: Duration = Duration::from_millis(125);
/// Maximum size of a join line, and of the file that joining writes, in bytes.
pub const JOINED_BYTES_MAX: usize = 64 * 1024;
