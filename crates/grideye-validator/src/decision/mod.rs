//! Decides between a scene and its alternatives, with known error rates.
//!
//! ```text
//!  scene ──▶ view: what each person adds at any place ┐                 ┌▶ of the scene ─────────▶ p of the recording
//!  laws of what the scene does not know exactly ──────┼▶ simulated ─────┤
//!  noise, pattern and steps of the unit ──────────────┘  recordings     └▶ of each alternative ──▶ excluded or not
//! ```
//!
//! A scene's subjects are its people, or its objects if it has none. A simulated recording, in the code a world, has people
//! beside where the scene has them, warmer or colder, earlier or later, seen by a unit with its own pattern and noise. Of all
//! recordings, the room that the scene has is subtracted first. Each is reduced to statistics; those of the recording are
//! compared with those of the scene's simulated recordings (is it one of them?) and of each alternative's (nobody, mirrored,
//! half a meter aside, at another time): if the recording could come from an alternative too, it cannot tell.

mod alternative;
mod builder;
pub(crate) mod decide;
mod displaced;
mod model;
pub(crate) mod recording;
pub(crate) mod spread;
pub(crate) mod template;
mod unit;
pub(crate) mod view;
mod world;

pub(crate) use alternative::Alternative;
pub use decide::{Alternatively, Contrast, Decision, Finding, OFFSETS_M};
pub(crate) use decide::{How, decide};
pub(crate) use recording::Recording;
pub(crate) use spread::{Statistic, contrast_in_words};
pub(crate) use view::{Image, Rendered, View};
