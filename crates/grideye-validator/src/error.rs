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
    #[error(
        "{found} {side} frames, expected at most {limit}\nhint: ask for fewer frames; they are chosen evenly over the recording"
    )]
    TooManyFrames {
        side: Side,
        limit: usize,
        found: usize,
    },
    #[error(
        "pixel index {pixel} of {side} frame {index} is not a finite number\nhint: leave the frame out; record a missing frame as missing, never as NaN"
    )]
    NotFinite {
        side: Side,
        index: usize,
        pixel: usize,
    },
    #[error(
        "{real} real frames cannot be paired with {simulated} simulated frames\nhint: simulate one frame at the time of each real frame, or use the static protocol"
    )]
    Unpaired { real: usize, simulated: usize },
    #[error("setting `{name}` is {found}, expected {expected}")]
    Setting {
        name: &'static str,
        expected: &'static str,
        found: f64,
    },
    #[error(
        "sensor `{sensor}` of the scene has {columns} x {rows} pixels, the recording has 8 x 8\nhint: compare with an 8 x 8 sensor of the scene"
    )]
    Resolution {
        sensor: String,
        columns: usize,
        rows: usize,
    },
    #[error(
        "time goes back by {by:?} at frame {seq} of the recording\nhint: compare the parts before and after it separately"
    )]
    TimeRunsBackwards { seq: u64, by: Duration },
    #[error(
        "the recording begins {starts:?} into the scene, which ends after {ends:?}\nhint: give an earlier start"
    )]
    NoOverlap { starts: Duration, ends: Duration },
    #[error("the recording ends before the scene begins\nhint: give a later start")]
    EndsBefore,
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
