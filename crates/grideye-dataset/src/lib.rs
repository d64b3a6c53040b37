//! Labeled frames of a scene that differs from frame to frame, in a folder of parts that many processes may fill.
//!
//! ```text
//!  scene + what varies + seed ──▶ manifest (dataset.json) ──▶ parts 0, 1, 2 … of so many frames each
//!                                                              part k belongs to shard k mod n, is made by one thread,
//!                                                              and gets its name when it is whole and on the disk
//! ```
//!
//! Frame k is a function of (scene, seed, k), and a part of its frames: how many threads and shards there are, and
//! where the work was interrupted, cannot be told from the files. How a part is written is for an [`Output`] to know.

mod error;
mod folder;
mod frames;
mod manifest;
mod part;
mod shard;
mod work;

pub use error::{Cause, DatasetError};
pub use folder::{Folder, Output};
pub use frames::{Frames, Remembered, Subject};
pub use manifest::Manifest;
pub use part::{AgentLabels, Part, Scalars, VariedColumn};
pub use shard::{Shard, Table};
pub use work::make;
