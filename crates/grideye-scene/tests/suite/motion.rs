//! Paths by speed, by time stamps, with stops and with turns: against closed forms.

use crate::{CEILING, ROOM, parse, scene};
use grideye_scene::{Agent, Loaded, Scene, SceneError, Simulator};
use std::collections::BTreeMap;
use std::time::Duration;

const BODY: &str = "[[agent]]\nname = \"a\"\nsize_mm = [200, 500, 1750]\ntemperature_c = 28\ntrajectory = \"w.csv\"\n";

fn load(keys: &str, walk: &str) -> Result<Loaded, SceneError> {
    let files = BTreeMap::from([("w.csv".to_owned(), walk.to_owned())]);
    Scene::parse(&format!("{ROOM}{CEILING}{BODY}{keys}"), "room.toml", &files)
}

fn walker(keys: &str, walk: &str) -> Agent {
    let loaded = load(keys, walk).unwrap_or_else(|error| panic!("{error}"));
    loaded.scene.agents()[0].clone()
}

/// x in millimeters after this many seconds.
fn x_mm(agent: &Agent, seconds: f64) -> f64 {
    agent.position_m(Duration::from_secs_f64(seconds)).x * 1000.0
}

fn assert_x(agent: &Agent, expected: &[(f64, f64)]) {
    for (seconds, expected_mm) in expected {
        let found_mm = x_mm(agent, *seconds);
        assert!(
            (found_mm - expected_mm).abs() < 1e-6,
            "at {seconds} s: {found_mm} mm, expected {expected_mm}"
        );
    }
}

/// From 500 to 2000 and on to 3500 mm.
const WALK: &str = "x_mm,y_mm,z_mm\n500,3000,0\n2000,3000,0\n3500,3000,0\n";
const WALK_WITH_STOP: &str =
    "x_mm,y_mm,z_mm,dwell_s\n500,3000,0,0\n2000,3000,0,2.5\n3500,3000,0,1\n";
const TIME_TABLE: &str =
    "t_s,x_mm,y_mm,z_mm,dwell_s\n1,500,3000,0,0\n3,2000,3000,0,1\n7,3500,3000,0,0.5\n";

#[test]
fn constant_speed_is_the_default() {
    let plain = walker("speed_mm_per_s = 750\n", WALK);
    let named = walker("speed_mm_per_s = 750\nmotion = \"constant\"\n", WALK);
    let fixed = walker("speed_mm_per_s = 750\nfaces = \"fixed\"\n", WALK);
    assert_eq!(plain, named);
    assert_eq!(plain, fixed);
    assert_eq!(plain.duration(), Duration::from_secs(4));
    assert_x(&plain, &[(1.0, 1250.0), (3.0, 2750.0)]);
}

/// The columns of a time table in every order, with the floor's height left out where it is 0.
#[test]
fn columns_come_in_any_order() {
    let rows: Vec<Vec<&str>> = TIME_TABLE
        .lines()
        .map(|row| row.split(',').collect())
        .collect();
    let written = walker("", TIME_TABLE);
    for first in 0..5 {
        for step in [1, 2, 3, 4] {
            let order: Vec<usize> = (0..5).map(|index| (first + index * step) % 5).collect();
            for left_out in [5, 3] {
                let row = |row: &Vec<&str>| {
                    let order = order.iter().filter(|column| **column != left_out);
                    order
                        .map(|column| row[*column])
                        .collect::<Vec<_>>()
                        .join(",")
                };
                let text: Vec<String> = rows.iter().map(row).collect();
                assert_eq!(walker("", &text.join("\n")), written, "{text:?}");
            }
        }
    }
}

/// 10:00:00.25 UTC, 2 s later in another zone, and 4 s after that in Unix seconds (`date -u -d 2026-11-25T10:00:06 +%s`).
const UTC_TABLE: &str = "x_mm,utc,y_mm,dwell_s\n500,2026-11-25 10:00:00.25Z,3000,0\n\
    2000,2026-11-25T11:00:02.25+01:00,3000,1\n3500,1795600806.25,3000,0.5\n";

#[test]
fn the_earliest_stamp_is_the_scenes_start() {
    let walk = walker("", UTC_TABLE);
    let seconds = "t_s,x_mm,y_mm,dwell_s\n0,500,3000,0\n2,2000,3000,1\n6,3500,3000,0.5\n";
    assert_eq!(walk, walker("", seconds));
    let starts = load("", UTC_TABLE).unwrap().scene.starts_utc().unwrap();
    assert_eq!(starts.ns, 1_795_600_800_250_000_000);
    assert_eq!(load("", seconds).unwrap().scene.starts_utc(), None);

    // Another walker from half a second before, and one that counts from the scene's start.
    let other = |name: &str| {
        BODY.replace("\"a\"", &format!("\"{name}\""))
            .replace("w.csv", &format!("{name}.csv"))
    };
    let files = BTreeMap::from([
        ("w.csv".to_owned(), UTC_TABLE.to_owned()),
        (
            "early.csv".to_owned(),
            "utc,x_mm,y_mm\n1795600799.75,500,1000\n1795600803.75,900,1000\n".to_owned(),
        ),
        (
            "counted.csv".to_owned(),
            "t_s,x_mm,y_mm\n1,500,5000\n5,900,5000\n".to_owned(),
        ),
    ]);
    let text = format!(
        "{ROOM}{CEILING}{BODY}{}{}",
        other("early"),
        other("counted")
    );
    let scene = Scene::parse(&text, "room.toml", &files).unwrap().scene;
    assert_eq!(scene.starts_utc().unwrap().ns, 1_795_600_799_750_000_000);
    let [late, early, counted] = scene.agents() else {
        panic!("three walkers");
    };
    assert_x(
        late,
        &[(0.5, 500.0), (1.5, 1250.0), (2.5, 2000.0), (6.5, 3500.0)],
    );
    assert_x(early, &[(0.0, 500.0), (2.0, 700.0), (4.0, 900.0)]);
    assert_x(counted, &[(1.0, 500.0), (3.0, 700.0)]);
    assert_eq!(scene.duration(), Duration::from_secs(7));
}

#[test]
fn a_stop_takes_its_time() {
    let walk = walker("speed_mm_per_s = 750\n", WALK_WITH_STOP);
    assert_eq!(walk.duration().as_secs_f64(), 2.0 + 2.5 + 2.0 + 1.0);
    assert_x(
        &walk,
        &[
            (1.0, 1250.0),
            (2.0, 2000.0),
            (4.5, 2000.0),
            (5.5, 2750.0),
            (6.5, 3500.0),
            (7.5, 3500.0),
        ],
    );
}

#[test]
fn trapezoidal_speed_rests_only_at_stops() {
    let keys = "speed_mm_per_s = 1000\nmotion = \"trapezoidal\"\nacceleration_mm_per_s2 = 500\n";
    // 3 m: 2 s and 1 m up, 1 m at full speed, 2 s and 1 m down.
    let through = walker(keys, WALK);
    assert_eq!(through.duration(), Duration::from_secs(5));
    assert_x(
        &through,
        &[
            (1.0, 750.0),
            (2.0, 1500.0),
            (2.5, 2000.0),
            (3.0, 2500.0),
            (4.0, 3250.0),
        ],
    );
    // Two triangles of 1.5 m: half of it after sqrt(1.5 / 0.5) seconds.
    let ramp_s = 3.0_f64.sqrt();
    let stops = walker(keys, WALK_WITH_STOP);
    assert!((stops.duration().as_secs_f64() - (4.0 * ramp_s + 3.5)).abs() < 1e-9);
    assert_x(
        &stops,
        &[
            (ramp_s, 1250.0),
            (2.0 * ramp_s, 2000.0),
            (2.0 * ramp_s + 2.5, 2000.0),
            (3.0 * ramp_s + 2.5, 2750.0),
        ],
    );
}

#[test]
fn minimum_jerk_rests_at_every_waypoint() {
    let keys = "speed_mm_per_s = 750\nmotion = \"minimum-jerk\"\n";
    let walk = walker(keys, WALK);
    assert_eq!(walk.duration(), Duration::from_secs(4));
    // s(1/4) = 10/64 - 15/256 + 6/1024 = 0.103515625 of each leg.
    assert_x(
        &walk,
        &[
            (0.5, 500.0 + 1500.0 * 0.103_515_625),
            (1.0, 1250.0),
            (1.5, 2000.0 - 1500.0 * 0.103_515_625),
            (2.0, 2000.0),
            (3.0, 2750.0),
        ],
    );
    let speed = |seconds: f64| (x_mm(&walk, seconds + 1e-6) - x_mm(&walk, seconds - 1e-6)) / 2e-6;
    assert!((speed(1.0) - 1.875 * 750.0).abs() < 0.01, "{}", speed(1.0));
    assert!(speed(2.0).abs() < 0.01, "{}", speed(2.0));
}

#[test]
fn waypoints_are_reached_at_their_time_stamps() {
    for keys in [
        "",
        "motion = \"minimum-jerk\"\n",
        "motion = \"trapezoidal\"\nacceleration_mm_per_s2 = 2000\n",
    ] {
        let walk = walker(keys, TIME_TABLE);
        assert_eq!(walk.duration().as_secs_f64(), 7.5);
        assert_x(
            &walk,
            &[
                (0.0, 500.0),
                (1.0, 500.0),
                (2.0, 1250.0),
                (3.0, 2000.0),
                (4.0, 2000.0),
                (5.5, 2750.0),
                (7.0, 3500.0),
                (60.0, 3500.0),
            ],
        );
    }
    assert_x(&walker("", TIME_TABLE), &[(1.5, 875.0), (4.75, 2375.0)]);
}

#[test]
fn an_agent_facing_its_path_turns_with_it() {
    // 0.5 m across the shoulders: along y while walking along x, along x while walking along y.
    let corner = "x_mm,y_mm,z_mm,dwell_s\n1000,2000,0,0\n3000,2000,0,1\n3000,4000,0,0\n";
    let keys = "speed_mm_per_s = 1000\nfaces = \"way\"\n";
    let files = BTreeMap::from([("w.csv".to_owned(), corner.to_owned())]);
    let text = format!("{ROOM}{CEILING}{BODY}{keys}");
    let turning = Scene::parse(&text, "room.toml", &files).unwrap().scene;
    let picture = |scene: &Scene, seconds: f64| {
        let simulator = Simulator::new(scene, "ceiling").unwrap();
        simulator.image(Duration::from_secs_f64(seconds)).celsius
    };
    for (seconds, x_mm, y_mm, yaw_deg) in [
        (0.0, 1000, 2000, 0),
        (1.0, 2000, 2000, 0),
        (2.0, 3000, 2000, 0),
        (3.0, 3000, 2000, 0),
        (4.0, 3000, 3000, 90),
        (9.0, 3000, 4000, 90),
    ] {
        let stands = scene(&format!(
            "{ROOM}{CEILING}[[agent]]\nname = \"a\"\nsize_mm = [200, 500, 1750]\ntemperature_c = 28\n\
             position_mm = [{x_mm}, {y_mm}, 0]\nyaw_deg = {yaw_deg}\n"
        ));
        for (found, expected) in picture(&turning, seconds).iter().zip(picture(&stands, 0.0)) {
            assert!((found - expected).abs() < 1e-9, "at {seconds} s");
        }
    }
}

/// The image of a walker equals that of an agent standing there with the same rotation.
fn assert_stands(walking: &Scene, seconds: f64, place_mm: [i32; 3], yaw_deg: i32) {
    let stands = scene(&format!(
        "{ROOM}{CEILING}[[agent]]\nname = \"a\"\nsize_mm = [200, 500, 1000]\ntemperature_c = 28\n\
         position_mm = {place_mm:?}\nyaw_deg = {yaw_deg}\n"
    ));
    let picture = |scene: &Scene, seconds: f64| {
        let simulator = Simulator::new(scene, "ceiling").unwrap();
        simulator.image(Duration::from_secs_f64(seconds)).celsius
    };
    for (found, expected) in picture(walking, seconds).iter().zip(picture(&stands, 0.0)) {
        assert!((found - expected).abs() < 1e-9, "at {seconds} s");
    }
}

fn facing_the_path(walk: &str, keys: &str) -> Scene {
    let files = BTreeMap::from([("w.csv".to_owned(), walk.to_owned())]);
    let body = BODY.replace("1750", "1000");
    let text = format!("{ROOM}{CEILING}{body}faces = \"way\"\n{keys}");
    Scene::parse(&text, "room.toml", &files).unwrap().scene
}

#[test]
fn a_climbing_agent_faces_its_path_and_stays_upright() {
    // 3 m along y and 1 m up: the square root of 10 in as many seconds.
    let walk = "x_mm,y_mm,z_mm\n2000,1500,0\n2000,4500,1000\n";
    let climbs = facing_the_path(walk, "speed_mm_per_s = 1000\n");
    assert_stands(&climbs, 0.0, [2000, 1500, 0], 90);
    assert_stands(&climbs, 10.0, [2000, 4500, 1000], 90);
}

#[test]
fn an_agent_waiting_between_time_stamps_keeps_its_direction() {
    let walk = "t_s,x_mm,y_mm,z_mm\n0,1000,2000,0\n2,2500,2000,0\n4,2500,4000,0\n8,2500,4000,0\n";
    let waits = facing_the_path(walk, "");
    for (seconds, place_mm, yaw_deg) in [
        (0.0, [1000, 2000, 0], 0),
        (3.0, [2500, 3000, 0], 90),
        (6.0, [2500, 4000, 0], 90),
        (9.0, [2500, 4000, 0], 90),
    ] {
        assert_stands(&waits, seconds, place_mm, yaw_deg);
    }
}

#[test]
fn a_turning_agent_needs_room_to_turn() {
    // 0.5 m across stand 0.12 m from the wall only while the shoulders are along it.
    let walk = "x_mm,y_mm,z_mm\n120,2000,0\n120,2600,0\n";
    let keys = "speed_mm_per_s = 1000\n";
    assert!(load(keys, walk).is_ok());
    let refused = load(&format!("{keys}faces = \"way\"\n"), walk);
    assert_eq!(
        refused.unwrap_err().to_string(),
        "w.csv:2:1: agent `a` leaves the room of [4000, 6000, 2700] mm: its body reaches from [-130, 1900, 0] to [370, 2100, 1750] mm there\n\
         hint: a position is the center of the base; move the waypoint or shrink the body"
    );
}

#[test]
fn an_arriving_agent_needs_room_in_its_last_direction() {
    // Walking along x, the shoulders are along y: 0.25 m to either side, and 0.1 m ahead.
    let keys = "speed_mm_per_s = 1000\nfaces = \"way\"\n";
    let walk =
        |y_mm: u32, end_mm: u32| format!("x_mm,y_mm,z_mm\n2000,{y_mm},0\n{end_mm},{y_mm},0\n");
    assert!(load(keys, &walk(260, 3880)).is_ok());
    let refused = load(keys, &walk(260, 3920)).unwrap_err().to_string();
    assert!(
        refused.starts_with("w.csv:3:1: agent `a` leaves the room"),
        "{refused}"
    );
}

fn refusal(keys: &str, walk: &str) -> String {
    let refused = load(keys, walk).map(|_| "accepted".to_owned());
    refused.unwrap_or_else(|error| error.to_string())
}

/// Keys, trajectory and the first line of the message.
const REFUSED: &[(&str, &str, &str)] = &[
    (
        "speed_mm_per_s = 800\nmotion = \"hopping\"\n",
        WALK,
        "room.toml:16:10: `motion` is \"hopping\", expected \"constant\", \"trapezoidal\" or \"minimum-jerk\"",
    ),
    (
        "speed_mm_per_s = 800\nmotion = \"trapezoidal\"\n",
        WALK,
        "room.toml:16:10: agent `a` has no `acceleration_mm_per_s2`",
    ),
    (
        "speed_mm_per_s = 800\nmotion = \"minimum-jerk\"\nacceleration_mm_per_s2 = 500\n",
        WALK,
        "room.toml:17:26: agent `a` has both `acceleration_mm_per_s2` and `motion`",
    ),
    (
        "speed_mm_per_s = 800\nacceleration_mm_per_s2 = 500\n",
        WALK,
        "room.toml:16:26: agent `a` has both `acceleration_mm_per_s2` and `motion`",
    ),
    (
        "speed_mm_per_s = 800\nmotion = \"trapezoidal\"\nacceleration_mm_per_s2 = 0\n",
        WALK,
        "room.toml:17:26: `acceleration_mm_per_s2` is 0, expected an acceleration above 0 and up to 100000 mm/s²",
    ),
    (
        "speed_mm_per_s = 800\nfaces = \"north\"\n",
        WALK,
        "room.toml:16:9: `faces` is \"north\", expected \"fixed\" or \"way\"",
    ),
    (
        "speed_mm_per_s = 800\n",
        TIME_TABLE,
        "room.toml:15:18: agent `a` has both `speed_mm_per_s` and `t_s`",
    ),
    (
        "motion = \"minimum-jerk\"\n",
        WALK,
        "room.toml:14:14: agent `a` has no `speed_mm_per_s`",
    ),
    (
        "motion = \"trapezoidal\"\nacceleration_mm_per_s2 = 600\n",
        TIME_TABLE,
        "w.csv:3:1: found 1500 mm in 2 s, expected a leg that the acceleration allows; this one needs at least 1500 mm/s²",
    ),
    // Half a meter in a second from rest to rest: 4 L / T².
    (
        "motion = \"trapezoidal\"\nacceleration_mm_per_s2 = 1999\n",
        "t_s,x_mm,y_mm,z_mm\n0,500,3000,0\n1,1000,3000,0\n",
        "w.csv:3:1: found 500 mm in 1 s, expected a leg that the acceleration allows; this one needs at least 2000 mm/s²",
    ),
    (
        "",
        "t_s,x_mm,y_mm,z_mm\n1,500,3000,0\n1,600,3000,0\n",
        "w.csv:3:1: found `1` as t_s, expected more than 1 s, when the agent leaves the previous waypoint",
    ),
    (
        "",
        "t_s,x_mm,y_mm,z_mm,dwell_s\n1,500,3000,0,2\n3,600,3000,0,0\n",
        "w.csv:3:1: found `3` as t_s, expected more than 3 s, when the agent leaves the previous waypoint",
    ),
    (
        "",
        "t_s,x_mm,y_mm,z_mm\n-1,500,3000,0\n",
        "w.csv:2:1: found `-1` as t_s, expected 0 to 31622400 seconds",
    ),
    (
        "speed_mm_per_s = 800\n",
        "x_mm,y_mm,z_mm,dwell_s\n500,3000,0,31622400.5\n",
        "w.csv:2:12: found `31622400.5` as dwell_s, expected 0 to 31622400 seconds",
    ),
    (
        "",
        "t_s,x_mm,y_mm,z_mm,dwell_s\n31622400,500,3000,0,1\n",
        "w.csv:2:1: found `31622400` as t_s, expected a stop that ends by 31622400 s",
    ),
    (
        "speed_mm_per_s = 800\n",
        "x_mm,y_mm,z_mm,dwell_s\n500,3000,0,31622400\n600,3000,0,1\n",
        "room.toml:15:18: `speed_mm_per_s` is 800, expected a speed at which the path takes at most 366 days",
    ),
    (
        "",
        "utc,x_mm,y_mm,dwell_s\n2026-11-25T10:00:00Z,500,3000,2\n2026-11-25T11:00:01.5+01:00,600,3000,0\n",
        "w.csv:3:1: found `2026-11-25T10:00:01.5Z` as utc, expected later than 2026-11-25T10:00:02Z, when the agent leaves the previous waypoint",
    ),
    (
        "",
        "utc,x_mm,y_mm\n2026-11-25T10:00:00Z,500,3000\n2028-11-25T10:00:00Z,600,3000\n",
        "w.csv:3:1: found `2028-11-25T10:00:00Z` as utc, expected a stop that ends by 2027-11-26T10:00:00Z",
    ),
    (
        "speed_mm_per_s = 800\n",
        "utc,x_mm,y_mm\n1795600800,500,3000\n",
        "room.toml:15:18: agent `a` has both `speed_mm_per_s` and `utc`",
    ),
];

#[test]
fn conflicting_keys_are_refused() {
    for (keys, walk, expected) in REFUSED {
        let found = refusal(keys, walk);
        let first_line = found.lines().next().unwrap_or_default();
        assert_eq!(&first_line, expected, "with {keys}{walk}");
        assert!(found.contains("\nhint: "), "{found}");
    }
}

#[test]
fn motion_keys_need_a_trajectory() {
    for key in [
        "motion = \"minimum-jerk\"",
        "faces = \"way\"",
        "speed_mm_per_s = 5",
    ] {
        let text = format!(
            "{ROOM}[[agent]]\nname = \"a\"\nsize_mm = [200, 500, 1750]\ntemperature_c = 28\nposition_mm = [2000, 3000, 0]\n{key}\n"
        );
        let refused = parse(&text).unwrap_err().to_string();
        assert!(
            refused.contains("agent `a` has no `trajectory`"),
            "{refused}"
        );
    }
}

/// The scene that shows them all.
#[test]
fn three_motions_and_a_time_table() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let files = |name: &str| std::fs::read_to_string(folder.join(name));
    let text = files("three-motions.toml").unwrap();
    let scene = Scene::parse(&text, "three-motions.toml", &files)
        .unwrap()
        .scene;
    assert_eq!(scene.duration(), Duration::from_secs(5));
    let expected = [
        [(1.5, 2000.0), (3.0, 3500.0)],
        [(0.5, 625.0), (2.0, 2000.0)],
        [(1.0, 500.0 + 3000.0 * 0.103_515_625), (2.0, 2000.0)],
        [(1.25, 1250.0), (4.0, 2750.0)],
    ];
    for (agent, expected) in scene.agents().iter().zip(&expected) {
        assert_x(agent, expected);
    }
}
