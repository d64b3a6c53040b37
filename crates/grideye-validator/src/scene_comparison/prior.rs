//! What is known beside the frames that are compared: the room without its people, the specimen, the recording itself.

use crate::align::Alignment;
use crate::frames::sensor_step_c;
use crate::metrics::foreground::{EmptyRoom, RoomSource};
use crate::scene_comparison::types::Options;
use crate::scene_comparison::unit::KnownUnit;
use crate::verdict::sensor_criteria::Inspection;
use crate::verdict::types::Prior;
use grideye_frame::PIXELS;
use grideye_recording::Record;
use grideye_scene::Simulator;

/// The scene without its people.
pub(crate) struct People {
    /// At the times of the simulated frames, without noise.
    pub(crate) nobody: Vec<Vec<f64>>,
    pub(crate) are_in_scene: bool,
    /// Whether any simulated frame shows them.
    pub(crate) are_shown: bool,
}

/// What the recording shows of the empty room.
pub(crate) struct LearnedRoom {
    /// Mean over frames, row by row, °C.
    pub(crate) celsius: Vec<f64>,
    pub(crate) frames: usize,
    /// Standard error of the middle pixel's mean, °C.
    pub(crate) error_c: f64,
}

impl KnownPattern {
    /// What a profile says, and leaves.
    pub(crate) fn of(unit: &KnownUnit) -> Self {
        Self {
            from: RoomSource::Profile,
            added_c: unit.pattern_c.to_vec(),
            left_c: vec![unit.spread_c; PIXELS],
        }
    }
}

/// What is known of how much each pixel shows too much.
pub(crate) struct KnownPattern {
    pub(crate) from: RoomSource,
    /// What was added to the scene, row by row, °C.
    pub(crate) added_c: Vec<f64>,
    /// Standard deviation of what is not known, row by row, °C.
    pub(crate) left_c: Vec<f64>,
}

pub(crate) fn prior(
    records: &[Record],
    simulator: &Simulator,
    people: People,
    (learned, pattern): (Option<LearnedRoom>, Option<KnownPattern>),
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
        nobody: people.nobody,
        has_people: people.are_in_scene,
        shows_people: people.are_shown,
        pattern_from: pattern
            .as_ref()
            .map_or(RoomSource::Scene, |pattern| pattern.from),
        pattern_added_c: pattern
            .as_ref()
            .map_or_else(Vec::new, |pattern| pattern.added_c.clone()),
        pattern_c: pattern.map(|pattern| pattern.left_c),
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
    }
}
