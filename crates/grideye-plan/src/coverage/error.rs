//! Errors of a coverage survey.

use super::limits;
use grideye_scene::SceneError;

/// Why a survey fails.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CoverageError {
    /// The cells are too fine for the room.
    #[error(
        "{} cells of the floor, expected at most {}\nhint: choose larger cells",
        .0,
        limits::CELLS_MAX
    )]
    TooManyCells(usize),
    /// There are too many poses.
    #[error(
        "{} candidate poses, expected at most {}\nhint: choose a wider spacing, or fewer tilts, headings and heights",
        .0,
        limits::CANDIDATES_MAX
    )]
    TooManyCandidates(usize),
    /// There are too many pairs of a pose and a cell.
    #[error(
        "{poses} poses times {cells} cells are {} pairs, expected at most {}\nhint: choose a wider spacing of the poses, or larger cells",
        poses.saturating_mul(*cells),
        limits::PAIRS_MAX
    )]
    TooManyPairs {
        /// The number of poses.
        poses: usize,
        /// Cells of the floor inside the room.
        cells: usize,
    },
    /// There is no pose.
    #[error(
        "no candidate pose is in the room\nhint: choose a narrower spacing, or heights below the ceiling"
    )]
    NoCandidates,
    /// The person fits nowhere.
    #[error(
        "there is no place for {0}: furniture or walls are everywhere\nhint: choose smaller cells or a smaller person"
    )]
    NoPlace(String),
    /// A length, an angle or a count is invalid.
    #[error("{what} is {found}, expected {expected}\nhint: {hint}")]
    Value {
        /// The name of the value.
        what: &'static str,
        /// The value.
        found: String,
        /// The allowed values.
        expected: String,
        /// What to do.
        hint: &'static str,
    },
    /// A sensor without noise would see everything.
    #[error("sensor `{0}` has no noise to compare with\nhint: give it a noise_sigma_c above 0")]
    NoNoise(String),
    /// A scene, a preset or a sensor cannot be simulated.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

impl CoverageError {
    pub(crate) fn value(
        what: &'static str,
        found: &impl ToString,
        expected: impl Into<String>,
        hint: &'static str,
    ) -> Self {
        let (found, expected) = (found.to_string(), expected.into());
        Self::Value {
            what,
            found,
            expected,
            hint,
        }
    }
}

pub(crate) fn check_count(
    what: &'static str,
    found: usize,
    limit: usize,
    hint: &'static str,
) -> Result<(), CoverageError> {
    if (1..=limit).contains(&found) {
        return Ok(());
    }
    let expected = format!("1 to {limit}");
    Err(CoverageError::value(what, &found, expected, hint))
}

/// Checks that a length is at least a millimeter.
pub(crate) fn check_length(
    what: &'static str,
    length_m: f64,
    hint: &'static str,
) -> Result<(), CoverageError> {
    if length_m.is_finite() && length_m >= 1e-3 {
        return Ok(());
    }
    let found = format!("{} mm", length_m * 1000.0);
    Err(CoverageError::value(what, &found, "1 mm or more", hint))
}
