//! Sensors in a grid, and their frames combined into one.

use super::arrangement;
use super::arrangement::{check_alike, check_full, middle, place, virtual_sensor};
use super::axis::Axis;
use super::error::{ArrayError, SENSORS_MAX};
use super::normal_equations::{System, steps};
use glam::DVec2;
use grideye_scene::{Image, Scene, SceneError, Sensor, Simulator, count};

/// Sensors in a grid that look the same way.
#[derive(Debug, Clone)]
pub struct SensorArray {
    across: Axis,
    down: Axis,
    /// Each sensor's place across and down, from the top left of the image.
    places: Vec<(usize, usize)>,
    /// The high-resolution sensor that the array replaces.
    virtual_sensor: Sensor,
}

/// How to combine the frames of several sensors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Method {
    /// The mean of the pixels over a cell.
    Mean,
    /// Linear between the nearest pixel centers.
    Interpolation,
    /// The warmest pixel over a cell.
    Maximum,
    /// The cells that explain all pixels best, and are level where pixels give no information.
    LeastSquares,
}

impl SensorArray {
    /// The array of these sensors, in the plane at their operating distance.
    ///
    /// # Errors
    /// [`ArrayError`].
    pub fn new(sensors: &[&Sensor]) -> Result<Self, ArrayError> {
        let first = match sensors {
            [first, ..] if sensors.len() <= SENSORS_MAX => *first,
            _ => {
                return Err(ArrayError(format!(
                    "{} sensors, expected 1 to {SENSORS_MAX}\nhint: name the sensors of the array with --sensors",
                    sensors.len()
                )));
            }
        };
        check_alike(first, sensors)?;
        let offsets: Vec<DVec2> = sensors
            .iter()
            .map(|sensor| {
                let at = first.pose.point_in_sensor(sensor.pose.position_m);
                DVec2::new(-at.y, -at.z)
            })
            .collect();
        let distance_m = first.operating_distance_m;
        let extent = 2.0 * distance_m * first.view_slopes();
        let columns: Vec<f64> = offsets.iter().map(|offset| offset.x).collect();
        let rows: Vec<f64> = offsets.iter().map(|offset| offset.y).collect();
        let across = arrangement::axis("across", &columns, first.columns, extent.x, distance_m)?;
        let down = arrangement::axis("down", &rows, first.rows, extent.y, distance_m)?;
        let places: Vec<(usize, usize)> = columns
            .iter()
            .zip(&rows)
            .map(|(x, y)| (place(*x, &columns, &across), place(*y, &rows, &down)))
            .collect();
        check_full(&places, &across, &down)?;
        let middle = DVec2::new(middle(&columns), middle(&rows));
        Ok(Self {
            across,
            down,
            places,
            virtual_sensor: virtual_sensor(first, middle, &across, &down),
        })
    }

    /// The axis along the rows of the image.
    #[must_use]
    pub const fn across(&self) -> &Axis {
        &self.across
    }

    /// The axis along the columns of the image.
    #[must_use]
    pub const fn down(&self) -> &Axis {
        &self.down
    }

    /// The high-resolution sensor at the center of the array that the array replaces: one pixel per cell.
    #[must_use]
    pub const fn virtual_sensor(&self) -> &Sensor {
        &self.virtual_sensor
    }

    /// What the virtual sensor sees of the scene: the truth for fused frames.
    ///
    /// # Errors
    /// None if the scene contains the array's sensors.
    pub fn truth(&self, scene: &Scene) -> Result<Simulator, SceneError> {
        let scene = scene.with_sensors(vec![self.virtual_sensor.clone()]);
        Simulator::new(&scene, &self.virtual_sensor.name)
    }

    /// How many sensors have each cell in view, row by row.
    #[must_use]
    pub fn coverage(&self) -> Vec<usize> {
        let on = |axis: &Axis, cell| {
            (0..axis.sensors)
                .filter(|at| axis.pixel(*at, cell).is_some())
                .count()
        };
        let rows = 0..self.down.union_cells();
        rows.flat_map(|row| {
            let down = on(&self.down, row);
            (0..self.across.union_cells()).map(move |column| down * on(&self.across, column))
        })
        .collect()
    }

    /// Combines one frame of each sensor, in the order of [`SensorArray::new`]. Least squares use the noise, °C.
    ///
    /// # Panics
    /// Unless there is one frame of each sensor, with its size.
    #[must_use]
    pub fn fuse(&self, method: Method, frames: &[Image], noise_sigma_c: f64) -> Image {
        assert_eq!(frames.len(), self.places.len(), "one frame of each sensor");
        for frame in frames {
            let size = (frame.columns, frame.rows);
            assert_eq!(
                size,
                (self.across.pixels, self.down.pixels),
                "pixels of a frame"
            );
        }
        match method {
            Method::Mean => self.over_cells(frames, |pixels| {
                pixels.iter().sum::<f64>() / count::float(pixels.len())
            }),
            Method::Maximum => self.over_cells(frames, |pixels| {
                pixels.iter().copied().fold(f64::NEG_INFINITY, f64::max)
            }),
            Method::Interpolation => self.interpolated(frames),
            Method::LeastSquares => self.least_squares(frames, noise_sigma_c),
        }
    }

    fn over_cells(&self, frames: &[Image], of: impl Fn(&[f64]) -> f64) -> Image {
        self.image(|row, column| {
            let pixels: Vec<f64> = frames
                .iter()
                .zip(&self.places)
                .filter_map(|(frame, (across, down))| {
                    let x = self.across.pixel(*across, column)?;
                    Some(frame.at(self.down.pixel(*down, row)?, x))
                })
                .collect();
            of(&pixels)
        })
    }

    fn interpolated(&self, frames: &[Image]) -> Image {
        let pixels = self.stacked(frames);
        let across = self.across.interpolation();
        let down = self.down.interpolation();
        self.image(|row, column| {
            let mut sum = 0.0;
            for (y, share) in &down[row] {
                for (x, part) in &across[column] {
                    sum += share * part * pixels[y * self.across.samples() + x];
                }
            }
            sum
        })
    }

    /// Minimizes `|A h - pixels|² / (2 sigma²) + |steps of h| / b` over the cells `h`, where `b` is [`STEP_C`];
    /// absolute steps keep edges. Runs [`ROUNDS`] rounds of least squares with weights updated from the steps.
    fn least_squares(&self, frames: &[Image], noise_sigma_c: f64) -> Image {
        let mut cells = self.fuse(Method::Mean, frames, noise_sigma_c);
        let pixels = self.stacked(frames);
        let variance = noise_sigma_c.max(SIGMA_FLOOR_C).powi(2);
        let mut system = System {
            across: self.across.blur(),
            down: self.down.blur(),
            columns: cells.columns,
            to_right: Vec::new(),
            to_below: Vec::new(),
        };
        for _ in 0..ROUNDS {
            let weight = |step: f64| variance / (STEP_C * step.abs().max(FLAT_C));
            system.to_right = steps(&cells.celsius, 1).map(weight).collect();
            system.to_below = steps(&cells.celsius, cells.columns).map(weight).collect();
            system.solve(&pixels, &mut cells.celsius);
        }
        cells
    }

    /// All pixels of all sensors in one table: rows by place down and row, columns by place across and column.
    fn stacked(&self, frames: &[Image]) -> Vec<f64> {
        let columns = self.across.samples();
        let mut pixels = vec![0.0; columns * self.down.samples()];
        for (frame, (across, down)) in frames.iter().zip(&self.places) {
            for row in 0..frame.rows {
                for column in 0..frame.columns {
                    let at = (down * frame.rows + row) * columns + across * frame.columns + column;
                    pixels[at] = frame.at(row, column);
                }
            }
        }
        pixels
    }

    fn image(&self, cell: impl Fn(usize, usize) -> f64) -> Image {
        let (columns, rows) = (self.across.union_cells(), self.down.union_cells());
        Image {
            columns,
            rows,
            celsius: (0..columns * rows)
                .map(|index| cell(index / columns, index % columns))
                .collect(),
        }
    }
}

/// Error of a pixel even without noise, °C, from surfaces not exactly in the plane.
const SIGMA_FLOOR_C: f64 = 0.02;
/// Typical difference of neighboring cells, °C; from 0.4 to 1 the error of scenario A's fused frame hardly changes.
const STEP_C: f64 = 0.5;
/// Smaller steps have the same weight, °C, because they are rounding.
const FLAT_C: f64 = 0.01;
const ROUNDS: usize = 20;
