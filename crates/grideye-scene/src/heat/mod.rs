//! How warm a body is, over its faces and over time.

mod transient;

pub(crate) use transient::{Material, Thermal, Transient, left};
