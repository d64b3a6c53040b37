//! Judges the evidence criterion by criterion: agrees, disagrees or cannot tell, with a sentence for each.

mod image_criteria;
pub(crate) mod judgment;
mod score_criteria;
pub(crate) mod sensor_criteria;
pub(crate) mod types;

pub use types::{Asked, Criterion, Judgment, Nobody, State, Verdict, WarmPixels};

#[cfg(test)]
mod tests;
