//! Alignment options and results.

use crate::align::clock::Bounds;
use crate::align::space::Orientation;
use crate::error::{ValidatorError, check_setting};
use crate::frames::LeftOutCount;
use crate::names::named;
use serde::Serialize;
use std::time::Duration;

named! {
    /// How the recording's time may be changed.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub enum TimeAlignment {
        /// Not at all.
        None = "none";
        /// One delay for the whole recording.
        Shift = "shift";
        /// A delay and a constant rate of the clock.
        Rate = "rate";
    }
}

/// What to align, and how far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AlignOptions {
    /// How time may be changed.
    pub time: TimeAlignment,
    /// Whether to turn back an image in another orientation; it is reported in any case.
    pub orientation: bool,
    /// Whether to remove an offset of up to [`OFFSET_MAX_PX`]; it is reported in any case.
    pub pose: bool,
    /// Largest delay, up to [`SHIFT_MAX`](super::SHIFT_MAX).
    pub shift_max: Duration,
    /// Largest clock rate error either way, as a share, 0 to [`RATE_MAX`](super::RATE_MAX).
    pub rate_max: f64,
}

impl Default for AlignOptions {
    /// A delay of up to half a second and a rate error of up to 6 %; orientation and offset are not corrected.
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

/// Largest image offset that is corrected, pixels each way. A larger one is a different pose, not an error of it.
pub const OFFSET_MAX_PX: f64 = 0.5;
/// What alignment found and what it applied.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Alignment {
    /// Frames left out, by reason.
    pub left_out: Vec<LeftOutCount>,
    /// Range of the slow common drift removed from all pixels, °C.
    pub drift_c: f64,
    /// `None` if not requested or nothing moves.
    pub time: Option<TimeFound>,
    /// `None` if the recording cannot tell.
    pub orientation: Option<OrientationFound>,
    /// `None` if the recording cannot tell.
    pub offset: Option<OffsetFound>,
}

impl Alignment {
    /// The orientation that was turned back.
    pub(crate) fn turned(&self) -> Orientation {
        let applied = self.orientation.as_ref().filter(|found| found.applied);
        applied.map_or(Orientation::Upright, |found| found.orientation)
    }
}

/// The alignment in time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the names say it")]
pub struct TimeFound {
    pub asked: TimeAlignment,
    /// Scene time less recording time at the first frame, seconds; above zero the recording is late.
    pub shift_s: f64,
    /// Standard error of the shift, seconds; `None` if too little changes in the scene.
    pub shift_error_s: Option<f64>,
    /// Scene seconds per recording second, less 1; 0 if not distinguishable from 0.
    pub rate: f64,
    pub rate_error: Option<f64>,
    /// Likeness before alignment: correlation of what moves over all pixels and frames, -1 to 1.
    pub likeness_before: f64,
    pub likeness: f64,
    /// Best likeness of the decoys, aligned the same way; `None` if every decoy equals the scene.
    pub chance: Option<f64>,
    pub decoys: usize,
    /// Whether it was applied: it beats chance, and nothing beyond the bounds is better.
    pub applied: bool,
    /// Whether a better fit lies beyond the bounds; then nothing is applied.
    pub at_bound: bool,
}

/// The orientation of the image.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the names say it")]
pub struct OrientationFound {
    #[serde(rename = "found")]
    pub orientation: Orientation,
    /// Likeness in this orientation, -1 to 1.
    pub likeness: f64,
    /// Likeness of the image as recorded.
    #[serde(rename = "likeness_upright")]
    pub upright: f64,
    pub applied: bool,
}

/// The offset of the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OffsetFound {
    /// Offset of the recorded image from the scene's, pixels right and down.
    pub right_down_px: [f64; 2],
    /// Likeness without and with the correction.
    pub likeness: [f64; 2],
    /// Whether the offset was removed.
    pub applied: bool,
}

impl OffsetFound {
    /// Whether the offset exceeds [`OFFSET_MAX_PX`] either way.
    #[must_use]
    pub fn is_another_pose(&self) -> bool {
        self.right_down_px.iter().any(|px| px.abs() > OFFSET_MAX_PX)
    }
}

/// Largest `shift_max`.
pub const SHIFT_MAX: Duration = Duration::from_secs(60);
/// Largest `rate_max`.
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
                TimeAlignment::Rate => self.rate_max,
                TimeAlignment::None | TimeAlignment::Shift => 0.0,
            },
        }
    }
}
