//! Why frames could not be compared.

use std::fmt;
use std::time::Duration;

/// Which of the two recordings a fault was found in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// The sensor's frames.
    Real,
    /// The simulator's frames.
    Simulated,
}

impl fmt::Display for Side {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(match self {
            Self::Real => "real",
            Self::Simulated => "simulated",
        })
    }
}

/// Why nothing could be compared. A comparison that was made but tells nothing is no error: it is the verdict
/// [`CannotTell`](crate::Verdict::CannotTell).
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ValidatorError {
    /// One side has no frame at all.
    #[error(
        "there is no {side} frame to compare\nhint: check that the recording holds frames of this sensor and not only gaps"
    )]
    NoFrames {
        /// The side without frames.
        side: Side,
    },
    /// One side has more frames than are compared at once.
    #[error(
        "{found} {side} frames are more than the {limit} that are compared at once\nhint: ask for fewer frames; they are chosen evenly over the recording"
    )]
    TooManyFrames {
        /// The side with too many.
        side: Side,
        /// The limit, [`FRAMES_MAX`](crate::FRAMES_MAX).
        limit: usize,
        /// How many there were.
        found: usize,
    },
    /// A frame has another number of pixels than the others.
    #[error(
        "{side} frame {index} has {found} pixels where {expected} are expected\nhint: compare frames of one resolution only"
    )]
    FrameSize {
        /// The side.
        side: Side,
        /// The frame, counted from 0.
        index: usize,
        /// Pixels of the first real frame's shape.
        expected: usize,
        /// Pixels found.
        found: usize,
    },
    /// A pixel is not a finite number.
    #[error(
        "pixel index {pixel} of {side} frame {index} is not a finite number\nhint: leave the frame out; a missing frame is recorded as missing, never as NaN"
    )]
    NotFinite {
        /// The side.
        side: Side,
        /// The frame, counted from 0.
        index: usize,
        /// The pixel, counted from 0.
        pixel: usize,
    },
    /// The dynamic protocol needs one simulated frame for each real one.
    #[error(
        "{real} real frames cannot be compared one by one with {simulated} simulated frames\nhint: simulate one frame at the time of each real frame, or use the static protocol"
    )]
    Unpaired {
        /// Real frames.
        real: usize,
        /// Simulated frames.
        simulated: usize,
    },
    /// A setting is out of its range.
    #[error("setting `{name}` is {found} where {expected} is expected")]
    Setting {
        /// The setting's name.
        name: &'static str,
        /// What is allowed.
        expected: &'static str,
        /// What was given.
        found: f64,
    },
    /// The scene's sensor has another resolution than the recording.
    #[error(
        "sensor `{sensor}` of the scene has {columns} x {rows} pixels, the recording has 8 x 8\nhint: compare with an 8 x 8 sensor of the scene"
    )]
    Resolution {
        /// The sensor's name.
        sensor: String,
        /// Its columns.
        columns: usize,
        /// Its rows.
        rows: usize,
    },
    /// The device's clock went back within the recording, so that frames cannot be met at their times.
    #[error(
        "time runs back by {by:?} at frame {seq} of the recording\nhint: compare the parts before and after it on their own"
    )]
    TimeRunsBackwards {
        /// Sequence number of the frame that is earlier than the one before.
        seq: u64,
        /// By how much.
        by: Duration,
    },
    /// The recording begins after the scene has ended.
    #[error(
        "the recording begins {starts:?} into the scene, which ends after {ends:?}\nhint: give an earlier start"
    )]
    NoOverlap {
        /// Time of the scene at the first frame.
        starts: Duration,
        /// End of the scene's movement.
        ends: Duration,
    },
    /// The scene was refused.
    #[error(transparent)]
    Scene(#[from] grideye_scene::SceneError),
}
