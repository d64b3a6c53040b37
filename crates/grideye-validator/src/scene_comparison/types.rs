//! How to compare a recording with a scene, its frames on the way there, and what is known beside them.

use crate::align::clock::Clock;
use crate::align::{AlignOptions, Alignment};
use crate::frames::types::Pixels;
use crate::frames::{Protocol, sensor_step_c};
use crate::metrics::Binning;
use crate::metrics::foreground::{EmptyRoom, RoomSource};
use crate::thresholds::Thresholds;
use crate::verdict::sensor_criteria::Inspection;
use crate::verdict::types::{KnownPattern, Prior};
use grideye_frame::PIXELS;
use grideye_recording::Record;
use grideye_scene::Simulator;
use grideye_scene::profile::Profile;
use std::time::Duration;

/// Frames compared under the static protocol unless asked otherwise, as in the paper.
pub const STATIC_FRAMES: usize = 10;
/// Frames compared under the dynamic protocol unless asked otherwise.
pub const DYNAMIC_FRAMES: usize = 100;
/// Most frames that the repeat may be later.
pub const LAG_FRAMES_MAX: usize = 600;

/// How to compare a recording with a scene. Every default can be left as it is.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Options {
    /// Seed of the simulated noise and of the shuffled pixels; a recording simulated with it is met by other noise.
    pub seed: u64,
    /// Which frame meets which; by default static if nothing moves in the scene.
    pub protocol: Option<Protocol>,
    /// Frames a side, chosen evenly over the recording; by default [`STATIC_FRAMES`] or [`DYNAMIC_FRAMES`].
    pub frames: Option<usize>,
    /// How many frames later a frame's repeat is, 1 to [`LAG_FRAMES_MAX`]; by default 3, or the nearest to 0.1 s (dynamic).
    pub lag_frames: Option<usize>,
    pub start: Duration,
    pub shuffles: usize,
    /// The bins of the second set of entropies; by default the sensor's own steps.
    pub binning: Option<Binning>,
    /// Threads that count pairs of frames; the result is the same with any number.
    pub threads: usize,
    pub thresholds: Thresholds,
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

pub(crate) struct TimedFrame {
    pub(crate) seq: u64,
    pub(crate) time: Duration,
    pub(crate) celsius: Pixels,
}

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

/// What is known of a sensor's specimen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownUnit {
    /// What each pixel shows too much, °C.
    pub pattern_c: [f64; PIXELS],
    /// Standard deviation of what all pixels do together from one recording to another, °C.
    pub wander_c: f64,
    /// What of the level is no chance and still not known: error at power-on, the depth of the five-frame cycle, °C.
    pub bias_c: f64,
    /// Standard deviation of what is not known of the pattern, °C.
    pub spread_c: f64,
}

impl KnownUnit {
    /// What a profile says.
    #[must_use]
    pub fn of(profile: &Profile) -> Self {
        let common = profile.common_mode;
        // The mean of the 64 draws of a specimen that is not drawn yet.
        let drawn_c = profile.fixed_pattern.spread_c / 8.0;
        Self {
            pattern_c: profile.fixed_pattern.offset_c,
            wander_c: common.sd_c.hypot(drawn_c),
            bias_c: common.cycle_depth_c + profile.warm_up.start_c.abs(),
            spread_c: profile.fixed_pattern.spread_c,
        }
    }

    pub(crate) fn pattern(&self) -> KnownPattern {
        KnownPattern {
            from: RoomSource::Profile,
            added_c: self.pattern_c.to_vec(),
            left_c: Some(vec![self.spread_c; PIXELS]),
        }
    }

    /// The largest common offset that is no fault, °C.
    pub(crate) fn level_c(&self, thresholds: &Thresholds) -> f64 {
        thresholds.level_margin_c + 3.0 * self.wander_c + self.bias_c
    }
}

pub(crate) struct LearnedRoom {
    pub(crate) celsius: Vec<f64>,
    pub(crate) frames: usize,
    /// Standard error of the middle pixel's mean, °C.
    pub(crate) error_c: f64,
}

/// What is known of sensor and room beside the scene; of people and pattern, nothing.
pub(crate) fn prior(
    records: &[Record],
    simulator: &Simulator,
    learned: Option<LearnedRoom>,
    found: &Alignment,
    options: &Options,
) -> Prior {
    let thresholds = &options.thresholds;
    let mut sensor = Vec::new();
    if let Some(inspection) = Inspection::new(records, sensor_step_c()) {
        let rate_hz = simulator.sensor().sampling_hz;
        sensor.extend(inspection.criteria(thresholds, rate_hz, simulator.ambient_c()));
    }
    let from = match (options.unit, &learned) {
        (Some(_), _) => RoomSource::Profile,
        (None, Some(_)) => RoomSource::Recording,
        (None, None) => RoomSource::Scene,
    };
    Prior {
        recorded_frames: records
            .iter()
            .filter(|record| record.reading.frame().is_some())
            .count(),
        turned_back: found
            .orientation
            .filter(|found| found.applied)
            .map(|found| found.orientation),
        room: EmptyRoom {
            from,
            frames: learned.as_ref().map_or(0, |learned| learned.frames),
            celsius: learned.map(|learned| learned.celsius),
        },
        level_c: options.unit.map(|unit| unit.level_c(thresholds)),
        sensor,
        ..Prior::default()
    }
}
