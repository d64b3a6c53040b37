//! Why a dataset is not made.

use grideye_scene::SceneError;
use grideye_variation::VariationError;
use std::io;
use std::path::PathBuf;

/// Why a part could not be written, as whoever writes it has it.
pub type Cause = Box<dyn std::error::Error + Send + Sync>;

/// Why a dataset is not made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DatasetError {
    /// The scene has not what was asked for.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A frame cannot be drawn.
    #[error(transparent)]
    Variation(#[from] VariationError),
    /// A frame of another size.
    #[error(
        "frame {index} has {} x {} pixels, and the scene's sensor {} x {}\nhint: all frames of a dataset have one size; make one dataset for each resolution",
        found.0, found.1, expected.0, expected.1
    )]
    Size {
        /// The frame, from 0.
        index: u64,
        /// Its columns and rows.
        found: (usize, usize),
        /// Those of the scene's sensor.
        expected: (usize, usize),
    },
    /// More parts than have names.
    #[error(
        "{frames} frames, {per_part} in each part, are more than {limit} parts\nhint: ask for fewer frames, or for more in a part with --frames-per-part"
    )]
    Parts {
        /// Frames of the dataset.
        frames: u64,
        /// Frames of a part.
        per_part: u64,
        /// The most parts.
        limit: u64,
    },
    /// Somebody else's file.
    #[error(
        "{} is there, and is not a whole file of this dataset; it is left as it is\nhint: name another folder with --out, or move the file away",
        .0.display()
    )]
    Foreign(PathBuf),
    /// The folder of another dataset: its manifest, and in what it differs.
    #[error(
        "{} is of another dataset: {}\nhint: name another folder with --out, or give the same scene, options and program to go on with this one",
        .0.display(), .1
    )]
    OtherDataset(PathBuf, String),
    /// Another process has it in hand.
    #[error(
        "another process is writing {}\nhint: give every process a shard of its own with --shard",
        .0.display()
    )]
    Locked(PathBuf),
    /// A folder that cannot be made.
    #[error("cannot make the folder {}: {}\nhint: name a folder of your own with --out", .0.display(), .1)]
    NoFolder(PathBuf, io::Error),
    /// A file of the folder that cannot be looked at.
    #[error("cannot read {}: {}\nhint: name another folder with --out, or see to this file", .0.display(), .1)]
    Unread(PathBuf, io::Error),
    /// A file that cannot be written.
    #[error(
        "cannot write {}: {:#}\nhint: make room, or see to the folder, and run the same command again: it goes on where it was",
        .0.display(), .1
    )]
    Unwritten(PathBuf, Cause),
}

impl DatasetError {
    /// Whether it is for its user to change what was asked for, rather than for a disk to have room.
    #[must_use]
    pub const fn is_bad_input(&self) -> bool {
        !matches!(self, Self::Unread(..) | Self::Unwritten(..))
    }
}
