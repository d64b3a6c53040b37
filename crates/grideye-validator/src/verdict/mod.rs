//! From the scores to agrees, disagrees or cannot tell: one criterion after the other, and the sentences for each.

mod image_criteria;
pub(crate) mod judgment;
mod score_criteria;
pub(crate) mod sensor_criteria;
pub(crate) mod types;

pub use types::{Asked, Criterion, Judgment, Nobody, State, Verdict, WarmPixels};

#[cfg(test)]
mod tests;
