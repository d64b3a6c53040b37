//! Makes labeled frames of a scene that varies from frame to frame, in a folder of parts that many processes may fill.
//!
//! ```text
//!  scene + what varies (grideye-variation) ─▶ Frames ─▶ frame k: °C, °C without noise, labels, masks
//!                                               │
//!  Manifest: seed, frames, frames per part ─────┴─▶ make: missing parts on any number of threads ─▶ Folder
//!                                                         part-000000.parquet …  Output writes each file
//! ```
//!
//! Frame k is a function of (scene, seed, k), so threads, shards and interruptions do not change a part's content. A part
//! is written under a temporary name, locked, synced and renamed; files of others are never overwritten.
//!
//! | file | holds |
//! |---|---|
//! | `frames` | the scene of a frame, what its sensor measures, and the ground truth |
//! | `labels` | what a person who looks at a frame would say of it; from when on somebody counts as in view |
//! | `part`, `counts`, `card` | the frames of a part as columns; how many show what; the data card |
//! | `manifest`, `shard`, `splits` | what makes a dataset the same one; which parts are whose, and for training or testing |
//! | `folder`, `work` | which files are complete and ours; the threads |
//! | `preview` | frames to look at before |
//!
//! ```
//! use grideye_dataset::{CountsFrom, Frames, Subject, preview};
//! use grideye_scene::Scene;
//! use grideye_variation::Recipe;
//! use std::collections::BTreeMap;
//!
//! let text = r#"
//!     [room]
//!     size_mm = [4000, 6000, 2700]
//!     ambient_c = 20
//!
//!     [[agent]]
//!     name = "person"
//!     person = {}
//!     position_mm = [2000, 3000, 0]
//!
//!     [[sensor]]
//!     name = "ceiling"
//!     preset = "grid-eye"
//!     position_mm = [2000, 3000, 2700]
//!     elevation_deg = 90
//!     azimuth_deg = -90
//! "#;
//! let no_files = |_: &str| Err(std::io::ErrorKind::NotFound.into());
//! let scene = Scene::parse(text, "room.toml", &no_files)?.scene;
//! let vary = vec!["agent.person.position=floor".to_owned()];
//! let subject = Subject {
//!     title: "room".to_owned(),
//!     recipe: Recipe::new(text, "room.toml", &vary)?,
//!     vary,
//!     text: text.to_owned(),
//!     files: BTreeMap::new(),
//!     is_built_in: false,
//!     given: Vec::new(),
//!     sensor: "ceiling".to_owned(),
//!     seed: 1,
//!     clip: 1,
//!     counts_from: CountsFrom::default(),
//!     in_view: Vec::new(),
//! };
//! let frames = Frames::new(subject, &scene)?;
//! // A row for each number of people in view.
//! let rows = preview(&frames, 20)?;
//! assert!(rows.len() <= 2 && rows.iter().flatten().all(|seen| seen.celsius.len() == 64));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The crate must not know registers, clocks, HTTP, or file formats: the caller hands in an [`Output`].
//! `crates/grideye/DATASET.md` is the guide for users; `cargo bench -p grideye-dataset` prints labeled frames per CPU
//! second.

mod card;
mod counts;
mod error;
mod folder;
mod frames;
mod labels;
mod manifest;
mod part;
mod preview;
mod shard;
mod splits;
mod work;

pub use counts::Counts;
pub use error::{Cause, DatasetError, TRIES_MAX};
pub use folder::{Folder, Output};
pub use frames::{DRAWS_MAX, Frames, Remembered, Subject};
pub use labels::{CountsFrom, Label};
pub use manifest::Manifest;
pub use part::{AgentLabels, Part, Scalars, VariedColumn};
pub use preview::{Seen, preview};
pub use shard::{Shard, Table};
pub use splits::Splits;
pub use work::make;
