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
//! | [`Method::Interpolation`] | linear between the nearest centers of pixels of all sensors |
//! | [`Method::LeastSquares`] | such that all cells together, blurred as the sensors blur, explain all pixels, with few steps between them (Irani and Peleg 1991; Farsiu et al. 2004) |

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
