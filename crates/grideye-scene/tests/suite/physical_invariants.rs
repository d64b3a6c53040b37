//! The physical model for any scene: energy, symmetries, order, no NaN.

use crate::object;
use crate::physical::{CEILING, ROOM, filled, pixels, sensor, share, sheet};

#[test]
fn warmer_things_make_no_pixel_colder() {
    let seen = |celsius| {
        let thing = object(
            "thing",
            [2100.0, 1800.0, 200.0],
            [500.0, 300.0, 900.0],
            33.0,
            celsius,
        );
        let wall = object(
            "wall",
            [1700.0, 2000.0, 0.0],
            [100.0, 900.0, 800.0],
            0.0,
            26.0,
        );
        pixels(&format!("{ROOM}{thing}{wall}{CEILING}"))
    };
    let mut before = seen(-40.0);
    for celsius in [0.0, 19.0, 20.0, 25.0, 60.0, 300.0] {
        let now = seen(celsius);
        assert!(
            now.iter()
                .zip(&before)
                .all(|(now, before)| *now >= *before - 1e-9)
        );
        assert!(now.iter().sum::<f64>() > before.iter().sum::<f64>());
        before = now;
    }
}

/// A narrow image of many pixels, where a blur changes only where radiance falls, not how much.
#[test]
fn a_blur_keeps_the_energy_and_adds_its_width_in_squares() {
    let fine = |blur: &str| {
        let text = format!(
            "{ROOM}{}{}",
            sheet([0.01, -0.02], [0.06, 0.04], 2.0, 60.0, 1.0),
            sensor(&format!(
                "resolution = [41, 41]\nfov_deg = 12\npixel_width_deg = 0.8\n{blur}"
            ))
        );
        let ambient = 293.15_f64.powi(4);
        let excess: Vec<f64> = pixels(&text)
            .iter()
            .map(|celsius| (celsius + 273.15).powi(4) - ambient)
            .collect();
        let total: f64 = excess.iter().sum();
        let degrees = |index: usize| (index as f64 - 20.0) * 12.0 / 41.0;
        let moment = |power: i32, middle: f64| -> f64 {
            excess
                .iter()
                .enumerate()
                .map(|(pixel, excess)| excess * (degrees(pixel % 41) - middle).powi(power))
                .sum::<f64>()
                / total
        };
        let middle = moment(1, 0.0);
        (total, middle, moment(2, middle))
    };
    let sharp = fine("");
    let per_sigma = (8.0 * 2.0_f64.ln()).sqrt();
    for (keys, width_deg) in [
        ("blur_deg = 1.2", 1.2),
        ("blur_deg = [1.2, 0.3]", 1.2),
        ("blur_px = 5", 5.0 * 12.0 / 41.0),
    ] {
        let blurred = fine(keys);
        assert!(
            (blurred.0 / sharp.0 - 1.0).abs() < 2e-3,
            "{keys}: {blurred:?} {sharp:?}"
        );
        assert!((blurred.1 - sharp.1).abs() < 2e-3, "{keys}");
        let added = (blurred.2 - sharp.2) / (width_deg / per_sigma).powi(2);
        assert!((added - 1.0).abs() < 0.01, "{keys}: {added}");
    }
    assert_eq!(fine("blur_px = 0"), sharp);
}

/// The mean square of the distances grows by the share that goes astray times the square of how far.
#[test]
fn a_spill_keeps_the_warmth_and_an_even_image_even() {
    let fine = |object: &str, spill: &str| {
        pixels(&format!(
            "{ROOM}{object}{}",
            sensor(&format!(
                "resolution = [41, 41]\nfov_deg = 12\npixel_width_deg = 0.8\n{spill}"
            ))
        ))
    };
    let spill = "spill = 0.3\nspill_px = 2.5";
    let spot = sheet([0.01, -0.02], [0.06, 0.04], 2.0, 60.0, 1.0);
    let moments = |celsius: Vec<f64>| {
        let excess: Vec<f64> = celsius.iter().map(|celsius| celsius - 20.0).collect();
        let total: f64 = excess.iter().sum();
        let of = |power: i32, middle: f64| {
            let column = |pixel: usize| (pixel % 41) as f64 - middle;
            excess
                .iter()
                .enumerate()
                .map(|(pixel, excess)| excess * column(pixel).powi(power))
                .sum::<f64>()
                / total
        };
        (total, of(1, 0.0), of(2, of(1, 0.0)))
    };
    let (sharp, spilled) = (moments(fine(&spot, "")), moments(fine(&spot, spill)));
    assert!(
        (spilled.0 / sharp.0 - 1.0).abs() < 1e-3,
        "{spilled:?} {sharp:?}"
    );
    assert!((spilled.1 - sharp.1).abs() < 1e-2, "{spilled:?} {sharp:?}");
    assert!(
        ((spilled.2 - sharp.2) / (0.3 * 2.5 * 2.5) - 1.0).abs() < 0.01,
        "{spilled:?} {sharp:?}"
    );
    assert!(
        fine("", spill)
            .iter()
            .all(|celsius| (celsius - 20.0).abs() < 1e-9)
    );
}

#[test]
fn a_pinhole_has_even_steps_and_pixels_as_wide_as_a_step() {
    let pinhole = CEILING.replace("\"grid-eye\"", "\"grid-eye\"\noptics = \"pinhole\"");
    let slope = 30.0_f64.to_radians().tan() / 4.0;
    for pixel in [0, 9, 27, 36, 60] {
        let (column, row) = ((pixel % 8) as f64, (pixel / 8) as f64);
        let at = [(column - 3.5) * slope, (3.5 - row) * slope];
        // A small spot on the axis of the pixel, and the height of the Gaussian there.
        let spot = sheet([2.0 * at[0], 2.0 * at[1]], [0.02, 0.02], 2.0, 60.0, 1.0);
        let found = pixels(&format!("{ROOM}{spot}{pinhole}"));
        let shares = [0, 1].map(|axis| {
            let border = |by: f64| (at[axis] + by).atan();
            let width = border(0.5 * slope) - border(-0.5 * slope);
            share(
                border(-0.005),
                border(0.005),
                at[axis].atan().to_degrees(),
                width.to_degrees(),
            )
        });
        let expected = filled(shares[0] * shares[1], 60.0, 1.0, 20.0);
        assert!(
            (found[pixel] - expected).abs() < 1e-5,
            "{pixel}: {} {expected}",
            found[pixel]
        );
        assert!(
            found
                .iter()
                .enumerate()
                .all(|(other, celsius)| other == pixel || *celsius < found[pixel])
        );
    }
}

#[test]
fn images_turn_and_mirror_with_the_room() {
    let pinhole = CEILING.replace("\"grid-eye\"", "\"grid-eye\"\noptics = \"pinhole\"");
    let at = |x: f64, y: f64, yaw: f64| {
        let one = object(
            "one",
            [2000.0 + x, 2000.0 + y, 0.0],
            [300.0, 500.0, 1200.0],
            yaw,
            33.0,
        );
        let two = object(
            "two",
            [2000.0 - 0.3 * x, 2000.0 + 0.6 * y, 0.0],
            [200.0, 250.0, 1700.0],
            -yaw,
            25.0,
        );
        format!("{one}{two}")
    };
    let seen = pixels(&format!("{ROOM}{}{pinhole}", at(400.0, 250.0, 17.0)));
    let mirrored = pixels(&format!("{ROOM}{}{pinhole}", at(-400.0, 250.0, -17.0)));
    let turned = pixels(&format!("{ROOM}{}{pinhole}", at(-400.0, -250.0, 17.0)));
    let rolled = pixels(&format!(
        "{ROOM}{}{pinhole}pixel_1 = \"bottom-right\"\n",
        at(400.0, 250.0, 17.0)
    ));
    for pixel in 0..64 {
        let (row, column) = (pixel / 8, pixel % 8);
        assert!(
            (seen[pixel] - mirrored[row * 8 + 7 - column]).abs() < 2e-3,
            "{pixel}"
        );
        assert!((seen[pixel] - turned[63 - pixel]).abs() < 2e-3, "{pixel}");
        assert!((seen[pixel] - rolled[63 - pixel]).abs() < 2e-3, "{pixel}");
    }
    // In both models the key has the same meaning.
    let paper = |keys: &str| {
        pixels(&format!(
            "{}{}{pinhole}{keys}",
            ROOM.replace("physical", "paper"),
            at(400.0, 250.0, 17.0)
        ))
    };
    let (usual, rolled) = (paper(""), paper("pixel_1 = \"bottom-right\"\n"));
    assert!((0..64).all(|pixel| (usual[pixel] - rolled[63 - pixel]).abs() < 1e-9));
    assert_eq!(paper("pixel_1 = \"top-left\"\n"), usual);
}

#[test]
fn the_order_of_things_does_not_matter_and_nothing_is_nan() {
    let things = [
        object(
            "a",
            [2000.0, 2000.0, 2600.0],
            [200.0, 200.0, 100.0],
            0.0,
            30.0,
        ),
        object("b", [2000.0, 2000.0, 0.0], [3900.0, 3900.0, 1.0], 0.0, 18.0),
        object(
            "c",
            [1500.0, 2000.0, 0.0],
            [500.0, 200.0, 2700.0],
            45.0,
            5000.0,
        ),
        object(
            "d",
            [2300.0, 2300.0, 1.0],
            [0.001, 900.0, 900.0],
            10.0,
            -273.0,
        ),
        object(
            "e",
            [2300.0, 2300.0, 1.0],
            [900.0, 0.001, 900.0],
            10.0,
            60.0,
        ),
    ];
    for band in ["", "band_um = [8, 14]\n"] {
        let order = |order: [usize; 5]| {
            let things: String = order.iter().map(|index| things[*index].as_str()).collect();
            pixels(&format!("{band}{ROOM}{things}{CEILING}"))
        };
        let (one, other) = (order([0, 1, 2, 3, 4]), order([4, 2, 0, 3, 1]));
        for (one, other) in one.iter().zip(&other) {
            assert!(
                one.is_finite() && (one - other).abs() < 1e-7,
                "{one} {other}"
            );
        }
        // The sensor is on `a`, which hides everything from it.
        assert!(
            one.iter()
                .all(|celsius| (celsius - filled(1.0, 30.0, 0.95, 20.0)).abs() < 0.02),
            "{one:?}"
        );
        let behind: String = things[1..].concat();
        let behind = pixels(&format!("{band}{ROOM}{behind}{CEILING}"));
        assert!(behind.iter().all(|celsius| celsius.is_finite()));
        assert!(behind.iter().any(|celsius| *celsius > 100.0));
    }
}

/// Where two bodies pass through each other, each is seen where it is nearer, as if cut out of the other.
#[test]
fn bodies_may_cross() {
    let upright = object(
        "upright",
        [2000.0, 2000.0, 0.0],
        [200.0, 200.0, 1500.0],
        0.0,
        30.0,
    );
    let level = object(
        "level",
        [2000.0, 2000.0, 500.0],
        [1500.0, 400.0, 400.0],
        0.0,
        10.0,
    );
    let crossing = pixels(&format!("{ROOM}{upright}{level}{CEILING}"));
    let around: String = [
        ("a", [1575.0, 2000.0], [650.0, 400.0]),
        ("b", [2425.0, 2000.0], [650.0, 400.0]),
        ("c", [2000.0, 1850.0], [200.0, 100.0]),
        ("d", [2000.0, 2150.0], [200.0, 100.0]),
    ]
    .iter()
    .map(|(name, at, size)| {
        object(
            name,
            [at[0], at[1], 500.0],
            [size[0], size[1], 400.0],
            0.0,
            10.0,
        )
    })
    .collect();
    let cut = pixels(&format!("{ROOM}{upright}{around}{CEILING}"));
    for (crossing, cut) in crossing.iter().zip(&cut) {
        assert!((crossing - cut).abs() < 2e-3, "{crossing} {cut}");
    }
    assert!(crossing[27] > crossing[25] + 2.0);
}
