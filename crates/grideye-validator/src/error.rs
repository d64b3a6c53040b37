//! Why frames could not be compared.

use crate::frames::timeline::Apart;
use std::fmt;
use std::time::Duration;

/// The side of a comparison that an error was found on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it")]
pub enum Side {
    Real,
    Simulated,
}

impl fmt::Display for Side {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(match self {
            Self::Real => "real",
            Self::Simulated => "simulated",
        })
    }
}

/// Why frames could not be compared. A comparison without a result is [`CannotTell`](crate::Verdict::CannotTell)
/// instead.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages say what each is")]
pub enum ValidatorError {
    #[error(
        "no {side} frame to compare\nhint: check that the recording has frames of this sensor and not only gaps"
    )]
    NoFrames { side: Side },
    #[error("{0}")]
    Refused(String),
    #[error("setting `{name}` is {found}, expected {expected}")]
    Setting {
        name: &'static str,
        expected: &'static str,
        found: f64,
    },
    #[error(
        "the recording begins {starts:?} into the scene, which ends after {ends:?}\nhint: give an earlier start"
    )]
    NoOverlap { starts: Duration, ends: Duration },
    #[error("stopped before there was a result")]
    Stopped,
    #[error(transparent)]
    Apart(#[from] Apart),
    #[error(transparent)]
    Scene(#[from] grideye_scene::SceneError),
}

pub(crate) const fn check_setting(
    is_met: bool,
    name: &'static str,
    expected: &'static str,
    found: f64,
) -> Result<(), ValidatorError> {
    if is_met {
        return Ok(());
    }
    Err(ValidatorError::Setting {
        name,
        expected,
        found,
    })
}
