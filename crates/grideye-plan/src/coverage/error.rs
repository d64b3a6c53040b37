//! Why there is no survey.

use super::limits;
use grideye_scene::SceneError;

/// Why there is no survey.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CoverageError {
    /// Cells too fine for the room.
    #[error(
        "{} cells of the floor, expected at most {}\nhint: choose larger cells",
        .0,
        limits::CELLS_MAX
    )]
    TooManyCells(usize),
    /// Too many poses.
    #[error(
        "{} candidate poses, expected at most {}\nhint: choose a wider spacing, or fewer tilts, headings and heights",
        .0,
        limits::CANDIDATES_MAX
    )]
    TooManyCandidates(usize),
    /// Too many pairs of a pose and a cell.
    #[error(
        "{poses} poses times {cells} cells are {} pairs, expected at most {}\nhint: choose a wider spacing of the poses, or larger cells",
        poses.saturating_mul(*cells),
        limits::PAIRS_MAX
    )]
    TooManyPairs {
        /// Poses.
        poses: usize,
        /// Cells of the floor in the room.
        cells: usize,
    },
    /// No pose at all.
    #[error(
        "no candidate pose is in the room\nhint: choose a narrower spacing, or heights below the ceiling"
    )]
    NoCandidates,
    /// Nothing to look at: furniture everywhere.
    #[error(
        "there is no place for {0}: furniture or walls are everywhere\nhint: choose smaller cells or a smaller person"
    )]
    NoPlace(String),
    /// A length, an angle or a count that makes no sense.
    #[error("{what} is {found}, expected {expected}\nhint: {hint}")]
    Value {
        /// What.
        what: &'static str,
        /// Its value.
        found: String,
        /// The values there may be.
        expected: String,
        /// What to do.
        hint: &'static str,
    },
    /// A sensor without noise sees everything.
    #[error("sensor `{0}` has no noise to compare with\nhint: give it a noise_sigma_c above 0")]
    NoNoise(String),
    /// A scene, a preset or a sensor that cannot be simulated.
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

/// Refuses a count that is not from 1 to a limit.
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

/// Refuses a length below a millimeter.
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
