//! How warm a body is: over its faces, and in time.

mod transient;

pub(crate) use transient::{Material, Thermal, Transient, left};
