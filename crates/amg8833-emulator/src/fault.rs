//! What can be broken about a sensor and its bus, and what is broken now.

pub(crate) mod active;
mod kind;

pub use kind::{Chance, Fault, FaultCounts, FaultKind, FaultSet, Unit};
#[cfg(feature = "alloc")]
pub(crate) use kind::{draw, mix};
