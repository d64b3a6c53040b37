//! What each pixel shows of an empty room, learned from the stretches of a recording in which nobody is there.
//!
//! The background of an empty stretch tells more of a real frame than any law of physics does: what the room's surfaces
//! do, and what each pixel shows too much. It is kept in the profile's `fixed_pattern.offset_c`, as what each pixel has
//! above the scene's empty room, so that simulator, emulator and comparison need nothing new to use it. *Why no table of
//! its own: who adds the offsets to a simulated empty room must get the background, and that is what a pattern is.*
//!
//! # How empty stretches are found
//! Means over ten frames, less their middle pixel. Each pixel's level is the coldest narrow cluster of its means: people
//! are warmer than the room, and who stands still for most of the recording leaves a quarter of it at least. A mean
//! shows somebody if any two by two pixels are warmer than their levels beyond noise. Five such means in a row without
//! anybody are a stretch; the first and the last, in which somebody may be about to come, are not used. The levels are
//! then taken from the stretches, and the search is done again.

pub(crate) mod fit;
pub(crate) mod search;

pub use fit::{Empty, Stretch};
pub use search::{Background, BackgroundError, background};
