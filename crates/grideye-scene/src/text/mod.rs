//! Formatted lengths and time stamps.

mod lengths;
pub(crate) mod utc;

pub(crate) use lengths::{MM_PER_M, millimeters, reach};
pub(crate) use utc::NoUtc;
pub use utc::Utc;
