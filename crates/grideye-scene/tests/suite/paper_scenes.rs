//! The paper's experiment 5 as a scene file, and the tables of cells that it needs.

use crate::{ROOM, parse, scene};
use grideye_scene::{Scene, Simulator, Warning, limits};
use std::path::Path;
use std::time::Duration;

fn shipped(name: &str) -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let files = |relative: &str| std::fs::read_to_string(folder.join(relative));
    let text = std::fs::read_to_string(folder.join(name)).unwrap();
    Scene::parse(&text, name, &files)
        .unwrap_or_else(|error| panic!("{error}"))
        .scene
}

/// The rule in the head of `experiment-5.toml`.
fn face_c(row: usize, column: usize) -> f64 {
    let u = (column as f64 - 15.5) / 16.0;
    let v = (row as f64 - 16.0) / 16.5;
    let r = (u / 0.72).powi(2) + (v / 0.94).powi(2);
    if r > 1.0 {
        return 23.0;
    }
    let is_eye = [-0.3, 0.3]
        .iter()
        .any(|eye| (u - eye).powi(2) + (v + 0.15).powi(2) <= 0.13 * 0.13);
    let celsius = if u.abs() <= 0.28 && (0.46..=0.56).contains(&v) {
        34.0
    } else if u.abs() <= 0.1 && v > -0.05 && v <= 0.3 {
        30.0
    } else if is_eye {
        34.0
    } else if v < -0.5 {
        27.0
    } else {
        33.0 - 2.5 * r
    };
    (celsius * 2.0 + 0.5).floor() / 2.0
}

#[test]
fn experiment_5_is_a_face_of_1056_cuboids_1200_mm_below_a_lepton() {
    let scene = shipped("experiment-5.toml");
    assert_eq!(scene.objects().len(), 32 * 33);
    let sensor = &scene.sensors()[0];
    assert_eq!(
        (sensor.columns, sensor.rows, sensor.noise_sigma),
        (80, 60, 1.6)
    );
    assert!(
        (sensor.field_of_view_rad.to_array())
            .iter()
            .all(|angle| (angle - 50_f64.to_radians()).abs() < 1e-12)
    );
    let mut bounds: Option<(glam::DVec3, glam::DVec3)> = None;
    for (index, cell) in scene.objects().iter().enumerate() {
        let (row, column) = (index / 32, index % 32);
        assert_eq!(cell.name, format!("face {} {}", row + 1, column + 1));
        assert_eq!(cell.surface.celsius, face_c(row, column), "{row}, {column}");
        let (low, high) = cell.mesh.bounds_m();
        assert!((high - low).abs_diff_eq(glam::DVec3::new(0.009, 0.009, 0.01), 1e-12));
        assert!((sensor.pose.position_m.z - high.z - 1.2).abs() < 1e-12);
        bounds = Some(bounds.map_or((low, high), |(a, b)| (a.min(low), b.max(high))));
    }
    let (low, high) = bounds.unwrap();
    assert!(
        (high - low).abs_diff_eq(glam::DVec3::new(32.0 * 0.009, 33.0 * 0.009, 0.01), 1e-12),
        "no gaps"
    );
    let all = scene.objects().iter().map(|cell| cell.surface.celsius);
    let (coldest, warmest) = all.fold((100.0_f64, 0.0_f64), |(low, high), celsius| {
        (low.min(celsius), high.max(celsius))
    });
    assert_eq!((coldest, warmest), (23.0, 34.0), "the paper's range");
}

#[test]
fn experiment_5s_image_has_the_face_upright_in_its_middle() {
    let scene = shipped("experiment-5.toml");
    let image = Simulator::new(&scene, "camera")
        .unwrap()
        .image(Duration::ZERO);
    // 1.119 m across for 80 pixels: 20.6 pixels for 288 mm; and 60 for as much: 15.9 for 297 mm.
    let warm: Vec<(usize, usize)> = (0..80 * 60)
        .filter(|pixel| image.celsius[*pixel] > 23.3)
        .map(|pixel| (pixel / 80, pixel % 80))
        .collect();
    let rows = warm.iter().map(|(row, _)| *row);
    let columns = warm.iter().map(|(_, column)| *column);
    assert!(rows.clone().min().unwrap() >= 21 && rows.clone().max().unwrap() <= 38);
    assert!(columns.clone().min().unwrap() >= 29 && columns.clone().max().unwrap() <= 50);
    assert!(rows.clone().max().unwrap() - rows.min().unwrap() >= 13);
    // The hair is cool and at the top, the mouth warm and below the middle.
    assert!(image.at(24, 40) < image.at(34, 40) && image.at(34, 40) > image.at(31, 40));
}

#[test]
fn a_mosaic_equals_its_cuboids() {
    let lens = "[[sensor]]\nname = \"s\"\npreset = \"grid-eye\"\nposition_mm = [2000, 3000, 2700]\nelevation_deg = 90\nazimuth_deg = 90\n";
    let mosaic = format!(
        "{ROOM}{lens}[[mosaic]]\nname = \"plate\"\nposition_mm = [2000, 3100, 500]\nsize_mm = [300, 200, 20]\n\
         temperatures_c = [[25, 30.5], [35, 40], [45, 50]]\nemissivity = 0.9\ncolor = \"#102030\"\n"
    );
    let mut by_hand = format!("{ROOM}{lens}");
    for (name, x, y, celsius) in [
        ("plate 1 1", 1850, 3300, 25.0),
        ("plate 1 2", 2150, 3300, 30.5),
        ("plate 2 1", 1850, 3100, 35.0),
        ("plate 2 2", 2150, 3100, 40.0),
        ("plate 3 1", 1850, 2900, 45.0),
        ("plate 3 2", 2150, 2900, 50.0),
    ] {
        by_hand.push_str(&format!(
            "[[object]]\nname = \"{name}\"\nposition_mm = [{x}, {y}, 500]\nsize_mm = [300, 200, 20]\ntemperature_c = {celsius:?}\nemissivity = 0.9\ncolor = \"#102030\"\n"
        ));
    }
    let picture = |text: &str| {
        Simulator::new(&scene(text), "s")
            .unwrap()
            .image(Duration::ZERO)
    };
    let (one, other) = (picture(&mosaic), picture(&by_hand));
    for (one, other) in one.celsius.iter().zip(&other.celsius) {
        assert!((one - other).abs() < 1e-9);
    }
    let names = |text: &str| {
        scene(text)
            .objects()
            .iter()
            .map(|body| (body.name.clone(), body.color))
            .collect::<Vec<_>>()
    };
    assert_eq!(names(&mosaic), names(&by_hand));
}

#[test]
fn cells_beyond_the_room_are_removed_one_by_one() {
    let loaded = parse(&format!(
        "{ROOM}[[mosaic]]\nname = \"rug\"\nposition_mm = [100, 3000, 0]\nsize_mm = [200, 200, 10]\ntemperatures_c = [[21, 22]]\n"
    )).unwrap();
    // Two cells of 200 mm about x = 100: from -100 to 100 and from 100 to 300.
    assert_eq!(loaded.scene.objects().len(), 1);
    assert_eq!(loaded.scene.objects()[0].surface.celsius, 22.0);
    assert!(
        matches!(&loaded.warnings[..], [Warning::ObjectOutsideRoom { name, .. }] if name == "rug 1 1")
    );
}

#[test]
fn an_invalid_mosaic_is_refused_with_its_place() {
    let refused = |temperatures: &str| {
        parse(&format!(
            "{ROOM}[[mosaic]]\nname = \"rug\"\nposition_mm = [2000, 3000, 0]\nsize_mm = [9, 9, 10]\ntemperatures_c = {temperatures}\n"
        )).unwrap_err().to_string()
    };
    for wrong in ["[[21, 22], [23]]", "[]", "[[]]"] {
        let message = refused(wrong);
        assert!(
            message.starts_with("room.toml:8:") && message.contains("`temperatures_c`"),
            "{message}"
        );
        assert!(
            message.contains("rows of numbers, each as long as the first")
                && message.contains("hint: "),
            "{message}"
        );
    }
    let message = refused("[[21, -300]]");
    assert!(
        message.starts_with("room.toml:8:24")
            && message.contains("-300")
            && message.contains("°C above absolute zero"),
        "{message}"
    );
    assert!(refused("[[21, \"warm\"]]").contains("a number"));
    let message = parse(&format!(
        "{ROOM}[[object]]\nname = \"rug\"\nposition_mm = [100, 100, 0]\nsize_mm = [9, 9, 10]\n\
         [[mosaic]]\nname = \"rug\"\nposition_mm = [2000, 3000, 0]\nsize_mm = [9, 9, 10]\ntemperatures_c = [[21]]\n"
    )).unwrap_err().to_string();
    assert!(
        message.contains("rug") && message.starts_with("room.toml:9:"),
        "{message}"
    );
}

#[test]
fn mosaics_and_objects_share_one_limit() {
    let cells = |count: usize| {
        let row: Vec<String> = (0..count).map(|_| "21".to_owned()).collect();
        format!(
            "{ROOM}[[object]]\nname = \"box\"\nposition_mm = [100, 100, 0]\nsize_mm = [9, 9, 10]\n[[mosaic]]\nname = \"rug\"\nposition_mm = [2000, 3000, 0]\nsize_mm = [0.1, 9, 10]\ntemperatures_c = [[{}]]\n",
            row.join(", ")
        )
    };
    let most = limits::OBJECTS_MAX - 1;
    assert_eq!(scene(&cells(most)).objects().len(), limits::OBJECTS_MAX);
    let message = parse(&cells(most + 1)).unwrap_err().to_string();
    assert!(
        message.contains("10001") && message.contains("10000"),
        "{message}"
    );
}
