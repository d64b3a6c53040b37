//! Compares a recording with a scene: cleans, aligns, simulates and scores.

mod compare_scene;
mod known_scene;
mod mounting;
mod notes;
mod rendering;
mod types;

pub use compare_scene::compare_scene;
pub use known_scene::KnownScene;
pub use types::{DYNAMIC_FRAMES, KnownUnit, LAG_FRAMES_MAX, Options, STATIC_FRAMES};
