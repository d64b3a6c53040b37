//! How different two situations look to a sensor, in units of its noise (PeerJ CS 11:e3124, "Scenario B").
//!
//! d' is the root of the sum of squares of each pixel's difference / sigma. An observer who knows both images errs with
//! probability `Φ(-d' / 2)` (Green and Swets 1966): 16 % at 2, 0.6 % at [`D_PRIME_MIN`]. The squares of several sensors
//! add.

mod distance;
mod report;

pub(crate) use distance::d_prime;
pub use distance::{
    D_PRIME_MIN, Distance, Pair, SITUATIONS_MAX, Separation, SeparationError, distance, separation,
};
