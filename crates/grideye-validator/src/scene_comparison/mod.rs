//! A recording beside a scene: frames are cleaned, aligned, simulated and compared.

mod compare_scene;
mod notes;
mod prior;
mod rendering;
mod selection;
mod types;
mod unit;

pub use compare_scene::compare_scene;
pub use types::{DYNAMIC_FRAMES, LAG_FRAMES_MAX, Options, STATIC_FRAMES};
pub use unit::KnownUnit;
