//! The sampler's tasks and events, its time limits and retry counts.

use super::phase::Ns;
use grideye_frame::{RawFrame, Reading};
use std::time::Duration;

/// A task for the bus thread; each has a method that takes the outcome.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Task {
    /// Wake, reset and configure the sensor; answer with [`Sampler::set_up`](super::Sampler::set_up).
    SetUp,
    /// Read the settings back; answer with [`Sampler::settings_checked`](super::Sampler::settings_checked).
    CheckSettings,
    /// Read a frame; answer with [`Sampler::frame_read`](super::Sampler::frame_read).
    ReadFrame,
}

/// A task and its time on the boot clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Due {
    pub(crate) at: Duration,
    pub(crate) task: Task,
}

/// The outcome of [`Task::CheckSettings`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Checked {
    OtherSettings,
    AsConfigured {
        /// The interrupt flag, which each measurement sets, was set.
        has_measured: bool,
        /// It stayed cleared right after it was cleared: if it is set later, a measurement did that.
        is_cleared: bool,
    },
}

/// The boot clock immediately before and after a bus operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Span {
    pub(crate) before: Duration,
    pub(crate) after: Duration,
}

#[cfg(test)]
impl Span {
    pub(crate) fn new(before: Duration, after: Duration) -> Self {
        Self { before, after }
    }
}

/// A result of an operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Event {
    /// One sensor frame, numbered from 0: read at `at`, or found missing then.
    Record {
        seq: u64,
        at: Duration,
        reading: Reading<RawFrame>,
    },
    /// A fault, by the name it is counted under.
    Fault(&'static str),
}

/// The count of updates that came at an impossible time.
pub const OUT_OF_STEP: &str = "out-of-step";
/// The count of estimated gaps, after a set-up or a long time without frames: `seq` may be off from there on.
pub const COUNT_ESTIMATED: &str = "count-estimated";
/// The count of frames read so late that their thermistor, a separate transfer, may be the next frame's.
pub const THERMISTOR_LATE: &str = "thermistor-late";
/// The count of frames with a pixel at a failure value far from all its neighbors; they are recorded unchanged.
pub const GLITCH_PIXEL: &str = "glitch-pixel";
/// The count of transfers that hung.
pub const BUS_HUNG: &str = "bus-hung";
/// The count of gaps too long to list frame by frame.
pub const GAP_NOT_LISTED: &str = "gap-not-listed";

/// After this many frames of the same content, only a sensor whose interrupt flag shows that it measures is believed. A
/// scene without noise or a replayed recording may stand still for good.
pub const FROZEN_FRAMES: u32 = 100;
/// Further attempts at one frame after a fault.
pub(super) const RETRIES_PER_FRAME: u32 = 3;
/// After this many faults in a row, set up a sensor that answers again, and ask one that does not less often.
pub(super) const FAULTS_BEFORE_SET_UP: u32 = 8;
/// Longest pause between attempts at a sensor that does not answer.
pub(super) const RETRY_PAUSE_MAX: Duration = Duration::from_secs(1);
/// A frame must come within this many periods after a set-up; registers that still read zero are then a fault.
pub(super) const FIRST_FRAME_PERIODS: u32 = 10;
/// How often to read the settings back. A sensor that lost power briefly returns with others.
pub(super) const SETTINGS_EVERY: Duration = Duration::from_secs(5);
/// Pause before the second set-up attempt; it doubles up to [`SET_UP_PAUSE_MAX`].
pub(super) const SET_UP_PAUSE: Duration = Duration::from_millis(200);
/// Longest pause between set-up attempts.
pub(super) const SET_UP_PAUSE_MAX: Duration = Duration::from_secs(2);
/// Maximum missing frames listed one by one for one gap that is noticed at its end: as few as leave room in memory for the frames
/// that wait there, after a night of suspend too. A longer gap shows only in `seq`.
pub(super) const ROWS_PER_GAP_MAX: u64 = 1_000;
/// A narrower window is not halved further: at 100 kHz a read occupies the bus for 12.3 ms.
pub(super) const NARROW: Ns = 2_000_000;
/// How long after the window to read.
pub(super) const GUARD: Ns = 500_000;
/// How long before the window to read when proving its lower bound.
pub(super) const PROBE_LEAD: Ns = 1_000_000;
/// Prove the lower bound again after this many frames.
pub(super) const PROBE_EVERY: u32 = 16;
/// After an equal frame, this many changed ones in a row make the scene lively: an unchanged read then first means a
/// late update.
pub(super) const LIVELY_FRAMES: u32 = 16;
/// Number of reads over which to average the host's lateness.
pub(super) const LATENESS_READS: Ns = 8;
/// Number of reads to wait for a late update.
pub(super) const LATE_READS: u32 = 2;
/// After this many equal frames in a row, the estimate counts further ones while the bounds are wider than a period.
pub(super) const STILL_FRAMES: u32 = 5;
