//! What remedies and alternatives say, for the list of sentences.

use crate::advice::change::{Change, Compared, Kind};
use crate::advice::search::Tried;
use crate::align::Orientation;
use crate::decision::{Alternative, How, Recording, Rendered, View};
use grideye_scene::Scene;

const ROOM: &str = r#"
[room]
size_mm = [4000, 4000, 2700]
ambient_c = 21

[[sensor]]
name = "ceiling"
preset = "grid-eye"
position_mm = [2000, 2000, 2700]
elevation_deg = 90
azimuth_deg = 0

[[sensor]]
name = "left"
preset = "grid-eye"
position_mm = [1000, 2000, 2700]
elevation_deg = 90
azimuth_deg = 0

[[object]]
name = "radiator"
size_mm = [800, 100, 600]
position_mm = [2000, 3900, 0]
temperature_c = 45

[[agent]]
name = "anna"
position_mm = [2000, 2000, 0]
person = {}

[[agent]]
name = "bert"
person = {}
trajectory = "way.csv"
speed_mm_per_s = 500
"#;

/// A kind, of which it is, and by how much.
const CHANGES: [(Kind, usize, [f64; 2]); 16] = [
    (Kind::Unit, 0, [0.0; 2]),
    (Kind::Rate, 0, [0.1, 0.0]),
    (Kind::Late, 0, [1.5, 0.0]),
    (Kind::Late, 0, [-1.5, 0.0]),
    (Kind::Sensor, 0, [0.0; 2]),
    (Kind::Aside, 0, [0.5, -0.1]),
    (Kind::Aside, 1, [0.5, 0.0]),
    (Kind::Place, 0, [0.3, 0.0]),
    (Kind::Height, 0, [-0.3, 0.0]),
    (Kind::Azimuth, 0, [12.0, 0.0]),
    (Kind::Tilt, 0, [6.0, 0.0]),
    (Kind::Room, 0, [3.0, 0.0]),
    (Kind::Object, 0, [-4.0, 0.0]),
    (Kind::Contrast, 0, [3.0, 0.0]),
    (Kind::Without, 1, [0.0; 2]),
    (Kind::More, 0, [0.0; 2]),
];

fn room() -> Scene {
    let way = |_: &str| Ok("x_mm,y_mm,z_mm\n1000,1000,0\n3000,1000,0\n".to_owned());
    Scene::parse(ROOM, "room", &way).unwrap().scene
}

/// One of each change, as the only one that makes a scene agree; then two together, and some of which none does.
pub(crate) fn remedies() -> Vec<String> {
    let scene = room();
    let times_s: Vec<f64> = (0..20).map(|index| 0.1 * f64::from(index)).collect();
    let frames = vec![[21.0; 64]; times_s.len()];
    let compared = Compared {
        sensor: "ceiling",
        recording: &Recording::new(&times_s, &frames, [0.1; 64], 0.25),
        laws: &scene.laws(),
        how: How {
            right_min: 0.015,
            is_brief: true,
            is_stopped: || false,
        },
        start_s: 2.0,
        level_max_c: 2.5,
        level_c: 3.0,
        same: Vec::new(),
        contrasts: vec![1.0; 2],
        scene: &scene,
    };
    let upright = Orientation::Upright;
    let tried = |kind, of, by, turned| Tried {
        turned,
        change: Change {
            kind,
            of,
            by,
            ..Change::NONE
        },
        left: 0.0,
        level_c: 0.0,
    };
    let mut singles: Vec<Tried> = CHANGES
        .map(|(kind, of, by)| tried(kind, of, by, upright))
        .into();
    let mirrored = Orientation::MirroredLeftRight;
    singles.push(tried(Kind::None, 0, [0.0; 2], mirrored));
    let both = tried(Kind::Late, 0, [1.5, 0.0], mirrored);
    let mut all: Vec<_> = singles
        .iter()
        .map(|one| compared.told(&[*one], |_| 0.93, true))
        .collect();
    all.push(compared.told(&[both], |_| 0.93, true));
    let several = [singles[14], singles[11], singles[16]];
    all.push(compared.told(
        &several,
        |one| {
            if one.change.kind == Kind::Without {
                0.6
            } else {
                0.4
            }
        },
        false,
    ));
    let all = all.into_iter();
    all.map(|remedy| format!("{}\n  Next: {}", remedy.found, remedy.step))
        .collect()
}

/// One of each alternative.
pub(crate) fn alternatives() -> Vec<String> {
    let scene = room();
    let times_s: Vec<f64> = (0..20).map(f64::from).collect();
    let view = View::after(Rendered::default(), (&scene, "ceiling"), &times_s, 0.0).unwrap();
    let all = [
        Alternative::Nobody,
        Alternative::Missing(1),
        Alternative::Gone(0, 3..6),
        Alternative::More([1.0, 2.5]),
        Alternative::Follower(2.0),
        Alternative::Turned(Orientation::Half),
        Alternative::Turned(Orientation::MirroredTopBottom),
        Alternative::Aside(0, [0.5, 0.0]),
        Alternative::Aside(0, [-0.35, 0.35]),
        Alternative::Later(5.0),
        Alternative::Later(-1.0),
        Alternative::Backwards,
    ];
    all.iter().map(|one| one.in_words(&view)).collect()
}
