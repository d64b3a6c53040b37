//! How to compare a recording with a scene, and its frames on the way there.

use crate::align::clock::Clock;
use crate::align::{AlignOptions, Alignment};
use crate::frames::Protocol;
use crate::frames::pixels::Pixels;
use crate::metrics::Binning;
use crate::scene_comparison::unit::KnownUnit;
use crate::thresholds::Thresholds;
use std::time::Duration;

/// Frames compared under the static protocol unless asked otherwise, as in the paper.
pub const STATIC_FRAMES: usize = 10;
/// Frames compared under the dynamic protocol unless asked otherwise.
pub const DYNAMIC_FRAMES: usize = 100;
/// Most frames that the repeat may be later.
pub const LAG_FRAMES_MAX: usize = 600;

/// How to compare a recording with a scene. Every default can be left as it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Seed of the simulated noise and of the shuffled pixels. Equal seeds give equal reports; a recording that was
    /// itself simulated with this seed is met by other noise all the same.
    pub seed: u64,
    /// Which frame meets which; by default static if nothing moves in the scene.
    pub protocol: Option<Protocol>,
    /// Frames a side, chosen evenly over the recording; by default [`STATIC_FRAMES`] or [`DYNAMIC_FRAMES`].
    pub frames: Option<usize>,
    /// How many frames later a frame's repeat is, 1 to [`LAG_FRAMES_MAX`]; by default 3, and under the dynamic
    /// protocol as many as come nearest to 0.1 s.
    pub lag_frames: Option<usize>,
    /// Time of the scene at the recording's first frame.
    pub start: Duration,
    /// Random orders of the pixels.
    pub shuffles: usize,
    /// The bins of the second set of entropies; by default the sensor's own steps.
    pub binning: Option<Binning>,
    /// Threads that count pairs of frames; the result is the same with any number.
    pub threads: usize,
    /// What the verdict is measured against.
    pub thresholds: Thresholds,
    /// What may be aligned, and how far.
    pub align: AlignOptions,
    /// What is known of the sensor's specimen: its pattern is added to the scene's claim.
    pub unit: Option<KnownUnit>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            seed: 0,
            protocol: None,
            frames: None,
            lag_frames: None,
            start: Duration::ZERO,
            shuffles: 200,
            binning: None,
            threads: 1,
            thresholds: Thresholds::default(),
            align: AlignOptions::default(),
            unit: None,
        }
    }
}

/// A frame that was read, at the time that the scene has without alignment.
pub(crate) struct TimedFrame {
    pub(crate) seq: u64,
    pub(crate) time: Duration,
    pub(crate) celsius: Pixels,
}

/// Frames as they are compared, and what was done to them.
pub(crate) struct AlignedFrames {
    pub(crate) frames: Vec<TimedFrame>,
    pub(crate) clock: Clock,
    pub(crate) found: Alignment,
}

pub(crate) fn seconds(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds.max(0.0)).unwrap_or_default()
}

pub(crate) fn pixels(celsius: &[f64]) -> Pixels {
    std::array::from_fn(|pixel| celsius.get(pixel).copied().unwrap_or_default())
}
