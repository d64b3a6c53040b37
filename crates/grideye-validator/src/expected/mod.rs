//! What a right claim would score, given only the specification of the unit that recorded.
//!
//! The recording's own repeat is no ceiling for a claim, because it has the unit's fixed pattern on both sides. So
//! [`DRAWS`] units are drawn, each with a pattern, a level and the measured noise. Each sees the scene, the scene
//! without its people, and nothing, and is scored like the recording (a parametric bootstrap: Efron and Tibshirani,
//! 1993, chapter 6).

pub(crate) mod claim;
pub(crate) mod units;

pub use units::{DRAWS, ScoreDistribution};
