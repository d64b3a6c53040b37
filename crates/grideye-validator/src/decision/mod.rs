//! Decides between a scene and its alternatives, with known error rates.
//!
//! ```text
//!  scene ──▶ film: what each person adds at any place ───┐
//!  laws of what the scene does not know exactly ─────────┼──▶ worlds ──▶ statistics of right worlds ──▶ p of the recording
//!  noise, pattern and steps of the unit ─────────────────┘          └──▶ statistics of each alternative ─▶ told apart or not
//! ```
//!
//! A scene's subjects are its people, or its objects if it has none. A world is a recording that could be: people beside
//! where the scene has them, warmer or colder, earlier or later, seen by a unit with its own pattern and noise. The
//! recording's statistics are compared with those of worlds of the scene (is it one of them?) and of worlds of each
//! alternative (nobody, mirrored, half a meter aside, at another time): if the recording could come from an alternative
//! too, it cannot tell.

mod alternative;
mod builder;
pub(crate) mod decide;
mod displaced;
pub(crate) mod film;
mod model;
pub(crate) mod recording;
pub(crate) mod spread;
pub(crate) mod template;
mod unit;
mod world;

pub(crate) use alternative::Alternative;
pub use decide::{Alternatively, Contrast, Decision, Finding, OFFSETS_M};
pub(crate) use decide::{How, decide};
pub(crate) use film::{Film, Image, Rendered};
pub(crate) use recording::Recording;
pub(crate) use spread::Statistic;
pub(crate) use world::Law;
