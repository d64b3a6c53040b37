//! How much a spool may hold, and under which names it counts what it drops.

/// The reason under which frames are dropped because the spool was full.
pub const SPOOL_FULL: &str = "spool-full";
/// The reason under which frames are dropped that the disk held and could not give back.
pub const SPOOL_DAMAGED: &str = "spool-damaged";
/// Bytes of a segment, from which on another one is begun: some ten minutes of one sensor at 10 Hz.
pub const SEGMENT_BYTES: u64 = 1 << 20;
/// Bytes that the quarantine may hold; beyond, what belongs there is counted and logged, but not stored.
pub const QUARANTINE_BYTES_MAX: u64 = 16 << 20;
/// Runs of records on disk, each without a gap, that are remembered. While there are more, records stay in memory.
pub const EXTENTS_MAX: usize = 10_000;
/// Attempts to read a segment, after which its frames are given up.
pub const READS_MAX: u32 = 3;
/// The largest segment that is read: this program writes none that is larger.
pub(super) const SEGMENT_READ_MAX: usize = 16 << 20;

/// How much a spool may hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of all segments together.
    pub bytes_max: u64,
    /// Bytes that are left free on the disk.
    pub free_bytes_min: u64,
    /// Bytes of a segment, from which on another one is begun.
    pub segment_bytes: u64,
}

impl Limits {
    /// Segments of the usual size, or of an eighth of the spool where that is less.
    #[must_use]
    pub fn new(bytes_max: u64, free_bytes_min: u64) -> Self {
        Self {
            bytes_max,
            free_bytes_min,
            segment_bytes: SEGMENT_BYTES.min(bytes_max / 8),
        }
    }
}

/// Ended runs that are remembered; of more, the oldest that have nothing on disk are forgotten, and that is said.
pub const RUNS_MAX: usize = 1000;
