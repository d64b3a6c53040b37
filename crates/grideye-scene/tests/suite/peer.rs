//! A second simulator, written only from the paper's text and MATLAB's definition of `imresize`: every point against
//! every face of every box in the room's own axes, no windows, no slabs, no separable weights, powers by `powf`.

use crate::{ROOM, object, simulator};
use glam::DVec3;
use grideye_scene::perceived::Law;
use proptest::prelude::*;
use std::time::Duration;

#[derive(Debug, Clone)]
struct Box {
    base_mm: [f64; 3],
    size_mm: [f64; 3],
    yaw_deg: f64,
    celsius: f64,
    emissivity: f64,
}

#[derive(Debug, Clone)]
struct Setup {
    law: Law,
    position_mm: [f64; 3],
    angles_deg: [f64; 3],
    fov_deg: [f64; 2],
    pixels_per_degree: f64,
    resolution: [usize; 2],
    boxes: Vec<Box>,
}

const AMBIENT_C: f64 = 20.1;

impl Setup {
    /// The scene file; the last box is the agent.
    fn text(&self) -> String {
        let [elevation, azimuth, roll] = self.angles_deg;
        let mut text = format!("model = \"paper-grid\"\nlaw = \"{:?}\"\n{ROOM}", self.law);
        text += &format!(
            "[[sensor]]\nname = \"s\"\nposition_mm = {:?}\nelevation_deg = {elevation:?}\nazimuth_deg = {azimuth:?}\n\
             roll_deg = {roll:?}\nresolution = {:?}\nfov_deg = {:?}\npixels_per_degree = {:?}\nnoise_sigma_c = 0\nsampling_hz = 1\n",
            self.position_mm, self.resolution, self.fov_deg, self.pixels_per_degree
        );
        for (index, one) in self.boxes.iter().enumerate() {
            let table = object(
                &format!("box {index}"),
                one.base_mm,
                one.size_mm,
                one.yaw_deg,
                one.celsius,
            );
            let table = if index + 1 == self.boxes.len() {
                table.replace("object", "agent")
            } else {
                table
            };
            text += &format!("{table}emissivity = {:?}\n", one.emissivity);
        }
        text
    }

    fn points(&self) -> [usize; 2] {
        self.fov_deg
            .map(|degrees| (degrees * self.pixels_per_degree).round() as usize)
    }

    /// Forward, left and up of the sensor in the room, from the angles' definition.
    fn axes(&self) -> [DVec3; 3] {
        let [(sin_e, cos_e), (sin_a, cos_a), (sin_r, cos_r)] = self
            .angles_deg
            .map(|degrees| degrees.to_radians().sin_cos());
        let forward = DVec3::new(cos_e * cos_a, cos_e * sin_a, -sin_e);
        let left = DVec3::new(-sin_a, cos_a, 0.0);
        let up = DVec3::new(sin_e * cos_a, sin_e * sin_a, cos_e);
        [
            forward,
            cos_r * left + sin_r * up,
            cos_r * up - sin_r * left,
        ]
    }

    /// The image, and the share of each pixel that is the agent.
    fn picture(&self) -> (Vec<f64>, Vec<f64>) {
        let [columns, rows] = self.points();
        let [forward, left, up] = self.axes();
        let sensor_m = DVec3::from_array(self.position_mm) / 1000.0;
        let focal = [0, 1].map(|axis| {
            (self.points()[axis] as f64 / 2.0) / (self.fov_deg[axis].to_radians() / 2.0).tan()
        });
        let mut celsius = vec![AMBIENT_C; columns * rows];
        let mut is_agent = vec![0.0; columns * rows];
        for row in 0..rows {
            for column in 0..columns {
                let across = column as f64 + 0.5 - columns as f64 / 2.0;
                let down = row as f64 + 0.5 - rows as f64 / 2.0;
                let ray = forward - left * across / focal[0] - up * down / focal[1];
                let nearest = self
                    .boxes
                    .iter()
                    .enumerate()
                    .filter_map(|(index, one)| {
                        one.distance_m(sensor_m, ray.normalize())
                            .map(|d| (d, index))
                    })
                    // A sensor inside two bodies sees the warmer one.
                    .min_by(|one, other| {
                        let warmer = || {
                            self.boxes[other.1]
                                .celsius
                                .total_cmp(&self.boxes[one.1].celsius)
                        };
                        one.0.total_cmp(&other.0).then_with(warmer)
                    });
                if let Some((distance_m, index)) = nearest {
                    celsius[row * columns + column] =
                        self.boxes[index].seen_celsius(self.law, distance_m);
                    is_agent[row * columns + column] =
                        f64::from(u8::from(index + 1 == self.boxes.len()));
                }
            }
        }
        (self.resized(&celsius), self.resized(&is_agent))
    }

    fn resized(&self, picture: &[f64]) -> Vec<f64> {
        let [columns, rows] = self.points();
        let [pixel_columns, pixel_rows] = self.resolution;
        let mut pixels = Vec::new();
        for pixel_row in 0..pixel_rows {
            for pixel_column in 0..pixel_columns {
                let mut sum = 0.0;
                for (row, weight_down) in imresize_weights(rows, pixel_rows, pixel_row) {
                    for (column, weight_across) in
                        imresize_weights(columns, pixel_columns, pixel_column)
                    {
                        sum += weight_down * weight_across * picture[row * columns + column];
                    }
                }
                pixels.push(sum);
            }
        }
        pixels
    }
}

impl Box {
    /// Distance along the ray to the nearest of the six faces; 0 inside.
    fn distance_m(&self, from_m: DVec3, ray: DVec3) -> Option<f64> {
        let (sin, cos) = self.yaw_deg.to_radians().sin_cos();
        let axes = [
            DVec3::new(cos, sin, 0.0),
            DVec3::new(-sin, cos, 0.0),
            DVec3::Z,
        ];
        let half = DVec3::from_array(self.size_mm) / 2000.0;
        let center = DVec3::from_array(self.base_mm) / 1000.0 + DVec3::new(0.0, 0.0, half.z);
        let within =
            |point: DVec3, axis: usize| (point - center).dot(axes[axis]).abs() <= half[axis];
        if (0..3).all(|axis| within(from_m, axis)) {
            return Some(0.0);
        }
        let mut nearest: Option<f64> = None;
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                let face = center + side * half[axis] * axes[axis];
                let distance = (face - from_m).dot(axes[axis]) / ray.dot(axes[axis]);
                let point = from_m + distance * ray;
                if distance > 0.0 && (0..3).all(|other| other == axis || within(point, other)) {
                    nearest = Some(nearest.map_or(distance, |found| found.min(distance)));
                }
            }
        }
        nearest
    }

    fn seen_celsius(&self, law: Law, distance_m: f64) -> f64 {
        if distance_m < 0.01 {
            return self.celsius - (self.celsius - AMBIENT_C) * distance_m / 5.0;
        }
        let (object_k, ambient_k, square) = (
            self.celsius + 273.15,
            AMBIENT_C + 273.15,
            distance_m * distance_m,
        );
        let fourth = match law {
            Law::A => {
                let weight = f64::min(1.0, self.emissivity / square);
                weight * object_k.powi(4) + (1.0 - weight) * ambient_k.powi(4)
            }
            Law::B => {
                (self.emissivity * object_k.powi(4) + square * ambient_k.powi(4))
                    / (self.emissivity + square)
            }
        };
        fourth.powf(0.25) - 273.15
    }
}

/// MATLAB's `contributions`: 1-based positions, widened triangle when shrinking, mirrored borders.
fn imresize_weights(inputs: usize, outputs: usize, output: usize) -> Vec<(usize, f64)> {
    let scale = outputs as f64 / inputs as f64;
    let kernel_width = if scale < 1.0 { 2.0 / scale } else { 2.0 };
    let u = (output + 1) as f64 / scale + 0.5 * (1.0 - 1.0 / scale);
    let left = (u - kernel_width / 2.0).floor() as i64;
    let taps = kernel_width.ceil() as i64 + 2;
    let mirror: Vec<usize> = (0..inputs).chain((0..inputs).rev()).collect();
    let shrink = scale.min(1.0);
    let mut weights: Vec<(usize, f64)> = (left..left + taps)
        .map(|k| {
            let weight = (1.0 - (shrink * (u - k as f64)).abs()).max(0.0);
            (
                mirror[(k - 1).rem_euclid(mirror.len() as i64) as usize],
                weight,
            )
        })
        .collect();
    let total: f64 = weights.iter().map(|(_, weight)| weight).sum();
    weights.iter_mut().for_each(|(_, weight)| *weight /= total);
    weights
}

fn assert_same(setup: &Setup) {
    let (celsius, share) = setup.picture();
    let simulator = simulator(&setup.text());
    let found = simulator.image(Duration::ZERO);
    assert_eq!([found.columns, found.rows], setup.resolution);
    for (pixel, (found, expected)) in found.celsius.iter().zip(&celsius).enumerate() {
        assert!(
            (found - expected).abs() < 1e-9,
            "pixel {pixel}: {found}, expected {expected}\n{}",
            setup.text()
        );
    }
    for (pixel, (found, expected)) in simulator
        .truth(Duration::ZERO)
        .share
        .iter()
        .zip(&share)
        .enumerate()
    {
        assert!(
            (found - expected).abs() < 1e-9,
            "pixel {pixel}: {found}, expected {expected}\n{}",
            setup.text()
        );
    }
}

#[test]
fn both_simulators_agree_on_a_furnished_room() {
    let one = |base_mm, size_mm, yaw_deg, celsius| Box {
        base_mm,
        size_mm,
        yaw_deg,
        celsius,
        emissivity: 0.8,
    };
    assert_same(&Setup {
        law: Law::B,
        position_mm: [1201.0, 1352.0, 2700.0],
        angles_deg: [71.0, -83.0, 9.0],
        fov_deg: [60.0, 60.0],
        pixels_per_degree: 5.0,
        resolution: [8, 8],
        boxes: vec![
            one([2000.0, 3000.0, 0.0], [1600.0, 1600.0, 750.0], 0.0, 23.0),
            one([225.0, 2000.0, 0.0], [250.0, 1000.0, 600.0], 10.0, 27.5),
            one([1500.0, 700.0, 300.0], [400.0, 300.0, 900.0], 33.0, 12.0),
            one([1200.0, 1050.0, 0.0], [200.0, 500.0, 1750.0], 20.0, 31.0),
        ],
    });
}

fn boxes() -> impl Strategy<Value = Vec<Box>> {
    // The center leaves room for every size and turn, so that no box is removed for sticking out.
    let one = (
        (1.0..3.0, 1.0..5.0, 0.0..1.2)
            .prop_map(|(x, y, z)| [x, y, z].map(|meters: f64| meters * 1000.0)),
        [50.0..1300.0, 50.0..1300.0, 50.0..1500.0],
        -360.0..360.0,
        -20.0..120.0,
        0.1..1.0,
    )
        .prop_map(|(base_mm, size_mm, yaw_deg, celsius, emissivity)| Box {
            base_mm,
            size_mm,
            yaw_deg,
            celsius,
            emissivity,
        });
    prop::collection::vec(one, 1..5)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn both_simulators_agree_on_any_room_from_anywhere(
        law in prop::sample::select(vec![Law::A, Law::B]),
        position_mm in [0.0..4000.0, 0.0..6000.0, 0.0..2700.0],
        angles_deg in [-90.0..90.0, -360.0..360.0, -360.0..360.0],
        fov_deg in [5.0..175.0, 5.0..175.0],
        points in 10.0..40.0,
        resolution in [1_usize..20, 1_usize..20],
        boxes in boxes(),
    ) {
        let pixels_per_degree = points / f64::max(fov_deg[0], fov_deg[1]);
        let fov_deg = fov_deg.map(|degrees: f64| degrees.max(1.0 / pixels_per_degree));
        assert_same(&Setup { law, position_mm, angles_deg, fov_deg, pixels_per_degree, resolution, boxes });
    }
}
