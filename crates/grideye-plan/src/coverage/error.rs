//! Errors of a coverage survey.

use super::limits;
use grideye_scene::SceneError;

/// Why a survey fails.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CoverageError {
    /// Too much is asked for, or a value is invalid: a sentence and a hint.
    #[error("{0}")]
    Refused(String),
    /// There is no pose.
    #[error(
        "no candidate pose is in the room\nhint: choose a narrower spacing, or heights below the ceiling"
    )]
    NoCandidates,
    /// A scene, a preset or a sensor cannot be simulated.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

impl CoverageError {
    pub(crate) fn value(what: &str, found: &impl ToString, expected: &str, hint: &str) -> Self {
        let found = found.to_string();
        Self::Refused(format!(
            "{what} is {found}, expected {expected}\nhint: {hint}"
        ))
    }

    pub(crate) fn too_many_candidates(found: usize) -> Self {
        Self::Refused(format!(
            "{found} candidate poses, expected at most {}\nhint: choose a wider spacing, or fewer tilts, headings and heights",
            limits::CANDIDATES_MAX
        ))
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
    Err(CoverageError::value(what, &found, &expected, hint))
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
