//! What the page draws: a scene's bodies as faces and ellipsoids, ordered for any eye.

use crate::{CEILING, ROOM, object, scene};
use glam::DVec3;
use grideye_plan::drawing::json;
use std::time::Duration;

/// The page and the paper draw the same: a room's bodies with their kinds, names, colors and temperatures.
#[test]
fn the_json_has_every_face_of_every_body_and_an_order_from_any_side() {
    let mut text = format!("model = \"physical\"\n{ROOM}{CEILING}");
    text.push_str(&object(
        "table",
        [2000.0, 3000.0, 0.0],
        [1000.0, 1000.0, 750.0],
        0.0,
        21.0,
    ));
    text.push_str(&object(
        "lamp",
        [3000.0, 5000.0, 0.0],
        [300.0, 300.0, 300.0],
        0.0,
        40.0,
    ));
    text.push_str("color = \"#00ff00\"\n[[agent]]\nname = \"p\"\nperson = {}\nposition_mm = [1000, 1000, 0]\n");
    let json = json(&scene(&text), Duration::ZERO, 100);
    let shapes = json["shapes"].as_array().unwrap();
    let shape = |index: &serde_json::Value| &shapes[index.as_u64().unwrap() as usize];
    let nodes = json["nodes"].as_array().unwrap();
    let faces = nodes
        .iter()
        .flat_map(|node| node["faces"].as_array().unwrap());
    let faces: Vec<_> = faces.collect();
    for (name, color, celsius) in [("table", "#5b8dd9", 21.0), ("lamp", "#00ff00", 40.0)] {
        let own = faces
            .iter()
            .filter(|face| shape(&face["shape"])["name"] == name);
        let own: Vec<_> = own.map(|face| shape(&face["shape"])).collect();
        assert!(own.len() >= 6, "{name}: {}", own.len());
        let one = own[0];
        assert_eq!(
            (&one["kind"], &one["color"]),
            (&"object".into(), &color.into())
        );
        assert_eq!(one["celsius"].as_f64().unwrap(), celsius);
    }
    let rounds = json["rounds"].as_array().unwrap();
    assert_eq!(rounds.len(), 18);
    assert_eq!(shape(&rounds[0]["shape"])["kind"], "agent");
    assert!(sides_checked(nodes) > 100);
    // Straight down from 2.7 m with 60 degrees: one face on the floor, and a ray to each of its corners.
    let sensor = &json["sensors"][0];
    assert_eq!(sensor["view_m"][0].as_array().unwrap().len(), 4);
    assert_eq!(sensor["rays_m"].as_array().unwrap().len(), 4);
    assert_eq!(json["room"]["sides_m"].as_array().unwrap().len(), 6);
}

/// All faces on the sides of a node are on the sides of its plane.
fn sides_checked(nodes: &[serde_json::Value]) -> usize {
    let numbers = |list: &serde_json::Value| -> Vec<f64> {
        list.as_array()
            .unwrap()
            .iter()
            .map(|number| number.as_f64().unwrap())
            .collect()
    };
    fn below(nodes: &[serde_json::Value], node: usize) -> Vec<usize> {
        let sides = nodes[node]["sides"].as_array().unwrap();
        let sides = sides
            .iter()
            .filter_map(|side| Some(side.as_u64()? as usize));
        std::iter::once(node)
            .chain(sides.flat_map(|side| below(nodes, side)))
            .collect()
    }
    let mut checked = 0;
    for node in nodes {
        let plane = numbers(&node["plane"]);
        for (side, sign) in [(0, -1.0), (1, 1.0)] {
            let Some(first) = node["sides"][side].as_u64() else {
                continue;
            };
            for inner in below(nodes, first as usize) {
                for face in nodes[inner]["faces"].as_array().unwrap() {
                    for corner in face["corners_m"].as_array().unwrap() {
                        let at = numbers(corner);
                        let height =
                            plane[0] * at[0] + plane[1] * at[1] + plane[2] * at[2] - plane[3];
                        assert!(sign * height > -2e-3, "{face}");
                        checked += 1;
                    }
                }
            }
        }
    }
    checked
}

fn corners(list: &serde_json::Value) -> Vec<DVec3> {
    let corners = list.as_array().unwrap().iter();
    let corner = |one: &serde_json::Value| {
        DVec3::from_array([0, 1, 2].map(|axis| one[axis].as_f64().unwrap()))
    };
    corners.map(corner).collect()
}

/// The areas of the first sensor's footprints on a surface.
fn areas(surface: &serde_json::Value) -> Vec<f64> {
    let footprints = surface["footprints"].as_array().unwrap().iter();
    let area = |one: &serde_json::Value| {
        let corners = corners(&one[2]);
        let fan = corners
            .windows(2)
            .map(|edge| (edge[0] - corners[0]).cross(edge[1] - corners[0]));
        0.5 * fan.sum::<DVec3>().length()
    };
    footprints.map(area).collect()
}

/// From 2.7 m straight down, 60 degrees wide: a square on the floor, of which a box of 1 m hides its shadow.
#[test]
fn footprints_tile_what_a_sensor_sees_and_nothing_behind_a_body() {
    let side_m = 2.0 * 2.7 * (30_f64).to_radians().tan();
    let empty = json(&scene(&format!("{ROOM}{CEILING}")), Duration::ZERO, 100);
    let sides: Vec<_> = empty["sides"].as_array().unwrap().iter().collect();
    let floor: Vec<f64> = sides.iter().flat_map(|side| areas(side)).collect();
    assert_eq!(floor.len(), 64);
    assert!(
        (floor.iter().sum::<f64>() - side_m * side_m).abs() < 0.01,
        "{floor:?}"
    );

    let at = corners(&serde_json::json!([empty["sensors"][0]["at_m"]]))[0];
    let cube = object(
        "cube",
        [at.x * 1000.0, at.y * 1000.0, 0.0],
        [1000.0; 3],
        0.0,
        25.0,
    );
    let drawn = json(
        &scene(&format!("{ROOM}{CEILING}{cube}")),
        Duration::ZERO,
        100,
    );
    let nodes = drawn["nodes"].as_array().unwrap().iter();
    let faces = nodes.flat_map(|node| node["faces"].as_array().unwrap());
    let is_top = |face: &&serde_json::Value| {
        corners(&face["corners_m"])
            .iter()
            .all(|corner| corner.z > 0.999)
    };
    let top: f64 = faces.filter(is_top).flat_map(areas).sum();
    // A ray stands for a square of 0.06 m on the top.
    assert!((top - 1.0).abs() < 0.07, "{top}");
    let sides: Vec<_> = drawn["sides"].as_array().unwrap().iter().collect();
    let floor: f64 = sides.iter().flat_map(|side| areas(side)).sum();
    let shadow = (2.7_f64 / 1.7).powi(2);
    // A ray stands for a square of 0.1 m on the floor.
    assert!(
        (floor + shadow - side_m * side_m).abs() < 0.2,
        "{floor} {shadow}"
    );
}

#[test]
fn a_person_has_footprints_on_the_side_that_the_sensor_sees() {
    let person = "[[agent]]\nname = \"p\"\nperson = {}\nposition_mm = [2000, 3000, 0]\n";
    let drawn = json(
        &scene(&format!("{ROOM}{CEILING}{person}")),
        Duration::ZERO,
        100,
    );
    let rounds: Vec<_> = drawn["rounds"].as_array().unwrap().iter().collect();
    let seen: usize = rounds.iter().map(|round| areas(round).len()).sum();
    assert!(seen > 5, "{seen}");
    for round in rounds {
        let center = corners(&serde_json::json!([round["center_m"]]))[0];
        for footprint in round["footprints"].as_array().unwrap() {
            let middle =
                corners(&footprint[2]).iter().sum::<DVec3>() / corners(&footprint[2]).len() as f64;
            // The sensor hangs at 2.7 m: what it sees of an ellipsoid is on the side towards it.
            let at = corners(&serde_json::json!([drawn["sensors"][0]["at_m"]]))[0];
            assert!((middle - center).dot(at - center) > 0.0, "{footprint}");
        }
    }
}
