//! What is known beside the frames that are compared: the room without its people, the specimen, the recording itself.

use super::{Options, sensor_step_c};
use crate::Thresholds;
use crate::align::{Alignment, Orientation, OrientationFound};
use crate::inspect::Inspection;
use crate::text::fixed;
use crate::verdict::{Beside, Criterion, Room, RoomFrom, State};
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
        }
    }

    /// The largest common offset that is no fault, °C.
    fn level_c(&self, thresholds: &Thresholds) -> f64 {
        thresholds.level_margin_c + 3.0 * self.wander_c + self.bias_c
    }
}

pub(super) fn beside(
    records: &[Record],
    simulator: &Simulator,
    (nobody, has_people): (Vec<Vec<f64>>, bool),
    learned: Option<Vec<f64>>,
    found: &Alignment,
    options: &Options,
) -> Beside {
    let thresholds = &options.thresholds;
    let mut sensor = vec![orientation(found.orientation.as_ref())];
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
        nobody,
        has_people,
        room: Room {
            from,
            celsius: learned,
        },
        level_c: options.unit.map(|unit| unit.level_c(thresholds)),
        sensor,
    }
}

fn orientation(found: Option<&OrientationFound>) -> Criterion {
    let (state, sentence) = match found {
        None => (
            State::NotAsked,
            "How the image lies cannot be told from this recording.".to_owned(),
        ),
        Some(found) if found.orientation == Orientation::Upright => (
            State::Met,
            format!(
                "The image lies as the scene has it: likeness {} with what moves, or stands, in it.",
                fixed(found.upright, 2)
            ),
        ),
        Some(found) if found.applied => (
            State::Met,
            format!(
                "The image is {}, and was turned back as asked.",
                found.orientation
            ),
        ),
        Some(found) => (
            State::Failed,
            format!(
                "The image is {}: so it resembles the scene by {}, as it was recorded by {}.",
                found.orientation,
                fixed(found.likeness, 2),
                fixed(found.upright, 2)
            ),
        ),
    };
    Criterion {
        name: "orientation",
        title: "The image lies as the scene has it",
        state,
        sentence,
        keys: &[],
    }
}
