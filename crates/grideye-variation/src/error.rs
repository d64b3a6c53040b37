//! Why a scene cannot be varied as asked.

use grideye_scene::{SceneError, key::KeyError};

/// The most choices of one key.
pub(crate) const CHOICES_MAX: usize = 1_000;

/// Why a scene cannot be varied as it was asked to: each names what was asked for.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VariationError {
    /// The scene itself was refused.
    #[error(transparent)]
    Scene(Box<SceneError>),
    /// What was asked for cannot be read, or the scene has no such place.
    #[error("`{asked}`: {mistake}")]
    Asked {
        /// What was asked for.
        asked: String,
        /// What is wrong with it.
        mistake: Mistake,
    },
    /// The scene cannot have one of the values.
    #[error("`{asked}`, with {key} = {value}: {source}")]
    Value {
        /// What was asked for.
        asked: String,
        /// The key.
        key: String,
        /// The value that the scene refused.
        value: String,
        /// Why it did.
        source: Box<SceneError>,
    },
    /// The values of one frame do not go together.
    #[error("frame {index} ({values}): {source}")]
    Frame {
        /// The frame, from 0.
        index: u64,
        /// What was drawn for it.
        values: String,
        /// Why the scene refused it.
        source: Box<SceneError>,
    },
    /// Nowhere on the floor was free.
    #[error(
        "frame {index}: no free place on the floor for `{agent}` in {tries} tries\nhint: the room is full, or the agent is larger than what is free of it; take objects out, or list in `touches` what it may stand in"
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

/// What is wrong with one thing that was asked for.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Mistake {
    /// There is no `=`.
    #[error("no `=`\nhint: a key and what it may be, as in agent.person.temperature_c=26..34")]
    NoEquals,
    /// A choice is empty.
    #[error("a value is missing\nhint: as in 26..34, or 0.1,0.2, or [500..3500, 1200, 0]")]
    Nothing,
    /// A bracket or quote has no end.
    #[error("`{0}` is never closed\nhint: quote the whole argument for the shell")]
    Unclosed(String),
    /// A bracket has no beginning.
    #[error("`{0}` was never opened\nhint: quote the whole argument for the shell")]
    Unopened(String),
    /// A range from high to low.
    #[error("the range {0} is empty\nhint: write the lower number first")]
    Backwards(String),
    /// A range of what are no numbers.
    #[error("{0} is no range of numbers\nhint: LOW..HIGH, as in 26..34")]
    NoRange(String),
    /// More choices than there may be.
    #[error(
        "{0} choices are more than {CHOICES_MAX}\nhint: a range, as in 26..34, has any number of them"
    )]
    TooManyChoices(usize),
    /// The scene has no such key.
    #[error(transparent)]
    NoSuchKey(#[from] KeyError),
    /// The same key twice, or a key and its table.
    #[error("it overlaps with `{0}`\nhint: every key may be varied once")]
    Twice(String),
    /// A key that cannot be put into the text of the scene.
    #[error(
        "`{0}` cannot be added to its table\nhint: write it into the scene file, with any value"
    )]
    NotAddable(String),
    /// The moment of a frame is one number of seconds.
    #[error("the moment of a frame is 0 to 31622400 seconds\nhint: as in time_s=0..12")]
    NoTime,
    /// Something else than an agent cannot be put on the floor.
    #[error(
        "only agents are put on the floor\nhint: as in agent.person.position=floor; give objects a range, as in object.table.position_mm=[500..3500, 1200, 0]"
    )]
    FloorForAgents,
    /// The only thing that `position` may be.
    #[error(
        "`position` may only be floor\nhint: agent.NAME.position=floor, or position_mm=[x, y, z] with numbers or ranges"
    )]
    OnlyFloor,
}
