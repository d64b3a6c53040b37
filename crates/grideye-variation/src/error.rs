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
    /// There is not one weight for each choice.
    #[error(
        "{weights} weights for {choices} choices\nhint: give one weight for each of the values, as in values = \"0,1,2\" and weights = [3, 2, 1]"
    )]
    Weights {
        /// How many values there are to choose from.
        choices: usize,
        /// How many weights are given.
        weights: usize,
    },
    /// The number of people is no whole number up to that of the agents.
    #[error(
        "the number of people must be whole, and at most {0}, the agents of the scene\nhint: write 0..{0} or 0,1; so many of the file's agents are there, the first ones first"
    )]
    People(usize),
    /// One of two keys that belong together has no single law.
    #[error(
        "only numbers that vary by one range or normal law each can go together, and `{0}` does not\nhint: write values = \"18..26\" or \"22+-2\" for both, and list the key that `with` names before this one"
    )]
    With(String),
    /// The scene has no such key.
    #[error(transparent)]
    NoSuchKey(#[from] KeyError),
    /// A key is named twice.
    #[error("it overlaps with `{0}`\nhint: vary each key only once")]
    Twice(String),
    /// Two keys write the same part of the scene.
    #[error("it overlaps with `{other}`: {why}\nhint: {hint}")]
    Overlaps {
        /// The other key.
        other: String,
        /// What both write.
        why: &'static str,
        /// What to do.
        hint: &'static str,
    },
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
    /// Only persons do anything.
    #[error(
        "only a person can do something\nhint: write agent.NAME.acts for an agent with person = {{}}"
    )]
    ActsForPeople,
    /// No such act.
    #[error(
        "`{0}` is no act\nhint: write enter, walk, stand, sit, lie, fall, leave or away, as in \"enter walk sit:5..20 leave\""
    )]
    NoAct(String),
    /// An act that takes no seconds.
    #[error(
        "`{0}` takes as long as its way\nhint: write {0} without seconds; stand, sit, lie, fall and away take them, as in sit:5..20"
    )]
    NoLasting(String),
    /// Seconds that are no number or range.
    #[error(
        "`{0}` does not say how many seconds\nhint: write seconds or LOW..HIGH up to 86400, as in sit:5..20"
    )]
    NoSeconds(String),
    /// More acts than the limit.
    #[error("{0} acts are more than {max}\nhint: make several clips of fewer acts", max = ACTS_MAX)]
    TooManyActs(usize),
    /// A person comes in who is in the room.
    #[error("the person is in the room already\nhint: write enter or away first, or after leave")]
    Inside,
    /// A person does something in the room but is not there.
    #[error("the person is not in the room\nhint: write enter after leave or away")]
    Outside,
    /// `position` is not `floor`.
    #[error(
        "`position` can only be floor\nhint: write agent.NAME.position=floor, or position_mm=[x, y, z] with numbers or ranges"
    )]
    OnlyFloor,
}
