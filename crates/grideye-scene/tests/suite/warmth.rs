//! Bodies of several temperatures, bodies that change, and warm prints: against bodies of one temperature each, and
//! against closed forms.

use crate::{CEILING, ROOM, object, parse, scene};
use grideye_scene::{Scene, Simulator, limits};
use std::collections::BTreeMap;
use std::time::Duration;

fn seconds(seconds: f64) -> Duration {
    Duration::from_secs_f64(seconds)
}

/// What either way of making frames says of a scene.
fn pictures(scene: &Scene, at_s: f64) -> [Vec<f64>; 2] {
    let name = &scene.sensors()[0].name;
    let simulators = [
        Simulator::new(scene, name).unwrap(),
        Simulator::without_grid(scene, name).unwrap(),
    ];
    simulators.map(|simulator| simulator.image(seconds(at_s)).celsius)
}

fn assert_same(found: &Scene, at_s: f64, expected: &Scene, within_c: f64) {
    let pairs = pictures(found, at_s)
        .into_iter()
        .zip(pictures(expected, 0.0));
    // Without a grid integrals are taken piece by piece, and their rule is not exact on pieces of another shape.
    for ((way, (found, expected)), rule_c) in pairs.enumerate().zip([0.0, 3e-5]) {
        let ambient_c = 20.1;
        assert!(
            expected
                .iter()
                .any(|celsius| (celsius - ambient_c).abs() > 0.05),
            "there is something to be seen"
        );
        for (pixel, (found, expected)) in found.iter().zip(&expected).enumerate() {
            assert!(
                (found - expected).abs() <= within_c + rule_c,
                "way {way}, pixel {pixel}: {found} instead of {expected}"
            );
        }
    }
}

fn with(things: &str) -> Scene {
    scene(&format!("{ROOM}{CEILING}{things}"))
}

#[test]
fn each_face_has_its_own_temperature() {
    let place = [2000.0, 3000.0, 0.0];
    let thing = |celsius: f64| object("thing", place, [600.0, 400.0, 900.0], 0.0, celsius);
    // From straight above nothing but the top is seen.
    let top = with(&format!(
        "{}faces_c = {{ top = 35, left = 90 }}\n",
        thing(22.0)
    ));
    assert_same(&top, 0.0, &with(&thing(35.0)), 1e-9);
    let others = "left = 90, right = 91, front = 92, back = 93, bottom = 94";
    let rest = with(&format!("{}faces_c = {{ {others} }}\n", thing(35.0)));
    assert_same(&rest, 0.0, &with(&thing(35.0)), 1e-9);
    // From the front nothing but the front is, and so on: the name of a side is where it looks.
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

/// 5 °C a metre on a plate of 2 m is 10 °C; the plate is also built of 400 plates, each with its own temperature.
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
    // The law weakens what is seen from 2 m away, and a pixel sees many strips: half a strip, 0.05 °C, evens out.
    assert_same(&gradient("[5, 0, 0]", 0.0), 0.0, &slices(true, 1.0), 0.004);
    assert_same(
        &gradient("[-5, 0, 0]", 0.0),
        0.0,
        &slices(true, -1.0),
        0.004,
    );
    // The gradient turns with the body.
    assert_same(&gradient("[5, 0, 0]", 90.0), 0.0, &slices(false, 1.0), 0.02);
}

fn texture(keys: &str) -> String {
    let plate = object(
        "plate",
        [2000.0, 3000.0, 700.0],
        [1500.0, 1000.0, 20.0],
        0.0,
        25.0,
    );
    format!("{plate}{keys}")
}

/// The same cells as plates of their own: 3 across, 2 down, the first row at the back.
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
    // Turned by half a turn, the first row is at the front and the first column at the right.
    let turned = texture(keys).replace("yaw_deg = 0.0", "yaw_deg = 180");
    let grid = [[22.0, 25.0, 30.0], [28.0, 26.0, 24.0]];
    assert_same(&with(&turned), 0.0, &with(&cells(grid)), 1e-9);
}

#[test]
fn a_texture_on_a_side_is_seen_as_one_stands_before_it() {
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
    // Constant to the middle of the outer cells, straight between: 20.1, 26.1, 23.1 °C at -500, 0 and 500 mm.
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

#[test]
fn a_body_warms_up_and_cools_down_as_a_whole() {
    let thing = |celsius: f64| {
        object(
            "thing",
            [2300.0, 3100.0, 300.0],
            [600.0, 400.0, 900.0],
            30.0,
            celsius,
        )
    };
    // Before it stands a cold agent, behind it a warm object: the changing one hides and is hidden.
    let others = format!(
        "{}{}",
        object(
            "agent",
            [2200.0, 3100.0, 1400.0],
            [300.0, 300.0, 300.0],
            0.0,
            15.0
        )
        .replace("[[object]]", "[[agent]]"),
        object(
            "plate",
            [2300.0, 3000.0, 0.0],
            [1500.0, 1500.0, 20.0],
            0.0,
            40.0
        ),
    );
    let cooling = with(&format!("{}time_constant_s = 600\n{others}", thing(60.1)));
    let heated = with(&format!(
        "{}time_constant_s = 600\npower_w = 500\nheat_capacity_j_per_k = 10000\non_s = [[300, 900]]\n{others}",
        thing(20.1)
    ));
    for at_s in [0.0, 300.0, 1200.0] {
        let celsius = 20.1 + 40.0 * (-at_s / 600.0_f64).exp();
        assert_same(
            &cooling,
            at_s,
            &with(&format!("{}{others}", thing(celsius))),
            1e-9,
        );
    }
    // 500 W x 600 s / 10000 J/K = 30 °C in the end.
    for (at_s, excess_c) in [
        (0.0, 0.0),
        (600.0, 30.0 * (1.0 - (-0.5_f64).exp())),
        (1500.0, 30.0 * (1.0 - (-1.0_f64).exp()) * (-1.0_f64).exp()),
    ] {
        assert_same(
            &heated,
            at_s,
            &with(&format!("{}{others}", thing(20.1 + excess_c))),
            1e-9,
        );
    }
    let simulator = Simulator::new(&cooling, "ceiling").unwrap();
    let alone = Simulator::new(&with(&format!("{}{others}", thing(30.0))), "ceiling").unwrap();
    assert_eq!(
        simulator.truth(seconds(10.0)),
        alone.truth(Duration::ZERO),
        "what changes is nobody"
    );
}

#[test]
fn a_part_that_changes_is_seen_to_change_where_it_is() {
    let part = "[[agent]]\nname = \"a\"\nposition_mm = [2000, 3000, 0]\n[[agent.part]]\nname = \"cup\"\nposition_mm = [100, 0, 900]\nsize_mm = [300, 300, 300]\ntemperature_c = 80\ntime_constant_s = 100\n";
    let cup = object(
        "cup",
        [2100.0, 3000.0, 900.0],
        [300.0; 3],
        0.0,
        20.1 + 59.9 * (-2.0_f64).exp(),
    );
    assert_same(&with(part), 200.0, &with(&cup), 1e-9);
}

fn sofa_scene(material: &str, walk: &str, keys: &str) -> Scene {
    let sofa = object(
        "sofa",
        [2000.0, 3000.0, 0.0],
        [2200.0, 900.0, 450.0],
        0.0,
        20.1,
    );
    let text = format!(
        "{ROOM}{CEILING}{sofa}material = {material:?}\n[[agent]]\nname = \"a\"\nsize_mm = [800, 500, 250]\ntemperature_c = 30.1\ntrajectory = \"w.csv\"\n{keys}"
    );
    let files = BTreeMap::from([("w.csv".to_owned(), walk.to_owned())]);
    Scene::parse(&text, "room.toml", &files)
        .unwrap_or_else(|error| panic!("{error}"))
        .scene
}

/// Away at a time at once, to a corner that is out of view.
fn leaves_after(contact_s: f64) -> String {
    format!(
        "t_s,x_mm,y_mm,z_mm,dwell_s\n0,2000,3000,450,{contact_s}\n{},500,600,450,0\n",
        contact_s + 0.001
    )
}

#[test]
fn a_print_fades_by_the_formula() {
    // (2/π) asin(√(tc / t)) · exp(x) erfc(√x) with x = (t - tc) / fading, by Python's math module.
    for (material, contact_s, after_s, share) in [
        ("wood", 60.0, 180.0, WOOD_180),
        ("foam", 30.0, 90.0, FOAM_90),
        ("textile", 600.0, 300.0, TEXTILE_300),
    ] {
        let left = sofa_scene(material, &leaves_after(contact_s), "");
        let sofa = object(
            "sofa",
            [2000.0, 3000.0, 0.0],
            [2200.0, 900.0, 450.0],
            0.0,
            20.1,
        );
        let print = object(
            "print",
            [2000.0, 3000.0, 449.9],
            [800.0, 500.0, 0.11],
            0.0,
            20.1 + 10.0 * share,
        );
        let expected = with(&format!("{sofa}{print}"));
        assert_same(&left, contact_s + after_s, &expected, 1e-3);
    }
}

const WOOD_180: f64 = 0.242906703509;
const FOAM_90: f64 = 0.104031066196;
const TEXTILE_300: f64 = 0.258930283434;

#[test]
fn a_print_is_where_the_body_was_and_only_after_it_was_there() {
    let scene = sofa_scene("textile", &leaves_after(600.0), "");
    let simulator = Simulator::new(&scene, "ceiling").unwrap();
    let bare = sofa_scene(
        "textile",
        "x_mm,y_mm,z_mm\n500,600,450\n",
        "speed_mm_per_s = 1\n",
    );
    let bare = Simulator::new(&bare, "ceiling")
        .unwrap()
        .image(Duration::ZERO);
    let after = simulator.image(seconds(601.0));
    let warmer = |pixel: usize| after.celsius[pixel] - bare.celsius[pixel];
    assert!(warmer(27) > 0.5 && warmer(36) > 0.5, "{after:?}");
    assert!(warmer(24).abs() < 1e-9, "beside it");
    let truth = simulator.truth(seconds(601.0));
    assert!(
        truth.share.iter().all(|share| *share < 1e-9),
        "a print is nobody"
    );
    // Somebody who comes later has left nothing before.
    let later = "t_s,x_mm,y_mm,z_mm,dwell_s\n0,500,600,450,100\n100.001,2000,3000,450,100\n200.1,500,600,450,0\n";
    let later = sofa_scene("textile", later, "");
    let later = Simulator::new(&later, "ceiling").unwrap();
    assert_eq!(later.image(seconds(99.0)).celsius, bare.celsius);
    assert_ne!(later.image(seconds(201.0)).celsius, bare.celsius);
}

#[test]
fn no_print_without_a_material_or_a_contact() {
    let above = leaves_after(600.0).replace(",450,", ",600,");
    let scene = sofa_scene("textile", &above, "");
    let image = Simulator::new(&scene, "ceiling")
        .unwrap()
        .image(seconds(601.0));
    assert!(
        image
            .celsius
            .iter()
            .all(|celsius| (celsius - 20.1).abs() < 1e-9)
    );
}

#[test]
fn no_print_on_top_of_what_stands_over_the_body() {
    // 250 mm of body below a top at 450 mm.
    let below = leaves_after(600.0).replace(",450,", ",0,");
    let scene = sofa_scene("textile", &below, "");
    let image = Simulator::new(&scene, "ceiling")
        .unwrap()
        .image(seconds(601.0));
    let warmest = image.celsius.iter().copied().fold(f64::MIN, f64::max);
    assert!((warmest - 20.1).abs() < 1e-9, "{warmest}");
}

#[test]
fn a_print_on_what_cools_is_warmer_by_what_the_body_was_warmer_when_it_came() {
    // A plate of 60 °C that cools to the room's 20.1 °C in 100 s; a body of 30.1 °C is on it from 50 s to 110 s.
    let plate_c = |at_s: f64| 20.1 + 39.9 * (-at_s / 100.0).exp();
    let plate = |keys: &str, celsius: f64| {
        let size_mm = [2200.0, 900.0, 450.0];
        object("plate", [2000.0, 3000.0, 0.0], size_mm, 0.0, celsius) + keys
    };
    let walk = "t_s,x_mm,y_mm,z_mm,dwell_s\n0,500,600,450,49.999\n50,2000,3000,450,60\n110.001,500,600,450,0\n";
    let text = format!(
        "{ROOM}{CEILING}{}[[agent]]\nname = \"a\"\nsize_mm = [800, 500, 250]\ntemperature_c = 30.1\ntrajectory = \"w.csv\"\n",
        plate("material = \"wood\"\ntime_constant_s = 100\n", 60.0)
    );
    let files = BTreeMap::from([("w.csv".to_owned(), walk.to_owned())]);
    let scene = Scene::parse(&text, "room.toml", &files).unwrap().scene;
    // 180 s after a contact of 60 s: the share that the formula leaves.
    let print_c = plate_c(290.0) + WOOD_180 * (30.1 - plate_c(50.0));
    let print = object(
        "print",
        [2000.0, 3000.0, 449.9],
        [800.0, 500.0, 0.11],
        0.0,
        print_c,
    );
    let expected = with(&format!("{}{print}", plate("", plate_c(290.0))));
    assert_same(&scene, 290.0, &expected, 1e-3);
}

#[test]
fn a_scene_lasts_as_long_as_it_says() {
    let scene = |keys: &str| scene(&format!("{keys}{ROOM}{CEILING}"));
    assert_eq!(
        scene("duration_s = 90\n").duration(),
        Duration::from_secs(90)
    );
    assert!(!scene("duration_s = 90\n").is_static() && scene("").is_static());
    let longer = format!(
        "duration_s = 3\n{ROOM}{CEILING}[[agent]]\nname = \"a\"\nsize_mm = [200, 200, 200]\ntemperature_c = 20\ntrajectory = \"w.csv\"\nspeed_mm_per_s = 100\n"
    );
    let files = BTreeMap::from([(
        "w.csv".to_owned(),
        "x_mm,y_mm,z_mm\n1000,1000,0\n2000,1000,0\n".to_owned(),
    )]);
    let longer = Scene::parse(&longer, "room.toml", &files).unwrap().scene;
    assert_eq!(longer.duration(), Duration::from_secs(10));
}

/// Keys of an object, and how the message begins.
const REFUSED: &[(&str, &str)] = &[
    (
        "faces_c = { top = 30, lid = 31 }\n",
        "room.toml:10:11: `faces_c` is { top = 30, lid = 31 }, expected left, right,",
    ),
    (
        "faces_c = { 0 = 30 }\n",
        "room.toml:10:11: `faces_c` is { 0 = 30 }, expected left, right,",
    ),
    (
        "faces_c = { top = -300 }\n",
        "room.toml:10:19: `temperature_c` is -300, expected °C above",
    ),
    (
        "gradient_c_per_m = [0, 0, 1001]\n",
        "room.toml:10:20: `gradient_c_per_m` is [0, 0, 1001], expected three numbers from -1000",
    ),
    (
        "gradient_c_per_m = [0, 0, nan]\n",
        "room.toml:10:20: `gradient_c_per_m` is [0, 0, nan], expected three numbers from -1000",
    ),
    (
        "gradient_c_per_m = [0, 0, 1]\nfaces_c = { top = 3 }\n",
        "room.toml:4:1: `thing` has both `faces_c` and `gradient_c_per_m`",
    ),
    (
        "texture_c = [[1]]\nfaces_c = { top = 3 }\n",
        "room.toml:4:1: `thing` has both `faces_c` and `texture_c`",
    ),
    (
        "texture_c = []\n",
        "room.toml:10:13: `texture_c` is [], expected rows of the same number",
    ),
    (
        "texture_c = [[]]\n",
        "room.toml:10:13: `texture_c` is [[]], expected rows of the same number",
    ),
    (
        "texture_c = [[1, 2], [3]]\n",
        "room.toml:10:22: `texture_c` is [3], expected rows of the same number",
    ),
    (
        "texture_c = [[1, 6000]]\n",
        "room.toml:10:18: `temperature_c` is 6000, expected °C above",
    ),
    (
        "texture_c = [[1]]\ntexture_on = \"lid\"\n",
        "room.toml:11:14: `texture_on` is \"lid\", expected \"all\", or",
    ),
    (
        "texture_c = [[1]]\ntexture_filter = \"cubic\"\n",
        "room.toml:11:18: `texture_filter` is \"cubic\", expected \"nearest\" or",
    ),
    (
        "texture_on = \"top\"\n",
        "room.toml:4:1: `thing` has no `texture_c`",
    ),
    (
        "texture_filter = \"nearest\"\n",
        "room.toml:4:1: `thing` has no `texture_c`",
    ),
    (
        "time_constant_s = 0\n",
        "room.toml:10:19: `time_constant_s` is 0, expected 0.001",
    ),
    (
        "power_w = 5\n",
        "room.toml:4:1: `thing` has no `time_constant_s`",
    ),
    (
        "time_constant_s = 5\npower_w = 5\n",
        "room.toml:4:1: `thing` has no `heat_capacity_j_per_k`",
    ),
    (
        "time_constant_s = 5\nheat_capacity_j_per_k = 5\n",
        "room.toml:4:1: `thing` has no `power_w`",
    ),
    (
        "time_constant_s = 5\non_s = [[0, 5]]\n",
        "room.toml:4:1: `thing` has no `power_w`",
    ),
    (
        "time_constant_s = 5\npower_w = 1e10\nheat_capacity_j_per_k = 1\n",
        "room.toml:11:11: `power_w` is 1e10, expected",
    ),
    (
        "time_constant_s = 5\npower_w = 5\nheat_capacity_j_per_k = 0\n",
        "room.toml:12:25: `heat_capacity_j_per_k` is 0, expected",
    ),
    (
        "time_constant_s = 5\npower_w = 5\nheat_capacity_j_per_k = 1\non_s = [[5, 9], [8, 12]]\n",
        "room.toml:13:8: `on_s` is [[5, 9], [8, 12]], expected [[from, until], …]",
    ),
    (
        "time_constant_s = 5\npower_w = 5\nheat_capacity_j_per_k = 1\non_s = [[-5, 9]]\n",
        "room.toml:13:8: `on_s` is [[-5, 9]], expected [[from, until], …]",
    ),
    (
        "material = \"steel\"\n",
        "room.toml:10:12: `material` is \"steel\", expected \"foam\", \"textile\" or",
    ),
];

#[test]
fn keys_without_sense_are_refused() {
    let thing = object(
        "thing",
        [2000.0, 3000.0, 0.0],
        [600.0, 400.0, 900.0],
        0.0,
        22.0,
    );
    let refusal = |keys: &str| {
        let text = format!("{ROOM}{thing}{keys}");
        parse(&text).map_or_else(|error| error.to_string(), |_| "accepted".to_owned())
    };
    for (keys, expected) in REFUSED {
        let found = refusal(keys);
        assert!(found.starts_with(expected), "with {keys}: {found}");
        assert!(found.contains("\nhint: "), "{found}");
    }
    let part = "[[agent]]\nname = \"a\"\nposition_mm = [2000, 3000, 0]\n[[agent.part]]\nname = \"p\"\nposition_mm = [0, 0, 0]\nsize_mm = [200, 200, 200]\nmaterial = \"foam\"\n";
    let found = parse(&format!("{ROOM}{part}")).unwrap_err().to_string();
    assert!(
        found.starts_with("room.toml:7:1: part `p` has both `material` and `part`"),
        "{found}"
    );
    let found = parse(&format!("duration_s = -1\n{ROOM}"))
        .unwrap_err()
        .to_string();
    assert!(
        found.starts_with("room.toml:1:14: `duration_s` is -1, expected 0 to 31622400"),
        "{found}"
    );
}

#[test]
fn no_more_cells_or_prints_than_the_limits() {
    let columns = limits::TEXTURE_CELLS_MAX + 1;
    let grid = format!("texture_c = [[{}]]\n", "25, ".repeat(columns));
    let refused = parse(&format!("{ROOM}{}", texture(&grid)))
        .unwrap_err()
        .to_string();
    assert!(
        refused.contains("10001 cells of a texture, expected at most 10000"),
        "{refused}"
    );
    let most = format!("texture_c = [[{}]]\n", "25, ".repeat(columns - 1));
    assert!(parse(&format!("{ROOM}{}", texture(&most))).is_ok());

    let stops = |count: usize| {
        let rows = (0..count).map(|stop| format!("{stop},2000,3000,450,0.5\n"));
        format!("t_s,x_mm,y_mm,z_mm,dwell_s\n{}", rows.collect::<String>())
    };
    let sofa = object(
        "sofa",
        [2000.0, 3000.0, 0.0],
        [2200.0, 900.0, 450.0],
        0.0,
        20.1,
    );
    let body = "[[agent]]\nname = \"a\"\ntrajectory = \"w.csv\"\n";
    let parts: String = (0..100)
        .map(|part| format!("[[agent.part]]\nname = \"{part}\"\nposition_mm = [0, 0, 0]\nsize_mm = [200, 200, 200]\n"))
        .collect();
    let text = format!("{ROOM}{sofa}material = \"foam\"\n{body}{parts}");
    let load = |count: usize| {
        let files = BTreeMap::from([("w.csv".to_owned(), moving(&stops(count)))]);
        Scene::parse(&text, "room.toml", &files)
    };
    let refused = load(101).unwrap_err().to_string();
    assert!(
        refused.contains("10100 warm prints, expected at most 10000"),
        "{refused}"
    );
    assert!(load(100).is_ok());
}

/// Every second stop a millimetre aside, so that each is a stop of its own.
fn moving(walk: &str) -> String {
    let rows = walk.lines().enumerate().map(|(index, row)| {
        let aside = if index % 2 == 0 { "2001" } else { "2000" };
        format!("{}\n", row.replace("2000", aside))
    });
    rows.collect()
}

fn shipped(name: &str) -> Scene {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let files = |name: &str| std::fs::read_to_string(folder.join(name));
    let text = files(name).unwrap();
    Scene::parse(&text, name, &files).unwrap().scene
}

/// The scene's own numbers: 1000 W x 600 s / 15000 J/K.
#[test]
fn the_kitchen_warms_up_and_cools_down() {
    let kitchen = shipped("heating-and-cooling.toml");
    assert_eq!(kitchen.duration(), Duration::from_secs(1800));
    let text = std::fs::read_to_string(
        std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../../scenes/heating-and-cooling.toml"),
    )
    .unwrap();
    let heating = [
        "time_constant_s",
        "power_w",
        "heat_capacity_j_per_k",
        "on_s",
        "temperature_c = 95",
    ];
    for at_s in [0.0_f64, 900.0, 1800.0] {
        let on_s = (at_s.min(1200.0) - 300.0).max(0.0);
        let off_s = (at_s - 1200.0).max(0.0);
        let radiator = 20.0 + 40.0 * (1.0 - (-on_s / 600.0).exp()) * (-off_s / 600.0).exp();
        let kettle = 20.0 + 75.0 * (-at_s / 3600.0).exp();
        let still: String = text
            .lines()
            .filter(|line| !heating.iter().any(|key| line.starts_with(key)))
            .map(|line| match line {
                "name = \"radiator\"" => format!("{line}\ntemperature_c = {radiator:?}\n"),
                "name = \"kettle\"" => format!("{line}\ntemperature_c = {kettle:?}\n"),
                _ => format!("{line}\n"),
            })
            .collect();
        assert_same(&kitchen, at_s, &scene(&still), 1e-9);
    }
}

#[test]
fn the_sofa_stays_warm_for_a_while() {
    let scene = shipped("warm-print.toml");
    let simulator = Simulator::new(&scene, "ceiling").unwrap();
    let warmest = |at_s: f64| {
        let image = simulator.image(seconds(at_s)).celsius;
        [27, 28, 35, 36]
            .map(|pixel| image[pixel] - 20.0)
            .into_iter()
            .fold(0.0, f64::max)
    };
    let (early, late) = (warmest(610.0), warmest(1200.0));
    // The formula's share after 600 s over that after 10 s, by Python's math module; the law is all but linear here.
    assert!(early > 0.4, "{early}");
    assert!((late / early - 0.221531).abs() < 0.02, "{early} {late}");
}

#[test]
fn who_is_near_hides_who_is_far() {
    let both = shipped("two-people.toml");
    let simulator = Simulator::new(&both, "wall").unwrap();
    let exact = Simulator::without_grid(&both, "wall").unwrap();
    let total = |simulator: &Simulator, agent: usize, at_s: f64| -> f64 {
        simulator.truth_of(agent, seconds(at_s)).share.iter().sum()
    };
    for simulator in [&simulator, &exact] {
        // 3 m at 600 mm/s: they cross after 2.5 s. At 1 s each is seen whole: 900 mm from the middle.
        assert!(total(simulator, 0, 2.5) > 1.0);
        assert!(total(simulator, 1, 2.5) < 1e-9, "hidden");
        assert!(total(simulator, 1, 1.2) > 0.3 && total(simulator, 1, 3.8) > 0.3);
        for step in 0..=50 {
            let at = seconds(f64::from(step) / 10.0);
            let (near, far, any) = (
                simulator.truth_of(0, at),
                simulator.truth_of(1, at),
                simulator.truth(at),
            );
            for pixel in 0..64 {
                let sum = near.share[pixel] + far.share[pixel];
                assert!((sum - any.share[pixel]).abs() < 1e-9, "each pixel once");
            }
        }
    }
    // The far one's outline before a pinhole: 0.2 m wide from 4.25 m on, and its side.
    let pixel = (2.0 * (std::f64::consts::PI / 6.0).tan() / 8.0).powi(2);
    let far_only = total(&exact, 1, 3.8) * pixel;
    let x_mm: f64 = 500.0 + 600.0 * 3.8 - 2000.0;
    let (left, right) = ((x_mm - 100.0) / 4750.0, (x_mm + 100.0) / 4250.0);
    // From its feet, 1.2 m below the sensor, to its head, 0.55 m above: the front, and beside it the narrowing side.
    let front = (200.0 / 4250.0) * (1750.0 / 4250.0);
    let side = ((x_mm - 100.0) / 4250.0 - left) * 0.5 * (1750.0 / 4250.0 + 1750.0 / 4750.0);
    assert!(right > left);
    assert!(
        (far_only / (front + side) - 1.0).abs() < 1e-6,
        "{far_only} {}",
        front + side
    );
}
