//! Frames of one sensor, and what is true of them.

mod frames;
mod labels;

pub use crate::picture::image::{Image, Mask};
pub use frames::Simulator;
pub use labels::visibility;
