//! Aligns a recording with a scene in time (delay, clock rate) and in the image (orientation, offset).
//!
//! ```text
//!  recording ─▶ each pixel less its mean ─┐
//!                                         ├─▶ likeness of what moves ─▶ best within the bounds ─▶ better than chance? ─▶ applied
//!  scene ─────▶ frames at any time ───────┘                                                    ─▶ or left as it was
//! ```
//!
//! What keeps alignment from making a wrong scene look right:
//!
//! - By default it finds a delay and a clock rate within bounds; half a second is a third of a meter of walking.
//! - The search looks beyond the bounds. If a better fit lies there, nothing is applied.
//! - Each pixel loses its mean over time, so only motion counts and static errors stay in the scores.
//! - No delay gains by dropping frames: before and after a walk its people stand.
//! - Fifteen decoys (the scene turned, mirrored, run backwards) get the same freedom. A fit no better than the best
//!   decoy is not applied.
//!
//! On a straight path walked once, a delay and a tilted sensor look alike.

pub(crate) mod aligner;
pub(crate) mod clock;
pub(crate) mod series;
pub(crate) mod space;
pub(crate) mod time_search;
pub(crate) mod types;

pub use aligner::{SAMPLE_MAX, SPAN_MAX};
pub use space::Orientation;
pub use types::{
    AlignOptions, Alignment, OFFSET_MAX_PX, OffsetFound, OrientationFound, RATE_MAX, SHIFT_MAX,
    TimeAlignment, TimeFound,
};
