//! What a right claim would score where the unit that recorded is known only within its specification.
//!
//! The recording's own repeat is no ceiling for a claim: it holds the unit's fixed pattern on both sides. So [`DRAWS`] units are
//! drawn (pattern, level, the noise that was measured); each is shown the scene, the scene without its people, and nothing,
//! and is scored as the recording is (a parametric bootstrap: Efron and Tibshirani, 1993, chapter 6).

pub(crate) mod claim;
pub(crate) mod units;

pub use units::{DRAWS, ScoreDistribution};
