//! Parametric people: how large and warm they look beside measured ones, and how exactly and quickly they are drawn.

use crate::{parse, scene, simulator};
use glam::DVec3;
use grideye_scene::{Agent, Simulator};
use std::time::Duration;

const ROOM: &str = "model = \"physical\"\ncollisions = \"ignore\"\n[room]\nsize_mm = [10000, 8000, 2500]\nambient_c = 20\n";
const CEILING: &str = "[[sensor]]\nname = \"ceiling\"\npreset = \"grid-eye\"\nposition_mm = [5000, 3000, 2500]\nelevation_deg = 90\nazimuth_deg = 0\n";

fn person(keys: &str, place_mm: [f64; 2], yaw_deg: f64) -> String {
    let [x, y] = place_mm;
    format!(
        "[[agent]]\nname = \"one\"\nposition_mm = [{x:?}, {y:?}, 0]\nyaw_deg = {yaw_deg:?}\nperson = {{ {keys} }}\n"
    )
}

/// What one distance from the axis shows: medians over directions, headings and moments of a stride.
struct Seen {
    peak_c: f64,
    sum_c: f64,
    width_px: f64,
}

/// As it is measured on recordings: pixels above 0.5 °C count for sum and width.
fn seen(clothing: &str, from_m: f64) -> Seen {
    let mut found = [const { Vec::new() }; 3];
    for direction in 0..10 {
        // Within 0.3 m, at a direction that no symmetry of the sensor favors.
        let angle = 0.2 + 0.628 * f64::from(direction);
        let distance_m = from_m + 0.03 + 0.027 * f64::from(direction);
        let place = [angle.cos(), angle.sin()].map(|part| 1000.0 * distance_m * part);
        for heading in 0..4 {
            let keys = format!("height_mm = 1750, posture = \"walk\", clothing = \"{clothing}\"");
            let yaw_deg = 17.0 + 90.0 * f64::from(heading);
            let place = [place[0] + 5000.0, place[1] + 3000.0];
            let text = format!("{ROOM}{}{CEILING}", person(&keys, place, yaw_deg));
            let celsius = simulator(&text).image(Duration::ZERO).celsius;
            let counted = |pixel: usize| Some(celsius[pixel] - 20.0).filter(|above| *above > 0.5);
            let weight = |pixel: usize| counted(pixel).unwrap_or(0.0);
            let mean = |of: &dyn Fn(usize) -> f64| {
                let (all, sum) = (0..64).fold((0.0, 0.0), |(all, sum), pixel| {
                    (all + weight(pixel), sum + weight(pixel) * of(pixel))
                });
                sum / all
            };
            let (row, column) = (|pixel| (pixel / 8) as f64, |pixel| (pixel % 8) as f64);
            let middle = (mean(&row), mean(&column));
            let square =
                |pixel: usize| (row(pixel) - middle.0).powi(2) + (column(pixel) - middle.1).powi(2);
            found[0].push(celsius.iter().copied().fold(0.0, f64::max) - 20.0);
            found[1].push((0..64).map(weight).sum());
            found[2].push((0.5 * mean(&square)).sqrt());
        }
    }
    let [peak_c, sum_c, width_px] = found.map(|mut values| {
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    });
    Seen {
        peak_c,
        sum_c,
        width_px,
    }
}

/// Distance; 10th and 90th percentile of the peak; medians of sum and width: measured on two persons of 9,000 frames of a sensor at 2.5 m
/// (open-thermopile-dataset, doi 10.1109/JIOT.2022.3161646), who walked below it with a tracker.
const MEASURED: [(&str, [f64; 5]); 8] = [
    ("indoor", [0.0, 3.12, 4.25, 17.9, 0.75]),
    ("indoor", [0.3, 3.50, 4.50, 19.2, 0.77]),
    ("indoor", [0.6, 2.50, 4.25, 11.2, 0.62]),
    ("indoor", [0.9, 1.25, 3.00, 4.5, 0.48]),
    ("coat", [0.0, 2.00, 3.00, 13.0, 0.80]),
    ("coat", [0.3, 1.75, 3.00, 12.0, 0.78]),
    ("coat", [0.6, 1.50, 2.50, 8.2, 0.68]),
    ("coat", [0.9, 1.00, 1.75, 3.2, 0.47]),
];

#[test]
fn a_person_is_as_warm_and_as_wide_as_measured_ones() {
    let mut faults = Vec::new();
    for (clothing, [from_m, low, high, sum_c, width_px]) in MEASURED {
        let found = seen(clothing, from_m);
        let line = format!(
            "{clothing} {from_m}: peak {:.2} ({low}-{high}), sum {:.1} ({sum_c}), width {:.2} ({width_px})",
            found.peak_c, found.sum_c, found.width_px
        );
        println!("{line}");
        let is_near = |found: f64, measured: f64| (found / measured - 1.0).abs() <= 0.25;
        if !(low..=high).contains(&found.peak_c)
            || !is_near(found.sum_c, sum_c)
            || !is_near(found.width_px, width_px)
        {
            faults.push(line);
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// More clothes are never warmer outside, and a number beside a name looks nearly like it.
#[test]
fn clothing_and_build_are_names_or_numbers() {
    let sum = |keys: &str| -> f64 {
        let text = format!("{ROOM}{}{CEILING}", person(keys, [5000.0, 3000.0], 0.0));
        let celsius = simulator(&text).image(Duration::ZERO).celsius;
        celsius.iter().map(|celsius| celsius - 20.0).sum()
    };
    for (name, clo) in [("light", 0.5), ("indoor", 1.0), ("coat", 2.0)] {
        let named = sum(&format!("clothing = \"{name}\""));
        assert_eq!(named, sum(&format!("clothing = {clo:?}")), "{name}");
        let beside = sum(&format!("clothing = {:?}", clo + 0.01));
        assert!(
            (beside / named - 1.0).abs() < 0.02,
            "{name}: {named} {beside}"
        );
    }
    let chests = [0.0, 0.25, 0.5, 0.8, 1.0, 1.5, 2.0, 3.0, 4.0].map(|clo: f64| {
        let scene = scene(&format!(
            "{ROOM}{}{CEILING}",
            person(&format!("clothing = {clo:?}"), [5000.0, 3000.0], 0.0)
        ));
        scene.agents()[0].parts[4].surface.celsius
    });
    assert!(chests.is_sorted_by(|less, more| less > more), "{chests:?}");
    for (name, girth) in [("slight", 0.9), ("average", 1.0), ("stout", 1.15)] {
        let [named, number] = [format!("\"{name}\""), format!("{girth:?}")];
        let [named, number] = [named, number].map(|build| sum(&format!("build = {build}")));
        assert_eq!(named, number, "{name}");
    }
}

/// The same bodies as flat faces, which another part of the renderer draws.
#[test]
fn rounded_segments_look_like_their_faces() {
    for posture in ["stand", "walk", "sit", "lie"] {
        let keys = format!("posture = \"{posture}\", build = \"stout\"");
        let scene = scene(&format!(
            "{ROOM}{}{CEILING}",
            person(&keys, [5300.0, 3200.0], 40.0)
        ));
        let mut simulator = Simulator::new(&scene, "ceiling").unwrap();
        let round = simulator.image(Duration::ZERO);
        let agent = &scene.agents()[0];
        let bodies = agent.bodies_at(Duration::ZERO);
        simulator.replace_agents(vec![Agent::at_rest("faces", bodies, agent.start_m)]);
        let flat = simulator.image(Duration::ZERO);
        let warmest = round.celsius.iter().copied().fold(0.0, f64::max);
        assert!(warmest > 23.0, "{posture}: {warmest}");
        for (round, flat) in round.celsius.iter().zip(&flat.celsius) {
            assert!((round - flat).abs() < 0.12, "{posture}: {round} {flat}");
        }
    }
}

#[test]
fn a_person_has_its_height_and_stands_on_the_floor_in_every_posture() {
    for (posture, height_m, length_m) in [
        ("stand", 1.8, 0.5),
        ("walk", 1.8, 0.5),
        ("sit", 1.3, 0.9),
        ("lie", 0.4, 1.9),
    ] {
        let keys = format!("height_mm = 1800, posture = \"{posture}\"");
        let scene = scene(&format!(
            "{ROOM}{}{CEILING}",
            person(&keys, [5000.0, 3000.0], 0.0)
        ));
        let bodies = scene.agents()[0].bodies_at(Duration::ZERO);
        let (low, high) = bodies.iter().map(|body| body.mesh.bounds_m()).fold(
            (DVec3::INFINITY, DVec3::NEG_INFINITY),
            |(low, high), bounds| (low.min(bounds.0), high.max(bounds.1)),
        );
        assert!(low.z.abs() < 0.04, "{posture}: {low}");
        assert!((high.z - height_m).abs() < 0.1, "{posture}: {high}");
        assert!(high.x - low.x < length_m + 0.1, "{posture}: {low} {high}");
    }
}

#[test]
fn legs_swing_with_the_way_and_rest_at_its_end() {
    let files = |_: &str| Ok("x_mm,y_mm,z_mm\n3000,3000,0\n7000,3000,0\n".to_owned());
    let text = format!(
        "{ROOM}[[agent]]\nname = \"one\"\nperson = {{}}\ntrajectory = \"way.csv\"\nspeed_mm_per_s = 1000\n{CEILING}"
    );
    let scene = grideye_scene::Scene::parse(&text, "room.toml", &files)
        .unwrap()
        .scene;
    let agent = &scene.agents()[0];
    let apart_m = |seconds: f64| {
        let bodies = agent.bodies_at(Duration::from_secs_f64(seconds));
        let foot = |side: &str| {
            let foot = bodies
                .iter()
                .find(|body| body.name == format!("{side} foot"));
            let (low, high) = foot.unwrap().mesh.bounds_m();
            0.5 * (low.x + high.x)
        };
        foot("left") - foot("right")
    };
    let steps: Vec<f64> = (0..40)
        .map(|tenth| apart_m(0.1 * f64::from(tenth)))
        .collect();
    let widest = steps.iter().copied().fold(0.0, f64::max);
    // A step of a walk at 1 m/s is about 0.3 of stature (Winter, chapter 3).
    assert!((0.4..0.8).contains(&widest), "{steps:?}");
    let turns = steps
        .windows(2)
        .filter(|pair| pair[0].signum() != pair[1].signum());
    assert!((5..8).contains(&turns.count()), "{steps:?}");
    assert!(apart_m(60.0).abs() < 1e-9);
}

#[test]
fn what_a_person_cannot_be_is_refused_with_the_place() {
    for (keys, expected) in [
        ("person = { height_mm = 175 }", "height_mm"),
        ("person = { clothing = 5 }", "`clothing` is 5, expected"),
        ("person = { build = [1] }", "expected a name or a number"),
        (
            "person = { posture = \"run\" }",
            "\"stand\", \"walk\", \"sit\" or \"lie\"",
        ),
        (
            "person = { clothing = \"none\" }",
            "\"light\", \"indoor\", \"coat\" or 0 to 4 clo",
        ),
        (
            "person = { build = \"big\" }",
            "\"slight\", \"average\" or \"stout\"",
        ),
        ("person = { size_mm = [1, 2, 3] }", "size_mm"),
        (
            "person = {}\ntemperature_c = 30",
            "has both `temperature_c` and `person`",
        ),
        (
            "person = {}\nsurface = \"coat\"",
            "has both `surface` and `person`",
        ),
    ] {
        let text = format!(
            "{ROOM}[[agent]]\nname = \"one\"\nposition_mm = [5000, 3000, 0]\n{keys}\n{CEILING}"
        );
        let error = parse(&text).unwrap_err().to_string();
        assert!(error.contains(expected), "{keys}: {error}");
        assert!(error.contains("room.toml:"), "{error}");
    }
}
