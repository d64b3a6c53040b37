//! Questions put to scenes: where to put sensors, what several see together or tell apart, and what a room looks like.
//!
//! Like [`grideye_scene`] it opens no file, reads no clock and owns no randomness.

pub mod coverage;
pub mod drawing;
pub mod fusion;
pub mod ground;
pub mod separation;
