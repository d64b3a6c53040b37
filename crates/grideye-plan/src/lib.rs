//! Answers questions about scenes: where to put sensors, what several see together or tell apart, and how a room looks
//! on paper.
//!
//! Like [`grideye_scene`], it opens no file, reads no clock and has no randomness of its own.

pub mod coverage;
pub mod drawing;
pub mod fusion;
pub mod ground;
pub mod separation;
