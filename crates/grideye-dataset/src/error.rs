//! Errors of making a dataset.

use grideye_scene::SceneError;
use grideye_variation::VariationError;
use std::io;
use std::path::PathBuf;

/// Why a part could not be written, as reported by its writer.
pub type Cause = Box<dyn std::error::Error + Send + Sync>;

/// So many draws are tried for a frame with the wanted people in view.
pub const TRIES_MAX: u64 = 1_000;

/// Why a dataset cannot be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DatasetError {
    /// The scene lacks something requested.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A frame's values cannot be drawn.
    #[error(transparent)]
    Variation(#[from] VariationError),
    /// A frame has another size.
    #[error(
        "frame {index} has {} x {} pixels, but the scene's sensor has {} x {}\nhint: all frames of a dataset have one size; make one dataset per resolution",
        found.0, found.1, expected.0, expected.1
    )]
    Size {
        /// The frame, from 0.
        index: u64,
        /// Its columns and rows.
        found: (usize, usize),
        /// Columns and rows of the scene's sensor.
        expected: (usize, usize),
    },
    /// Weights of people in view that the scene or the clips do not allow.
    #[error(
        "{weights} weights of people in view, for {agents} agents and clips of {clip} frames\nhint: give up to {} weights from 0 on, not all 0, for 0, 1, 2 and more people, as in --in-view 1,1,1, and no --clip",
        agents + 1
    )]
    InView {
        /// How many weights are given.
        weights: usize,
        /// Agents of the scene.
        agents: usize,
        /// Frames of a clip.
        clip: u64,
    },
    /// No draw shows the wanted number of people.
    #[error(
        "frame {index}: none of {} draws has {people} in view\nhint: give {people} the weight 0 in --in-view, or let more people be there, nearer to the sensor",
        TRIES_MAX
    )]
    NoClass {
        /// The frame, from 0.
        index: u64,
        /// The wanted number of people in view.
        people: u64,
    },
    /// More parts than there are names for.
    #[error(
        "{frames} frames with {per_part} per part need more than {limit} parts\nhint: ask for fewer frames, or for more per part with --frames-per-part"
    )]
    Parts {
        /// Frames in the dataset.
        frames: u64,
        /// Frames per part.
        per_part: u64,
        /// The limit on parts.
        limit: u64,
    },
    /// A split that would be empty.
    #[error(
        "the split `{name}` gets none of {clips} clips\nhint: ask for more frames, or give it a larger share"
    )]
    Split {
        /// Its name.
        name: String,
        /// Clips in the dataset.
        clips: u64,
    },
    /// A clip that would be cut.
    #[error(
        "--{what} {number} does not hold whole clips of {clip} frames\nhint: write a multiple of {clip}, such as --{what} {}",
        (number / clip).max(1) * clip
    )]
    Clips {
        /// The option.
        what: &'static str,
        /// Its value.
        number: u64,
        /// Frames in a clip.
        clip: u64,
    },
    /// A file of something else.
    #[error(
        "{} exists but is not a complete file of this dataset; it is left as it is\nhint: name another folder with --out, or move the file away",
        .0.display()
    )]
    Foreign(PathBuf),
    /// The manifest of another dataset, and the differences.
    #[error(
        "{} belongs to another dataset: {}\nhint: name another folder with --out, or continue this one with the same scene, options and program",
        .0.display(), .1
    )]
    OtherDataset(PathBuf, String),
    /// Another process is writing this file.
    #[error(
        "another process is writing {}\nhint: give every process its own shard with --shard",
        .0.display()
    )]
    Locked(PathBuf),
    /// The folder cannot be created.
    #[error("cannot create the folder {}: {}\nhint: name a folder you can write to with --out", .0.display(), .1)]
    NoFolder(PathBuf, io::Error),
    /// A file in the folder cannot be read.
    #[error("cannot read {}: {}\nhint: name another folder with --out, or fix this file", .0.display(), .1)]
    Unread(PathBuf, io::Error),
    /// A file cannot be written.
    #[error(
        "cannot write {}: {:#}\nhint: free disk space or fix the folder, then run the same command again: it continues where it stopped",
        .0.display(), .1
    )]
    Unwritten(PathBuf, Cause),
}

impl DatasetError {
    /// Whether the user must change the request, as opposed to fixing the disk.
    #[must_use]
    pub const fn is_bad_input(&self) -> bool {
        !matches!(self, Self::Unread(..) | Self::Unwritten(..))
    }
}
