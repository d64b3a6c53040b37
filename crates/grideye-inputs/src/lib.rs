//! Reads the files that people name, for everything that people start: the command line and the Python package.
//!
//! | file | function |
//! |---|---|
//! | a scene, with the files that it names | [`scene`], [`SceneText`] |
//! | a sensor's profile, or a built-in one | [`profile`], [`profile_or_built_in`] |
//! | thresholds of a verdict | [`thresholds`] |
//! | a script of faults | [`faults`], [`faults_of`] |
//!
//! [`compare`] puts them together: a recording, a scene and what both may be judged by. Every failure is an
//! [`InputError`]: the message that the command line prints, with its file and line.

mod comparison;
mod error;
mod read;
mod scene;
mod text;

pub use comparison::{Compared, Sides, compare, hashed, hashed_text};
pub use error::InputError;
pub use read::{TOML_HINT, faults, faults_of, profile, profile_or_built_in, thresholds};
pub use scene::{Beside, LoadedScene, SceneText, scene, sensor_name};
pub use text::{open, read_text, text};
