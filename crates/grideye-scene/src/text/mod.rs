//! Tools for reporting on a file: places, rules, excerpts, and formatted lengths.

pub(crate) mod place;
pub(crate) mod source;
pub(crate) mod utc;

pub(crate) use place::{MM_PER_M, excerpt, millimeters, reach};
pub use place::{Place, Refusal};
pub(crate) use source::{Bounded, Rule, Source};
pub(crate) use utc::NoUtc;
pub use utc::Utc;
