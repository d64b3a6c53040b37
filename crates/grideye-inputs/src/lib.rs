#![doc = include_str!("../README.md")]

mod comparison;
pub mod counting;
mod error;
mod read;
mod scene;
mod text;

pub use comparison::{Compared, Sides, compare, hashed, hashed_text, room};
pub use error::{InputError, shown};
pub use read::{TOML_HINT, faults, faults_of, profile, profile_or_built_in, thresholds};
pub use scene::{Beside, Held, LoadedScene, SceneText, scene, sensor_name};
pub use text::{open, read_text, regular, text};
