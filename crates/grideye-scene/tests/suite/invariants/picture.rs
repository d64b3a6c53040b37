//! What an image shows of still objects.

use super::*;

#[test]
fn an_empty_room_is_exactly_ambient() {
    assert_eq!(picture(&format!("{ROOM}{CEILING}")), [AMBIENT_C; 64]);
    let furnished = object(
        "table",
        [2000.0, 3000.0, 0.0],
        [1600.0, 900.0, 750.0],
        20.0,
        AMBIENT_C,
    );
    assert_eq!(
        picture(&format!("{ROOM}{CEILING}{furnished}")),
        [AMBIENT_C; 64],
        "a table at ambient"
    );
}

#[test]
fn front_is_at_the_top_and_right_appears_left() {
    let at = |x, y| {
        picture(&format!(
            "{ROOM}{CEILING}{}",
            object("lamp", [x, y, 0.0], [200.0; 3], 0.0, 90.0)
        ))
    };
    let (row, column) = warmest(&at(2000.0, 2000.0));
    assert!(
        row < 2 && (3..=4).contains(&column),
        "front: {row} {column}"
    );
    let (row, column) = warmest(&at(3000.0, 3000.0));
    assert!(
        column < 2 && (3..=4).contains(&row),
        "right: {row} {column}"
    );
    let back_left = warmest(&at(1000.0, 4000.0));
    assert!(
        back_left.0 > 5 && back_left.1 > 5,
        "back left: {back_left:?}"
    );
}

#[test]
fn a_level_sensor_sees_the_floor_below_and_its_left_at_the_left() {
    let level = CEILING
        .replace("elevation_deg = 90", "elevation_deg = 0")
        .replace("2700]", "1350]");
    let at = |x, z| {
        picture(&format!(
            "{ROOM}{level}{}",
            object("lamp", [x, 1000.0, z], [200.0; 3], 0.0, 90.0)
        ))
    };
    // Looking to the front, the room's right is at the left hand.
    assert!(warmest(&at(2700.0, 1250.0)).1 < 2);
    assert!(warmest(&at(1300.0, 1250.0)).1 > 5);
    assert!(warmest(&at(2000.0, 2000.0)).0 < 2, "up is the top");
    assert!(warmest(&at(2000.0, 500.0)).0 > 5);
}

#[test]
fn a_mirrored_room_gives_a_mirrored_image() {
    let room = |side: f64| {
        let x = |offset_mm: f64| 2000.0 + side * offset_mm;
        [
            object(
                "table",
                [x(700.0), 3300.0, 0.0],
                [900.0, 600.0, 750.0],
                side * 25.0,
                31.0,
            ),
            object(
                "heater",
                [x(-500.0), 2500.0, 200.0],
                [300.0, 700.0, 900.0],
                side * -70.0,
                45.0,
            ),
        ]
        .concat()
    };
    let one = picture(&format!("{ROOM}{CEILING}{}", room(1.0)));
    let other = picture(&format!("{ROOM}{CEILING}{}", room(-1.0)));
    assert_close(&left_right(&one), &other);
    assert!(left_right(&one) != one, "the room itself is not symmetric");
}

#[test]
fn turning_room_and_sensor_together_changes_nothing() {
    let one = object(
        "table",
        [2400.0, 3300.0, 0.0],
        [900.0, 600.0, 750.0],
        25.0,
        31.0,
    );
    // A quarter turn counter-clockwise about the sensor: (400, 300) goes to (-300, 400).
    let other = object(
        "table",
        [1700.0, 3400.0, 0.0],
        [900.0, 600.0, 750.0],
        115.0,
        31.0,
    );
    let turned = CEILING.replace("azimuth_deg = -90", "azimuth_deg = 0");
    assert_close(
        &picture(&format!("{ROOM}{CEILING}{one}")),
        &picture(&format!("{ROOM}{turned}{other}")),
    );
    // A roll of a half turn reverses the image.
    let rolled = format!("{CEILING}roll_deg = 180\n");
    let reversed: Vec<f64> = picture(&format!("{ROOM}{rolled}{one}"))
        .into_iter()
        .rev()
        .collect();
    assert_close(&reversed, &picture(&format!("{ROOM}{CEILING}{one}")));
}

#[test]
fn a_roll_turns_the_camera_clockwise_and_the_image_the_other_way() {
    let lamp = object("lamp", [2000.0, 2000.0, 0.0], [200.0; 3], 0.0, 90.0);
    let rolled = picture(&format!("{ROOM}{CEILING}roll_deg = 90\n{lamp}"));
    assert!(warmest(&rolled).1 < 2, "what was at the top is at the left");
}

#[test]
fn the_order_of_objects_is_irrelevant_even_where_faces_coincide() {
    let objects = [
        object("a", [1800.0, 3000.0, 0.0], [400.0, 400.0, 800.0], 0.0, 35.0),
        object("b", [2000.0, 3000.0, 0.0], [400.0, 400.0, 800.0], 0.0, 25.0),
        object("c", [2100.0, 3100.0, 0.0], [400.0, 400.0, 800.0], 0.0, 5.0),
    ];
    let orders = [
        [0, 1, 2],
        [0, 2, 1],
        [1, 0, 2],
        [1, 2, 0],
        [2, 0, 1],
        [2, 1, 0],
    ];
    let pictures = orders.map(|order| {
        let tables: String = order.iter().map(|index| objects[*index].as_str()).collect();
        let text = format!("{ROOM}{CEILING}{tables}");
        (
            picture(&text),
            picture(&format!("model = \"paper-grid\"\n{text}")),
        )
    });
    for pair in pictures.windows(2) {
        assert_close(&pair[0].0, &pair[1].0);
        assert_eq!(pair[0].1, pair[1].1, "on the grid");
    }
}

#[test]
fn near_objects_hide_far_ones() {
    let hot = object("hot", [2000.0, 3000.0, 0.0], [300.0; 3], 0.0, 80.0);
    let board = object(
        "board",
        [2000.0, 3000.0, 1000.0],
        [400.0, 400.0, 20.0],
        0.0,
        AMBIENT_C,
    );
    assert!(
        picture(&format!("{ROOM}{CEILING}{hot}"))
            .iter()
            .any(|pixel| *pixel > 21.0)
    );
    assert_eq!(
        picture(&format!("{ROOM}{CEILING}{hot}{board}")),
        [AMBIENT_C; 64]
    );
    let behind = board
        .replace("1000.0]", "400.0]")
        .replace("\"board\"", "\"low\"");
    let low = picture(&format!(
        "{ROOM}{CEILING}{}",
        object(
            "high",
            [2000.0, 3000.0, 1000.0],
            [900.0, 900.0, 300.0],
            0.0,
            80.0
        )
    ));
    let both = picture(&format!(
        "{ROOM}{CEILING}{behind}{}",
        object(
            "high",
            [2000.0, 3000.0, 1000.0],
            [900.0, 900.0, 300.0],
            0.0,
            80.0
        )
    ));
    assert_eq!(low, both, "a hidden object changes nothing");
}

#[test]
fn agents_hide_things_and_are_hidden() {
    let agent = object(
        "person",
        [2000.0, 3000.0, 0.0],
        [500.0, 200.0, 1750.0],
        0.0,
        31.0,
    )
    .replace("object", "agent");
    let roof = object(
        "roof",
        [2000.0, 3000.0, 1800.0],
        [900.0, 900.0, 20.0],
        0.0,
        AMBIENT_C,
    );
    let hidden = simulator(&format!("{ROOM}{CEILING}{agent}{roof}"));
    assert_eq!(hidden.image(Duration::ZERO).celsius, [AMBIENT_C; 64]);
    assert_eq!(hidden.truth(Duration::ZERO).share, [0.0; 64]);
    // A heater on the floor below the person is not seen.
    let heater = object(
        "heater",
        [2000.0, 3000.0, 0.0],
        [100.0, 100.0, 50.0],
        0.0,
        80.0,
    );
    let alone = picture(&format!("{ROOM}{CEILING}{agent}"));
    assert_close(&picture(&format!("{ROOM}{CEILING}{agent}{heater}")), &alone);
}

#[test]
fn objects_behind_the_sensor_are_not_seen() {
    let level = CEILING
        .replace("elevation_deg = 90", "elevation_deg = 0")
        .replace("2700]", "1350]");
    let behind = object(
        "hot",
        [2000.0, 4000.0, 0.0],
        [2000.0, 1500.0, 2700.0],
        0.0,
        80.0,
    );
    assert_eq!(picture(&format!("{ROOM}{level}{behind}")), [AMBIENT_C; 64]);
    // A wall that starts behind the sensor and ends in front of it, at its left, shows only at the left.
    let beside = object(
        "hot",
        [2600.0, 2500.0, 0.0],
        [200.0, 3000.0, 2700.0],
        0.0,
        80.0,
    );
    let seen = picture(&format!("{ROOM}{level}{beside}"));
    for row in seen.chunks_exact(8) {
        assert!(row[0] > 30.0, "{row:?}");
        assert_eq!(row[7], AMBIENT_C);
    }
}

#[test]
fn the_view_covers_as_much_as_in_the_paper() {
    // At 2.7 m, 60° cover 3.118 m: half of that is 1.559 m.
    let flat = |x| object("plate", [x, 3000.0, 0.0], [20.0, 20.0, 0.001], 0.0, 4000.0);
    let inside = picture(&format!("{ROOM}{CEILING}{}", flat(2000.0 + 1559.0 - 15.0)));
    assert!(inside.iter().any(|pixel| *pixel != AMBIENT_C));
    let outside = picture(&format!("{ROOM}{CEILING}{}", flat(2000.0 + 1559.0 + 15.0)));
    assert_eq!(outside, [AMBIENT_C; 64]);
}

#[test]
fn a_wide_plate_has_the_perceived_temperature_of_its_distance() {
    // 1 m below the sensor, in a steep narrow view: every point is 1 m away to within a millimeter.
    let narrow = format!("{CEILING}fov_deg = 2\npixels_per_degree = 50\n");
    let plate = object(
        "plate",
        [2000.0, 3000.0, 0.0],
        [1000.0, 1000.0, 1700.0],
        0.0,
        31.0,
    );
    for (law, expected) in [("A", 28.89), ("B", 25.05)] {
        for pixel in picture(&format!("law = \"{law}\"\n{ROOM}{narrow}{plate}")) {
            let surface = Surface {
                celsius: 31.0,
                emissivity: 0.8,
            };
            let law = if law == "A" { Law::A } else { Law::B };
            assert!((pixel - perceived_celsius(law, surface, AMBIENT_C, 1.0, 5.0)).abs() < 1e-2);
            assert!((pixel - expected).abs() < 0.06, "{pixel}");
        }
    }
}
