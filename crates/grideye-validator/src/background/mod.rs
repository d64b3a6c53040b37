//! What each pixel shows of an empty room, learned from the stretches of a recording in which nobody is there.
//!
//! It is kept in the profile's `fixed_pattern.offset_c`, above the scene's empty room: what simulator, emulator and comparison
//! add to a simulated empty room must give the background.
//!
//! # How empty stretches are found
//! Means over ten frames, less their middle pixel. Each pixel's level is the coldest narrow cluster of its means, as people are
//! warmer than the room. A mean shows somebody if any two by two pixels are warmer beyond noise. Five means in a row without
//! anybody are a stretch, without its first and last; levels are then taken from the stretches, and the search is done again.

pub(crate) mod fit;
pub(crate) mod search;

pub use fit::{Empty, Stretch};
pub use search::{Background, BackgroundError, background};
