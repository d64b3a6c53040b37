//! What remedies and alternatives say, for the list of sentences.

use crate::advice::change::{Change, Compared, Kind, Row};
use crate::advice::search::Tried;
use crate::align::Orientation;
use crate::decision::{Alternative, How, Recording, Rendered, View};
use grideye_scene::{Laws, Scene};

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

[[sensor]]
name = "level"
preset = "grid-eye"
position_mm = [2000, 1000, 600]
elevation_deg = 0
azimuth_deg = 90

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
const CHANGES: [(Kind, usize, [f64; 2]); 17] = [
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
    (Kind::More, 0, [1.3, 2.9]),
    (Kind::Fahrenheit, 0, [-27.1, 0.0]),
];

fn room() -> Scene {
    let way = |_: &str| Ok("x_mm,y_mm,z_mm\n1000,1000,0\n3000,1000,0\n".to_owned());
    Scene::parse(ROOM, "room", &way).unwrap().scene
}

fn compared<'a>(scene: &'a Scene, recording: &'a Recording, laws: &'a Laws) -> Compared<'a> {
    Compared {
        sensor: "ceiling",
        recording,
        laws,
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
        scene,
    }
}

fn recording() -> Recording {
    let times_s: Vec<f64> = (0..20).map(|index| 0.1 * f64::from(index)).collect();
    Recording::new(&times_s, &[[21.0; 64]; 20], [0.1; 64], 0.25)
}

/// One of each change, as the only one that makes a scene agree; then two together, and some of which none does.
pub(crate) fn remedies() -> Vec<String> {
    let (scene, recording) = (room(), recording());
    let laws = scene.laws();
    let compared = compared(&scene, &recording, &laws);
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
    for turned in [Orientation::QuarterClockwise, Orientation::Half] {
        singles.push(tried(Kind::None, 0, [0.0; 2], turned));
    }
    let both = tried(Kind::Late, 0, [1.5, 0.0], mirrored);
    let mut all: Vec<_> = singles
        .iter()
        .map(|one| compared.told(&[*one], |_| 0.93, true))
        .collect();
    all.push(compared.told(&[both], |_| 0.93, true));
    all.push(compared.told(&[singles[14]], |_| 0.01, true));
    let several = [singles[14], singles[11], singles[17]];
    all.push(compared.told(
        &several,
        |one| {
            if one.change.kind == Kind::Without {
                1.2
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

/// Of a scene that looks the same mirrored, no mirror image is a cause.
#[test]
fn an_orientation_that_shows_the_same_is_no_cause() {
    let (scene, recording) = (room(), recording());
    let laws = scene.laws();
    let alike = |same: Vec<Orientation>| {
        let compared = Compared {
            same,
            ..compared(&scene, &recording, &laws)
        };
        let all = Orientation::ALL.into_iter();
        all.filter(|one| compared.looks_the_same(*one)).collect()
    };
    let [none, mirror, half]: [Vec<Orientation>; 3] = [
        alike(Vec::new()),
        alike(vec![Orientation::MirroredTopBottom]),
        alike(vec![Orientation::Half]),
    ];
    assert_eq!((none, half), (Vec::new(), vec![Orientation::Half]));
    assert_eq!(mirror, Orientation::ALL[4..]);
}

/// Only what is in view can be warmer, and only a number that is the recording's level in the other unit is in that.
#[test]
fn what_no_frame_shows_is_no_cause() {
    let (scene, recording) = (room(), recording());
    let laws = scene.laws();
    let mut here = compared(&scene, &recording, &laws);
    let object = Row::of(Kind::Object).unwrap();
    assert!(object.changes(&here, 0, 0.1).is_empty());
    here.sensor = "level";
    assert_eq!(object.changes(&here, 0, 0.1).len(), 1);
    let of = (&scene, "ceiling");
    let view = View::after(Rendered::default(), of, &[0.0, 0.1], 0.0).unwrap();
    let warm = scene.in_warmer_room(48.8);
    let found = [-48.5, -50.9, -45.0, 0.0].map(|level_c| {
        let compared = Compared {
            level_c,
            ..compared(&warm, &recording, &laws)
        };
        let fahrenheit = Row::of(Kind::Fahrenheit).unwrap();
        (fahrenheit.number)(&compared, &view)
    });
    assert_eq!(found, [1, 1, 0, 0]);
}
