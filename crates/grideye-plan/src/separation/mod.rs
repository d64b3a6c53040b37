//! How far apart two situations look to a sensor, in units of its noise (PeerJ CS 11:e3124, "Scenario B": "a preliminary
//! evaluation of the effectiveness and limitations").
//!
//! ```text
//!  picture of situation 1 ─┐
//!                          ├─ difference of each pixel / sigma ─▶ d' = root of the sum of squares
//!  picture of situation 2 ─┘
//! ```
//!
//! An observer who knows both pictures, and has to say of one noisy frame which it is, errs with probability
//! `Φ(-d' / 2)` (Green and Swets 1966): 16 % at 2, 0.6 % at [`D_PRIME_MIN`]. The distances of several sensors add by
//! their squares. It is a bound: whoever does not know the pictures beforehand does worse.

mod distance;
mod report;

pub use distance::{
    D_PRIME_MIN, Distance, Pair, SITUATIONS_MAX, Separation, SeparationError, distance, separation,
};
