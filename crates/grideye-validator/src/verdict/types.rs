//! The evidence that a verdict is judged on, and the verdict.

use crate::advice::Remedy;
use crate::align::Orientation;
use crate::decision::Decision;
use crate::frames::fitted::FittedShare;
use crate::frames::{LeftOut, LeftOutCount, RoomSource};
use crate::names::named;
use grideye_draw::text::frames;
use serde::Serialize;
use std::fmt::{self, Display};

named! {
    /// The outcome of a comparison.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    #[expect(missing_docs, reason = "the names say it")]
    pub enum Verdict {
        Agrees = "agrees", "agrees";
        Disagrees = "disagrees", "disagrees";
        CannotTell = "cannot_tell", "cannot tell";
    }
}

/// The verdict and its reasons.
#[derive(Debug, Clone, PartialEq)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Judgment {
    pub verdict: Verdict,
    /// The verdict, the finding that decided it, and how many frames were compared.
    pub headline: String,
    /// What to do about that finding; empty if the scene agrees.
    pub next_step: String,
    /// Each reason is a finding and the next step. The first is the headline's.
    pub reasons: Vec<String>,
    /// All criteria in a fixed order, including those not asked.
    pub criteria: Vec<Criterion>,
}

/// The headline, the next step and the other reasons, one per line.
impl Display for Judgment {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(formatter, "{}", self.headline)?;
        if !self.next_step.is_empty() {
            writeln!(formatter, "  Next: {}", self.next_step)?;
        }
        let mut others = self.reasons.iter().skip(1);
        others.try_for_each(|line| writeln!(formatter, "  {line}"))
    }
}

pub(crate) struct Evidence<'a> {
    pub(crate) real_frames: usize,
    pub(crate) has_repeat: bool,
    pub(crate) offset_c: f64,
    pub(crate) prior: &'a Prior,
}

#[derive(Debug, Clone, Default)]
pub(crate) struct Prior {
    pub(crate) has_people: bool,
    pub(crate) pattern: KnownPattern,
    /// Frames that the recording holds, of which some were compared.
    pub(crate) recorded_frames: usize,
    /// What was left out of them.
    pub(crate) left_out: Vec<LeftOutCount>,
    /// The largest common offset that this unit's profile allows, °C.
    pub(crate) level_c: Option<f64>,
    pub(crate) sensor: Vec<Criterion>,
    /// The orientation of the recording that was turned back, as requested.
    pub(crate) turned: Orientation,
    /// The share of the recording that the scene was fitted to, if it was calibrated.
    pub(crate) fitted: Option<FittedShare>,
    /// Whether it is the scene; without one, frames alone decide nothing.
    pub(crate) decision: Option<Decision>,
    /// What would make it agree, or bring it nearest.
    pub(crate) remedy: Option<Remedy>,
    /// Range of the slow drift against the scene, °C, and the largest that is no fault.
    pub(crate) drift_c: [f64; 2],
}

/// The known part of a unit's fixed pattern; by default none.
#[derive(Debug, Clone, Default)]
pub(crate) struct KnownPattern {
    /// Its source; [`RoomSource::Scene`] means that nothing is known.
    pub(crate) from: RoomSource,
    /// Standard deviation of the unknown rest, row by row, °C.
    pub(crate) left_c: Option<Vec<f64>>,
}

/// One requirement on a recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Criterion {
    pub name: &'static str,
    pub title: &'static str,
    pub state: State,
    /// The finding, with its numbers.
    #[serde(rename = "text")]
    pub sentence: String,
    /// What to do about it; never empty if the criterion failed or is open.
    pub next_step: String,
    /// The thresholds that it depends on.
    #[serde(rename = "thresholds")]
    pub keys: &'static [&'static str],
}

named! {
    /// Whether a criterion is met.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum State {
        /// It is met.
        Met = "met";
        /// It failed: the verdict is "disagrees".
        Failed = "failed";
        /// The recording cannot answer: the verdict is "cannot tell", unless another criterion failed.
        Open = "open";
        /// It was not asked and has no effect on the verdict.
        NotAsked = "not_asked";
    }
}

/// The name and title of a criterion, and the thresholds that it depends on.
#[derive(Clone, Copy)]
pub(crate) struct Question(
    pub(crate) &'static str,
    pub(crate) &'static str,
    pub(crate) &'static [&'static str],
);

impl Question {
    pub(crate) fn answered(&self, state: State, sentence: impl Into<String>) -> Criterion {
        self.with_next(state, sentence, "")
    }

    pub(crate) fn met_or(&self, is_met: bool, sentence: String, next_step: &str) -> Criterion {
        match is_met {
            true => self.answered(State::Met, sentence),
            false => self.failed(sentence, next_step),
        }
    }

    pub(crate) fn failed(&self, sentence: impl Into<String>, next_step: &str) -> Criterion {
        self.with_next(State::Failed, sentence, next_step)
    }

    pub(crate) fn with_next(
        &self,
        state: State,
        sentence: impl Into<String>,
        next_step: impl Into<String>,
    ) -> Criterion {
        let Self(name, title, keys) = *self;
        Criterion {
            name,
            title,
            state,
            sentence: sentence.into(),
            next_step: next_step.into(),
            keys,
        }
    }
}

/// How to tell a unit's fixed pattern from the scene.
pub(crate) const PROFILE: &str = "Record the empty room, measure it with `grideye characterize`, and compare again with `--profile`.";

/// How to record whole frames.
pub(crate) const WHOLE: &str = "Read all 64 pixels in one burst (one I2C transfer of 128 bytes) as soon as the sensor has written them, as `grideye-agent` does, and record again.";

impl Prior {
    /// What is wrong with a recording of which most frames are torn.
    pub(crate) fn torn(&self) -> Option<String> {
        let torn = |one: &&LeftOutCount| one.reason == LeftOut::Torn;
        let torn = self.left_out.iter().find(torn)?.rows;
        let all = frames(self.recorded_frames);
        (2 * torn > self.recorded_frames).then(|| {
            format!("{torn} of {all} are torn: the sensor wrote the next while they were read.")
        })
    }
}

pub(crate) fn joined(pieces: &[&str], word: &str) -> String {
    match pieces {
        [] => String::new(),
        [one] => (*one).to_owned(),
        [one, other] => format!("{one} {word} {other}"),
        [others @ .., last] => format!("{}, {word} {last}", others.join(", ")),
    }
}
