//! Several sensors as one: against closed forms, a system solved by hand, and the scenes of scenario A.

use crate::{ROOM, object, scene};
use grideye_plan::fusion::{ArrayError, Axis, Method, SENSORS_MAX, SensorArray};
use grideye_scene::{Image, Scene, Sensor, Simulator};
use std::time::Duration;

const ALL: [Method; 4] = [
    Method::Mean,
    Method::Interpolation,
    Method::Maximum,
    Method::LeastSquares,
];

/// Sensors under the ceiling, the top of their images at the front; places in millimeters.
fn sensors(places: &[(f64, f64)], resolution: [usize; 2], more: &str) -> String {
    let mut text = ROOM.to_owned();
    for (index, (x, y)) in places.iter().enumerate() {
        text.push_str(&format!(
            "[[sensor]]\nname = \"S{index}\"\npreset = \"grid-eye\"\nresolution = {resolution:?}\nposition_mm = [{x:?}, {y:?}, 2700]\n\
             elevation_deg = 90\nazimuth_deg = -90\noperating_distance_mm = 2000\n{more}"
        ));
    }
    text
}

/// Eq. 7 for 60 degrees and 2 m, in millimeters.
fn spacing_mm(pixels: usize, factor: usize) -> f64 {
    4000.0 * (1.0 / 3.0_f64.sqrt()) / (pixels * factor) as f64
}

fn grid(across: usize, down: usize, step_mm: (f64, f64)) -> Vec<(f64, f64)> {
    let places = (0..down).flat_map(|row| (0..across).map(move |column| (column, row)));
    // Right is left in these images, and the front is at the top.
    places
        .map(|(column, row)| {
            (
                2000.0 - column as f64 * step_mm.0,
                3000.0 + row as f64 * step_mm.1,
            )
        })
        .collect()
}

fn array(scene: &Scene) -> Result<SensorArray, ArrayError> {
    let sensors: Vec<&Sensor> = scene.sensors().iter().collect();
    SensorArray::new(&sensors)
}

fn frames(scene: &Scene, seed: Option<u64>) -> Vec<Image> {
    let frame = |sensor: &Sensor| {
        let simulator = Simulator::new(scene, &sensor.name).unwrap();
        match seed {
            None => simulator.image(Duration::ZERO),
            Some(seed) => simulator.noisy(Duration::ZERO, seed),
        }
    };
    scene.sensors().iter().map(frame).collect()
}

fn rmse(one: &Image, other: &Image) -> f64 {
    assert_eq!((one.columns, one.rows), (other.columns, other.rows));
    let squares = one
        .celsius
        .iter()
        .zip(&other.celsius)
        .map(|(one, other)| (one - other).powi(2));
    (squares.sum::<f64>() / one.celsius.len() as f64).sqrt()
}

#[test]
fn the_papers_array_has_its_spacing_and_cell_counts() {
    let step = spacing_mm(8, 3);
    assert!((step - 96.225).abs() < 1e-3, "the paper: 9.6 cm");
    assert!(
        (spacing_mm(8, 2) - 144.338).abs() < 1e-3,
        "the paper: 14.4 cm"
    );
    let nine = scene(&sensors(&grid(3, 3, (step, spacing_mm(8, 2))), [8, 8], ""));
    let array = array(&nine).unwrap();
    let (across, down) = (array.across(), array.down());
    assert_eq!(
        (across.factor, across.sensors, down.factor, down.sensors),
        (3, 3, 2, 3)
    );
    assert_eq!((across.union_cells(), down.union_cells()), (26, 18));
    assert_eq!((across.covered_cells(), down.covered_cells()), (22, 14));
    let coverage = array.coverage();
    assert_eq!(coverage.len(), 26 * 18);
    assert_eq!(
        (coverage[0], coverage[1], coverage[2], coverage[26 + 1]),
        (1, 2, 3, 4)
    );
    assert_eq!(
        coverage.iter().filter(|sensors| **sensors == 9).count(),
        22 * 14
    );
    // Each sensor has 24 x 16 cells in view.
    assert_eq!(coverage.iter().sum::<usize>(), 9 * 24 * 16);
    let middle = array.virtual_sensor().pose.position_m;
    assert!(middle.abs_diff_eq(
        glam::DVec3::new(2.0 - step / 1000.0, 3.0 + spacing_mm(8, 2) / 1000.0, 2.7),
        1e-9
    ));
}

#[test]
fn all_but_the_sharpening_method_leave_one_sensor_unchanged() {
    let text = sensors(&[(2000.0, 3000.0)], [8, 8], "")
        + &object(
            "lamp",
            [2100.0, 3200.0, 600.0],
            [400.0, 300.0, 100.0],
            20.0,
            40.0,
        );
    let scene = scene(&text);
    let array = array(&scene).unwrap();
    let frames = frames(&scene, Some(3));
    for method in [Method::Mean, Method::Maximum, Method::Interpolation] {
        assert_eq!(array.fuse(method, &frames, 0.2), frames[0], "{method:?}");
    }
}

#[test]
fn every_method_keeps_equal_frames() {
    let step = spacing_mm(8, 3);
    let scene = scene(&sensors(&grid(3, 3, (step, step)), [8, 8], ""));
    let array = array(&scene).unwrap();
    let frames = vec![
        Image {
            columns: 8,
            rows: 8,
            celsius: vec![21.25; 64]
        };
        9
    ];
    for method in ALL {
        let fused = array.fuse(method, &frames, 0.2);
        assert_eq!((fused.columns, fused.rows), (26, 26));
        assert!(
            fused
                .celsius
                .iter()
                .all(|celsius| (celsius - 21.25).abs() < 1e-9),
            "{method:?}"
        );
    }
}

/// The paper's Figure 23: four sensors of 2 x 2 pixels, offset by one pixel, make 3 x 3 cells.
#[test]
fn four_sensors_of_two_by_two_pixels_are_figure_23() {
    let step = spacing_mm(2, 1);
    let scene = scene(&sensors(&grid(2, 2, (step, step)), [2, 2], ""));
    let array = array(&scene).unwrap();
    let frame = |celsius: [f64; 4]| Image {
        columns: 2,
        rows: 2,
        celsius: celsius.to_vec(),
    };
    let frames = [
        frame([1.0, 2.0, 3.0, 4.0]),
        frame([10.0, 20.0, 30.0, 40.0]),
        frame([100.0, 200.0, 300.0, 400.0]),
        frame([1000.0, 2000.0, 3000.0, 4000.0]),
    ];
    let mean = array.fuse(Method::Mean, &frames, 0.2);
    let expected = [
        1.0,
        (2.0 + 10.0) / 2.0,
        20.0,
        (3.0 + 100.0) / 2.0,
        (4.0 + 30.0 + 200.0 + 1000.0) / 4.0,
        (40.0 + 2000.0) / 2.0,
        300.0,
        (400.0 + 3000.0) / 2.0,
        4000.0,
    ];
    assert_eq!(mean.celsius, expected);
    let warmest = array.fuse(Method::Maximum, &frames, 0.2);
    assert_eq!(
        warmest.celsius,
        [
            1.0, 10.0, 20.0, 100.0, 1000.0, 2000.0, 300.0, 3000.0, 4000.0
        ]
    );
    // Pixels of several sensors share a center here, so interpolation is the mean.
    let between = array.fuse(Method::Interpolation, &frames, 0.2);
    for (found, expected) in between.celsius.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-9);
    }
    assert_eq!(array.coverage(), [1, 2, 1, 2, 4, 2, 1, 2, 1]);
}

/// One pixel of two cells, twice, one cell apart, by hand. Folded at its edges each pixel is the mean of its two cells,
/// so with pixels p and q and weights w of the two steps the cells a, b, c solve (a + b)/4 + w(a - b) = p/2, (a + 2b +
/// c)/4 + w(2b - a - c) = (p + q)/2, (b + c)/4 + w(c - b) = q/2.
#[test]
fn a_small_system_solved_by_hand() {
    let step = spacing_mm(1, 2);
    let scene = scene(&sensors(&grid(2, 1, (step, step)), [1, 1], ""));
    let array = array(&scene).unwrap();
    let frame = |celsius: f64| Image {
        columns: 1,
        rows: 1,
        celsius: vec![celsius],
    };
    let (p, q) = (20.0, 26.0);
    let fused = array.fuse(Method::LeastSquares, &[frame(p), frame(q)], 0.2);
    assert_eq!((fused.columns, fused.rows), (3, 1));
    // By symmetry b is the mean, (p + q)/2 = 23, and a = b - e, c = b + e; the first line then reads (2b - e)/4 - w e =
    // p/2, so e (1/2 + 2w) = b - p. The weight is 0.2² / (0.5 e), so e = 2 (b - p) - 4 * 0.2² / 0.5.
    let e = 6.0 - 4.0 * 0.04 / 0.5;
    for (found, expected) in fused.celsius.iter().zip([23.0 - e, 23.0, 23.0 + e]) {
        assert!(
            (found - expected).abs() < 1e-9,
            "{found}, expected {expected}"
        );
    }
}

#[test]
fn only_least_squares_recovers_objects_in_the_plane() {
    let step = spacing_mm(8, 3);
    // Thin plates, 2 m below the sensors; weak enough that the law's change with distance is small.
    let text = sensors(&grid(3, 3, (step, step)), [8, 8], "")
        + &object(
            "one",
            [1800.0, 3000.0, 699.0],
            [300.0, 900.0, 1.0],
            0.0,
            30.0,
        )
        + &object(
            "two",
            [2200.0, 3300.0, 699.0],
            [150.0, 150.0, 1.0],
            30.0,
            35.0,
        );
    let scene = scene(&text);
    let array = array(&scene).unwrap();
    let truth = array.truth(&scene).unwrap().image(Duration::ZERO);
    let error = |seed| {
        let frames = frames(&scene, seed);
        ALL.map(|method| {
            rmse(
                &array.fuse(method, &frames, if seed.is_some() { 0.2 } else { 0.0 }),
                &truth,
            )
        })
    };
    let [mean, interpolation, maximum, least_squares] = error(None);
    assert!(
        least_squares < 0.35 * mean,
        "{least_squares} against {mean}"
    );
    assert!(
        interpolation < mean && mean < maximum,
        "{interpolation} {mean} {maximum}"
    );
    let [mean, .., least_squares] = error(Some(7));
    assert!(
        least_squares < 0.95 * mean,
        "also with noise: {least_squares} against {mean}"
    );
}

#[test]
fn the_truth_is_centered_and_not_shifted() {
    // A warm plate to the room's right of the array's center appears left in the image.
    let step = spacing_mm(8, 3);
    let text = sensors(&grid(3, 3, (step, step)), [8, 8], "")
        + &object(
            "plate",
            [2400.0, 3000.0, 690.0],
            [100.0, 100.0, 10.0],
            0.0,
            60.0,
        );
    let scene = scene(&text);
    let array = array(&scene).unwrap();
    let truth = array.truth(&scene).unwrap().image(Duration::ZERO);
    let fused = array.fuse(Method::LeastSquares, &frames(&scene, None), 0.0);
    let warmest = |image: &Image| {
        (0..26 * 26)
            .max_by(|one, other| image.celsius[*one].total_cmp(&image.celsius[*other]))
            .unwrap()
    };
    assert_eq!(warmest(&truth), warmest(&fused));
    // 2400 mm is 496 mm from the center at 1903.8, 5.2 cells of 96.2 mm left of column 13.
    assert_eq!(warmest(&truth) % 26, 7);
    // 3000 mm is 96 mm, one cell, in front of the center at 3096: the row above the middle.
    assert!(
        (11..=12).contains(&(warmest(&truth) / 26)),
        "{}",
        warmest(&truth) / 26
    );
}

#[test]
fn invalid_arrays_are_refused_with_the_reason() {
    let step = spacing_mm(8, 3);
    let refused = |text: &str| array(&scene(text)).unwrap_err().to_string();
    let wrong = refused(&sensors(&grid(3, 1, (80.0, 0.0)), [8, 8], ""));
    assert_eq!(
        wrong,
        "sensors are 80 mm apart across, expected 72.17 mm at an operating distance of 2000 mm for a factor of 4 (Eq. 7)\n\
         hint: move the sensors, or set operating_distance_mm to their intended distance"
    );
    let mut uneven = grid(3, 1, (step, 0.0));
    uneven[1].0 += 20.0;
    let wrong = refused(&sensors(&uneven, [8, 8], ""));
    assert!(wrong.contains(" mm apart across"), "{wrong}");
    let mut hole = grid(2, 2, (step, step));
    hole.pop();
    let wrong = refused(&sensors(&hole, [8, 8], ""));
    let no_grid = "3 sensors are not in a grid of 2 x 2 places\n";
    assert!(wrong.starts_with(no_grid), "{wrong}");
    let twice = [(2000.0, 3000.0), (2000.0, 3000.0)];
    let wrong = refused(&sensors(&twice, [8, 8], ""));
    assert!(wrong.contains("sensors are not in a grid"), "{wrong}");

    let two = sensors(&grid(2, 1, (step, 0.0)), [8, 8], "");
    for (from, to, what) in [
        ("resolution = [8, 8]", "resolution = [8, 4]", "resolution"),
        ("azimuth_deg = -90", "azimuth_deg = 90", "its angles"),
        (
            "2700]\nelevation",
            "2600]\nelevation",
            "its place along the axis of view",
        ),
        (
            "operating_distance_mm = 2000",
            "operating_distance_mm = 2500",
            "operating_distance_mm",
        ),
        (
            "preset = \"grid-eye\"",
            "preset = \"grid-eye-wide\"",
            "fov_deg",
        ),
    ] {
        let last = two.rfind(from).unwrap();
        let text = format!("{}{to}{}", &two[..last], &two[last + from.len()..]);
        let wrong = refused(&text);
        let unlike = format!("sensor `S1` differs from `S0` in {what}\n");
        assert!(wrong.starts_with(&unlike), "{wrong}");
    }
}

#[test]
fn the_limits_of_an_array_are_reached() {
    let refused = |sensors: &[&Sensor]| SensorArray::new(sensors).unwrap_err().to_string();
    assert!(refused(&[]).starts_with("0 sensors, expected 1 to 400\n"));
    let step = spacing_mm(8, 100);
    let most = scene(&sensors(
        &grid(SENSORS_MAX, 1, (step / 10.0, 0.0)),
        [8, 8],
        "",
    ));
    let all: Vec<&Sensor> = most.sensors().iter().collect();
    let more: Vec<&Sensor> = all.iter().copied().chain([all[0]]).collect();
    assert!(refused(&more).starts_with("401 sensors, expected 1 to 400\n"));
    // Two sensors a hundredth of a pixel apart: 8 pixels are 800 cells; 125 times 8 is the maximum.
    let pair = |factor| {
        array(&scene(&sensors(
            &grid(2, 1, (spacing_mm(8, factor), 0.0)),
            [8, 8],
            "",
        )))
    };
    assert_eq!(pair(100).unwrap().across().union_cells(), 801);
    assert_eq!(pair(124).unwrap().across().union_cells(), 993);
    let refused = pair(125).unwrap_err().to_string();
    assert!(refused.starts_with("1001 cells on one axis, expected at most 1000\n"));
}

#[test]
fn eq_8_of_the_paper_in_both_readings() {
    let axis_of = |pixels, factor, sensors| Axis {
        pixels,
        factor,
        sensors,
        spacing_m: 0.0,
        spacing_by_eq_7_m: 0.0,
    };
    let axis = axis_of(8, 3, 3);
    assert_eq!((axis.union_cells(), axis.covered_cells()), (26, 22));
    let axis = axis_of(2, 2, 2);
    assert_eq!((axis.union_cells(), axis.covered_cells()), (5, 3));
    assert_eq!(axis_of(2, 1, 5).covered_cells(), 0);
}
