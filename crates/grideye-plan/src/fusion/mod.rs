//! Super-resolution: several adjacent sensors act as one with more pixels (PeerJ CS 11:e3124, "Scenario A").
//!
//! Eq. 7: `x = 2 d tan(FOV / 2) / (R m)` puts `n` sensors of `R` pixels one cell apart at distance `d`, with `m` cells
//! per pixel; anything nearer or farther is blurred. Eq. 8 is missing in our copy of the paper. Of its two readings, we
//! compute the union, `R m + n - 1` cells; all views share `R m - (n - 1)`. [`Method`] defines a cell's value.

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
