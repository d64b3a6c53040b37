//! Frames of the paper's model, against its sampling grid and ever finer ones.

use crate::{CEILING, ROOM, object, scene};
use grideye_scene::{Scene, Simulator};
use std::time::Duration;

/// The largest difference between frames by grid and by area, and between shares, over a walk.
fn difference(scene: &Scene, moments: u32) -> (f64, f64) {
    let name = &scene.sensors()[0].name;
    let by_grid = Simulator::new(&scene.on_grid(), name).unwrap();
    let by_area = Simulator::new(scene, name).unwrap();
    let largest = |one: &[f64], other: &[f64]| {
        let pairs = one.iter().zip(other);
        pairs
            .map(|(one, other)| (one - other).abs())
            .fold(0.0, f64::max)
    };
    let mut found = (0.0_f64, 0.0_f64);
    for moment in 0..moments {
        let time = scene.duration() * moment / moments;
        let (grid, area) = (by_grid.image(time), by_area.image(time));
        found.0 = found.0.max(largest(&grid.celsius, &area.celsius));
        let (grid, area) = (by_grid.truth(time), by_area.truth(time));
        found.1 = found.1.max(largest(&grid.share, &area.share));
    }
    found
}

/// Boxes behind, in front of and through each other, a round body, one of them moving.
fn furnished(sensor: &str) -> String {
    let things = [
        object(
            "table",
            [2000.0, 3000.0, 0.0],
            [1600.0, 900.0, 750.0],
            20.0,
            24.0,
        ),
        object(
            "pillar",
            [2100.0, 3050.0, 0.0],
            [300.0, 300.0, 1500.0],
            50.0,
            12.0,
        ),
        object(
            "shelf",
            [1500.0, 2500.0, 900.0],
            [900.0, 400.0, 100.0],
            -10.0,
            33.0,
        ),
        object(
            "ball",
            [1400.0, 3500.0, 300.0],
            [500.0, 400.0, 600.0],
            0.0,
            40.0,
        ) + "shape = \"ellipsoid\"\n",
        object(
            "person",
            [1650.0, 2650.0, 0.0],
            [300.0, 500.0, 1650.0],
            35.0,
            30.0,
        )
        .replace("object", "agent"),
    ];
    format!("{ROOM}{sensor}{}", things.concat())
}

fn crowded(pixels_per_degree: u32) -> Scene {
    let sensor = CEILING.replace("elevation_deg = 90", "elevation_deg = 80\nroll_deg = 7");
    let sensor = format!("{sensor}pixels_per_degree = {pixels_per_degree}\n");
    scene(&furnished(&sensor))
}

#[test]
fn finer_grids_tend_to_the_area() {
    let differences = [2, 8, 32].map(|points| difference(&crowded(points), 1));
    for pair in differences.windows(2) {
        assert!(pair[1].0 < 0.5 * pair[0].0, "degrees: {differences:?}");
        assert!(pair[1].1 < 0.5 * pair[0].1, "shares: {differences:?}");
    }
    assert!(differences[2].0 < 2e-3, "{differences:?}");
    assert!(differences[2].1 < 5e-4, "{differences:?}");
}

#[test]
fn an_empty_room_and_a_sensor_in_a_body_are_exact() {
    let empty = scene(&format!("{ROOM}{CEILING}"));
    assert_eq!(difference(&empty, 1), (0.0, 0.0));
    let around = object(
        "cupboard",
        [2000.0, 3000.0, 1000.0],
        [900.0, 900.0, 1700.0],
        0.0,
        31.0,
    );
    for kind in ["object", "agent"] {
        let inside = format!("{ROOM}{CEILING}{}", around.replace("object", kind));
        let inside = scene(&inside.replace("3000, 2700]", "3000, 2000]"));
        let image = Simulator::new(&inside, "ceiling")
            .unwrap()
            .image(Duration::ZERO);
        for celsius in image.celsius {
            assert!((celsius - 31.0).abs() < 1e-9, "{kind}: {celsius}");
        }
    }
}

#[test]
fn coinciding_faces_show_the_warmer_in_any_order() {
    let one = object(
        "one",
        [2000.0, 3000.0, 0.0],
        [600.0, 600.0, 800.0],
        0.0,
        30.0,
    );
    let other = object(
        "other",
        [2200.0, 3000.0, 0.0],
        [600.0, 600.0, 800.0],
        0.0,
        26.0,
    );
    let pictures = [[&one, &other], [&other, &one]].map(|[first, second]| {
        let scene = scene(&format!("{ROOM}{CEILING}{first}{second}"));
        let by_area = Simulator::new(&scene, "ceiling").unwrap();
        assert!(difference(&scene, 1).0 < 0.05);
        by_area.image(Duration::ZERO).celsius
    });
    for (one, other) in pictures[0].iter().zip(&pictures[1]) {
        assert!((one - other).abs() < 1e-9);
    }
}

#[test]
fn a_sensor_in_several_bodies_shows_the_warmest_in_any_order() {
    let around = |name: &str, celsius: f64, emissivity: f64| {
        let size_mm = [900.0 + 10.0 * celsius, 900.0, 1700.0];
        object(name, [2000.0, 3000.0, 900.0], size_mm, celsius, celsius)
            + &format!("emissivity = {emissivity}\n")
    };
    // The warmest has the lowest emissivity, so that from afar it would not appear warmest.
    let bodies = [
        around("one", 31.0, 0.2),
        around("two", 27.0, 0.9),
        around("three", 24.0, 1.0),
    ];
    for order in [
        &[0, 1][..],
        &[1, 0],
        &[0, 1, 2],
        &[2, 1, 0],
        &[1, 0, 2],
        &[2, 0, 1],
    ] {
        for agents in 0..=order.len() {
            let things = order.iter().enumerate().map(|(place, body)| {
                if place < agents {
                    bodies[*body].replace("object", "agent")
                } else {
                    bodies[*body].clone()
                }
            });
            let things: String = things.collect();
            let text = format!("{ROOM}{CEILING}{things}").replace("3000, 2700]", "3000, 2000]");
            let inside = scene(&text);
            for inside in [inside.on_grid(), inside] {
                let image = Simulator::new(&inside, "ceiling")
                    .unwrap()
                    .image(Duration::ZERO);
                for celsius in image.celsius {
                    assert!(
                        (celsius - 31.0).abs() < 1e-9,
                        "{order:?} {agents}: {celsius}"
                    );
                }
            }
        }
    }
}

/// Largest difference between two images, degrees.
fn apart(one: &[f64], other: &[f64]) -> f64 {
    let pairs = one.iter().zip(other);
    pairs
        .map(|(one, other)| (one - other).abs())
        .fold(0.0, f64::max)
}

#[test]
fn the_area_is_closer_to_the_finest_grid_than_the_papers_grid() {
    // 34.1 points per degree are 2,046 on each axis, the maximum; the paper has 300.
    let (mut papers_c, mut areas_c) = (0.0, 0.0);
    for pose in 0..12 {
        let angles = format!(
            "elevation_deg = {}\nroll_deg = {}",
            90 - 5 * pose,
            31 * pose
        );
        let turned = |pixels_per_degree: f64| {
            let sensor = CEILING.replace("elevation_deg = 90", &angles);
            let sensor = format!("{sensor}pixels_per_degree = {pixels_per_degree:?}\n");
            scene(&furnished(&sensor))
        };
        let finest = Simulator::new(&turned(34.1).on_grid(), "ceiling").unwrap();
        let paper = Simulator::new(&turned(5.0).on_grid(), "ceiling").unwrap();
        let area = Simulator::new(&turned(5.0), "ceiling").unwrap();
        let at = Duration::ZERO;
        let limit = finest.image(at).celsius;
        let paper_c = apart(&paper.image(at).celsius, &limit);
        let area_c = apart(&area.image(at).celsius, &limit);
        println!(
            "pose {pose}: grid of 300 {paper_c:.6}, area {area_c:.6} degrees from the finest grid"
        );
        assert!(area_c < 0.5 * paper_c, "pose {pose}: {area_c} {paper_c}");
        papers_c += paper_c;
        areas_c += area_c;
    }
    assert!(areas_c < 0.1 * papers_c, "{areas_c} {papers_c}");
}

const INDOORS: &str = "person = { clothing = \"indoor\", posture = \"POSTURE\" }\n";
const COAT: &str = "person = { clothing = \"coat\", posture = \"POSTURE\" }\n";
const PARTS: &str = "[[agent.part]]\nname = \"trunk\"\nshape = \"capsule\"\nposition_mm = [0, 0, 700]\nsize_mm = [240, 400, 780]\ntemperature_c = 27\n\
    [[agent.part]]\nname = \"legs\"\nshape = \"capsule\"\nposition_mm = [0, 0, 0]\nsize_mm = [200, 300, 700]\ntemperature_c = 25\n\
    [[agent.part]]\nname = \"head\"\nshape = \"ellipsoid\"\nposition_mm = [0, 0, 1480]\nsize_mm = [190, 160, 240]\ntemperature_c = 32\n";

/// The outlines of persons and of hand-made parts are as warm as their faces on the grid, from above, from the side, behind
/// furniture and half out of view.
#[test]
fn outlines_are_a_persons_faces_without_relief() {
    for (elevation_deg, body, most) in [
        (90, INDOORS, 0.03),
        (60, COAT, 0.03),
        (35, INDOORS, 0.03),
        (90, PARTS, 0.05),
        (50, PARTS, 0.05),
    ] {
        let sensor = CEILING.replace("= 90", &format!("= {elevation_deg}"));
        let text = furnished(&sensor);
        let (furniture, _) = text.split_once("[[agent]]").unwrap();
        let with = |[x, y]: [u32; 2]| {
            let posture = ["stand", "sit"][(x % 2) as usize];
            let body = body.replace("POSTURE", posture);
            scene(&format!(
                "collisions = \"ignore\"\n{furniture}[[agent]]\nname = \"one\"\nposition_mm = [{x}, {y}, 0]\n{body}"
            ))
        };
        let seen = |scene: &Scene| {
            let simulator = Simulator::new(scene, "ceiling").unwrap();
            simulator.image(Duration::ZERO).celsius
        };
        let empty = seen(&scene(furniture));
        let (mut apart, mut shown) = (0.0, 0.0);
        for place in (0..16).map(|step| [1101 + 115 * step, 1400 + 300 * (step * 7 % 11)]) {
            let one = with(place);
            let (faces, outlines) = (seen(&one.on_grid()), seen(&one));
            for ((outline, face), bare) in outlines.iter().zip(&faces).zip(&empty) {
                apart += (outline - face).powi(2);
                shown += (face - bare).powi(2);
            }
        }
        let ratio = f64::sqrt(apart / shown);
        println!(
            "elevation {elevation_deg}: {ratio:.4} of {:.3}",
            f64::sqrt(shown)
        );
        assert!(ratio < most, "elevation {elevation_deg}: {ratio}");
    }
}
