//! Learns what each pixel shows of the empty room, from stretches of a recording without people.
//!
//! A profile takes it in two parts: the unit's pattern, which simulator and emulator add to any scene, and the room's
//! background, which only a comparison with a recording of that room adds too.
//!
//! # How empty stretches are found
//! The search uses means over ten frames, less their median pixel. A pixel's level is the coldest narrow cluster of its
//! means, because people are warmer than the room. A mean shows a person if any 2 x 2 pixels are warmer beyond noise.
//! Five means in a row without a person are a stretch, less its first and last. Levels are then taken from the
//! stretches and the search repeats.

pub(crate) mod fit;
pub(crate) mod once;
pub(crate) mod search;
mod split;

pub use fit::{Empty, Stretch};
pub use search::{Background, BackgroundError, background};
pub use split::put_shown_into;
