//! Errors and limits of sensor arrays.

/// Why sensors form no array.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ArrayError {
    /// No sensor, or more than [`SENSORS_MAX`].
    #[error(
        "{found} sensors, expected 1 to {SENSORS_MAX}\nhint: name the sensors of the array with --sensors"
    )]
    Count {
        /// The number of sensors.
        found: usize,
    },
    /// A sensor differs from the first.
    #[error(
        "sensor `{name}` differs from `{first}` in {what}\nhint: an array needs equal sensors that look the same way; name them with --sensors"
    )]
    Unlike {
        /// The sensor.
        name: String,
        /// The first sensor.
        first: String,
        /// The differing property.
        what: &'static str,
    },
    /// The sensors do not fill a grid with one in each place.
    #[error(
        "{sensors} sensors are not in a grid of {across} x {down} places\nhint: Eq. 7 needs sensors in rows and columns, all equally far apart"
    )]
    NoGrid {
        /// The number of sensors.
        sensors: usize,
        /// Distinct places across.
        across: usize,
        /// Distinct places down.
        down: usize,
    },
    /// The spacing is not a pixel divided by a whole number.
    #[error(
        "sensors are {spacing_mm} mm apart {direction}, expected {expected_mm} mm at an operating distance of {distance_mm} mm for a factor of {factor} (Eq. 7)\nhint: move the sensors, or set operating_distance_mm to their intended distance"
    )]
    Spacing {
        /// `across` or `down`.
        direction: &'static str,
        /// The spacing.
        spacing_mm: f64,
        /// The spacing by Eq. 7 for the nearest factor.
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
        /// The number of cells.
        cells: usize,
    },
}

/// Limit on the sensors of an array.
pub const SENSORS_MAX: usize = 400;

/// Limit on the cells of a virtual sensor on one axis.
pub const CELLS_PER_AXIS_MAX: usize = 1_000;

/// Limit on the steps of the least-squares solution, which ends earlier once it has converged.
pub const STEPS_MAX: usize = 1_000;
