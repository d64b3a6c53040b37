//! Why sensors make no array, and the bounds of one.

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
