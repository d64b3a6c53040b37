//! People who change their posture on the way: speeds and heights of the body, what it is doing, and when it is away.

use crate::CEILING;
use glam::DVec3;
use grideye_scene::{Agent, Doing, Posture, Scene, Simulator};
use std::time::Duration;

const ROOM: &str = "model = \"physical\"\n[room]\nsize_mm = [8000, 8000, 2700]\nambient_c = 20\n";

fn read(way: &str, person: &str) -> Result<Scene, String> {
    let way = way.to_owned();
    let files = move |_: &str| Ok(way.clone());
    let text =
        format!("{ROOM}[[agent]]\nname = \"one\"\n{person}\ntrajectory = \"way.csv\"\n{CEILING}");
    let parsed = Scene::parse(&text, "room.toml", &files);
    let parsed = parsed.map_err(|error| error.to_string())?;
    assert!(parsed.warnings.is_empty(), "{:?}", parsed.warnings);
    Ok(parsed.scene)
}

fn agent(way: &str) -> Agent {
    let scene = read(way, "person = { height_mm = 1650 }").unwrap();
    scene.agents()[0].clone()
}

/// The center of one of the segments, and the lowest and highest points of all.
fn at(agent: &Agent, name: &str, seconds: f64) -> (DVec3, DVec3, DVec3) {
    let bodies = agent.bodies_at(Duration::from_secs_f64(seconds));
    let bounds = bodies.iter().map(|body| body.mesh.bounds_m());
    let (low, high) = bounds.fold(
        (DVec3::INFINITY, DVec3::NEG_INFINITY),
        |(low, high), bounds| (low.min(bounds.0), high.max(bounds.1)),
    );
    let part = bodies.iter().find(|body| body.name == name);
    let (from, to) = part.unwrap().mesh.bounds_m();
    (0.5 * (from + to), low, high)
}

/// Choi, Wakeling and Robinovitch (2015), J. Biomech. 48:911, 25 falls on video: the pelvis hits the floor at 2.14 m/s
/// (sd 0.63), the head at 2.91 (0.86), both vertically.
#[test]
fn a_fall_ends_as_fast_as_falls_on_video() {
    let fallen = "t_s,x_mm,y_mm,posture\n0,3000,4000,walk\n2,4500,4000,walk\n2.75,5300,4000,lie\n";
    let agent = agent(fallen);
    for (part, mean, sd) in [("pelvis", 2.14, 0.63), ("face", 2.91, 0.86)] {
        let z = |seconds: f64| at(&agent, part, seconds).0.z;
        let speed = (z(2.70) - z(2.749)) / 0.049;
        assert!((speed - mean).abs() < sd, "{part}: {speed} m/s");
    }
    let (head, ..) = at(&agent, "face", 3.0);
    assert!(head.x > 5300.0 / 1000.0 + 0.6, "falls on ahead: {head}");
    // As a rod that falls over: slow at first.
    let z = |seconds: f64| at(&agent, "face", seconds).0.z;
    let [first, second] = [z(2.0) - z(2.375), z(2.375) - z(2.75)];
    assert!(second > 1.5 * first, "{first} {second}");
}

/// The body never leaves the floor or sinks into it by more than a foot's height, and is as long as the person.
#[test]
fn the_body_stays_on_the_floor_between_any_two_postures() {
    let postures = ["stand", "walk", "sit", "lie"];
    for from in postures {
        for to in postures {
            for ahead_mm in [-600, 0, 600] {
                let way = format!(
                    "t_s,x_mm,y_mm,posture\n0,3000,4000,walk\n2,4000,4000,{from}\n4,{},4000,{to}\n",
                    4000 + ahead_mm
                );
                let agent = agent(&way);
                for step in 0..=20 {
                    let seconds = 2.0 + 0.1 * f64::from(step);
                    let (_, low, high) = at(&agent, "face", seconds);
                    assert!(
                        low.z.abs() < 0.05,
                        "{from} {to} {ahead_mm} {seconds}: {low}"
                    );
                    let length = (high - low).max_element();
                    assert!(
                        (0.8..1.85).contains(&length),
                        "{from} {to} {seconds}: {length}"
                    );
                }
            }
        }
    }
}

/// Written the other way, as a person who never changes its posture.
#[test]
fn at_the_waypoints_the_body_is_that_of_a_person_in_that_posture() {
    for (posture, yaw_deg) in [("stand", 0.0), ("sit", 0.0), ("lie", 180.0)] {
        // Without a way to there, a person lies down backward; one that always lies has the head where it faces.
        let way = format!(
            "t_s,x_mm,y_mm,posture\n0,3000,4000,walk\n2,4000,4000,sit\n4,4000,4000,{posture}\n"
        );
        let changing = agent(&way);
        let text = format!(
            "{ROOM}[[agent]]\nname = \"one\"\nperson = {{ height_mm = 1650, posture = \"{posture}\" }}\nposition_mm = [4000, 4000, 0]\nyaw_deg = {yaw_deg:?}\n{CEILING}"
        );
        let fixed = crate::scene(&text).agents()[0].clone();
        for part in ["face", "pelvis", "left hand", "right foot"] {
            let (found, ..) = at(&changing, part, 4.0);
            let (expected, ..) = at(&fixed, part, 0.0);
            assert!(
                found.distance(expected) < 0.04,
                "{posture} {part}: {found} {expected}"
            );
        }
    }
}

#[test]
fn what_a_person_is_doing_follows_from_the_waypoints() {
    let way = "t_s,x_mm,y_mm,dwell_s,posture\n\
        1,500,4000,0,away\n3,2500,4000,0,walk\n5,4000,4000,1,walk\n7.5,3800,4000,2,sit\n\
        11,3800,4000,1,stand\n13,3800,4000,0,sit\n15,3800,4000,1,lie\n18,3800,4000,0,sit\n20,3800,4000,1,stand\n\
        22,5000,4000,0,walk\n22.7,5800,4000,2,lie\n28,5800,4000,1,stand\n31,7500,4000,5,away\n";
    let scene = read(way, "person = {}").unwrap();
    // The words for both ways through the door say the same as the one word of older files.
    let worded = way
        .replacen("away", "enter", 1)
        .replacen("away", "leave", 1);
    assert_eq!(read(&worded, "person = {}").unwrap(), scene);
    let agent = &scene.agents()[0];
    for (seconds, doing, posture) in [
        (0.5, None, None),
        (1.0, None, None),
        (2.0, Some("enter"), Some(Posture::Walk)),
        (4.0, Some("walk"), Some(Posture::Walk)),
        (5.5, Some("stand"), Some(Posture::Stand)),
        (6.2, Some("sit-down"), Some(Posture::Stand)),
        (7.2, Some("sit-down"), Some(Posture::Sit)),
        (9.0, Some("sit"), Some(Posture::Sit)),
        (10.0, Some("stand-up"), Some(Posture::Sit)),
        (11.5, Some("stand"), Some(Posture::Stand)),
        (14.5, Some("lie-down"), Some(Posture::Lie)),
        (15.5, Some("lie"), Some(Posture::Lie)),
        (17.9, Some("sit-up"), Some(Posture::Sit)),
        (22.5, Some("fall"), Some(Posture::Lie)),
        (24.0, Some("lie"), Some(Posture::Lie)),
        (27.5, Some("get-up"), Some(Posture::Stand)),
        (30.0, Some("leave"), Some(Posture::Walk)),
        (31.0, None, None),
        (99.0, None, None),
    ] {
        let time = Duration::from_secs_f64(seconds);
        assert_eq!(agent.doing(time).map(Doing::name), doing, "at {seconds} s");
        assert_eq!(agent.posture(time), posture, "at {seconds} s");
        assert_eq!(agent.is_here(time), doing.is_some(), "at {seconds} s");
    }
    assert_eq!(agent.duration(), Duration::from_secs(36));
    // Who is away is in no image.
    let simulator = Simulator::new(&scene, "ceiling").unwrap();
    let empty = Simulator::new(&scene.without_agents(), "ceiling").unwrap();
    let away = Duration::from_millis(31_000);
    assert_eq!(simulator.image(away), empty.image(away));
    assert_eq!(simulator.labeled(away, 1).2[0].seen.pixels(), 0.0);
}

/// Who sits down or falls backward keeps facing the way it came.
#[test]
fn only_who_is_upright_turns() {
    let way = "t_s,x_mm,y_mm,dwell_s,posture\n0,3000,2000,0,walk\n4,3000,5000,0,stand\n4.7,3000,4200,1,lie\n";
    let agent = agent(way);
    for seconds in [1.0, 3.9, 4.0, 4.3, 4.7, 9.0] {
        let front = agent
            .front_rad(Duration::from_secs_f64(seconds))
            .to_degrees();
        assert!((front - 90.0).abs() < 1e-9, "at {seconds} s: {front}");
    }
    let (head, low, high) = at(&agent, "face", 5.0);
    assert!(
        head.y < 3.6 && high.z < 0.5,
        "on the back: {head} {low} {high}"
    );
}

#[test]
fn mistakes_are_refused() {
    let person = "person = {}";
    for (way, person, words) in [
        (
            "t_s,x_mm,y_mm,posture\n0,3000,4000,jump\n",
            person,
            "way.csv:2:13: found `jump` as posture, expected walk, stand, sit, lie, enter or leave\nhint: ",
        ),
        (
            "t_s,x_mm,y_mm,posture\n0,3000,4000,enter\n3,4000,4000,enter\n",
            person,
            "way.csv:2:1: found `enter`, but no waypoint in the room after it\nhint: ",
        ),
        (
            "t_s,x_mm,y_mm,posture\n0,3000,4000,walk\n3,4000,4000,enter\n",
            person,
            "way.csv:3:1: found `enter`, but the person is in the room already\nhint: ",
        ),
        (
            "t_s,x_mm,y_mm,posture\n0,3000,4000,walk\n3,4000,4000,leave\n5,4000,4000,leave\n",
            person,
            "way.csv:3:1: found `leave`, but the person goes on in the room\nhint: ",
        ),
        (
            "t_s,x_mm,y_mm,posture\n0,3000,4000,leave\n3,4000,4000,walk\n",
            person,
            "way.csv:2:1: found `leave`, but the person is not in the room\nhint: ",
        ),
        (
            "t_s,x_mm,y_mm,posture\n0,3000,4000,enter\n3,4000,4000,leave\n",
            person,
            "way.csv:2:1: found `enter`, but no waypoint in the room after it\nhint: ",
        ),
        (
            "x_mm,y_mm,posture\n3000,4000,walk\n4000,4000,sit\n",
            "person = {}\nspeed_mm_per_s = 800",
            "add a column t_s or utc",
        ),
        (
            "t_s,x_mm,y_mm,posture\n0,3000,4000,walk\n",
            "size_mm = [200, 500, 1700]\ntemperature_c = 28",
            "write person = {}, or delete the column",
        ),
        (
            "t_s,x_mm,y_mm,posture\n0,3000,4000,walk\n",
            "person = { posture = \"sit\" }",
            "remove the key or the column",
        ),
        (
            "t_s,x_mm,y_mm,posture\n0,6000,4000,walk\n3,7400,4000,walk\n3.7,7600,4000,lie\n",
            person,
            "way.csv:4:1: agent `one` leaves the room",
        ),
    ] {
        let refused = read(way, person).unwrap_err();
        assert!(refused.contains(words), "{way}{person}\n{refused}");
    }
}
