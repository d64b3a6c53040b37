//! Errors and limits of sensor arrays.

/// Why sensors form no array: a sentence and a hint.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ArrayError(pub(super) String);

/// Limit on the sensors of an array.
pub const SENSORS_MAX: usize = 400;

/// Limit on the cells of a virtual sensor on one axis.
pub const CELLS_PER_AXIS_MAX: usize = 1_000;

/// Limit on the steps of the least-squares solution, which ends earlier once it has converged.
pub const STEPS_MAX: usize = 1_000;
