//! Super-resolution: several sensors side by side as one of more pixels (PeerJ CS 11:e3124, "Scenario A").
//!
//! ```text
//!  n sensors, each one cell beside the next           cells of the virtual sensor, one axis, R = 2, m = n = 3
//!  ├── pixel, m cells ──┤                                ┌─┬─┬─┬─┬─┬─┬─┬─┐
//!  sensor 0  █████ █████                       coverage  │1│2│3│3│3│3│2│1│   union R m + n - 1 = 8
//!  sensor 1   █████ █████                                └─┴─┴─┴─┴─┴─┴─┴─┘   covered by all R m - (n - 1) = 4
//!  sensor 2    █████ █████
//! ```
//!
//! Spacing, Eq. 7: `x = 2 d tan(FOV / 2) / (R m)`, so that in the plane at distance `d` the sensors are one cell apart.
//! Number of cells, Eq. 8: the paper's copy has lost it; both readings are offered, the union is what is computed.
//! What lies before or behind that plane is seen displaced, and therefore blurred, as the paper says.
//!
//! | method | a cell is |
//! |---|---|
//! | [`Method::Mean`] | the mean of the pixels that lie over it, one of each sensor |
//! | [`Method::Maximum`] | the warmest of them |
//! | [`Method::Interpolation`] | linear between the nearest centres of pixels of all sensors |
//! | [`Method::LeastSquares`] | such that all cells together, blurred as the sensors blur, explain all pixels, with few steps between them (Irani and Peleg 1991; Farsiu et al. 2004) |

use crate::count;
use crate::error::SceneError;
use crate::physical::Optics;
use crate::scene::{Scene, Sensor};
use crate::simulator::{Image, Simulator};
use glam::{DVec2, DVec3, USizeVec2};

/// Sensors in a grid that look the same way.
#[derive(Debug, Clone)]
pub struct SensorArray {
    across: Axis,
    down: Axis,
    /// For each sensor, in the order given: its place across and down, from the top left of the picture.
    places: Vec<(usize, usize)>,
    /// The sensor that the array stands for.
    virtual_sensor: Sensor,
}

/// How the frames of several sensors become one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Method {
    /// The mean of the pixels over a cell.
    Mean,
    /// Linear between the nearest centres of pixels.
    Interpolation,
    /// The warmest pixel over a cell.
    Maximum,
    /// The cells that explain all pixels best, and are level where pixels tell nothing.
    LeastSquares,
}

/// One axis of the array.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// Pixels of one sensor, the paper's R.
    pub pixels: usize,
    /// Cells a pixel, the paper's multiplication factor m.
    pub factor: usize,
    /// Sensors, the paper's n.
    pub sensors: usize,
    /// Distance between sensors as the scene has it, metres; 0 for one sensor.
    pub spacing_m: f64,
    /// The same by Eq. 7, metres.
    pub spacing_by_eq_7_m: f64,
}

/// Why sensors make no array.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ArrayError {
    /// No sensor at all, or more than [`SENSORS_MAX`].
    #[error(
        "{found} sensors, expected 1 to {SENSORS_MAX}\nhint: name the sensors of the array with --sensors"
    )]
    Count {
        /// How many there are.
        found: usize,
    },
    /// A sensor that is not like the first.
    #[error(
        "sensor `{name}` differs from `{first}` in {what}\nhint: an array is of equal sensors that look the same way; name those of the array with --sensors"
    )]
    Unlike {
        /// The sensor.
        name: String,
        /// The first sensor.
        first: String,
        /// In what it differs.
        what: &'static str,
    },
    /// Sensors that are not in a grid, one in each place.
    #[error(
        "{sensors} sensors are not in a grid of {across} x {down} places\nhint: Eq. 7 needs sensors in rows and columns, all equally far apart"
    )]
    NoGrid {
        /// Sensors.
        sensors: usize,
        /// Different places across.
        across: usize,
        /// Different places down.
        down: usize,
    },
    /// A spacing that is not a pixel divided by a whole number.
    #[error(
        "sensors are {spacing_mm} mm apart {direction}, expected {expected_mm} mm at an operating distance of {distance_mm} mm for a factor of {factor} (Eq. 7)\nhint: move the sensors, or set operating_distance_mm to the distance for which they are meant"
    )]
    Spacing {
        /// `across` or `down`.
        direction: &'static str,
        /// What it is.
        spacing_mm: f64,
        /// What Eq. 7 has for the nearest factor.
        expected_mm: f64,
        /// The sensors' operating distance.
        distance_mm: f64,
        /// The nearest factor.
        factor: usize,
    },
    /// More cells than [`CELLS_PER_AXIS_MAX`].
    #[error(
        "{cells} cells on one axis, expected at most {CELLS_PER_AXIS_MAX}\nhint: place fewer sensors, or farther apart"
    )]
    TooManyCells {
        /// The cells.
        cells: usize,
    },
}

/// Sensors of one array.
pub const SENSORS_MAX: usize = 400;
/// Cells of a virtual sensor on one axis.
pub const CELLS_PER_AXIS_MAX: usize = 1_000;
/// Steps of the least-squares solution; it ends earlier where another step changes nothing.
pub const STEPS_MAX: usize = 1_000;

impl SensorArray {
    /// The array of these sensors in the plane at their operating distance.
    ///
    /// # Errors
    /// [`ArrayError`].
    pub fn new(sensors: &[&Sensor]) -> Result<Self, ArrayError> {
        let first = match sensors {
            [first, ..] if sensors.len() <= SENSORS_MAX => *first,
            _ => {
                return Err(ArrayError::Count {
                    found: sensors.len(),
                });
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
        let extent = 2.0 * distance_m * tangents(first);
        let columns: Vec<f64> = offsets.iter().map(|offset| offset.x).collect();
        let rows: Vec<f64> = offsets.iter().map(|offset| offset.y).collect();
        let across = axis("across", &columns, first.columns, extent.x, distance_m)?;
        let down = axis("down", &rows, first.rows, extent.y, distance_m)?;
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

    /// Along the rows of the picture.
    #[must_use]
    pub const fn across(&self) -> &Axis {
        &self.across
    }

    /// Along its columns.
    #[must_use]
    pub const fn down(&self) -> &Axis {
        &self.down
    }

    /// The sensor of high resolution in the middle of the array that it stands for: one pixel for each cell.
    #[must_use]
    pub const fn virtual_sensor(&self) -> &Sensor {
        &self.virtual_sensor
    }

    /// What the virtual sensor sees of the scene: the truth that fused frames are measured against.
    ///
    /// # Errors
    /// None that a scene can have which the array's sensors came from.
    pub fn truth(&self, scene: &Scene) -> Result<Simulator, SceneError> {
        let scene = Scene {
            sensors: vec![self.virtual_sensor.clone()],
            ..scene.clone()
        };
        Simulator::without_grid(&scene, &self.virtual_sensor.name)
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

    /// The frames, one of each sensor in the order of [`SensorArray::new`], as one.
    ///
    /// `noise_sigma_c` is the standard deviation of a pixel's noise, °C; only [`Method::LeastSquares`] needs it, to
    /// know how far the pixels are to be believed.
    ///
    /// # Panics
    /// If there is not one frame of each sensor, of its size.
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

    /// Cells `h` that make `|A h - pixels|² / (2 sigma²) + |steps of h| / b` least, where `b` is [`STEP_C`]: the most
    /// likely ones if neighbours differ seldom but then by much. The absolute value keeps edges, where a square would
    /// round them off; it is reached by squares whose weights follow the steps, [`ROUNDS`] times.
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

impl Axis {
    /// Cells that at least one sensor has in view: `R m + n - 1`.
    #[must_use]
    pub const fn union_cells(&self) -> usize {
        self.pixels * self.factor + self.sensors - 1
    }

    /// Cells that every sensor has in view: `R m - (n - 1)`.
    #[must_use]
    pub const fn covered_cells(&self) -> usize {
        (self.pixels * self.factor + 1).saturating_sub(self.sensors)
    }

    /// The pixel of a sensor that lies over a cell.
    fn pixel(&self, sensor: usize, cell: usize) -> Option<usize> {
        let pixel = cell.checked_sub(sensor)? / self.factor;
        (pixel < self.pixels).then_some(pixel)
    }

    const fn samples(&self) -> usize {
        self.sensors * self.pixels
    }

    /// The centre of a pixel, in cells from the first cell's edge.
    fn centre(&self, sensor: usize, pixel: usize) -> f64 {
        count::float(sensor) + count::float(self.factor) * (count::float(pixel) + 0.5)
    }

    /// For each cell the pixels with their weights, which sum to 1: those whose centres are nearest on either side.
    fn interpolation(&self) -> Vec<Vec<(usize, f64)>> {
        let mut centres: Vec<(f64, usize)> = (0..self.sensors)
            .flat_map(|sensor| (0..self.pixels).map(move |pixel| (sensor, pixel)))
            .map(|(sensor, pixel)| (self.centre(sensor, pixel), sensor * self.pixels + pixel))
            .collect();
        centres.sort_by(|one, other| one.0.total_cmp(&other.0));
        (0..self.union_cells())
            .map(|cell| neighbours(&centres, count::float(cell) + 0.5))
            .collect()
    }

    /// For each pixel of each sensor its response to each cell: a triangle that reaches to the middles of the next
    /// pixels, as the resampling kernel is, mirrored at the border of the sensor's own view, as that is.
    ///
    /// A triangle as wide as two pixels is a sum of triangles as wide as two cells, with these weights, so that
    /// blurring what the virtual sensor sees gives exactly what a sensor sees, where a pixel's centre is a cell's.
    fn blur(&self) -> Vec<Vec<(usize, f64)>> {
        let reach = count::float(self.factor);
        let width = self.pixels * self.factor;
        let mut rows = Vec::with_capacity(self.samples());
        for sensor in 0..self.sensors {
            for pixel in 0..self.pixels {
                let centre = self.centre(0, pixel);
                // From one pixel before the first cell of this one, counted from there.
                let taps = (0..3 * self.factor).map(|tap| {
                    let from_start = pixel * self.factor + tap;
                    let position = count::float(from_start) - reach + 0.5;
                    let weight = (1.0 - (position - centre).abs() / reach).max(0.0);
                    let inside = match from_start.checked_sub(self.factor) {
                        None => self.factor - 1 - from_start,
                        Some(cell) if cell >= width => 2 * width - 1 - cell,
                        Some(cell) => cell,
                    };
                    (sensor + inside, weight / reach)
                });
                rows.push(taps.filter(|(_, weight)| *weight > 0.0).collect());
            }
        }
        rows
    }
}

/// The normal equations, one axis after the other.
struct System {
    across: Vec<Vec<(usize, f64)>>,
    down: Vec<Vec<(usize, f64)>>,
    columns: usize,
    /// Weight of the step from each cell to the next, and to the one below.
    to_right: Vec<f64>,
    to_below: Vec<f64>,
}

impl System {
    /// Conjugate gradients from the cells that are given.
    fn solve(&self, pixels: &[f64], cells: &mut [f64]) {
        let wanted = self.spread_back(pixels);
        let applied = self.apply(cells);
        let mut rest: Vec<f64> = wanted.iter().zip(&applied).map(|(a, b)| a - b).collect();
        let mut direction = rest.clone();
        let mut left = dot(&rest, &rest);
        let enough = 1e-24 * dot(&wanted, &wanted);
        for _ in 0..STEPS_MAX {
            if left <= enough {
                break;
            }
            let image = self.apply(&direction);
            let step = left / dot(&direction, &image);
            add_scaled(cells, step, &direction);
            add_scaled(&mut rest, -step, &image);
            let before = left;
            left = dot(&rest, &rest);
            for (part, rest) in direction.iter_mut().zip(&rest) {
                *part = rest + left / before * *part;
            }
        }
    }

    /// What the sensors make of the cells, given back to the cells, and the smoothness.
    fn apply(&self, cells: &[f64]) -> Vec<f64> {
        let mut sum = self.spread_back(&self.seen(cells));
        for (apart, weights) in [(1, &self.to_right), (self.columns, &self.to_below)] {
            for (here, weight) in weights.iter().enumerate() {
                // The last cell of a row has no neighbour to the right.
                if apart == 1 && (here + 1) % self.columns == 0 {
                    continue;
                }
                let slope = weight * (cells[here] - cells[here + apart]);
                sum[here] += slope;
                sum[here + apart] -= slope;
            }
        }
        sum
    }

    fn seen(&self, cells: &[f64]) -> Vec<f64> {
        let mut pixels = Vec::with_capacity(self.down.len() * self.across.len());
        for down in &self.down {
            let mut line = vec![0.0; self.columns];
            for (row, weight) in down {
                add_scaled(
                    &mut line,
                    *weight,
                    &cells[row * self.columns..][..self.columns],
                );
            }
            let pixel = |across: &Vec<(usize, f64)>| {
                across
                    .iter()
                    .map(|(column, weight)| weight * line[*column])
                    .sum::<f64>()
            };
            pixels.extend(self.across.iter().map(pixel));
        }
        pixels
    }

    /// The transpose of [`System::seen`].
    fn spread_back(&self, pixels: &[f64]) -> Vec<f64> {
        let rows = 1 + self
            .down
            .iter()
            .flatten()
            .map(|(row, _)| *row)
            .max()
            .unwrap_or(0);
        let mut cells = vec![0.0; rows * self.columns];
        for (down, line) in self.down.iter().zip(pixels.chunks_exact(self.across.len())) {
            let mut spread = vec![0.0; self.columns];
            for (across, pixel) in self.across.iter().zip(line) {
                for (column, weight) in across {
                    spread[*column] += weight * pixel;
                }
            }
            for (row, weight) in down {
                add_scaled(
                    &mut cells[row * self.columns..][..self.columns],
                    *weight,
                    &spread,
                );
            }
        }
        cells
    }
}

fn neighbours(centres: &[(f64, usize)], at: f64) -> Vec<(usize, f64)> {
    let after = centres.partition_point(|(centre, _)| *centre < at - SAME_CELL);
    let before = if centres
        .get(after)
        .is_some_and(|(centre, _)| *centre <= at + SAME_CELL)
    {
        after
    } else {
        after.saturating_sub(1)
    };
    let after = after.min(centres.len().saturating_sub(1));
    let (low, high) = (centres[before].0, centres[after].0);
    let share = if high > low {
        ((at - low) / (high - low)).clamp(0.0, 1.0)
    } else {
        1.0
    };
    let mut weights = Vec::new();
    for (centre, part) in [(low, 1.0 - share), (high, share)] {
        // Pixels of several sensors may have one centre: their mean stands for it.
        let here: Vec<usize> = centres
            .iter()
            .filter(|(other, _)| (other - centre).abs() < SAME_CELL)
            .map(|(_, pixel)| *pixel)
            .collect();
        if part > 0.0 {
            let each = part / count::float(here.len());
            weights.extend(here.into_iter().map(|pixel| (pixel, each)));
        }
    }
    weights
}

fn check_alike(first: &Sensor, sensors: &[&Sensor]) -> Result<(), ArrayError> {
    for sensor in sensors {
        let forward_m = first.pose.point_in_sensor(sensor.pose.position_m).x;
        let turned =
            (sensor.pose.world_from_sensor() - first.pose.world_from_sensor()).to_cols_array();
        let differences = [
            (
                "resolution",
                (sensor.columns, sensor.rows) != (first.columns, first.rows),
            ),
            (
                "fov_deg",
                sensor.field_of_view_rad != first.field_of_view_rad,
            ),
            (
                "operating_distance_mm",
                (sensor.operating_distance_m - first.operating_distance_m).abs() > SLACK_M,
            ),
            ("its angles", turned.iter().any(|part| part.abs() > 1e-9)),
            (
                "its place along the axis of view",
                forward_m.abs() > SLACK_M,
            ),
        ];
        if let Some((what, _)) = differences.into_iter().find(|(_, differs)| *differs) {
            return Err(ArrayError::Unlike {
                name: sensor.name.clone(),
                first: first.name.clone(),
                what,
            });
        }
    }
    Ok(())
}

/// Spacing and factor from the places on one axis.
fn axis(
    direction: &'static str,
    offsets: &[f64],
    pixels: usize,
    extent_m: f64,
    distance_m: f64,
) -> Result<Axis, ArrayError> {
    let different = different(offsets);
    let sensors = different.len();
    let (low, high) = (different[0], different[sensors - 1]);
    let pixel_m = extent_m / count::float(pixels);
    let spacing_m = if sensors > 1 {
        (high - low) / count::float(sensors - 1)
    } else {
        0.0
    };
    let factor = if sensors > 1 {
        count::floor((pixel_m / spacing_m).round()).max(1)
    } else {
        1
    };
    let axis = Axis {
        pixels,
        factor,
        sensors,
        spacing_m,
        spacing_by_eq_7_m: pixel_m / count::float(factor),
    };
    let is_even = different.iter().enumerate().all(|(index, offset)| {
        (offset - low - count::float(index) * spacing_m).abs() <= TOLERANCE * spacing_m
    });
    let is_eq_7 =
        sensors == 1 || (spacing_m - axis.spacing_by_eq_7_m).abs() <= TOLERANCE * spacing_m;
    if !(is_even && is_eq_7) {
        let rounded = |metres: f64| (metres * 1e5).round() / 100.0;
        return Err(ArrayError::Spacing {
            direction,
            spacing_mm: rounded(if is_even {
                spacing_m
            } else {
                different[1] - low
            }),
            expected_mm: rounded(axis.spacing_by_eq_7_m),
            distance_mm: rounded(distance_m),
            factor,
        });
    }
    let cells = pixels.saturating_mul(factor).saturating_add(sensors - 1);
    if cells > CELLS_PER_AXIS_MAX {
        return Err(ArrayError::TooManyCells { cells });
    }
    Ok(axis)
}

/// The places without those that are there already, in order.
fn different(offsets: &[f64]) -> Vec<f64> {
    let mut sorted = offsets.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.dedup_by(|one, other| (*one - *other).abs() <= SLACK_M);
    sorted
}

fn place(offset: f64, offsets: &[f64], axis: &Axis) -> usize {
    let low = offsets.iter().copied().fold(f64::INFINITY, f64::min);
    if axis.sensors > 1 {
        count::floor(((offset - low) / axis.spacing_m).round())
    } else {
        0
    }
}

fn check_full(places: &[(usize, usize)], across: &Axis, down: &Axis) -> Result<(), ArrayError> {
    let mut sorted = places.to_vec();
    sorted.sort_unstable();
    sorted.dedup();
    if sorted.len() == places.len() && places.len() == across.sensors * down.sensors {
        return Ok(());
    }
    Err(ArrayError::NoGrid {
        sensors: places.len(),
        across: across.sensors,
        down: down.sensors,
    })
}

fn middle(offsets: &[f64]) -> f64 {
    let (low, high) = offsets
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), offset| {
            (low.min(*offset), high.max(*offset))
        });
    0.5 * (low + high)
}

fn virtual_sensor(first: &Sensor, middle: DVec2, across: &Axis, down: &Axis) -> Sensor {
    let share =
        |axis: &Axis| count::float(axis.union_cells()) / count::float(axis.pixels * axis.factor);
    let shares = DVec2::new(share(across), share(down));
    let wider = tangents(first) * shares;
    let points = |points: usize, share: f64| count::floor((count::float(points) * share).ceil());
    let mut pose = first.pose;
    pose.position_m += first.pose.world_from_sensor() * DVec3::new(0.0, -middle.x, -middle.y);
    Sensor {
        name: "virtual".to_owned(),
        columns: across.union_cells(),
        rows: down.union_cells(),
        field_of_view_rad: 2.0 * DVec2::new(libm::atan(wider.x), libm::atan(wider.y)),
        grid_points: USizeVec2::new(
            points(first.grid_points.x, shares.x),
            points(first.grid_points.y, shares.y),
        ),
        pose,
        // The truth is sharp: the step of its own pixels is what it may blur.
        optics: Optics::Pinhole,
        pixel_width_rad: None,
        blur_rad: DVec2::ZERO,
        profile: None,
        ..first.clone()
    }
}

fn tangents(sensor: &Sensor) -> DVec2 {
    let half = 0.5 * sensor.field_of_view_rad;
    DVec2::new(libm::tan(half.x), libm::tan(half.y))
}

/// The difference of each cell to the one so many further on.
fn steps(cells: &[f64], apart: usize) -> impl Iterator<Item = f64> {
    let further = cells.iter().skip(apart);
    cells.iter().zip(further).map(|(one, other)| one - other)
}

fn dot(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(one, other)| one * other).sum()
}

fn add_scaled(sum: &mut [f64], scale: f64, parts: &[f64]) {
    for (sum, part) in sum.iter_mut().zip(parts) {
        *sum += scale * part;
    }
}

/// Deviation of a spacing from Eq. 7 that is let pass: 1 %, a third of a millimetre in 30.
const TOLERANCE: f64 = 0.01;
/// Places so near to one another are one: a tenth of a millimetre.
const SLACK_M: f64 = 1e-4;
/// Centres so near to one another, in cells, are one.
const SAME_CELL: f64 = 1e-6;
/// What a pixel may be wrong by without any noise, °C: what is not exactly in the plane.
const SIGMA_FLOOR_C: f64 = 0.02;
/// By how much neighbouring cells differ, °C: what weighs smoothness against the noise. From 0.4 to 1 the error of
/// scenario A's fused frame hardly changes.
const STEP_C: f64 = 0.5;
/// Steps below it weigh as it does, °C: rounding must not.
const FLAT_C: f64 = 0.01;
/// How often the weights are found anew.
const ROUNDS: usize = 20;

#[cfg(test)]
mod tests {
    use super::*;

    fn axis_of(pixels: usize, factor: usize, sensors: usize) -> Axis {
        Axis {
            pixels,
            factor,
            sensors,
            spacing_m: 0.0,
            spacing_by_eq_7_m: 0.0,
        }
    }

    #[test]
    fn eq_8_of_the_paper_in_both_readings() {
        let axis = axis_of(8, 3, 3);
        assert_eq!((axis.union_cells(), axis.covered_cells()), (26, 22));
        let axis = axis_of(2, 2, 2);
        assert_eq!((axis.union_cells(), axis.covered_cells()), (5, 3));
        assert_eq!(axis_of(2, 1, 5).covered_cells(), 0);
    }

    #[test]
    fn the_response_of_a_pixel_is_the_triangle_and_sums_to_1() {
        let blur = axis_of(3, 3, 2).blur();
        assert_eq!(blur.len(), 6);
        // The middle pixel of the first sensor: cells 2 to 6 by 1, 2, 3, 2, 1 ninths.
        let expected = [(2, 1.0), (3, 2.0), (4, 3.0), (5, 2.0), (6, 1.0)];
        for ((cell, weight), (expected_cell, ninths)) in blur[1].iter().zip(expected) {
            assert_eq!(*cell, expected_cell);
            assert!((weight - ninths / 9.0).abs() < 1e-15);
        }
        // That of the second sensor is one cell further.
        assert_eq!(blur[4][0].0, 3);
        for (sizes, rows) in [
            ((3, 3, 2), blur),
            ((4, 2, 3), axis_of(4, 2, 3).blur()),
            ((1, 5, 1), axis_of(1, 5, 1).blur()),
        ] {
            for row in rows {
                let total: f64 = row.iter().map(|(_, weight)| weight).sum();
                assert!((total - 1.0).abs() < 1e-12, "{sizes:?}: {row:?}");
            }
        }
    }

    #[test]
    fn the_edge_pixel_is_mirrored() {
        // One pixel of 2 cells: the triangle over cells -1 to 2 is 1, 3, 3, 1 eighths, folded 4, 4.
        let blur = axis_of(1, 2, 1).blur();
        let mut cells = [0.0; 2];
        for (cell, weight) in &blur[0] {
            cells[*cell] += weight;
        }
        assert_eq!(cells, [0.5, 0.5]);
    }

    #[test]
    fn interpolation_is_exact_on_centres_and_linear_between_them() {
        // Factor 3, 3 sensors: each inner cell is the centre of one pixel.
        let axis = axis_of(2, 3, 3);
        let weights = axis.interpolation();
        assert_eq!(weights.len(), 8);
        for (cell, pixel) in [(1, 0), (2, 2), (3, 4), (4, 1), (5, 3), (6, 5)] {
            assert_eq!(weights[cell], [(pixel, 1.0)], "cell {cell}");
        }
        assert_eq!(weights[0], weights[1], "nothing lies beyond");
        // Factor 4, 1 sensor: centres at 2 and 6; the cell at 3.5 is 5/8 of the first and 3/8 of the second.
        let weights = axis_of(2, 4, 1).interpolation();
        assert_eq!(weights[3], [(0, 0.625), (1, 0.375)]);
    }
}
