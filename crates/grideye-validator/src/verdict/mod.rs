//! From the scores to agrees, disagrees or cannot tell: one criterion after the other, and the sentences for each.

pub(crate) mod criterion;
mod image_criteria;
pub(crate) mod judgement;
mod score_criteria;
pub(crate) mod sensor_criteria;
mod sufficiency;
pub(crate) mod types;
mod weighed;

pub use criterion::{Asked, Criterion, State};
pub use types::{Judgement, Nobody, Verdict, WarmPixels};

#[cfg(test)]
mod tests;
