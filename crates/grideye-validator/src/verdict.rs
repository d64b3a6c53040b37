mod above;
mod criterion;
mod enough;
mod held;
mod judge;
mod picture;

pub use above::{AboveRoom, RoomFrom};
pub(crate) use above::{Products, Room, above_room};
pub use criterion::{Asked, Criterion, State};
pub(crate) use judge::judge;

use crate::Scores;
use crate::align::Orientation;
use crate::expected::{Expected, Statistics};
use crate::metrics::SENSOR_ACCURACY_C;
use std::fmt;
use std::time::Duration;

/// What the comparison says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Verdict {
    /// The simulated scene explains what the sensor saw.
    Agrees,
    /// It does not.
    Disagrees,
    /// The recording does not hold what an answer would need.
    CannotTell,
}

impl Verdict {
    /// The stable name for files and programs: `agrees`, `disagrees` or `cannot_tell`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Agrees => "agrees",
            Self::Disagrees => "disagrees",
            Self::CannotTell => "cannot_tell",
        }
    }
}

impl fmt::Display for Verdict {
    /// In words: `agrees`, `disagrees`, `cannot tell`.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(match self {
            Self::Agrees => "agrees",
            Self::Disagrees => "disagrees",
            Self::CannotTell => "cannot tell",
        })
    }
}

/// What the verdict is measured against. Skills are shares of the way from what chance scores on the recording to what
/// hardly any recording of a right scene falls below, so that the same thresholds serve a strong scene and a weak one.
///
/// The defaults are the numbers of `thresholds.toml`, which says of each where it comes from;
/// [`ThresholdSet`](crate::thresholds::ThresholdSet) reads such files.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thresholds {
    /// Least skill in C, 0 to 1.
    pub correlation_skill_min: f64,
    /// Least skill in the gain over the blank frame, 0 to 1.
    pub gain_skill_min: f64,
    /// Least skill in C with the empty room taken from both sides, 0 to 1.
    pub above_room_skill_min: f64,
    /// Least skill in the gain that the scene's people bring, 0 to 1.
    pub nobody_skill_min: f64,
    /// Standard deviation of what each pixel of a unit without a profile shows too much, °C.
    pub pattern_spread_c: f64,
    /// Less warmth than this in two by two pixels, beyond what the scene has there or nearby, is never a fault, °C.
    pub unclaimed_min_c: f64,
    /// Largest common offset of a unit that nothing is known of, °C.
    pub offset_max_c: f64,
    /// Largest common offset of a unit whose profile is given, °C, beyond three times the profile's common mode.
    pub level_margin_c: f64,
    /// How far the ceilings of C and gain must rise above chance before anything is said.
    pub headroom_min: f64,
    /// Least number of warm pixels a frame, on average, before a recording counts as holding something warm.
    pub warm_pixels_min: f64,
    /// A pixel is warm when it lies above the background by more than this many sigma of the sensor's noise.
    pub warm_sigma: f64,
    /// Least number of real frames.
    pub frames_min: f64,
    /// Most false alarms of each check, a recording of a right scene by a sound unit.
    pub false_alarm_max: f64,
    /// Most that the rate of frames may be off the scene's, as a share of it.
    pub rate_error_max: f64,
    /// Most that pixels and thermistor may be apart, °C.
    pub thermistor_apart_max_c: f64,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self {
            correlation_skill_min: 0.6,
            gain_skill_min: 0.6,
            above_room_skill_min: 0.5,
            nobody_skill_min: 0.5,
            pattern_spread_c: 0.26,
            unclaimed_min_c: 0.3,
            offset_max_c: SENSOR_ACCURACY_C,
            level_margin_c: 0.125,
            headroom_min: 0.1,
            warm_pixels_min: 0.3,
            warm_sigma: 4.0,
            frames_min: 2.0,
            false_alarm_max: 0.001,
            rate_error_max: 0.1,
            thermistor_apart_max_c: 12.0,
        }
    }
}

/// The verdict and what it rests on.
#[derive(Debug, Clone, PartialEq)]
pub struct Judgement {
    /// The verdict.
    pub verdict: Verdict,
    /// The verdict in one sentence.
    pub headline: String,
    /// What it rests on, each a sentence with the numbers; what failed comes first.
    pub reasons: Vec<String>,
    /// What would have changed it, in a sentence.
    pub would_change: String,
    /// Every part of it, those that were not asked among them, in a fixed order.
    pub criteria: Vec<Criterion>,
}

/// The numbers that the verdict rests on.
pub(crate) struct Evidence<'a> {
    pub(crate) scores: &'a Scores,
    pub(crate) real_frames: usize,
    pub(crate) offset_c: f64,
    pub(crate) warm: WarmPixels,
    pub(crate) warm_above_c: f64,
    pub(crate) lag_frames: usize,
    pub(crate) beside: &'a Beside,
    /// What the recording scores, and what recordings by drawn units score.
    pub(crate) found: &'a Statistics,
    pub(crate) expected: &'a Expected,
    /// Orientations in which the scene looks much as it does upright.
    pub(crate) alike: &'a [Orientation],
    /// When the frames were recorded that `found` speaks of.
    pub(crate) times: &'a [Duration],
}

/// What the same scene scores without its people.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nobody {
    /// C.
    pub correlation: Option<f64>,
    /// Gain over the blank frame.
    pub gain: Option<f64>,
    /// Whether the scene has people at all. If not, this is the scene itself.
    pub has_people: bool,
}

/// What is known beside the frames.
#[derive(Debug, Clone, Default)]
pub(crate) struct Beside {
    /// The scene without its people at the times of the simulated frames, without noise.
    pub(crate) nobody: Vec<Vec<f64>>,
    /// Whether the scene has people.
    pub(crate) has_people: bool,
    /// Whether they can be seen in any of the simulated frames.
    pub(crate) shows_people: bool,
    /// Where the unit's pattern is known from; nothing is known of it where that is the scene.
    pub(crate) pattern_from: RoomFrom,
    /// What of it was added to the scene, row by row, °C; empty if nothing was.
    pub(crate) pattern_added_c: Vec<f64>,
    /// Standard deviation of what is not known of it, row by row, °C, where something is.
    pub(crate) pattern_c: Option<Vec<f64>>,
    /// How the image was found to lie, if it was turned back.
    pub(crate) turned_back: Option<Orientation>,
    /// What the real side shows of the empty room, if that is known.
    pub(crate) room: Room,
    /// The largest common offset of this unit, °C, if its profile is known.
    pub(crate) level_c: Option<f64>,
    /// What was found about the sensor itself.
    pub(crate) sensor: Vec<Criterion>,
}

/// Warm pixels a frame, on average: both counts by the same rule, so that they can be set side by side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WarmPixels {
    /// In the real frames, above the median of their own pixels.
    pub real: f64,
    /// In the noise-free simulated frames, above the median of their own pixels: what the scene claims.
    pub claimed: f64,
    /// Of the pixels that the gain is taken over, the share that is warm on both sides, 0 to 1; `None` if there are
    /// none. The gain asks less of the claim than of the real side, so that the right scene does not reach 1.
    pub overlap: Option<f64>,
}

#[cfg(test)]
mod tests;
