//! What a scene has and no frame shows is said, and nothing else.

use crate::{CEILING, ROOM, object, scene};
use grideye_scene::{Scene, Why};
use std::io;

fn found(text: &str) -> Vec<(Why, String)> {
    let scene = scene(text);
    let unseen = scene.unseen(None).into_iter();
    unseen.map(|one| (one.why, one.name)).collect()
}

fn person(name: &str, place_mm: [f64; 3]) -> String {
    format!("[[agent]]\nname = \"{name}\"\nperson = {{}}\nposition_mm = {place_mm:?}\n")
}

fn said(why: Why, name: &str) -> Vec<(Why, String)> {
    vec![(why, name.to_owned())]
}

/// By `way.csv`, which is in the room's far corner or below the sensor.
fn walking(model: &str, way: &str) -> Scene {
    let agent = "[[agent]]\nname = \"anna\"\nperson = {}\ntrajectory = \"way.csv\"\n";
    let text = format!("model = \"{model}\"\n{ROOM}{agent}{CEILING}");
    let files = |_: &str| Ok::<_, io::Error>(way.to_owned());
    Scene::parse(&text, "room.toml", &files).unwrap().scene
}

#[test]
fn who_is_away_at_every_waypoint_is_never_in_the_room() {
    let way = "t_s,x_mm,y_mm,posture\n0,500,3000,away\n5,3500,3000,away\n";
    let unseen = walking("paper", way).unseen(Some("ceiling"));
    assert_eq!((unseen[0].why, &*unseen[0].name), (Why::NeverHere, "anna"));
    let text = "a = 1\n[[agent]]\nname = \"anna\"\n";
    let warning = unseen[0].warning(text, "room.toml").to_string();
    assert!(
        warning.starts_with("room.toml:3:8: agent `anna` is never in the room"),
        "{warning}"
    );
    assert!(
        warning.contains("hint: ") && warning.contains("`leave`"),
        "{warning}"
    );
    let way = "t_s,x_mm,y_mm,posture\n0,500,3000,away\n2,2000,3000,walk\n5,3500,3000,away\n";
    assert_eq!(walking("paper", way).unseen(None), []);
}

#[test]
fn who_only_walks_beside_the_view_is_never_in_view() {
    for model in ["paper", "physical"] {
        let beside = "t_s,x_mm,y_mm\n0,500,400\n600,3500,400\n";
        let unseen = walking(model, beside).unseen(None);
        assert_eq!(
            (unseen[0].why, &*unseen[0].name),
            (Why::NeverInView, "anna"),
            "{model}"
        );
        // Half a second of ten minutes is enough.
        let into = "t_s,x_mm,y_mm\n0,500,400\n599,500,400\n600,2000,2400\n";
        assert_eq!(walking(model, into).unseen(None), [], "{model}");
    }
}

#[test]
fn who_stands_behind_something_is_never_in_view() {
    let screen = object(
        "screen",
        [2000.0, 3000.0, 2400.0],
        [3000.0, 3000.0, 50.0],
        0.0,
        20.1,
    );
    let anna = person("anna", [2000.0, 3000.0, 0.0]);
    assert_eq!(found(&format!("{ROOM}{anna}{CEILING}")), []);
    assert_eq!(
        found(&format!("{ROOM}{screen}{anna}{CEILING}")),
        said(Why::NeverInView, "anna")
    );
}

#[test]
fn one_sensor_of_several_is_asked_by_name() {
    let other = CEILING
        .replace("\"ceiling\"", "\"far\"")
        .replace("[2000, 3000,", "[2000, 600,");
    let scene = scene(&format!(
        "{ROOM}{}{CEILING}{other}",
        person("anna", [2000.0, 3400.0, 0.0])
    ));
    assert_eq!(scene.unseen(Some("ceiling")), []);
    let far = scene.unseen(Some("far"));
    let whys: Vec<Why> = far.iter().map(|one| one.why).collect();
    assert_eq!(whys, [Why::NeverInView, Why::SeesNothing]);
    assert!(
        far[0]
            .warning("", "room.toml")
            .to_string()
            .contains("in view of sensor `far`")
    );
}

#[test]
fn heat_out_of_view_is_said_and_cold_furniture_is_not() {
    let seen = object(
        "rug",
        [2000.0, 3000.0, 0.0],
        [500.0, 500.0, 10.0],
        0.0,
        20.1,
    );
    let shelf = object(
        "shelf",
        [200.0, 300.0, 0.0],
        [300.0, 300.0, 900.0],
        0.0,
        20.1,
    );
    let radiator = object(
        "radiator",
        [200.0, 5700.0, 0.0],
        [300.0, 300.0, 900.0],
        0.0,
        45.0,
    );
    assert_eq!(found(&format!("{ROOM}{seen}{shelf}{CEILING}")), []);
    assert_eq!(
        found(&format!("{ROOM}{seen}{radiator}{CEILING}")),
        said(Why::HeatOutOfView, "radiator")
    );
    let below = object(
        "radiator",
        [2000.0, 3000.0, 0.0],
        [300.0, 300.0, 900.0],
        0.0,
        45.0,
    );
    assert_eq!(found(&format!("{ROOM}{below}{CEILING}")), []);
}

#[test]
fn a_sensor_that_looks_at_the_ceiling_sees_nothing() {
    let up = CEILING
        .replace("elevation_deg = 90", "elevation_deg = -90")
        .replace("2700]", "1200]");
    let table = object(
        "table",
        [2000.0, 3000.0, 0.0],
        [800.0, 800.0, 700.0],
        0.0,
        20.1,
    );
    assert_eq!(
        found(&format!("{ROOM}{table}{up}")),
        said(Why::SeesNothing, "ceiling")
    );
    assert_eq!(found(&format!("{ROOM}{table}{CEILING}")), []);
}

#[test]
fn an_empty_room_and_a_scene_without_sensors_are_silent() {
    assert_eq!(found(&format!("{ROOM}{CEILING}")), []);
    assert_eq!(
        found(&format!("{ROOM}{}", person("anna", [200.0, 300.0, 0.0]))),
        []
    );
}
