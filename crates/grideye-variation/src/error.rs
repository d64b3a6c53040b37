//! Errors of varying a scene.

use grideye_scene::{SceneError, key::KeyError};

/// Limit on the choices of one key.
pub(crate) const CHOICES_MAX: usize = 1_000;
/// Limit on the acts of one person.
pub(crate) const ACTS_MAX: usize = 100;

/// Why a scene cannot be varied; each error names the request.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VariationError {
    /// The unchanged scene was refused.
    #[error(transparent)]
    Scene(Box<SceneError>),
    /// The request cannot be parsed, or the scene has no such key.
    #[error("`{asked}`: {mistake}")]
    Asked {
        /// The request.
        asked: String,
        /// The mistake in it.
        mistake: Mistake,
    },
    /// The scene refuses one of the values.
    #[error("`{asked}`, with {key} = {value}: {source}")]
    Value {
        /// The request.
        asked: String,
        /// The key.
        key: String,
        /// The refused value.
        value: String,
        /// Why the scene refused it.
        source: Box<SceneError>,
    },
    /// The values of one frame conflict.
    #[error("frame {index} ({values}): {source}")]
    Frame {
        /// The frame, from 0.
        index: u64,
        /// Its drawn values.
        values: String,
        /// Why the scene refused it.
        source: Box<SceneError>,
    },
    /// No free place on the floor was found.
    #[error(
        "frame {index}: no free place on the floor for `{agent}` in {tries} tries\nhint: the room is full, or the agent is larger than the free floor; remove objects, or list in `touches` what it may stand in"
    )]
    NoPlace {
        /// The frame, from 0.
        index: u64,
        /// The agent.
        agent: String,
        /// How many places were tried.
        tries: usize,
    },
    /// No free way for what a person does was found.
    #[error(
        "frame {index}: no free way for `{agent}` to {acts} in {tries} tries\nhint: the room is too full or too small for this; remove objects, or let fewer people do less"
    )]
    NoWay {
        /// The first frame, from 0.
        index: u64,
        /// The agent.
        agent: String,
        /// What it should do.
        acts: String,
        /// How many ways were tried.
        tries: usize,
    },
}

impl VariationError {
    /// The same of another frame.
    #[must_use]
    pub fn of_frame(mut self, frame: u64) -> Self {
        match &mut self {
            Self::Frame { index, .. } | Self::NoPlace { index, .. } | Self::NoWay { index, .. } => {
                *index = frame;
            }
            Self::Scene(_) | Self::Asked { .. } | Self::Value { .. } => {}
        }
        self
    }
}

impl From<SceneError> for VariationError {
    fn from(error: SceneError) -> Self {
        Self::Scene(Box::new(error))
    }
}

/// What is wrong with a request: a sentence and a hint.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Mistake(pub(crate) String);

impl From<KeyError> for Mistake {
    fn from(error: KeyError) -> Self {
        Self(error.to_string())
    }
}

impl Mistake {
    pub(crate) fn nothing() -> Self {
        let what = "a value is missing\nhint: write values as in 26..34, 1700+-100, 0.1,0.2 or [500..3500, 1200, 0]";
        Self(what.to_owned())
    }

    pub(crate) fn too_many_choices(found: usize) -> Self {
        Self(format!(
            "{found} choices are more than {CHOICES_MAX}\nhint: use a range, as in 26..34"
        ))
    }

    pub(crate) fn unclosed(mark: &str) -> Self {
        Self(format!(
            "`{mark}` is never closed\nhint: quote the whole argument for the shell"
        ))
    }

    pub(crate) fn not_addable(key: &str) -> Self {
        Self(format!(
            "`{key}` cannot be added to its table\nhint: write it into the scene file, with any value"
        ))
    }
}
