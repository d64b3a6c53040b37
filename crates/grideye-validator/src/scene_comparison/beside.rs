//! What is known beside the frames that are compared: the room without its people, the specimen, the recording itself.

use super::{Options, sensor_step_c};
use crate::Thresholds;
use crate::align::Alignment;
use crate::inspect::Inspection;
use crate::verdict::{Beside, Room, RoomFrom};
use grideye_frame::PIXELS;
use grideye_recording::Record;
use grideye_scene::Simulator;
use grideye_scene::profile::Profile;

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

    /// The largest common offset that is no fault, °C.
    fn level_c(&self, thresholds: &Thresholds) -> f64 {
        thresholds.level_margin_c + 3.0 * self.wander_c + self.bias_c
    }
}

/// The scene without its people.
pub(super) struct People {
    /// At the times of the simulated frames, without noise.
    pub(super) nobody: Vec<Vec<f64>>,
    pub(super) are_in_scene: bool,
    /// Whether any simulated frame shows them.
    pub(super) are_shown: bool,
}

/// What the recording shows of the empty room.
pub(super) struct Learned {
    /// Mean over frames, row by row, °C.
    pub(super) celsius: Vec<f64>,
    pub(super) frames: usize,
    /// Standard error of the middle pixel's mean, °C.
    pub(super) error_c: f64,
}

impl KnownPattern {
    /// What a profile says, and leaves.
    pub(super) fn of(unit: &KnownUnit) -> Self {
        Self {
            from: RoomFrom::Profile,
            added_c: unit.pattern_c.to_vec(),
            left_c: vec![unit.spread_c; PIXELS],
        }
    }
}

/// What is known of how much each pixel shows too much.
pub(super) struct KnownPattern {
    pub(super) from: RoomFrom,
    /// What was added to the scene, row by row, °C.
    pub(super) added_c: Vec<f64>,
    /// Standard deviation of what is not known, row by row, °C.
    pub(super) left_c: Vec<f64>,
}

pub(super) fn beside(
    records: &[Record],
    simulator: &Simulator,
    people: People,
    (learned, pattern): (Option<Learned>, Option<KnownPattern>),
    found: &Alignment,
    options: &Options,
) -> Beside {
    let thresholds = &options.thresholds;
    let mut sensor = Vec::new();
    if let Some(inspection) = Inspection::new(records, sensor_step_c()) {
        let rate_hz = simulator.sensor().sampling_hz;
        sensor.extend(inspection.criteria(thresholds, rate_hz, simulator.ambient_c()));
    }
    let from = match (options.unit, &learned) {
        (Some(_), _) => RoomFrom::Profile,
        (None, Some(_)) => RoomFrom::Recording,
        (None, None) => RoomFrom::Scene,
    };
    Beside {
        nobody: people.nobody,
        has_people: people.are_in_scene,
        shows_people: people.are_shown,
        pattern_from: pattern
            .as_ref()
            .map_or(RoomFrom::Scene, |pattern| pattern.from),
        pattern_added_c: pattern
            .as_ref()
            .map_or_else(Vec::new, |pattern| pattern.added_c.clone()),
        pattern_c: pattern.map(|pattern| pattern.left_c),
        turned_back: found
            .orientation
            .filter(|found| found.applied)
            .map(|found| found.orientation),
        room: Room {
            from,
            frames: learned.as_ref().map_or(0, |learned| learned.frames),
            celsius: learned.map(|learned| learned.celsius),
        },
        level_c: options.unit.map(|unit| unit.level_c(thresholds)),
        sensor,
    }
}
