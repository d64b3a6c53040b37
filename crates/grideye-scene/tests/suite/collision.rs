//! Collisions of everything that moves with everything that stands: against closed forms for straight paths.

use crate::{ROOM, object, parse};
use grideye_scene::{Loaded, Scene, SceneError, Warning, limits};
use proptest::prelude::*;
use std::collections::BTreeMap;

/// An agent and its waypoints, in the plane of the floor.
fn walker(name: &str, shape_keys: &str, way: &[[f64; 2]], keys: &str) -> (String, String) {
    let agent = format!(
        "[[agent]]\nname = \"{name}\"\n{shape_keys}temperature_c = 28\ntrajectory = \"{name}.csv\"\n{keys}"
    );
    let rows = way.iter().map(|[x, y]| format!("{x},{y},0\n"));
    let walk = format!("x_mm,y_mm,z_mm\n{}", rows.collect::<String>());
    (agent, walk)
}

const BODY: &str = "size_mm = [200, 500, 1750]\n";

fn load(top: &str, tables: &[(String, String)]) -> Result<Loaded, SceneError> {
    let mut text = format!("{top}{ROOM}");
    let mut files = BTreeMap::new();
    for (index, (table, walk)) in tables.iter().enumerate() {
        text.push_str(table);
        let name = table.split('"').nth(1).unwrap_or_default();
        files.insert(format!("{name}.csv"), walk.clone());
        assert!(index < 1000);
    }
    Scene::parse(&text, "room.toml", &files)
}

fn still(table: String) -> (String, String) {
    (table, String::new())
}

/// Names, seconds and place of all contacts.
fn contacts(tables: &[(String, String)]) -> Vec<([String; 2], f64, [f64; 3])> {
    let loaded = load("", tables).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(loaded.warnings.len(), loaded.scene.contacts().len());
    let contacts = loaded.scene.contacts().into_iter();
    contacts
        .map(|contact| {
            (
                contact.names,
                contact.time.as_secs_f64(),
                contact.place_m.to_array(),
            )
        })
        .collect()
}

fn post(name: &str, x_mm: f64, y_mm: f64) -> (String, String) {
    still(object(
        name,
        [x_mm, y_mm, 0.0],
        [200.0, 200.0, 1000.0],
        0.0,
        20.0,
    ))
}

#[test]
fn a_walker_meets_a_box_when_their_sides_meet() {
    let way = [[1000.0, 3000.0], [3500.0, 3000.0]];
    let found = contacts(&[
        post("post", 3000.0, 3100.0),
        walker("a", BODY, &way, "speed_mm_per_s = 500\n"),
    ]);
    let [(names, seconds, place_m)] = found.as_slice() else {
        panic!("{found:?}");
    };
    assert_eq!(names, &["a", "post"]);
    // The front is at x + 100, the box starts at 2900: 1800 mm at 500 mm/s; 1 mm of overlap is free.
    assert!((seconds - 3.602).abs() < 1e-4, "{seconds}");
    assert!((place_m[0] - 2.9).abs() < 0.002, "{place_m:?}");
    assert!((3.0..=3.2).contains(&place_m[1]) && (0.0..=1.0).contains(&place_m[2]));
}

#[test]
fn an_oblique_contact_is_found_to_the_microsecond() {
    // At 45° the gap closes slower than the body moves, so that no step ends on the contact.
    let wall = still(object(
        "wall",
        [3000.0, 2000.0, 0.0],
        [200.0, 3000.0, 1000.0],
        0.0,
        20.0,
    ));
    let way = [[1000.0, 1000.0], [3000.0, 3000.0]];
    let small = "size_mm = [200, 200, 1750]\n";
    let found = contacts(&[wall, walker("a", small, &way, "speed_mm_per_s = 1000\n")]);
    // The front at x + 100, the wall from 2900 mm on, 1 mm of overlap free: 1801 mm at 1000 / √2 mm/s.
    let expected_s = 1.801 * 2.0_f64.sqrt();
    assert!((found[0].1 - expected_s).abs() < 5e-6, "{found:?}");
}

#[test]
fn contacts_are_sorted_by_time() {
    let way = |from_mm: f64| [[1000.0, from_mm], [3500.0, from_mm]];
    let found = contacts(&[
        post("far", 3000.0, 3000.0),
        post("near", 2000.0, 3000.0),
        walker("late", BODY, &way(3000.0), "speed_mm_per_s = 500\n"),
        post("first", 1500.0, 1500.0),
        walker("early", BODY, &way(1500.0), "speed_mm_per_s = 1000\n"),
    ]);
    let names: Vec<&str> = found.iter().map(|(names, ..)| names[1].as_str()).collect();
    assert_eq!(names, ["first", "near", "far"]);
}

#[test]
fn motion_and_stops_change_only_the_time_of_a_contact() {
    // s(1/4) = 0.103515625 of 2.5 m are 258.79 mm: the front is then at 1358.79 mm.
    let way = [[1000.0, 3000.0], [3500.0, 3000.0]];
    let found = contacts(&[
        post("post", 1000.0 + 100.0 + 258.789 - 1.0 + 100.0, 3000.0),
        walker(
            "a",
            BODY,
            &way,
            "speed_mm_per_s = 500\nmotion = \"minimum-jerk\"\n",
        ),
    ]);
    assert!((found[0].1 - 1.25).abs() < 1e-3, "{found:?}");
}

#[test]
fn balls_meet_at_two_radii() {
    let ball = "shape = \"ellipsoid\"\nsize_mm = [400, 400, 400]\n";
    let speed = "speed_mm_per_s = 1000\n";
    let found = contacts(&[
        walker("a", ball, &[[1000.0, 2000.0], [3000.0, 2000.0]], speed),
        walker("b", ball, &[[2000.0, 1000.0], [2000.0, 3000.0]], speed),
    ]);
    let [(names, seconds, place_m)] = found.as_slice() else {
        panic!("{found:?}");
    };
    assert_eq!(names, &["a", "b"]);
    let expected_s = 1.0 - 0.4 / 2.0_f64.sqrt();
    assert!(
        (seconds - expected_s).abs() < 0.005,
        "{seconds} {expected_s}"
    );
    let middle_m = 1.0 + expected_s + 0.1 * 2.0_f64.sqrt();
    assert!((place_m[0] - middle_m).abs() < 0.01, "{place_m:?}");
    // Both have walked equally far, one along x and one along y.
    assert!((place_m[1] - middle_m).abs() < 0.01, "{place_m:?}");
    assert!((place_m[2] - 0.2).abs() < 0.01, "{place_m:?}");
}

#[test]
fn standing_agents_are_collided_with() {
    let standing = "[[agent]]\nname = \"b\"\nsize_mm = [200, 200, 1000]\ntemperature_c = 28\nposition_mm = [3000, 3000, 0]\n";
    let way = [[1000.0, 3000.0], [3500.0, 3000.0]];
    let walk = walker("a", BODY, &way, "speed_mm_per_s = 500\n");
    let found = contacts(&[still(standing.to_owned()), walk]);
    assert_eq!(found[0].0, ["b", "a"]);
    assert!((found[0].1 - 3.602).abs() < 1e-4, "{found:?}");
    let found = contacts(&[still(standing.to_owned()), post("post", 3050.0, 3000.0)]);
    assert_eq!(found[0].0, ["b", "post"]);
    assert_eq!(found[0].1, 0.0, "from the start");
}

#[test]
fn a_turning_body_needs_the_room_of_its_turn() {
    // 0.5 m across: walking along y, the shoulders reach x ± 250 only if the body turns.
    let way = [[1000.0, 1000.0], [1000.0, 3000.0]];
    let beside = || post("post", 1300.0, 2000.0);
    let fixed = walker("a", BODY, &way, "speed_mm_per_s = 500\n");
    assert_eq!(contacts(&[beside(), fixed]), []);
    let turning = walker("a", BODY, &way, "speed_mm_per_s = 500\nfaces = \"way\"\n");
    let found = contacts(&[beside(), turning]);
    // The depth of 200 leads: 1000 to 1900, less half of it.
    assert!((found[0].1 - 1.602).abs() < 1e-4, "{found:?}");
}

/// An L of 2 x 2 m with a quarter missing.
fn corner_desk() -> (String, String) {
    still(
        "[[object]]\nname = \"desk\"\nposition_mm = [1000, 1000, 0]\nshape = \"polyhedron\"\n\
         vertices_mm = [[0, 0, 0], [2000, 0, 0], [2000, 1000, 0], [1000, 1000, 0], [1000, 2000, 0], [0, 2000, 0],\n\
         [0, 0, 700], [2000, 0, 700], [2000, 1000, 700], [1000, 1000, 700], [1000, 2000, 700], [0, 2000, 700]]\n\
         faces = [[5, 4, 3, 2, 1, 0], [6, 7, 8, 9, 10, 11], [0, 1, 7, 6], [1, 2, 8, 7], [2, 3, 9, 8], [3, 4, 10, 9], [4, 5, 11, 10], [5, 0, 6, 11]]\n"
            .to_owned(),
    )
}

#[test]
fn a_dent_is_free_and_its_walls_are_not() {
    let small = "size_mm = [200, 200, 1750]\n";
    let speed = "speed_mm_per_s = 500\n";
    let through = [[2500.0, 4000.0], [2500.0, 2500.0], [3500.0, 2500.0]];
    assert_eq!(
        contacts(&[corner_desk(), walker("a", small, &through, speed)]),
        []
    );
    let into = [[2500.0, 4000.0], [2500.0, 1000.0]];
    let found = contacts(&[corner_desk(), walker("a", small, &into, speed)]);
    // The wall is at y = 2000, the front at y - 100: 1900 mm; half a millimeter of overlap is free.
    assert!((found[0].1 - 3.801).abs() < 1e-4, "{found:?}");
    assert!((found[0].2[1] - 2.0).abs() < 0.002);
}

#[test]
fn touching_is_no_contact() {
    // Feet on the floor plate, shoulders along the wall of the box, and a stack of parts.
    let plate = still(object(
        "plate",
        [2000.0, 3000.0, 0.0],
        [3000.0, 1000.0, 50.0],
        0.0,
        20.0,
    ));
    let side = still(object(
        "side",
        [2000.0, 3350.0, 50.0],
        [3000.0, 200.0, 500.0],
        0.0,
        20.0,
    ));
    let parts = "[[agent]]\nname = \"a\"\ntrajectory = \"a.csv\"\nspeed_mm_per_s = 500\n\
         [[agent.part]]\nname = \"low\"\nposition_mm = [0, 0, 0]\nsize_mm = [200, 500, 900]\n\
         [[agent.part]]\nname = \"high\"\nposition_mm = [0, 0, 700]\nsize_mm = [200, 500, 900]\n";
    let way = "x_mm,y_mm,z_mm\n1000,3000,50\n3000,3000,50\n";
    assert_eq!(
        contacts(&[plate, side, (parts.to_owned(), way.to_owned())]),
        []
    );
}

#[test]
fn only_listed_contacts_are_ignored() {
    let way = [[1000.0, 3000.0], [3500.0, 3000.0]];
    let tables = |keys: &str| {
        [
            post("chair", 2000.0, 3000.0),
            post("post", 3000.0, 3000.0),
            walker("a", BODY, &way, &format!("speed_mm_per_s = 500\n{keys}")),
        ]
    };
    let names = |keys: &str| -> Vec<String> {
        let found = contacts(&tables(keys)).into_iter();
        found.map(|(names, ..)| names[1].clone()).collect()
    };
    assert_eq!(names(""), ["chair", "post"]);
    assert_eq!(names("touches = [\"chair\"]\n"), ["post"]);
    assert_eq!(names("touches = [\"post\", \"chair\"]\n"), [] as [&str; 0]);
    // Either of two agents may list the other.
    let one = walker("a", BODY, &way, "speed_mm_per_s = 500\ntouches = [\"b\"]\n");
    let other = walker("b", BODY, &way, "speed_mm_per_s = 400\n");
    assert_eq!(contacts(&[one.clone(), other.clone()]), []);
    assert_eq!(contacts(&[other, one]), []);
}

#[test]
fn a_contact_is_a_warning_an_error_or_nothing() {
    let way = [[1000.0, 3000.0], [3500.0, 3000.0]];
    let tables = [
        post("post", 3000.0, 3000.0),
        walker("a", BODY, &way, "speed_mm_per_s = 500\n"),
    ];
    let said = "room.toml:11:8: `a` runs into `post` after 3.602 s at [2900";
    for top in ["", "collisions = \"warning\"\n"] {
        let warnings = load(top, &tables).unwrap().warnings;
        let [warning @ Warning::Collision { names, .. }] = warnings.as_slice() else {
            panic!("{warnings:?}");
        };
        assert_eq!(names, &["a", "post"]);
        let lines = top.lines().count();
        let said = said.replace(":11:", &format!(":{}:", 11 + lines));
        assert!(warning.to_string().starts_with(&said), "{warning}");
        assert!(warning.to_string().ends_with(
            "mm\nhint: move one of them, list `post` in the agent's `touches`, or write collisions = \"ignore\" at the top of the scene"
        ));
    }
    assert_eq!(
        load("collisions = \"ignore\"\n", &tables).unwrap().warnings,
        []
    );
    let refused = load("collisions = \"error\"\n", &tables).unwrap_err();
    assert!(
        refused
            .to_string()
            .starts_with(&said.replace(":11:", ":12:"))
    );
}

#[test]
fn invalid_keys_are_refused() {
    let refusal = |text: &str| parse(text).unwrap_err().to_string();
    assert_eq!(
        refusal(&format!("collisions = \"maybe\"\n{ROOM}")),
        "room.toml:1:14: `collisions` is \"maybe\", expected \"warning\", \"error\" or \"ignore\"\nhint: warning is the default"
    );
    let agent = "[[agent]]\nname = \"a\"\nsize_mm = [200, 200, 1000]\ntemperature_c = 28\nposition_mm = [3000, 3000, 0]\n";
    assert_eq!(
        refusal(&format!("{ROOM}{agent}touches = [\"a\", \"chair\"]\n")),
        "room.toml:9:17: `touches` is \"chair\", expected names of objects or agents of this scene\nhint: list what the agent may touch, as in touches = [\"chair\"]"
    );
}

#[test]
fn contacts_are_limited() {
    let mut tables: Vec<_> = (0..=limits::CONTACTS_MAX)
        .map(|index| post(&format!("post {index}"), 2000.0, 3000.0))
        .collect();
    let way = [[1000.0, 3000.0], [3500.0, 3000.0]];
    tables.push(walker("a", BODY, &way, "speed_mm_per_s = 500\n"));
    assert_eq!(contacts(&tables).len(), limits::CONTACTS_MAX);
    tables.remove(0);
    assert_eq!(contacts(&tables).len(), limits::CONTACTS_MAX);
    tables.remove(0);
    assert_eq!(contacts(&tables).len(), limits::CONTACTS_MAX - 1);
}

/// The times between which two intervals, one of them moving, overlap.
fn overlap(start: f64, speed: f64, reach: f64) -> (f64, f64) {
    if speed == 0.0 {
        return if start.abs() < reach {
            (f64::NEG_INFINITY, f64::INFINITY)
        } else {
            (1.0, 0.0)
        };
    }
    let (one, other) = ((-reach - start) / speed, (reach - start) / speed);
    (one.min(other), one.max(other))
}

proptest! {
    /// Upright boxes on straight paths meet when they overlap on both axes of the floor: intervals of time.
    #[test]
    fn upright_boxes_meet_when_their_intervals_do(
        from in prop::array::uniform2(600.0..3000.0_f64),
        to in prop::array::uniform2(600.0..3000.0_f64),
        at in prop::array::uniform2(600.0..3000.0_f64),
        size in prop::array::uniform2(100.0..800.0_f64),
        speed in 200.0..2000.0_f64,
    ) {
        let length = f64::hypot(to[0] - from[0], to[1] - from[1]);
        prop_assume!(length > 1.0);
        let box_keys = format!("size_mm = [{}, {}, 1000]\n", size[0], size[1]);
        let found = contacts(&[
            post("post", at[0], at[1]),
            walker("a", &box_keys, &[from, to], &format!("speed_mm_per_s = {speed}\n")),
        ]);
        let axis = |axis: usize, slack: f64| {
            let velocity = (to[axis] - from[axis]) / length * speed;
            overlap(from[axis] - at[axis], velocity, 0.5 * size[axis] + 100.0 - slack)
        };
        // Contacts may be found from an overlap of 0.9 mm on, and must be found from 2 mm on.
        let interval = |slack: f64| {
            let (x, y) = (axis(0, slack), axis(1, slack));
            (x.0.max(y.0).max(0.0), x.1.min(y.1).min(length / speed))
        };
        let (loose, strict) = (interval(0.9), interval(2.0));
        match found.as_slice() {
            [] => prop_assert!(strict.0 >= strict.1 - 1e-3 / speed * 1000.0, "missed {strict:?}"),
            [(_, seconds, _)] => {
                prop_assert!(loose.0 <= loose.1, "none at {seconds}");
                prop_assert!(*seconds >= loose.0 - 1e-6, "{seconds} before {loose:?}");
                prop_assert!(*seconds <= strict.0 + 1e-6 || strict.0 >= strict.1, "{seconds} after {strict:?}");
            }
            more => prop_assert!(false, "{more:?}"),
        }
    }
}
