//! What may be asked of the alignment, and what it finds.

use crate::align::clock::{Bounds, Law, Warp};
use crate::align::space::Orientation;
use crate::error::{ValidatorError, check_setting};
use crate::frames::LeftOutCount;
use crate::names::named;
use serde::Serialize;
use std::time::Duration;

named! {
    /// What may be done to the recording's time.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub enum TimeAlignment {
        /// Nothing: every frame at its own time.
        None = "none";
        /// One delay for the whole recording.
        Shift = "shift";
        /// A delay and a constant rate of the clock.
        Rate = "rate";
        /// These, and a path about them (dynamic time warping in a band).
        Warp = "warp";
        /// When the walk begins and ends, and how speed is spread over it, in four numbers.
        Law = "law";
    }
}

/// What may be aligned, and how far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AlignOptions {
    /// What may be done to time.
    pub time: TimeAlignment,
    /// Whether an image that lies otherwise than the scene's is turned; it is reported in any case.
    pub orientation: bool,
    /// Whether an offset of up to [`OFFSET_MAX_PX`] is taken out; it is reported in any case.
    pub pose: bool,
    /// Largest delay, departure of a path or of either end of a walk, up to [`SHIFT_MAX`](super::SHIFT_MAX).
    pub shift_max: Duration,
    /// The clock rate is off by at most this share either way, 0 to [`RATE_MAX`](super::RATE_MAX).
    pub rate_max: f64,
}

impl Default for AlignOptions {
    /// Delay up to half a second and rate up to 6 %; nothing is turned or moved.
    fn default() -> Self {
        Self {
            time: TimeAlignment::Rate,
            orientation: false,
            pose: false,
            shift_max: Duration::from_millis(500),
            rate_max: 0.06,
        }
    }
}

/// The largest offset of the image that is taken out, pixels each way; a larger one is another pose, not its error.
pub const OFFSET_MAX_PX: f64 = 0.5;
/// What was found out about how recording and scene lie to each other, and what of it was applied.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Alignment {
    /// What was left out, by reason.
    pub left_out: Vec<LeftOutCount>,
    /// Range of the slow drift that was taken out of all pixels alike, °C.
    pub drift_c: f64,
    /// Time, if something moves and it was asked for.
    pub time: Option<TimeFound>,
    /// How the image lies, if the recording can tell.
    pub orientation: Option<OrientationFound>,
    /// Offset of the image, if the recording can tell.
    pub offset: Option<OffsetFound>,
}

/// What was found out about time.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the names say it")]
pub struct TimeFound {
    pub asked: TimeAlignment,
    /// The scene's time less the recording's at its first frame, seconds: above zero, the recording is late.
    pub shift_s: f64,
    /// Its standard error, seconds, if the scene's changes tell it.
    pub shift_error_s: Option<f64>,
    /// Seconds of the scene in one of the recording, less 1. 0 where it could not be told from 0.
    pub rate: f64,
    pub rate_error: Option<f64>,
    /// Likeness of what moves without alignment: correlation over all pixels and frames, -1 to 1.
    pub likeness_before: f64,
    pub likeness: f64,
    /// The best that decoys reach when they are aligned alike; `None` if every decoy is the scene itself.
    pub chance: Option<f64>,
    pub decoys: usize,
    /// Whether the alignment was applied: it is better than chance, and none beyond the bounds is better.
    pub applied: bool,
    /// Whether a better one lies beyond the bounds; then none is applied.
    pub at_bound: bool,
    /// An offset of the image, pixels right and down, that would explain the recording as well as the delay does.
    pub rival_offset_px: Option<[f64; 2]>,
    /// The path, if it was asked for and earned.
    pub warp: Option<Warp>,
    pub law: Option<Law>,
}

/// How the image lies.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the names say it")]
pub struct OrientationFound {
    #[serde(rename = "found")]
    pub orientation: Orientation,
    /// Its likeness, -1 to 1.
    pub likeness: f64,
    /// That of the image as it is.
    #[serde(rename = "likeness_upright")]
    pub upright: f64,
    pub applied: bool,
}

/// Where the image lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OffsetFound {
    /// Pixels that the recorded image lies to the right and below of the scene's.
    pub right_down_px: [f64; 2],
    /// Likeness without taking it out, and with.
    pub likeness: [f64; 2],
    /// Whether it was taken out.
    pub applied: bool,
}

impl OffsetFound {
    /// Whether it is more than [`OFFSET_MAX_PX`] either way.
    #[must_use]
    pub fn is_another_pose(&self) -> bool {
        self.right_down_px.iter().any(|px| px.abs() > OFFSET_MAX_PX)
    }
}

/// Largest bound of the delay.
pub const SHIFT_MAX: Duration = Duration::from_secs(60);
/// Largest bound of the clock rate, as a share.
pub const RATE_MAX: f64 = 0.2;

impl AlignOptions {
    pub(crate) fn check(&self) -> Result<(), ValidatorError> {
        let (shift_s, percent) = (self.shift_max.as_secs_f64(), 100.0 * self.rate_max);
        let is_shift = self.shift_max <= SHIFT_MAX;
        let is_rate = (0.0..=RATE_MAX).contains(&self.rate_max);
        check_setting(is_shift, "max-shift", "0 to 60 seconds", shift_s)?;
        check_setting(is_rate, "max-rate", "0 to 20 %", percent)
    }

    pub(crate) fn bounds(&self, origin_s: f64) -> Bounds {
        Bounds {
            origin_s,
            shift_max_s: match self.time {
                TimeAlignment::None => 0.0,
                _ => self.shift_max.as_secs_f64(),
            },
            rate_max: match self.time {
                TimeAlignment::Rate | TimeAlignment::Warp => self.rate_max,
                TimeAlignment::None | TimeAlignment::Shift | TimeAlignment::Law => 0.0,
            },
        }
    }
}
