//! Limits that several floors share.

use std::time::Duration;

/// Frames that the ring may be told to hold at most: about 35 MB, 5.5 hours of one sensor at 10 Hz.
pub const RING_FRAMES_MAX: usize = 200_000;
/// What is younger goes to the collector first, what is older when there is time for it.
pub const LIVE_FOR: Duration = Duration::from_secs(10);
/// How often the spooler looks, unless it syncs more often.
pub const LOOK_EVERY: Duration = Duration::from_millis(125);
/// How long the disk may take to sync for what is stated to hold ([`Guarantee`](crate::config::Guarantee)).
pub const SYNC_MAX: Duration = Duration::from_millis(125);
/// Length of a join line and of the file that joining leaves, at most, in bytes.
pub const JOINED_BYTES_MAX: usize = 64 * 1024;
