//! Reads the files that people name, with one error for all of them, and compares a recording with a scene: for the command
//! line and the Python package alike.
//!
//! ```text
//!  names of files ─┬─ scene (with what it names) ─┐
//!                  ├─ profile, thresholds ────────┼─▶ compare ─▶ Compared: the comparison, and what the report says of its files
//!                  ├─ script of faults            │
//!                  └─ recording ──────────────────┘        any failure ─▶ InputError: file, line, message, hint
//! ```
//!
//! | file | function |
//! |---|---|
//! | a scene, with the files that it names | [`scene`](fn@scene), [`SceneText`] |
//! | a sensor's profile, or a built-in one | [`profile`], [`profile_or_built_in`] |
//! | thresholds of a verdict | [`thresholds`] |
//! | a script of faults | [`faults`], [`faults_of`] |
//!
//! ```
//! use grideye_inputs::{SceneText, scene, sensor_name};
//! use std::path::Path;
//!
//! let text = "[room]\nsize_mm = [4000, 4000, 2700]\nambient_c = 20\n\n[[sensor]]\nname = \"ceiling\"\npreset = \"grid-eye\"\n\
//!     position_mm = [2000, 2000, 2700]\nelevation_deg = 90\nazimuth_deg = -90\n";
//! let loaded = SceneText::built_in("room", text, &[]).parse(None)?;
//! assert_eq!(sensor_name(&loaded.scene, None)?, "ceiling");
//!
//! let error = scene(None, Path::new("nowhere.toml")).unwrap_err().to_string();
//! assert!(error.contains("nowhere.toml"), "{error}");
//! # Ok::<(), grideye_inputs::InputError>(())
//! ```
//!
//! The libraries below read no file that they were not handed, and the programs above must not differ in what they read.
//! The crate must not know HTTP or the command line.

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
