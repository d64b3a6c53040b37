//! What a right claim would score where the unit that recorded is known only within its specification.
//!
//! The recording's own repeat is no ceiling for a claim: it holds the unit's fixed pattern on both sides, the claim on
//! none. So units are drawn, [`DRAWS`] of them: a pattern for each pixel, a level, and the noise that was measured on the
//! recording. Each is shown the claimed scene, the same scene without its people, and a room without anything, at the
//! recording's own moments, and what it would have recorded is scored by the functions that score the recording. (A
//! parametric bootstrap: Efron and Tibshirani, 1993, chapter 6.)
//!
//! The laws of those scores say what may be asked of a right claim, and whether a room without people would get by with
//! as much.

pub(crate) mod claim;
pub(crate) mod units;

pub use units::{DRAWS, ScoreDistribution};
