//! Decides between a scene and its alternatives, with known error rates.
//!
//! ```text
//! film: the scene at the recording's times, and what each person adds at any place
//!   + draws of what the scene leaves open, and of the unit's noise ─▶ simulated recordings
//!
//! 260 of the scene ──▶ reference: location and scale of each statistic
//! 266 of the scene ──▶ rank: how many are as far off as the recording?   few: disagrees
//! 100 of each alternative ──▶ how like the scene are they?               as like as the recording: cannot tell
//!                                                                        else: agrees
//! ```
//!
//! A scene's subjects are its people, or its objects if it has none. Recordings of it differ by where its people are, how warm
//! they are, when it begins, and by the unit. Each recording, real or simulated, is reduced to the same vector of statistics
//! ([`model`]): delay, contrast of each subject, misfit, warmth beyond the scene or missing from it in blocks of pixels, and how
//! much more it is like the scene than like each alternative (a likelihood ratio; [`template`]). Alternatives are nobody, half a
//! meter aside, mirrored, at another time and so on ([`alternative`]).
//!
//! Read `decide` first, then `simulated`, `model` and `reference`. `advice` seeks what would make a refused scene agree.

mod advice;
mod alternative;
mod change;
mod constants;
mod decide;
mod displacement;
mod film;
mod image;
mod model;
mod person;
mod recording;
mod reference;
mod simulated;
mod template;
mod unit;

pub(crate) use advice::{Compared, advice};
#[cfg(test)]
pub(crate) use alternative::Alternative;
pub use constants::OFFSETS_M;
pub use decide::{Alternatively, Contrast, Decision};
pub(crate) use decide::{How, decide};
pub(crate) use film::{Film, Rendered};
pub(crate) use recording::Recording;
pub(crate) use reference::Statistic;
pub(crate) use simulated::Law;
