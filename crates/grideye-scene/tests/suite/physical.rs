//! The physical model against closed forms, against an independent ray caster with numerical integration, and against
//! the figures of the reference.

use crate::{object, simulator};
use grideye_scene::perceived::Surface;
use grideye_scene::physical::{Band, apparent_celsius};
use std::time::Duration;

pub(crate) const ROOM: &str =
    "model = \"physical\"\n[room]\nsize_mm = [4000, 4000, 2700]\nambient_c = 20\n";

/// A Grid-EYE in the middle of the ceiling: the room's front at the top, its right at the left.
pub(crate) const CEILING: &str = "[[sensor]]\nname = \"ceiling\"\npreset = \"grid-eye\"\n\
    position_mm = [2000, 2000, 2700]\nelevation_deg = 90\nazimuth_deg = -90\n";

/// The same with other keys instead of the preset.
pub(crate) fn sensor(keys: &str) -> String {
    CEILING.replace(
        "preset = \"grid-eye\"",
        &format!("noise_sigma_c = 0\nsampling_hz = 10\n{keys}"),
    )
}

/// One pixel that looks along the axis, with a response of 8°.
fn one_pixel() -> String {
    sensor("resolution = [1, 1]\nfov_deg = 7.5\npixel_width_deg = 8")
}

/// A level sheet below the ceiling sensor: its center to the sensor's right and up, its size, meters; its depth.
pub(crate) fn sheet(
    middle_m: [f64; 2],
    size_m: [f64; 2],
    depth_m: f64,
    celsius: f64,
    emissivity: f64,
) -> String {
    let mm = |meters: f64| meters * 1000.0;
    let (x, y) = (0.5 * mm(size_m[0]), 0.5 * mm(size_m[1]));
    // The room's right appears left, its front at the top.
    let at = [
        2000.0 - mm(middle_m[0]),
        2000.0 - mm(middle_m[1]),
        2700.0 - mm(depth_m),
    ];
    format!(
        "[[object]]\nname = \"sheet\"\nshape = \"polyhedron\"\nposition_mm = {at:?}\n\
         vertices_mm = [[{0:?}, {1:?}, 0.0], [{2:?}, {1:?}, 0.0], [{2:?}, {3:?}, 0.0], [{0:?}, {3:?}, 0.0]]\n\
         faces = [[0, 1, 2, 3]]\ntemperature_c = {celsius:?}\nemissivity = {emissivity:?}\n",
        -x, -y, x, y
    )
}

pub(crate) fn pixels(text: &str) -> Vec<f64> {
    simulator(text).image(Duration::ZERO).celsius
}

/// Share between two angles of a Gaussian around 0 with full width `width_deg` at half its height, by Simpson.
pub(crate) fn share(from_rad: f64, to_rad: f64, at_deg: f64, width_deg: f64) -> f64 {
    let sigma = width_deg.to_radians() / (8.0 * 2.0_f64.ln()).sqrt();
    let (from, to) = (
        ((from_rad - at_deg.to_radians()) / sigma).clamp(-9.0, 9.0),
        ((to_rad - at_deg.to_radians()) / sigma).clamp(-9.0, 9.0),
    );
    let density = |t: f64| (-0.5 * t * t).exp() / std::f64::consts::TAU.sqrt();
    let steps = 2000;
    let step = (to - from) / f64::from(steps);
    let sum: f64 = (0..steps)
        .map(|index| {
            let at = from + step * f64::from(index);
            density(at) + 4.0 * density(at + 0.5 * step) + density(at + step)
        })
        .sum();
    sum * step / 6.0
}

/// The temperature of a pixel with this share filled by a surface.
pub(crate) fn filled(share: f64, object_c: f64, emissivity: f64, ambient_c: f64) -> f64 {
    let fourth = |celsius: f64| (celsius + 273.15).powi(4);
    let shines = emissivity * fourth(object_c) + (1.0 - emissivity) * fourth(ambient_c);
    (share * shines + (1.0 - share) * fourth(ambient_c)).powf(0.25) - 273.15
}

/// `thermal-model.md` §2: a head of 0.18 x 0.24 m at 31 °C, 0.95 m away, 20 °C room, 0.98: 29.3 °C centered on a pixel
/// of 7.5° (60 by 8), 27.3 on an edge, 26.4 on a corner. They follow from a Gaussian of 8°.
#[test]
fn a_head_on_a_pixels_center_edge_and_corner_matches_the_reference() {
    let half = 0.95 * 3.75_f64.to_radians().tan();
    for (middle, expected) in [
        ([0.0, 0.0], 29.3),
        ([half, 0.0], 27.3),
        ([-half, half], 26.4),
    ] {
        let head = sheet(middle, [0.18, 0.24], 0.95, 31.0, 0.98);
        let seen = pixels(&format!("{ROOM}{head}{}", one_pixel()))[0];
        println!("head at {middle:?}: {seen:.3}");
        assert!((seen - expected).abs() <= 0.051, "{middle:?}: {seen}");
    }
    // The same head in front of a Grid-EYE by its own map, with middle pixels of 7.74° by 8.32°, 7.96° apart.
    let place = |degrees: f64| 0.95 * degrees.to_radians().tan();
    for middle_deg in [[-4.05, 4.08], [-0.07, 4.08], [-0.07, 0.09]] {
        let middle = middle_deg.map(place);
        let head = sheet(middle, [0.18, 0.24], 0.95, 31.0, 0.98);
        let seen = pixels(&format!("{ROOM}{head}{CEILING}"))[27];
        let within = |axis: usize, half: f64, at: f64, width: f64| {
            let border = |by: f64| ((middle[axis] + by) / 0.95).atan();
            share(border(-half), border(half), at, width)
        };
        // Pixel 28 looks 4.05° to the left and 4.08° up.
        let shares = within(0, 0.09, -4.05, 7.74) * within(1, 0.12, 4.08, 8.32);
        let expected = filled(shares, 31.0, 0.98, 20.0);
        println!("by the map, head at {middle_deg:?}°: {seen:.3}");
        assert!((seen - expected).abs() < 2e-4, "{seen} {expected}");
    }
}

#[test]
fn any_rectangle_is_the_product_of_two_shares() {
    let mut worst: f64 = 0.0;
    for step in 0..40 {
        let k = f64::from(step);
        let middle = [0.011 * k - 0.2, 0.15 - 0.0093 * k];
        let size = [0.05 + 0.011 * k, 0.61 - 0.013 * k];
        let celsius = if step % 2 == 0 { 36.0 } else { 2.0 };
        let text = format!(
            "{ROOM}{}{}",
            sheet(middle, size, 1.1, celsius, 0.9),
            one_pixel()
        );
        let shares = [0, 1].map(|axis| {
            let angle = |border: f64| (border / 1.1).atan();
            share(
                angle(middle[axis] - 0.5 * size[axis]),
                angle(middle[axis] + 0.5 * size[axis]),
                0.0,
                8.0,
            )
        });
        let expected = filled(shares[0] * shares[1], celsius, 0.9, 20.0);
        let found = pixels(&text)[0];
        worst = worst.max((found - expected).abs());
        assert!(
            (found - expected).abs() < 2e-5,
            "{step}: {found} {expected}"
        );
    }
    println!("largest difference to the closed form: {worst:.1e} °C");
}

#[test]
fn a_surface_filling_a_pixel_looks_the_same_from_any_distance() {
    for (celsius, emissivity, reflected_c) in [
        (31.0, 1.0, 20.0),
        (80.0, 0.3, 20.0),
        (-20.0, 0.95, 20.0),
        (25.0, 0.0, 35.0),
        (25.0, 0.4, 5.0),
    ] {
        let room = ROOM.replace(
            "ambient_c = 20\n",
            &format!("ambient_c = 20\nreflected_c = {reflected_c:?}\n"),
        );
        for depth in [0.005, 0.3, 2.6] {
            let everything = sheet([0.0, 0.0], [3.9, 3.9], depth, celsius, emissivity);
            let seen = pixels(&format!("{room}{everything}{CEILING}"))[27];
            let expected = {
                let fourth = |celsius: f64| (celsius + 273.15).powi(4);
                (emissivity * fourth(celsius) + (1.0 - emissivity) * fourth(reflected_c)).powf(0.25)
                    - 273.15
            };
            // From the floor, a few millionths of the pixel see past the sheet.
            assert!(
                (seen - expected).abs() < 2e-4,
                "{celsius} {emissivity} {depth}: {seen} {expected}"
            );
            let told = apparent_celsius(
                Surface {
                    celsius,
                    emissivity,
                },
                reflected_c,
                Band::All,
            );
            assert!((told - expected).abs() < 1e-10);
        }
    }
    assert_eq!(
        apparent_celsius(
            Surface {
                celsius: 31.0,
                emissivity: 1.0
            },
            -50.0,
            Band::All
        ),
        31.0_f64.mul_add(1.0, 0.0),
    );
}

#[test]
fn an_empty_room_and_objects_at_ambient_are_exactly_ambient() {
    let table = object(
        "table",
        [2000.0, 2000.0, 0.0],
        [900.0, 700.0, 750.0],
        20.0,
        20.0,
    );
    for band in ["", "band_um = [8, 14]\n"] {
        for objects in ["", table.as_str()] {
            assert_eq!(
                pixels(&format!("{band}{ROOM}{objects}{CEILING}")),
                [20.0; 64]
            );
        }
    }
}

/// A box in the room, as the independent ray caster stores it.
struct Crate {
    low: [f64; 3],
    high: [f64; 3],
    celsius: f64,
    emissivity: f64,
}

impl Crate {
    /// How far along the ray it is met from outside.
    fn met(&self, from: [f64; 3], along: [f64; 3]) -> Option<f64> {
        let (mut near, mut far) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            let one = (self.low[axis] - from[axis]) / along[axis];
            let other = (self.high[axis] - from[axis]) / along[axis];
            near = near.max(one.min(other));
            far = far.min(one.max(other));
        }
        (near < far).then_some(near)
    }

    fn toml(&self, index: usize) -> String {
        let mm = |meters: f64| (meters * 1000.0).round();
        let middle = |axis: usize| 0.5 * (mm(self.low[axis]) + mm(self.high[axis]));
        let size = [0, 1, 2].map(|axis| mm(self.high[axis]) - mm(self.low[axis]));
        let at = [middle(0), middle(1), mm(self.low[2])];
        let keys = object(&format!("crate {index}"), at, size, 0.0, self.celsius);
        format!("{keys}emissivity = {:?}\n", self.emissivity)
    }
}

/// The 64 directions and widths, read from the source so that the ray caster shares only the numbers.
fn map() -> Vec<[f64; 4]> {
    let source = include_str!("../../src/picture/physical/map.rs");
    let rows = source
        .lines()
        .filter_map(|line| line.trim().strip_prefix('[')?.strip_suffix("],"));
    rows.map(|row| {
        let numbers: Vec<f64> = row
            .split(',')
            .map(|number| number.trim().parse().unwrap())
            .collect();
        [numbers[0], numbers[1], numbers[2], numbers[3]]
    })
    .collect()
}

const CRATES: [Crate; 4] = [
    Crate {
        low: [1.7, 1.6, 0.0],
        high: [2.1, 2.5, 0.7],
        celsius: 24.0,
        emissivity: 0.95,
    },
    Crate {
        low: [1.5, 1.9, 0.3],
        high: [2.6, 2.05, 1.1],
        celsius: 31.0,
        emissivity: 0.98,
    },
    Crate {
        low: [2.5, 0.8, 0.0],
        high: [3.2, 2.9, 0.4],
        celsius: 8.0,
        emissivity: 0.8,
    },
    Crate {
        low: [0.6, 2.6, 0.0],
        high: [1.3, 3.4, 1.9],
        celsius: 45.0,
        emissivity: 0.5,
    },
];

/// Elevation and azimuth of the sensor that looks at them, degrees.
const LOOKS: (f64, f64) = (77.0, -60.0);

fn fourth(celsius: f64) -> f64 {
    (celsius + 273.15).powi(4)
}

/// The radiance from the ray with these slopes to the left and upwards, above the ambient's.
fn shines(left: f64, up: f64) -> f64 {
    let (se, ce) = LOOKS.0.to_radians().sin_cos();
    let (sa, ca) = LOOKS.1.to_radians().sin_cos();
    // The axes of the sensor in the room, by the definition of elevation and azimuth.
    let (forward, lefts, ups) = (
        [ce * ca, ce * sa, -se],
        [-sa, ca, 0.0],
        [se * ca, se * sa, ce],
    );
    let along = [0, 1, 2].map(|axis| forward[axis] + left * lefts[axis] + up * ups[axis]);
    let met = CRATES
        .iter()
        .filter_map(|one| Some((one.met([2.0, 2.0, 2.7], along)?, one)));
    met.min_by(|one, other| one.0.total_cmp(&other.0))
        .map_or(0.0, |(_, one)| {
            one.emissivity * (fourth(one.celsius) - fourth(20.0))
        })
}

/// A Gaussian of 1 in the middle and one half at half its width.
fn bell(at: f64, middle: f64, width: f64) -> f64 {
    (-4.0 * 2.0_f64.ln() * ((at - middle) / width).powi(2)).exp()
}

#[test]
fn the_model_equals_the_sum_of_rays_over_the_map() {
    let objects: String = CRATES
        .iter()
        .enumerate()
        .map(|(index, one)| one.toml(index))
        .collect();
    let found = pixels(&format!(
        "{ROOM}{objects}{}",
        CEILING.replace("= 90", "= 77").replace("-90", "-60")
    ));
    let map = map();
    assert_eq!(map.len(), 64);
    let (step, half) = (0.08_f64, 55.0);
    let count = (2.0 * half / step) as usize;
    let angles: Vec<f64> = (0..count)
        .map(|index| (index as f64 + 0.5) * step - half)
        .collect();
    let slopes: Vec<f64> = angles
        .iter()
        .map(|angle| angle.to_radians().tan())
        .collect();
    let across: Vec<Vec<f64>> = map
        .iter()
        .map(|of| {
            angles
                .iter()
                .map(|angle| bell(*angle, -of[0], of[2]))
                .collect()
        })
        .collect();
    // By angle, as in the model, and by solid angle, as an alternative: response and received radiance.
    let mut sums = vec![[0.0; 4]; 64];
    for (angle, b) in angles.iter().zip(&slopes) {
        let line: Vec<f64> = slopes.iter().map(|a| shines(*a, *b)).collect();
        for (pixel, of) in map.iter().enumerate() {
            let down = bell(*angle, of[1], of[3]);
            if down < 1e-6 {
                continue;
            }
            for ((a, excess), across) in slopes.iter().zip(&line).zip(&across[pixel]) {
                let response = down * across;
                let mesh = (1.0 + a * a) * (1.0 + b * b) / (1.0 + a * a + b * b).powf(1.5);
                let parts = [
                    response,
                    response * excess,
                    response * mesh,
                    response * mesh * excess,
                ];
                for (sum, part) in sums[pixel].iter_mut().zip(parts) {
                    *sum += part;
                }
            }
        }
    }
    let celsius = |of: f64, all: f64| (fourth(20.0) + of / all).powf(0.25) - 273.15;
    let mut worst = [0.0_f64; 2];
    for (sums, found) in sums.iter().zip(&found) {
        worst[0] = worst[0].max((found - celsius(sums[1], sums[0])).abs());
        worst[1] = worst[1].max((found - celsius(sums[3], sums[2])).abs());
    }
    let warmest = found
        .iter()
        .fold(0.0_f64, |warmest, celsius| warmest.max(*celsius));
    println!(
        "rays at {step}°: {:.4} °C, by solid angle {:.4} °C, warmest {warmest:.1}",
        worst[0], worst[1]
    );
    assert!(worst[0] < 0.01, "{worst:?}");
    assert!(worst[1] < 0.08, "{worst:?}");
    assert!(warmest > 25.0 && found.iter().any(|celsius| *celsius < 18.0));
}
