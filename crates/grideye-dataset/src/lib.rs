#![doc = include_str!("../README.md")]

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
