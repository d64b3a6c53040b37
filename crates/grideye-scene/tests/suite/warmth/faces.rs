//! Bodies with several temperatures: faces, gradients, textures.

use super::*;

#[test]
fn each_face_has_its_own_temperature() {
    let place = [2000.0, 3000.0, 0.0];
    let thing = |celsius: f64| object("thing", place, [600.0, 400.0, 900.0], 0.0, celsius);
    // From straight above only the top is seen.
    let top = with(&format!(
        "{}faces_c = {{ top = 35, left = 90 }}\n",
        thing(22.0)
    ));
    assert_same(&top, 0.0, &with(&thing(35.0)), 1e-9);
    let others = "left = 90, right = 91, front = 92, back = 93, bottom = 94";
    let rest = with(&format!("{}faces_c = {{ {others} }}\n", thing(35.0)));
    assert_same(&rest, 0.0, &with(&thing(35.0)), 1e-9);
    // From the front only the front is seen, and so on: a side is named by where it faces.
    for (side, position, azimuth) in [
        ("front", "[2000, 500, 450]", 90),
        ("back", "[2000, 5500, 450]", -90),
        ("left", "[100, 3000, 450]", 0),
        ("right", "[3900, 3000, 450]", 180),
    ] {
        let sensor = format!(
            "[[sensor]]\nname = \"s\"\npreset = \"grid-eye\"\nposition_mm = {position}\nelevation_deg = 0\nazimuth_deg = {azimuth}\n"
        );
        let seen = |thing: &str| scene(&format!("{ROOM}{sensor}{thing}"));
        let one = seen(&format!("{}faces_c = {{ {side} = 35 }}\n", thing(22.0)));
        assert_same(&one, 0.0, &seen(&thing(35.0)), 1e-9);
    }
}

#[test]
fn faces_of_other_shapes_have_numbers() {
    let sheets = "[[object]]\nname = \"sheets\"\nposition_mm = [2000, 3000, 500]\ntemperature_c = 22\nshape = \"polyhedron\"\n\
         vertices_mm = [[-900, -300, 0], [-100, -300, 0], [-100, 300, 0], [-900, 300, 0], [100, -300, 0], [900, -300, 0], [900, 300, 0], [100, 300, 0]]\n\
         faces = [[0, 1, 2, 3], [4, 5, 6, 7]]\n";
    let found = with(&format!("{sheets}faces_c = {{ 1 = 31 }}\n"));
    let plates = [(-500.0, 22.0), (500.0, 31.0)].map(|(x, celsius)| {
        let place = [2000.0 + x, 3000.0, 499.9];
        object(&format!("{x}"), place, [800.0, 600.0, 0.1], 0.0, celsius)
    });
    assert_same(&found, 0.0, &with(&plates.concat()), 1e-9);
}

/// 5 °C per meter on a plate of 2 m is 10 °C; the plate is also built of 400 plates, each with its own temperature.
#[test]
fn a_gradient_is_off_by_no_more_than_half_a_strip() {
    let plate = |yaw_deg: f64| {
        object(
            "plate",
            [2000.0, 3000.0, 700.0],
            [2000.0, 1000.0, 20.0],
            yaw_deg,
            26.0,
        )
    };
    let gradient =
        |keys: &str, yaw_deg: f64| with(&format!("{}gradient_c_per_m = {keys}\n", plate(yaw_deg)));
    let slices = |across_x: bool, sign: f64| {
        let slice = |index: u32| {
            let share = (f64::from(index) + 0.5) / 400.0 - 0.5;
            let celsius = 26.0 + sign * 10.0 * share;
            let (place, size) = if across_x {
                (
                    [2000.0 + 2000.0 * share, 3000.0, 700.0],
                    [5.0, 1000.0, 20.0],
                )
            } else {
                (
                    [2000.0, 3000.0 + 2000.0 * share, 700.0],
                    [1000.0, 5.0, 20.0],
                )
            };
            object(&format!("slice {index}"), place, size, 0.0, celsius)
        };
        with(&(0..400).map(slice).collect::<String>())
    };
    // The law weakens the temperature from 2 m away, and a pixel sees many strips: half a strip, 0.05 °C, averages out.
    assert_same(&gradient("[5, 0, 0]", 0.0), 0.0, &slices(true, 1.0), 0.004);
    assert_same(
        &gradient("[-5, 0, 0]", 0.0),
        0.0,
        &slices(true, -1.0),
        0.004,
    );
    // The gradient rotates with the body.
    assert_same(&gradient("[5, 0, 0]", 90.0), 0.0, &slices(false, 1.0), 0.02);
}

pub(super) fn texture(keys: &str) -> String {
    let plate = object(
        "plate",
        [2000.0, 3000.0, 700.0],
        [1500.0, 1000.0, 20.0],
        0.0,
        25.0,
    );
    format!("{plate}{keys}")
}

/// The same cells as separate plates: 3 across, 2 down, the first row at the back.
fn cells(celsius: [[f64; 3]; 2]) -> String {
    let mut plates = String::new();
    for (row, line) in celsius.iter().enumerate() {
        for (column, celsius) in line.iter().enumerate() {
            let place = [
                1500.0 + 500.0 * column as f64,
                3250.0 - 500.0 * row as f64,
                700.0,
            ];
            plates += &object(
                &format!("{row} {column}"),
                place,
                [500.0, 500.0, 20.0],
                0.0,
                *celsius,
            );
        }
    }
    plates
}

#[test]
fn a_texture_is_its_cells() {
    let grid = [[24.0, 26.0, 28.0], [30.0, 25.0, 22.0]];
    let keys = "texture_c = [[24, 26, 28], [30, 25, 22]]\n";
    assert_same(&with(&texture(keys)), 0.0, &with(&cells(grid)), 1e-9);
    let on_top = with(&texture(&format!(
        "{keys}texture_on = \"top\"\ntexture_filter = \"nearest\"\n"
    )));
    assert_same(&on_top, 0.0, &with(&cells(grid)), 0.01);
    // Rotated by half a turn, the first row is at the front and the first column at the right.
    let turned = texture(keys).replace("yaw_deg = 0.0", "yaw_deg = 180");
    let grid = [[22.0, 25.0, 30.0], [28.0, 26.0, 24.0]];
    assert_same(&with(&turned), 0.0, &with(&cells(grid)), 1e-9);
}

#[test]
fn a_texture_on_a_side_looks_right_from_in_front_of_it() {
    for (side, place, azimuth_deg, size_mm) in [
        ("front", "2000, 1000", 90, [1600.0, 400.0, 1600.0]),
        ("back", "2000, 5000", -90, [1600.0, 400.0, 1600.0]),
        ("left", "20, 3000", 0, [1000.0, 1600.0, 1600.0]),
        ("right", "3980, 3000", 180, [1000.0, 1600.0, 1600.0]),
    ] {
        let sensor = format!(
            "[[sensor]]\nname = \"s\"\npreset = \"grid-eye\"\nposition_mm = [{place}, 1000]\nelevation_deg = 0\nazimuth_deg = {azimuth_deg}\n"
        );
        let thing = object("thing", [2000.0, 3000.0, 200.0], size_mm, 0.0, 20.1);
        let keys = format!("texture_on = \"{side}\"\ntexture_c = [[30, 20.1], [20.1, 24]]\n");
        assert_top_left_is_warm(&scene(&format!("{ROOM}{sensor}{thing}{keys}")), side);
    }
}

fn assert_top_left_is_warm(scene: &Scene, side: &str) {
    for celsius in pictures(scene, 0.0) {
        let (top_left, bottom_right) = (celsius[2 * 8 + 2], celsius[5 * 8 + 5]);
        assert!(
            top_left > bottom_right + 0.5 && bottom_right > 20.5,
            "{side}: {celsius:?}"
        );
        assert!(
            (celsius[2 * 8 + 5] - 20.1).abs() < 0.01 && (celsius[5 * 8 + 2] - 20.1).abs() < 0.01
        );
    }
}

#[test]
fn between_cells_temperatures_are_interpolated() {
    // Constant to the middle of the outer cells, linear between: 20.1, 26.1, 23.1 °C at -500, 0 and 500 mm.
    let keys = "texture_filter = \"bilinear\"\ntexture_c = [[20.1, 26.1, 23.1]]\n";
    let slices: String = (0..300)
        .map(|index| {
            let x = -750.0 + 5.0 * (f64::from(index) + 0.5);
            let celsius = match x {
                ..-500.0 => 20.1,
                ..0.0 => 20.1 + 6.0 * (x + 500.0) / 500.0,
                ..500.0 => 26.1 - 3.0 * x / 500.0,
                _ => 23.1,
            };
            object(
                &format!("{index}"),
                [2000.0 + x, 3000.0, 700.0],
                [5.0, 1000.0, 20.0],
                0.0,
                celsius,
            )
        })
        .collect();
    assert_same(&with(&texture(keys)), 0.0, &with(&slices), 0.02);
}
