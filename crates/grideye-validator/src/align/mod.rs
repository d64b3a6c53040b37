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
//! - By default it finds a delay and a clock rate, each within a bound; half a second is a third of a meter of walking.
//! - The search looks beyond the bounds, and where it is better there, nothing is applied.
//! - It sees only what moves: each pixel loses its mean over time, so that what stands wrong stays in the scores.
//! - No delay gains by leaving frames out: beyond the walk's ends people stand, and a film without a scene explains nothing.
//! - Fifteen decoys (the scene turned, mirrored, run backwards) get the same freedom; no better than the best is not applied.
//! - A path must earn itself on frames that it was not fitted to, and keeps its pace between a half and one and a half.
//!
//! On a straight way walked once, a delay and a tilted sensor look alike; the report says so where an offset would do as well.

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
