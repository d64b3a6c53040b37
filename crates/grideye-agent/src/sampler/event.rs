//! What the sampler wants done, and what it makes of the answers.

use grideye_frame::{RawFrame, Reading};
use std::time::Duration;

/// What the sampler wants done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Task {
    /// Wake, reset and configure the sensor; answer with [`Sampler::set_up`](super::Sampler::set_up).
    SetUp,
    /// Read the settings back; answer with [`Sampler::settings_checked`](super::Sampler::settings_checked).
    CheckSettings,
    /// Read a frame; answer with [`Sampler::frame_read`](super::Sampler::frame_read).
    ReadFrame,
}

/// A task and the moment for it on the boot clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Due {
    /// Not before this.
    pub at: Duration,
    /// What to do.
    pub task: Task,
}

/// The boot clock right before and right after an operation on the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Span {
    /// Before the operation.
    pub before: Duration,
    /// After it.
    pub after: Duration,
}

/// What came of an operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// One sensor frame, read or missing.
    Record {
        /// Which frame, from 0.
        seq: u64,
        /// When it was read, or found to be missing.
        at: Duration,
        /// The frame, or why there is none.
        reading: Reading<RawFrame>,
    },
    /// A fault, by the name under which it is counted.
    Fault(&'static str),
}

/// The count of moments at which the sensor's updates did not come where they had to.
pub const OUT_OF_STEP: &str = "out-of-step";
/// The count of moments at which the number of frames since the last one had to be estimated: after a set-up, or after
/// so long a time without frames that the sensor's period is not known well enough. `seq` may be off from there on.
pub const COUNT_ESTIMATED: &str = "count-estimated";
/// The count of frames whose thermistor, a transfer of its own, may be that of the frame after, because the read was
/// that late.
pub const THERMISTOR_LATE: &str = "thermistor-late";
/// The count of frames with a pixel that reads what a failed one does, far from all around it. They are recorded as
/// they are.
pub const GLITCH_PIXEL: &str = "glitch-pixel";
/// The count of transfers that did not come back.
pub const BUS_HUNG: &str = "bus-hung";
/// The count of gaps that were too long to be listed row by row.
pub const GAP_NOT_LISTED: &str = "gap-not-listed";
