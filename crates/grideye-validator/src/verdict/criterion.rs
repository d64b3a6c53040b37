//! One thing that a verdict asks of a recording.

use crate::expected::ScoreDistribution;

/// One thing that a verdict asks of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Criterion {
    /// The stable name for files and programs.
    pub name: &'static str,
    /// The name for people.
    pub title: &'static str,
    /// Whether it is met.
    pub state: State,
    /// What was found, with the numbers.
    pub sentence: String,
    /// The thresholds that it was held against.
    pub keys: &'static [&'static str],
    /// The score behind it, if there is one.
    pub asked: Option<Asked>,
}

/// A score, and what was asked of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Asked {
    /// What the recording scores.
    pub value: f64,
    /// What was asked for.
    pub least: f64,
    /// What drawn units score where the scene is right.
    pub right: ScoreDistribution,
    /// What they score where its people, or all things, are missing.
    pub without: Option<ScoreDistribution>,
}

/// Whether a criterion is met.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// It is.
    Met,
    /// It is not: the verdict is "disagrees".
    Failed,
    /// The recording does not hold what an answer would need: the verdict is "cannot tell", unless something failed that
    /// needs no more.
    Open,
    /// It was not asked, and the verdict does not rest on it.
    NotAsked,
}

impl State {
    /// The stable name for files and programs: `met`, `failed`, `open` or `not_asked`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Met => "met",
            Self::Failed => "failed",
            Self::Open => "open",
            Self::NotAsked => "not_asked",
        }
    }
}
