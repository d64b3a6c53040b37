//! The spool's size limits, and the reasons under which it counts dropped frames.

/// The reason for frames dropped because the spool was full.
pub const SPOOL_FULL: &str = "spool-full";
/// The reason for frames dropped because the disk could not return them.
pub const SPOOL_DAMAGED: &str = "spool-damaged";
/// A segment of this many bytes is full: about ten minutes of one sensor at 10 Hz.
pub const SEGMENT_BYTES: u64 = 1 << 20;
/// Maximum size of the quarantine in bytes. Further data is counted and logged but not stored.
pub const QUARANTINE_BYTES_MAX: u64 = 16 << 20;
/// Maximum number of runs of records on the disk that were acknowledged before older ones. At the limit, all records are
/// delivered oldest first, until there are fewer.
pub const RUNS_AHEAD_MAX: usize = 10_000;
/// After this many failed reads of a segment, its frames are dropped.
pub const READS_MAX: u32 = 3;
/// Largest segment read in bytes; this program writes none larger.
pub(super) const SEGMENT_READ_MAX: usize = 16 << 20;

/// The size limits of a spool.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Maximum bytes of all segments together.
    pub bytes_max: u64,
    /// Bytes to leave free on the disk.
    pub free_bytes_min: u64,
    /// A segment of this many bytes is full.
    pub segment_bytes: u64,
}

impl Limits {
    /// Segments of the usual size, or an eighth of the spool if that is less.
    #[must_use]
    pub fn new(bytes_max: u64, free_bytes_min: u64) -> Self {
        Self {
            bytes_max,
            free_bytes_min,
            segment_bytes: SEGMENT_BYTES.min(bytes_max / 8),
        }
    }
}

/// Maximum number of ended boots in the state. Beyond it the oldest are forgotten, with a log message.
pub const RUNS_MAX: usize = 1000;
