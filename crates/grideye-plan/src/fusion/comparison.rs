//! Compares each fusion method with the truth, as a table and as JSON.

use super::array::{Method, SensorArray};
use super::axis::Axis;
use grideye_scene::{Image, Scene, SceneError, Sensor, Simulator};
use serde_json::json;
use std::time::Duration;

const METHODS: [(Method, &str); 4] = [
    (Method::Mean, "mean"),
    (Method::Interpolation, "interpolation"),
    (Method::Maximum, "maximum"),
    (Method::LeastSquares, "least squares"),
];

/// Root mean square error, °C: over all cells, and over those in view of every sensor.
#[derive(Debug)]
struct Error {
    all_c: f64,
    covered_c: f64,
}

#[derive(Debug)]
struct Fused {
    name: &'static str,
    quiet: Error,
    noisy: Error,
    image: Image,
}

/// An array's frames at the scene's start, fused by each method, and its virtual sensor's image.
#[derive(Debug)]
pub struct Comparison {
    array: SensorArray,
    fused: Vec<Fused>,
    truth: Image,
    /// A pixel's noise in the mean of the frames.
    noise_c: f64,
}

impl Comparison {
    /// Compares the scene's sensors, in the array's order, over the mean of `frames` frames.
    ///
    /// # Errors
    /// If a sensor is not in the scene.
    pub fn new(
        scene: &Scene,
        sensors: &[&Sensor],
        array: SensorArray,
        frames: u32,
        seed: u64,
    ) -> Result<Self, SceneError> {
        let truth = array.truth(scene)?.image(Duration::ZERO);
        let noise_c = array.virtual_sensor().noise_sigma / f64::from(frames).sqrt();
        Ok(Self {
            fused: fuse(scene, sensors, &array, (frames, seed, noise_c), &truth)?,
            array,
            truth,
            noise_c,
        })
    }

    /// The table for people.
    #[must_use]
    pub fn text(&self) -> String {
        let (array, fused, noise_c) = (&self.array, &self.fused, self.noise_c);
        let (across, down) = (array.across(), array.down());
        let distance_mm = array.virtual_sensor().operating_distance_m * 1000.0;
        let mut text = format!(
            "{} x {} sensors of {} x {} pixels, in the plane {distance_mm:.0} mm in front of them\n\
         spacing      across {}, down {}\n\
         cells, Eq. 8 {} x {} in view of at least one sensor, {} x {} of all\n\n\
         sensors that see each cell\n",
            across.sensors,
            down.sensors,
            across.pixels,
            down.pixels,
            spacing(across),
            spacing(down),
            across.union_cells(),
            down.union_cells(),
            across.covered_cells(),
            down.covered_cells(),
        );
        for row in array.coverage().chunks(across.union_cells()) {
            let cells: Vec<String> = row.iter().map(|sensors| format!("{sensors:2}")).collect();
            text.push_str(&format!("  {}\n", cells.join(" ")));
        }
        text.push_str(&format!(
            "\nerror against one sensor of {} x {} pixels in the middle, RMSE in °C\n\
         {:<16}{:>24}{:>24}\n{:<16}{:>12}{:>12}{:>12}{:>12}\n",
            across.union_cells(),
            down.union_cells(),
            "",
            "without noise",
            format!("noise {noise_c:.3} °C"),
            "",
            "all cells",
            "seen by all",
            "all cells",
            "seen by all",
        ));
        for row in fused {
            text.push_str(&format!(
                "{:<16}{:>12.4}{:>12.4}{:>12.4}{:>12.4}\n",
                row.name,
                row.quiet.all_c,
                row.quiet.covered_c,
                row.noisy.all_c,
                row.noisy.covered_c
            ));
        }
        text
    }

    /// All results, for programs.
    #[must_use]
    pub fn json(&self) -> String {
        let (array, fused, noise_c) = (&self.array, &self.fused, self.noise_c);
        let axis = |axis: &Axis| {
            json!({
                "pixels": axis.pixels,
                "sensors": axis.sensors,
                "factor": axis.factor,
                "spacing_mm": axis.spacing_m * 1000.0,
                "spacing_by_eq_7_mm": axis.spacing_by_eq_7_m * 1000.0,
                "cells_union": axis.union_cells(),
                "cells_covered": axis.covered_cells(),
            })
        };
        let error = |error: &Error| {
            let covered = error.covered_c.is_finite().then_some(error.covered_c);
            json!({"all_cells_c": error.all_c, "seen_by_all_c": covered})
        };
        let methods: serde_json::Map<String, serde_json::Value> = fused
            .iter()
            .map(|row| {
                let value = json!({
                    "rmse_without_noise": error(&row.quiet),
                    "rmse_with_noise": error(&row.noisy),
                    "celsius": row.image.celsius,
                });
                (row.name.replace(' ', "_"), value)
            })
            .collect();
        let all = json!({
            "across": axis(array.across()),
            "down": axis(array.down()),
            "coverage": array.coverage(),
            "noise_c": noise_c,
            "methods": methods,
        });
        format!("{all:#}\n")
    }

    /// The fused frames with their methods' names, then the truth.
    pub fn images(&self) -> impl Iterator<Item = (&str, &Image)> {
        let fused = self.fused.iter().map(|fused| (fused.name, &fused.image));
        fused.chain([("truth", &self.truth)])
    }
}

fn fuse(
    scene: &Scene,
    sensors: &[&Sensor],
    array: &SensorArray,
    (frames, seed, noise_c): (u32, u64, f64),
    truth: &Image,
) -> Result<Vec<Fused>, SceneError> {
    let simulators = sensors
        .iter()
        .map(|sensor| Simulator::new(scene, &sensor.name))
        .collect::<Result<Vec<_>, _>>()?;
    let quiet: Vec<Image> = simulators
        .iter()
        .map(|simulator| simulator.image(Duration::ZERO))
        .collect();
    let noisy: Vec<Image> = simulators
        .iter()
        .zip(&quiet)
        .map(|(simulator, quiet)| mean_of_frames(simulator, quiet, (frames, seed)))
        .collect();
    let middle = middle_sensor(sensors, array);
    let one = [(quiet.as_slice(), 0.0), (noisy.as_slice(), noise_c)];
    let stretched = one.map(|(frames, _)| stretched(&frames[middle], array));
    let mut fused = vec![compared("one sensor", stretched, array, truth)];
    for (method, name) in METHODS {
        let images = one.map(|(frames, sigma)| array.fuse(method, frames, sigma));
        fused.push(compared(name, images, array, truth));
    }
    Ok(fused)
}

fn compared(
    name: &'static str,
    [quiet, noisy]: [Image; 2],
    array: &SensorArray,
    truth: &Image,
) -> Fused {
    Fused {
        name,
        quiet: error(&quiet, truth, array),
        noisy: error(&noisy, truth, array),
        image: noisy,
    }
}

fn mean_of_frames(simulator: &Simulator, quiet: &Image, (frames, seed): (u32, u64)) -> Image {
    let mut sum = vec![0.0; quiet.celsius.len()];
    for frame in 0..frames {
        let time = simulator.sensor().frame_time(frame);
        let noisy = simulator.noisy(time, seed).celsius;
        let without = simulator.image(time).celsius;
        for (sum, (noisy, without)) in sum.iter_mut().zip(noisy.iter().zip(&without)) {
            *sum += noisy - without;
        }
    }
    let frames = f64::from(frames);
    let celsius = quiet.celsius.iter().zip(sum);
    Image {
        celsius: celsius.map(|(quiet, sum)| quiet + sum / frames).collect(),
        ..quiet.clone()
    }
}

fn middle_sensor(sensors: &[&Sensor], array: &SensorArray) -> usize {
    let middle_m = array.virtual_sensor().pose.position_m;
    let away_m = |index: &usize| sensors[*index].pose.position_m.distance(middle_m);
    (0..sensors.len())
        .min_by(|one, other| away_m(one).total_cmp(&away_m(other)))
        .unwrap_or(0)
}

/// One sensor's value for each cell: its pixel there, or the nearest.
fn stretched(frame: &Image, array: &SensorArray) -> Image {
    let (columns, rows) = (array.across().union_cells(), array.down().union_cells());
    let pixel = |cell: usize, axis: &Axis| {
        let before = (axis.sensors - 1) / 2;
        (cell.saturating_sub(before) / axis.factor).min(axis.pixels - 1)
    };
    Image {
        columns,
        rows,
        celsius: (0..rows * columns)
            .map(|cell| {
                frame.at(
                    pixel(cell / columns, array.down()),
                    pixel(cell % columns, array.across()),
                )
            })
            .collect(),
    }
}

fn error(image: &Image, truth: &Image, array: &SensorArray) -> Error {
    let coverage = array.coverage();
    let all = array.across().sensors * array.down().sensors;
    let rms = |counts: &dyn Fn(usize) -> bool| {
        let squares: Vec<f64> = (0..truth.celsius.len())
            .filter(|cell| counts(coverage[*cell]))
            .map(|cell| (image.celsius[cell] - truth.celsius[cell]).powi(2))
            .collect();
        let count = squares.iter().map(|_| 1.0).sum::<f64>();
        (squares.iter().sum::<f64>() / count).sqrt()
    };
    Error {
        all_c: rms(&|_| true),
        covered_c: rms(&|sensors| sensors == all),
    }
}

fn spacing(axis: &Axis) -> String {
    if axis.sensors == 1 {
        return "one sensor".to_owned();
    }
    format!(
        "{:.2} mm (Eq. 7 for a factor of {}: {:.2})",
        axis.spacing_m * 1000.0,
        axis.factor,
        axis.spacing_by_eq_7_m * 1000.0
    )
}
