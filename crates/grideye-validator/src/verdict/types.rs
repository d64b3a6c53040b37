//! What goes into a verdict, and what comes out.

use crate::align::Orientation;
use crate::expected::ScoreDistribution;
use crate::expected::claim::Statistics;
use crate::expected::units::Expected;
use crate::metrics::foreground::{EmptyRoom, RoomSource};
use crate::metrics::score::Scores;
use crate::names::named;
use serde::Serialize;
use std::time::Duration;

named! {
    /// What the comparison says.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    #[expect(missing_docs, reason = "the names say it")]
    pub enum Verdict {
        Agrees = "agrees", "agrees";
        Disagrees = "disagrees", "disagrees";
        CannotTell = "cannot_tell", "cannot tell";
    }
}

/// The verdict and what it rests on.
#[derive(Debug, Clone, PartialEq)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Judgment {
    pub verdict: Verdict,
    pub headline: String,
    /// What it rests on, each a sentence with the numbers; what failed comes first.
    pub reasons: Vec<String>,
    /// What would have changed it, in a sentence.
    pub would_change: String,
    /// Every part of it, those that were not asked among them, in a fixed order.
    pub criteria: Vec<Criterion>,
}

pub(crate) struct Evidence<'a> {
    pub(crate) scores: &'a Scores,
    pub(crate) real_frames: usize,
    pub(crate) offset_c: f64,
    pub(crate) warm: WarmPixels,
    pub(crate) warm_above_c: f64,
    pub(crate) lag_frames: usize,
    pub(crate) prior: &'a Prior,
    pub(crate) found: &'a Statistics,
    pub(crate) expected: &'a Expected,
    pub(crate) alike: &'a [Orientation],
    pub(crate) times: &'a [Duration],
}

/// What the same scene scores without its people.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Nobody {
    pub correlation: Option<f64>,
    pub gain: Option<f64>,
    /// Whether the scene has people at all. If not, this is the scene itself.
    pub has_people: bool,
}

#[derive(Debug, Clone, Default)]
pub(crate) struct Prior {
    /// The scene without its people at the times of the simulated frames, without noise.
    pub(crate) nobody: Vec<Vec<f64>>,
    pub(crate) has_people: bool,
    /// Whether they can be seen in any of the simulated frames.
    pub(crate) shows_people: bool,
    pub(crate) pattern: KnownPattern,
    /// How the image was found to lie, if it was turned back.
    pub(crate) turned_back: Option<Orientation>,
    pub(crate) room: EmptyRoom,
    /// The largest common offset of this unit, °C, if its profile is known.
    pub(crate) level_c: Option<f64>,
    pub(crate) sensor: Vec<Criterion>,
}

/// What is known of a unit's pattern; by default nothing.
#[derive(Debug, Clone, Default)]
pub(crate) struct KnownPattern {
    /// Where from; nothing is known where that is the scene.
    pub(crate) from: RoomSource,
    /// What of it was added to the scene, row by row, °C; empty if nothing was.
    pub(crate) added_c: Vec<f64>,
    /// Standard deviation of what is not known of it, row by row, °C, where something is.
    pub(crate) left_c: Option<Vec<f64>>,
}

/// Warm pixels a frame, on average: both counts by the same rule, so that they can be set side by side.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct WarmPixels {
    /// In the real frames, above the median of their own pixels.
    pub real: f64,
    /// In the noise-free simulated frames, above the median of their own pixels: what the scene claims.
    pub claimed: f64,
    /// Of the pixels that the gain is taken over, the share that is warm on both sides, 0 to 1.
    pub overlap: Option<f64>,
}

/// One thing that a verdict asks of a recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Criterion {
    pub name: &'static str,
    pub title: &'static str,
    pub state: State,
    /// What was found, with the numbers.
    #[serde(rename = "text")]
    pub sentence: String,
    /// The thresholds that it was held against.
    #[serde(rename = "thresholds")]
    pub keys: &'static [&'static str],
    /// The score behind it, if there is one.
    pub asked: Option<Asked>,
}

/// A score, and what was asked of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Asked {
    pub value: f64,
    pub least: f64,
    /// What drawn units score where the scene is right.
    pub right: ScoreDistribution,
    /// What they score where its people, or all things, are missing.
    pub without: Option<ScoreDistribution>,
}

named! {
    /// Whether a criterion is met.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum State {
        /// It is.
        Met = "met";
        /// It is not: the verdict is "disagrees".
        Failed = "failed";
        /// The recording cannot answer: "cannot tell", unless something failed that needs no more.
        Open = "open";
        /// It was not asked, and the verdict does not rest on it.
        NotAsked = "not_asked";
    }
}

#[derive(Clone, Copy)]
pub(crate) struct Question {
    pub(crate) name: &'static str,
    pub(crate) title: &'static str,
    pub(crate) keys: &'static [&'static str],
}

impl Question {
    pub(crate) fn answered(&self, state: State, sentence: impl Into<String>) -> Criterion {
        Criterion {
            name: self.name,
            title: self.title,
            state,
            sentence: sentence.into(),
            keys: self.keys,
            asked: None,
        }
    }

    pub(crate) fn weighed(
        &self,
        state: State,
        sentence: impl Into<String>,
        turn: impl Into<String>,
    ) -> Weighed {
        Weighed {
            criterion: self.answered(state, sentence),
            margin: None,
            turn: turn.into(),
        }
    }
}

pub(crate) struct Weighed {
    pub(crate) criterion: Criterion,
    /// How far a skill is above its threshold.
    pub(crate) margin: Option<f64>,
    /// What would break it if it is met, mend it if it failed, settle it if it is open.
    pub(crate) turn: String,
}

/// What tells a pattern from what is there.
pub(crate) const PROFILE: &str = "a profile of this unit (grideye characterize, then --profile), or a recording that also shows the room empty";
