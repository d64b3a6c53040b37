//! Faults: the kinds that can be injected, and those active now.

pub(crate) mod active;
mod kind;

pub use kind::{Chance, Fault, FaultCounts, FaultKind, FaultSet, Unit};
#[cfg(feature = "alloc")]
pub(crate) use kind::{draw, mix};
