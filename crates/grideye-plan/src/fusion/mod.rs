//! Super-resolution: several sensors side by side as one of more pixels (PeerJ CS 11:e3124, "Scenario A").
//!
//! Eq. 7: `x = 2 d tan(FOV / 2) / (R m)` puts `n` sensors of `R` pixels one cell apart at distance `d`, `m` cells a
//! pixel; what is nearer or farther is blurred. Eq. 8 is lost in the paper's copy: of both readings, the union,
//! `R m + n - 1` cells, is computed; all views share `R m - (n - 1)`. [`Method`] says what a cell is.

mod arrangement;
mod array;
mod axis;
mod comparison;
mod error;
mod normal_equations;

pub use array::{Method, SensorArray};
pub use axis::Axis;
pub use comparison::Comparison;
pub use error::{ArrayError, CELLS_PER_AXIS_MAX, SENSORS_MAX, STEPS_MAX};
