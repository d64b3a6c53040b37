//! Errors of making a dataset.

use grideye_scene::SceneError;
use grideye_variation::VariationError;

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
    /// What was asked for cannot be, or the folder holds something else: what, and a hint.
    #[error("{0}")]
    Refused(String),
    /// A file cannot be read or written: which, why, and a hint.
    #[error("{0}")]
    Disk(String),
}

impl DatasetError {
    /// Whether the user must change the request, as opposed to fixing the disk.
    #[must_use]
    pub const fn is_bad_input(&self) -> bool {
        !matches!(self, Self::Disk(_))
    }
}
