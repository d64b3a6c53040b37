//! Compares a recording with a scene: cleans, aligns, simulates and scores.

mod compare_scene;
mod notes;
mod rendering;
mod types;

pub use compare_scene::compare_scene;
pub use types::{DYNAMIC_FRAMES, KnownUnit, LAG_FRAMES_MAX, Options, STATIC_FRAMES};
