//! Brings a recording and a scene into step: delay, clock rate, pace; and says how the image lies.
//!
//! ```text
//!  recording ─▶ each pixel less its mean ─┐
//!                                         ├─▶ likeness of what moves ─▶ best within the bounds ─▶ better than chance? ─▶ applied
//!  scene ─────▶ frames at any time ───────┘                                                    ─▶ or left as it was
//! ```
//!
//! Alignment could make a wrong scene look right. What keeps it from that:
//!
//! - It has one or two degrees of freedom by default, a delay and a clock rate, each within a stated bound. The default
//!   bound of half a second is a third of a meter of walking: what frames really lag behind is 0.2 to 0.3 s.
//! - The best delay must lie within the bounds. The search looks beyond them, and if it is better there, nothing is
//!   applied: a bound is not where a wrong scene may stop to be compared.
//! - It only ever sees what moves: each pixel loses its mean over time. A radiator, a table or an offset that is wrong
//!   cannot be aligned away, for they do not take part; they stay in the scores.
//! - Which frames count does not depend on the candidate: beyond the walk's ends the scene's people stand where they
//!   set off or arrived, and a film without a scene explains nothing there. No delay gains by leaving out what it cannot
//!   explain, and none loses by where the recording happens to end.
//! - Chance gets the same freedom. The same search is run with decoys: the scene in its seven other orientations and
//!   run backwards, fifteen films that move as much, as fast and as smoothly as the scene. An alignment that is no
//!   better than the best of them is not applied. Decoys that are the scene itself (a walk that is its own mirror
//!   image) are left out, told by their likeness to it.
//! - Warping must earn its path on frames that it was not fitted to, stays within the bound of the shift, and keeps
//!   every pace between a half and one and a half. Nobody is made to stand, to turn back or to be somewhere else.
//! - The scores and the verdict are then those of the aligned frames, with their floors and ceilings, as without.
//!
//! What it cannot tell: on a straight way walked once, a delay and a sensor that is tilted along the way look alike. If
//! an offset of the image explains the recording as well as the delay that was found, the report says so.

pub(crate) mod aligner;
pub(crate) mod clock;
mod film;
pub(crate) mod space;
pub(crate) mod time_search;
pub(crate) mod types;
mod warp_search;

pub use aligner::{SAMPLE_MAX, SPAN_MAX, align_films};
pub use clock::{Law, Warp};
pub use space::Orientation;
pub use types::{
    AlignOptions, Alignment, OFFSET_MAX_PX, OffsetFound, OrientationFound, RATE_MAX, SHIFT_MAX,
    TimeAlignment, TimeFound,
};
