//! Says what would make a refused scene agree: tries every single change of scene and recording that people make by mistake.

pub(crate) mod change;
mod remedy;
mod search;
#[cfg(test)]
pub(crate) mod tests;

pub(crate) use change::Compared;
pub(crate) use remedy::{Remedy, remedy};
