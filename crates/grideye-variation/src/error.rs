//! Errors of varying a scene.

use grideye_scene::{SceneError, key::KeyError};

/// Limit on the choices of one key.
pub(crate) const CHOICES_MAX: usize = 1_000;

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
}

impl From<SceneError> for VariationError {
    fn from(error: SceneError) -> Self {
        Self::Scene(Box::new(error))
    }
}

/// What is wrong with a request.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Mistake {
    /// There is no `=`, and the scene does not say how the number varies.
    #[error(
        "missing `=`, and the scene has no [[uncertain]] table for this number\nhint: write KEY=VALUES, as in agent.person.temperature_c=26..34, or add the table"
    )]
    NoEquals,
    /// A choice is empty.
    #[error(
        "a value is missing\nhint: write values as in 26..34, 1700+-100, 0.1,0.2 or [500..3500, 1200, 0]"
    )]
    Nothing,
    /// A bracket or quote is never closed.
    #[error("`{0}` is never closed\nhint: quote the whole argument for the shell")]
    Unclosed(String),
    /// A bracket is never opened.
    #[error("`{0}` was never opened\nhint: quote the whole argument for the shell")]
    Unopened(String),
    /// A range runs from high to low.
    #[error("the range {0} is empty\nhint: write the lower number first")]
    Backwards(String),
    /// A range has ends that are not numbers.
    #[error("{0} is not a range of numbers\nhint: write LOW..HIGH, as in 26..34")]
    NoRange(String),
    /// A normal law without a standard deviation.
    #[error("{0} is not a normal law\nhint: write MEAN+-SD with SD above 0, as in 1700+-100")]
    NoNormal(String),
    /// There are too many choices.
    #[error("{0} choices are more than {CHOICES_MAX}\nhint: use a range, as in 26..34")]
    TooManyChoices(usize),
    /// The scene has no such key.
    #[error(transparent)]
    NoSuchKey(#[from] KeyError),
    /// A key is named twice, or together with its table.
    #[error("it overlaps with `{0}`\nhint: vary each key only once")]
    Twice(String),
    /// A key cannot be added to the scene's text.
    #[error(
        "`{0}` cannot be added to its table\nhint: write it into the scene file, with any value"
    )]
    NotAddable(String),
    /// `time_s` is not a number of seconds within the limits.
    #[error(
        "the time of a frame must be 0 to 31622400 seconds\nhint: write a number or a range, as in time_s=0..12"
    )]
    NoTime,
    /// Only agents can be placed on the floor.
    #[error(
        "only agents can be placed on the floor\nhint: write agent.person.position=floor; give objects a range, as in object.table.position_mm=[500..3500, 1200, 0]"
    )]
    FloorForAgents,
    /// `position` is not `floor`.
    #[error(
        "`position` can only be floor\nhint: write agent.NAME.position=floor, or position_mm=[x, y, z] with numbers or ranges"
    )]
    OnlyFloor,
}
