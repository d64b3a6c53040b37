//! Shapes other than upright boxes, and several agents: against boxes, and against closed forms.

use crate::{CEILING, ROOM, object, picture, simulator};
use std::f64::consts::PI;
use std::time::Duration;

/// As two frames of the same surfaces differ that are cut into other pieces: the rule that integrates over them is not
/// exact.
const RULE_C: f64 = 1e-6;

fn assert_close(found: &[f64], expected: &[f64], within_c: f64) {
    for (pixel, (found, expected)) in found.iter().zip(expected).enumerate() {
        assert!(
            (found - expected).abs() <= within_c,
            "pixel {pixel}: {found}, expected {expected}"
        );
    }
}

/// The box of `object("thing", position, [600, 400, 900], 0, 31)` as a polyhedron with its faces turned inwards.
fn box_as_polyhedron(position_mm: [f64; 3], keys: &str) -> String {
    format!(
        "[[object]]\nname = \"thing\"\nposition_mm = {position_mm:?}\ntemperature_c = 31\nshape = \"polyhedron\"\n\
         vertices_mm = [[-300, -200, 0], [300, -200, 0], [300, 200, 0], [-300, 200, 0],\n\
         [-300, -200, 900], [300, -200, 900], [300, 200, 900], [-300, 200, 900]]\n\
         faces = [[0, 1, 2, 3], [7, 6, 5, 4], [4, 5, 1, 0], [5, 6, 2, 1], [6, 7, 3, 2], [7, 4, 0, 3]]\n{keys}"
    )
}

#[test]
fn a_box_given_by_its_faces_is_the_box() {
    let place = [2300.0, 3300.0, 200.0];
    let expected = object("thing", place, [600.0, 400.0, 900.0], 25.0, 31.0);
    let found = box_as_polyhedron(place, "yaw_deg = 25\n");
    assert_close(
        &picture(&format!("{ROOM}{CEILING}{found}")),
        &picture(&format!("{ROOM}{CEILING}{expected}")),
        RULE_C,
    );
}

#[test]
fn a_sheet_is_seen_from_both_sides() {
    let sheet = |faces: &str| {
        format!(
            "{ROOM}{CEILING}[[object]]\nname = \"sheet\"\nposition_mm = [2000, 3000, 1000]\ntemperature_c = 31\n\
             shape = \"polyhedron\"\nvertices_mm = [[-500, -500, 0], [500, -500, 0], [500, 500, 0], [-500, 500, 0]]\nfaces = {faces}\n"
        )
    };
    let plate = object(
        "plate",
        [2000.0, 3000.0, 990.0],
        [1000.0, 1000.0, 10.0],
        0.0,
        31.0,
    );
    let expected = picture(&format!("{ROOM}{CEILING}{plate}"));
    for faces in ["[[0, 1, 2, 3]]", "[[3, 2, 1, 0]]", "[[0, 1, 2], [0, 2, 3]]"] {
        assert_close(&picture(&sheet(faces)), &expected, RULE_C);
    }
}

#[test]
fn a_lying_box_is_a_box_with_swapped_sides() {
    // Pitched by 90 degrees, the height lies along +x from the base, and the base stands.
    let standing = object(
        "thing",
        [1500.0, 3000.0, 300.0],
        [600.0, 400.0, 900.0],
        0.0,
        31.0,
    );
    let lying = format!("{standing}pitch_deg = 90\n");
    let same = object(
        "thing",
        [1950.0, 3000.0, 0.0],
        [900.0, 400.0, 600.0],
        0.0,
        31.0,
    );
    assert_close(
        &picture(&format!("{ROOM}{CEILING}{lying}")),
        &picture(&format!("{ROOM}{CEILING}{same}")),
        RULE_C,
    );
    let rolled = format!("{standing}roll_deg = -90\n");
    let same = object(
        "thing",
        [1500.0, 3450.0, 100.0],
        [600.0, 900.0, 400.0],
        0.0,
        31.0,
    );
    assert_close(
        &picture(&format!("{ROOM}{CEILING}{rolled}")),
        &picture(&format!("{ROOM}{CEILING}{same}")),
        RULE_C,
    );
}

/// On the optical axis a ball covers, on a plane at depth 1, a disc of radius `r / sqrt(d² - r²)`.
#[test]
fn a_ball_covers_the_right_disc() {
    let ball = |shape: &str| {
        format!(
            "{ROOM}{CEILING}[[agent]]\nname = \"ball\"\nshape = {shape:?}\nsize_mm = [800, 800, 800]\ntemperature_c = 31\nposition_mm = [2000, 3000, 900]\n"
        )
    };
    let (radius_m, distance_m): (f64, f64) = (0.4, 2.7 - 1.3);
    let disc = PI * radius_m * radius_m / (distance_m * distance_m - radius_m * radius_m);
    let pixel = (2.0 * (PI / 6.0).tan() / 8.0).powi(2);
    for shape in ["ellipsoid", "capsule"] {
        let share = simulator(&ball(shape)).truth(Duration::ZERO).share;
        let covered: f64 = share.iter().sum::<f64>() * pixel;
        assert!(
            (covered / disc - 1.0).abs() < 0.012,
            "{shape}: {covered}, expected {disc}"
        );
    }
}

#[test]
fn a_pyramid_ends_in_its_tip() {
    let pyramid = |size: &str| {
        format!(
            "{ROOM}{CEILING}[[agent]]\nname = \"p\"\nshape = \"pyramid\"\nsize_mm = {size}\ntemperature_c = 31\nposition_mm = [2000, 3000, 0]\n"
        )
    };
    // Seen from above, the outline is the base, whatever the height below the sensor.
    let share = |size| simulator(&pyramid(size)).truth(Duration::ZERO).share;
    assert_close(
        &share("[1000, 1400, 500]"),
        &share("[1000, 1400, 1200]"),
        1e-12,
    );
    let warm = |size: &str| picture(&pyramid(size));
    let (low, high) = (warm("[1000, 1400, 500]"), warm("[1000, 1400, 1200]"));
    assert!(high[27] > low[27] + 0.5, "the tip is nearer");
}

#[test]
fn a_sensor_in_a_hollow_sees_out_and_one_in_the_wall_does_not() {
    // A cup: a box of 1 m with a shaft of 0.6 m from the top down to 0.2 m above its floor.
    let cup = |sensor_z: f64, sensor_x: f64| {
        format!(
            "{ROOM}[[sensor]]\nname = \"s\"\npreset = \"grid-eye\"\nposition_mm = [{sensor_x:?}, 3000, {sensor_z:?}]\nelevation_deg = -90\nazimuth_deg = 0\n\
             [[object]]\nname = \"cup\"\nposition_mm = [2000, 3000, 0]\ntemperature_c = 31\nshape = \"polyhedron\"\n\
             vertices_mm = [[-500, -500, 0], [500, -500, 0], [500, 500, 0], [-500, 500, 0], [-500, -500, 1000], [500, -500, 1000], [500, 500, 1000], [-500, 500, 1000],\n\
             [-300, -300, 200], [300, -300, 200], [300, 300, 200], [-300, 300, 200], [-300, -300, 1000], [300, -300, 1000], [300, 300, 1000], [-300, 300, 1000]]\n\
             faces = [[3, 2, 1, 0], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7],\n\
             [8, 9, 10, 11], [8, 12, 13, 9], [9, 13, 14, 10], [10, 14, 15, 11], [11, 15, 12, 8],\n\
             [4, 5, 13, 12], [5, 6, 14, 13], [6, 7, 15, 14], [7, 4, 12, 15]]\n"
        )
    };
    let in_the_hollow = picture(&cup(300.0, 2000.0));
    assert!(
        (in_the_hollow[27] - 20.1).abs() < 1e-9,
        "the ceiling straight above"
    );
    assert!(
        in_the_hollow[24] > 24.0,
        "the wall at the side: {}",
        in_the_hollow[24]
    );
    let in_the_wall = picture(&cup(300.0, 2400.0));
    assert_close(&in_the_wall, &[31.0; 64], 1e-9);
}

#[test]
fn the_nearer_of_two_agents_is_seen_and_each_has_its_share() {
    let agent = |name: &str, z: f64, celsius: f64| {
        object(
            name,
            [2000.0, 3000.0, z],
            [800.0, 600.0, 100.0],
            0.0,
            celsius,
        )
        .replace("object", "agent")
    };
    let (high, low) = (agent("high", 1500.0, 25.0), agent("low", 500.0, 35.0));
    let only_high = picture(&format!("{ROOM}{CEILING}{high}"));
    for both in [
        format!("{ROOM}{CEILING}{high}{low}"),
        format!("{ROOM}{CEILING}{low}{high}"),
    ] {
        // The higher plate covers the lower one completely, although the lower one is warmer.
        assert_close(&picture(&both), &only_high, 1e-12);
    }
    let simulator = simulator(&format!("{ROOM}{CEILING}{high}{low}"));
    let (_, _, filled) = simulator.labeled(Duration::ZERO, 1);
    let [upper, lower] = &filled[..] else {
        panic!("two agents, {} labels", filled.len());
    };
    assert_eq!(upper.seen, simulator.truth(Duration::ZERO));
    assert_eq!(lower.seen.share, [0.0; 64]);
    assert!(lower.unhidden.pixels() > 1.0 && lower.visibility() == 0.0);
}

#[test]
fn an_agent_with_parts_looks_like_its_parts() {
    let part = |name: &str, z: f64| {
        object(name, [0.0, 100.0, z], [300.0, 200.0, 500.0], 10.0, 30.0)
            .replace("[[object]]", "[[agent.part]]")
    };
    let parts = format!(
        "{ROOM}{CEILING}[[agent]]\nname = \"a\"\nposition_mm = [1700, 2800, 50]\n{}{}",
        part("low", 0.0),
        part("high", 800.0)
    );
    let objects = [("low", 50.0), ("high", 850.0)]
        .map(|(name, z)| object(name, [1700.0, 2900.0, z], [300.0, 200.0, 500.0], 10.0, 30.0));
    assert_close(
        &picture(&parts),
        &picture(&format!("{ROOM}{CEILING}{}", objects.concat())),
        1e-12,
    );
}
