//! Single changes of a scene that a user might make, and how to make them.

use crate::align::Orientation;
use glam::DVec3;
use grideye_draw::text::fixed;
use grideye_scene::{Pose, Scene};

/// One change of a scene, of its recording's time, or of how its image lies.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Change {
    Turned(Orientation),
    /// Everything happens this much later, seconds.
    Late(f64),
    /// The sensor is this much further in x and y, or higher, meters.
    Moved([f64; 2]),
    Raised(f64),
    /// The sensor looks this much further toward the right and the bottom of its image, or is turned about the vertical.
    Tilted([f64; 2]),
    Azimuth(f64),
    Sensor(String),
    /// How many times the contrast of all people, or objects.
    Contrast(f64),
    /// A person is not there; or one more is, at this second near there, meters.
    Missing(usize),
    More {
        at_s: f64,
        near_m: [f64; 2],
    },
}

/// Steps of a coarse search: meters in x and y, meters of height, degrees of tilt and of azimuth.
const MOVE_M: f64 = 0.5;
const RAISE_M: f64 = 0.15;
const TILT_DEG: f64 = 5.0;
const AZIMUTH_DEG: f64 = 10.0;

impl Change {
    /// All that a coarse search tries, but for orientation and delay.
    pub(super) fn ladder(scene: &Scene, sensor: &str) -> Vec<Self> {
        let steps = |most: i32| (-most..=most).filter(|by| *by != 0).map(f64::from);
        let grid = (-3..=3).flat_map(|x| (-3..=3).map(move |y| [x, y].map(f64::from)));
        let mut all: Vec<Self> = grid
            .filter(|by| *by != [0.0; 2])
            .map(|by| Self::Moved(by.map(|by| MOVE_M * by)))
            .collect();
        all.extend(steps(4).map(|by| Self::Raised(RAISE_M * by)));
        all.extend(steps(3).map(|by| Self::Tilted([TILT_DEG * by, 0.0])));
        all.extend(steps(3).map(|by| Self::Tilted([0.0, TILT_DEG * by])));
        all.extend(steps(6).map(|by| Self::Azimuth(AZIMUTH_DEG * by)));
        all.extend((0..scene.agents().len()).map(Self::Missing));
        let own = scene.sensor(sensor).map(|own| (own.columns, own.rows)).ok();
        let others = scene.sensors().iter();
        let others =
            others.filter(|one| one.name != sensor && Some((one.columns, one.rows)) == own);
        all.extend(others.map(|one| Self::Sensor(one.name.clone())));
        all
    }

    /// The changes beside this one, `share` of a coarse step away.
    pub(super) fn near(&self, share: f64) -> Vec<Self> {
        let ways = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
        let both = |at: [f64; 2], step: f64| {
            ways.map(|way| [0, 1].map(|axis| at[axis] + share * step * way[axis]))
        };
        let one = |at: f64, step: f64| [at - share * step, at + share * step];
        match self {
            Self::Moved(at) => Vec::from(both(*at, MOVE_M).map(Self::Moved)),
            Self::Tilted(at) => Vec::from(both(*at, TILT_DEG).map(Self::Tilted)),
            Self::Raised(at) => Vec::from(one(*at, RAISE_M).map(Self::Raised)),
            Self::Azimuth(at) => Vec::from(one(*at, AZIMUTH_DEG).map(Self::Azimuth)),
            Self::Late(at) => Vec::from(one(*at, 0.2).map(Self::Late)),
            _ => Vec::new(),
        }
    }

    /// Whether two are of one kind: a scene has one of each.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        std::mem::discriminant(self) == std::mem::discriminant(other)
    }

    /// The scene after it, as far as its sensors are concerned.
    pub(super) fn of_scene(&self, scene: &Scene, name: &str) -> Scene {
        let sensors = scene.sensors().iter().cloned().map(|mut sensor| {
            if sensor.name == name {
                sensor.pose = self.of_pose(sensor.pose);
            }
            sensor
        });
        scene.with_sensors(sensors.collect())
    }

    fn of_pose(&self, mut pose: Pose) -> Pose {
        match *self {
            Self::Moved([x, y]) => pose.position_m += DVec3::new(x, y, 0.0),
            Self::Raised(z) => pose.position_m.z += z,
            Self::Tilted([right, down]) => pose = pose.tilted(right, down),
            Self::Azimuth(by) => {
                let [elevation, azimuth, roll] =
                    [pose.elevation_rad, pose.azimuth_rad, pose.roll_rad].map(f64::to_degrees);
                pose = Pose::from_degrees(pose.position_m, elevation, azimuth + by, roll);
            }
            _ => {}
        }
        pose
    }

    /// Whether it changes where the sensor is, or which.
    pub(super) fn is_of_sensor(&self) -> bool {
        !matches!(
            self,
            Self::Turned(_)
                | Self::Late(_)
                | Self::Contrast(_)
                | Self::Missing(_)
                | Self::More { .. }
        )
    }

    /// What is changed, and the command or key that does it. `start_s` is the scene's time at the recording's first frame.
    pub(super) fn in_words(&self, scene: &Scene, sensor: &str, start_s: f64) -> [String; 2] {
        let pose = || {
            let changed = self.of_scene(scene, sensor);
            let position_m = changed.sensor(sensor).map(|one| one.pose.position_m);
            let [x, y, z] = position_m.unwrap_or_default().to_array().map(|m| 1e3 * m);
            format!("position_mm = [{x:.0}, {y:.0}, {z:.0}]")
        };
        let name = |person: usize| scene.agents().get(person).map_or("", |agent| &agent.name);
        match self {
            Self::Turned(turned) => [
                format!("the image, which is {turned}, turned back"),
                "--align orientation".to_owned(),
            ],
            Self::Late(late_s) => {
                // To a hundredth, and no negative zero.
                let start_s = (100.0 * (start_s - late_s)).round() / 100.0 + 0.0;
                let word = if *late_s < 0.0 { "earlier" } else { "later" };
                [
                    format!("the scene {} s {word}", fixed(late_s.abs(), 2)),
                    format!("--start {start_s:.2}"),
                ]
            }
            Self::Moved(by_m) => {
                let [x, y] = by_m.map(|by_m| fixed(by_m, 2));
                [
                    format!("the sensor {x} m further in x and {y} m in y"),
                    pose(),
                ]
            }
            Self::Raised(by_m) => {
                let word = if *by_m < 0.0 { "lower" } else { "higher" };
                [
                    format!("the sensor {} m {word}", fixed(by_m.abs(), 2)),
                    pose(),
                ]
            }
            Self::Tilted(by_deg) => {
                let [right, down] = by_deg.map(|by| fixed(by, 1));
                [
                    format!("the sensor tilted by {right}° to the right and {down}° down"),
                    format!("tilt_deg, by [{right}, {down}] more"),
                ]
            }
            Self::Azimuth(by_deg) => {
                let by = fixed(*by_deg, 1);
                [
                    format!("the sensor turned by {by}°"),
                    format!("azimuth_deg, by {by} more"),
                ]
            }
            Self::Sensor(name) => [format!("sensor `{name}`"), format!("--sensor {name}")],
            Self::Contrast(times) => [
                format!("{} times the scene's contrast", fixed(*times, 1)),
                "temperature_c, or person.clothing".to_owned(),
            ],
            Self::Missing(person) => [
                format!("`{}` not there", name(*person)),
                "take the [[agent]] out".to_owned(),
            ],
            Self::More { at_s, near_m } => {
                let [x, y] = near_m.map(|m| fixed(1e3 * m, 0));
                let at_s = fixed(*at_s, 1);
                [
                    format!("one person more, at second {at_s} near [{x}, {y}] mm"),
                    "add an [[agent]]".to_owned(),
                ]
            }
        }
    }
}
