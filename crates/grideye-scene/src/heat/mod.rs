//! How warm a body is: over its faces, and in time.

mod thermal;
mod transient;

pub(crate) use thermal::Thermal;
pub(crate) use transient::{Material, Transient, left};
