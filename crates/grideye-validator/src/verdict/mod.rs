//! Judges the evidence criterion by criterion: agrees, disagrees or cannot tell, with a sentence for each.

pub(crate) mod judgment;
mod scene_criteria;
pub(crate) mod sensor_criteria;
#[cfg(test)]
pub(crate) mod tests;
pub(crate) mod types;

pub use types::{Criterion, Judgment, State, Verdict};
