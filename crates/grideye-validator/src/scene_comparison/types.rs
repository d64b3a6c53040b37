//! Options of a scene comparison, its frames, and what is known of sensor and room besides the scene.

use crate::align::clock::Clock;
use crate::align::{AlignOptions, Alignment};
use crate::frames::timeline::Timeline;
use crate::frames::types::Pixels;
use crate::frames::{Protocol, RoomSource, sensor_step_c};
use crate::thresholds::Thresholds;
use crate::verdict::sensor_criteria::Inspection;
use crate::verdict::types::{KnownPattern, Prior};
use grideye_frame::PIXELS;
use grideye_recording::Record;
use grideye_scene::Simulator;
use grideye_scene::profile::Profile;
use std::time::Duration;

/// Default number of frames under the static protocol, as in the paper.
pub const STATIC_FRAMES: usize = 10;
/// Default number of frames under the dynamic protocol.
pub const DYNAMIC_FRAMES: usize = 100;
/// Largest lag of the repeat, frames.
pub const LAG_FRAMES_MAX: usize = 600;

/// How to compare a recording with a scene; the defaults suit most recordings.
#[derive(Debug, Clone, Copy)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Options {
    /// Seed of simulated noise and shuffles; a recording simulated with the same seed still gets other noise.
    pub seed: u64,
    /// Which frame meets which; by default static if nothing moves in the scene.
    pub protocol: Option<Protocol>,
    /// Frames per side, chosen evenly; by default [`STATIC_FRAMES`] or [`DYNAMIC_FRAMES`].
    pub frames: Option<usize>,
    /// Frames between a frame and its repeat, 1 to [`LAG_FRAMES_MAX`]; by default 3 (static) or the nearest to 0.1 s
    /// (dynamic).
    pub lag_frames: Option<usize>,
    /// The scene's time at the recording's first frame, seconds; below zero before the scene's start. By default their common
    /// UTC, or the scene's start.
    pub start_s: Option<f64>,
    pub shuffles: usize,
    pub thresholds: Thresholds,
    pub align: AlignOptions,
    /// Whether to seek the change that would make a refused scene agree, or bring it nearer: some seconds.
    pub advises: bool,
    /// What a profile says about the unit: its pattern is added to the scene's claim.
    pub unit: Option<KnownUnit>,
    /// Asked now and then: whether nobody waits for the result any more.
    pub is_stopped: fn() -> bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            seed: 0,
            protocol: None,
            frames: None,
            lag_frames: None,
            start_s: None,
            shuffles: 200,
            thresholds: Thresholds::default(),
            align: AlignOptions::default(),
            advises: false,
            unit: None,
            is_stopped: || false,
        }
    }
}

pub(crate) struct TimedFrame {
    pub(crate) seq: u64,
    pub(crate) time: Duration,
    pub(crate) celsius: Pixels,
    /// Whether the scene was fitted to it.
    pub(crate) is_fitted: bool,
}

pub(crate) struct AlignedFrames {
    pub(crate) frames: Vec<TimedFrame>,
    pub(crate) timeline: Timeline,
    pub(crate) clock: Clock,
    pub(crate) found: Alignment,
}

impl AlignedFrames {
    /// The scene's time of a frame.
    pub(crate) fn scene_time(&self, time: Duration) -> Duration {
        seconds(self.clock.scene_s(time.as_secs_f64()))
    }
}

pub(crate) fn seconds(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds.max(0.0)).unwrap_or_default()
}

pub(crate) fn pixels(celsius: &[f64]) -> Pixels {
    std::array::from_fn(|pixel| celsius.get(pixel).copied().unwrap_or_default())
}

/// What is known of a unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownUnit {
    /// Excess of each pixel, °C: the unit's pattern, plus the background if `has_background`.
    pub pattern_c: [f64; PIXELS],
    /// Whether the room's background is known too.
    pub has_background: bool,
    /// Standard deviation of the common mode between recordings, °C.
    pub wander_c: f64,
    /// Unknown but not random part of the level: power-on error plus depth of the five-frame cycle, °C.
    pub bias_c: f64,
    /// Standard deviation of the unknown part of the pattern, °C.
    pub spread_c: f64,
}

impl KnownUnit {
    /// From a profile.
    #[must_use]
    pub fn of(profile: &Profile) -> Self {
        let common = profile.common_mode;
        // Standard deviation of the mean of 64 draws, for a pattern that is not drawn yet.
        let drawn_c = profile.fixed_pattern.spread_c / 8.0;
        Self {
            pattern_c: profile.in_its_room_c(),
            has_background: profile.background_c.is_some(),
            wander_c: common.sd_c.hypot(drawn_c),
            bias_c: common.cycle_depth_c + profile.warm_up.start_c.abs(),
            spread_c: profile.fixed_pattern.spread_c,
        }
    }

    pub(crate) fn pattern(&self, thresholds: &Thresholds) -> KnownPattern {
        let left_c = if self.has_background {
            self.spread_c
        } else {
            self.spread_c.hypot(thresholds.background_spread_c)
        };
        KnownPattern {
            from: RoomSource::Profile,
            left_c: Some(vec![left_c; PIXELS]),
        }
    }

    /// The largest common offset that is not a fault, °C.
    pub(crate) fn level_c(&self, thresholds: &Thresholds) -> f64 {
        LEVEL_SDS * thresholds.ambient_spread_c.hypot(self.wander_c) + self.bias_c
    }
}

/// Standard deviations that the level of one in a hundred right recordings exceeds.
const LEVEL_SDS: f64 = 2.576;

pub(crate) struct LearnedRoom {
    pub(crate) celsius: Vec<f64>,
    pub(crate) frames: usize,
    /// Standard error of the mean, median over the pixels, °C.
    pub(crate) error_c: f64,
}

/// What is known of sensor and room besides the scene; the caller adds people and pattern.
pub(crate) fn prior(
    records: &[Record],
    simulator: &Simulator,
    pattern: KnownPattern,
    options: &Options,
) -> Prior {
    let thresholds = &options.thresholds;
    let mut sensor = Vec::new();
    if let Some(inspection) = Inspection::new(records, sensor_step_c()) {
        let rate_hz = simulator.sensor().sampling_hz;
        sensor.extend(inspection.criteria(thresholds, rate_hz, simulator.ambient_c()));
    }
    Prior {
        recorded_frames: records
            .iter()
            .filter(|record| record.reading.frame().is_some())
            .count(),
        pattern,
        level_c: options.unit.map(|unit| unit.level_c(thresholds)),
        sensor,
        ..Prior::default()
    }
}
