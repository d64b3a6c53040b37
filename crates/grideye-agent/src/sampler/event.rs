//! What the sampler wants done and makes of the answers; how long it waits and how often it tries.

use super::phase::Ns;
use grideye_frame::{RawFrame, Reading};
use std::time::Duration;

/// What the sampler wants done; each has a method that takes the answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Task {
    /// Wake, reset and configure the sensor; answer with [`Sampler::set_up`](super::Sampler::set_up).
    SetUp,
    /// Read the settings back; answer with [`Sampler::settings_checked`](super::Sampler::settings_checked).
    CheckSettings,
    /// Read a frame; answer with [`Sampler::frame_read`](super::Sampler::frame_read).
    ReadFrame,
}

/// A task, which is due at this moment on the boot clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Due {
    pub(crate) at: Duration,
    pub(crate) task: Task,
}

/// The boot clock right before and right after an operation on the bus.
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

/// What came of an operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Event {
    /// One sensor frame, numbered from 0: read at `at`, or found to be missing then.
    Record {
        seq: u64,
        at: Duration,
        reading: Reading<RawFrame>,
    },
    /// A fault, by the name under which it is counted.
    Fault(&'static str),
}

/// The count of moments at which the sensor's updates did not come where they had to.
pub const OUT_OF_STEP: &str = "out-of-step";
/// The count of moments at which the number of frames since the last one was estimated, after a set-up or a long time
/// without frames: `seq` may be off from there on.
pub const COUNT_ESTIMATED: &str = "count-estimated";
/// The count of frames that were read so late that their thermistor, a transfer of its own, may be the next frame's.
pub const THERMISTOR_LATE: &str = "thermistor-late";
/// The count of frames, recorded as they are, with a pixel that reads what a failed one does, far from all around it.
pub const GLITCH_PIXEL: &str = "glitch-pixel";
/// The count of transfers that did not come back.
pub const BUS_HUNG: &str = "bus-hung";
/// The count of gaps that were too long to be listed row by row.
pub const GAP_NOT_LISTED: &str = "gap-not-listed";

/// Content that stays the same for so many frames is that of a sensor which has stopped measuring. A scene without noise
/// or a replayed recording may stand still for ten seconds.
pub const FROZEN_FRAMES: u32 = 100;
/// Attempts at one frame after a fault, beside the first.
pub(super) const RETRIES_PER_FRAME: u32 = 3;
/// Faults in a row after which a sensor that answers is set up again, and one that does not is asked less often.
pub(super) const FAULTS_BEFORE_SET_UP: u32 = 8;
/// The longest pause between two attempts at a sensor that does not answer.
pub(super) const RETRY_PAUSE_MAX: Duration = Duration::from_secs(1);
/// Frame periods after a set-up within which a frame must have come; registers that are still zero then are a fault.
pub(super) const FIRST_FRAME_PERIODS: u32 = 10;
/// How often the settings are read back. A sensor that lost its supply for a moment comes back with others.
pub(super) const SETTINGS_EVERY: Duration = Duration::from_secs(5);
/// The pause before the second attempt to set the sensor up; it doubles up to [`SET_UP_PAUSE_MAX`].
pub(super) const SET_UP_PAUSE: Duration = Duration::from_millis(200);
/// The longest pause between two attempts to set the sensor up.
pub(super) const SET_UP_PAUSE_MAX: Duration = Duration::from_secs(2);
/// Missing frames that are listed row by row at once: an hour at 10 Hz. Beyond, the gap shows in `seq` alone.
pub(super) const ROWS_PER_GAP_MAX: u64 = 36_000;
/// A window narrower than this is not halved any more: at 100 kHz a read takes 12.3 ms of the bus.
pub(super) const NARROW: Ns = 2_000_000;
/// How far behind a window the read is set.
pub(super) const GUARD: Ns = 500_000;
/// How far before a window the read is set that proves its lower bound.
pub(super) const PROBE_LEAD: Ns = 1_000_000;
/// Frames after which the lower bound is proved again.
pub(super) const PROBE_EVERY: u32 = 16;
/// Frames in a row whose content changed, after an equal one, until an unchanged one is taken for a late one at first.
pub(super) const LIVELY_FRAMES: u32 = 16;
/// Reads over which the host's lateness is averaged.
pub(super) const LATENESS_READS: Ns = 8;
/// Reads that wait for a late frame.
pub(super) const LATE_READS: u32 = 2;
/// Equal frames in a row after which the estimate counts them, when the bounds have become wider than a period.
pub(super) const STILL_FRAMES: u32 = 5;
