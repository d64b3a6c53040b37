//! Scores held against what a right scene would reach, and what a room without its people, or without anything.

use crate::expected::claim::Statistics;
use crate::expected::units::{Pick, Scale};
use crate::expected::{DRAWS, ScoreDistribution};
use crate::metrics::foreground::RoomSource;
use crate::metrics::score::Measure;
use crate::thresholds::Thresholds;
use crate::verdict::types::{Asked, Evidence, PROFILE, Question, State, Weighed};
use grideye_draw::text::fixed;

#[derive(Clone, Copy)]
struct ScoreCriterion {
    question: Question,
    /// To stand at the beginning of a sentence.
    score: &'static str,
    scale: Scale,
    pick: Pick,
    /// Of the way from floor to what right scenes reach, so much is asked.
    share: f64,
    floor: f64,
    /// Whether rooms without people must not reach it, or else rooms without anything.
    is_of_people: bool,
}

pub(crate) fn scores(evidence: &Evidence<'_>, thresholds: &Thresholds) -> Vec<Weighed> {
    let floor = |measure| evidence.scores.get(measure).floor().unwrap_or(0.0);
    let correlation = ScoreCriterion {
        question: Question {
            name: "correlation",
            title: "C is a right scene's",
            keys: &[
                "correlation_skill_min",
                "false_alarm_max",
                "pattern_spread_c",
            ],
        },
        score: "C",
        scale: Scale::Correlation,
        pick: |statistics| statistics.correlation,
        share: thresholds.correlation_skill_min,
        floor: floor(Measure::Correlation),
        is_of_people: false,
    };
    let gain = ScoreCriterion {
        question: Question {
            name: "gain",
            title: "Better than a blank frame",
            keys: &["gain_skill_min", "false_alarm_max", "pattern_spread_c"],
        },
        score: "The gain over a blank frame",
        scale: Scale::Gain,
        pick: |statistics| statistics.gain,
        share: thresholds.gain_skill_min,
        floor: floor(Measure::Gain),
        is_of_people: false,
    };
    let above_room = ScoreCriterion {
        question: Question {
            name: "correlation_above_room",
            title: "C without the empty room",
            keys: &[
                "above_room_skill_min",
                "false_alarm_max",
                "pattern_spread_c",
            ],
        },
        score: "With the empty room taken out, C",
        pick: |statistics| statistics.above_room,
        share: thresholds.above_room_skill_min,
        floor: 0.0,
        is_of_people: true,
        ..correlation
    };
    let nobody = ScoreCriterion {
        question: Question {
            name: "better_than_nobody",
            title: "Better than the scene without its people",
            keys: &["nobody_skill_min", "false_alarm_max", "pattern_spread_c"],
        },
        score: "The gain that the scene's people bring",
        scale: Scale::Plain,
        pick: |statistics| statistics.over_nobody,
        share: thresholds.nobody_skill_min,
        ..above_room
    };
    let all = [correlation, gain, above_room, nobody].into_iter();
    all.filter(|criterion| !criterion.is_of_people || evidence.prior.has_people)
        .map(|criterion| criterion.weigh(evidence, thresholds))
        .collect()
}

impl ScoreCriterion {
    fn weigh(&self, evidence: &Evidence<'_>, thresholds: &Thresholds) -> Weighed {
        if self.is_of_people && !evidence.prior.shows_people {
            let why = "None of the scene's people are in view while it was recorded.";
            return self.question.weighed(State::NotAsked, why, "");
        }
        let expected = evidence.expected;
        let law =
            |draws: &[Statistics]| ScoreDistribution::of(self.scale, draws.iter().map(self.pick));
        let Some(right) = law(&expected.right) else {
            let score = self.score;
            let why = format!("{score} is not defined for a scene in which nothing stands out.");
            let turn = "a scene with something warm in view";
            return self.question.weighed(State::Open, why, turn);
        };
        let without = if self.is_of_people {
            law(&expected.nobody)
        } else {
            law(&expected.blank)
        };
        let rate = thresholds.false_alarm_max;
        let low = right.low(rate);
        let least = low.min(self.floor + self.share * (low - self.floor));
        let value = (self.pick)(evidence.found).unwrap_or(self.floor);
        // Written so that a value that is not a number falls on the side of failure.
        let is_reached = value >= least;
        let needed = without.map_or(least, |without| least.max(without.high(rate)));
        let (name, limit) = (lower(self.score), fixed(needed, 2));
        let (state, turn) = match (is_reached, value < needed) {
            (false, _) => (State::Failed, format!("{name} of {limit}")),
            (true, true) => (State::Open, remedy(evidence).to_owned()),
            (true, false) => (State::Met, format!("{name} below {limit}")),
        };
        let asked = Asked {
            value,
            least,
            right,
            without,
        };
        let sentence = self.sentence(&asked, state, rate);
        let mut weighed = self.question.weighed(state, sentence, turn);
        weighed.criterion.asked = Some(asked);
        weighed.margin = Some((value - needed) / (low - self.floor).abs().max(1e-9));
        weighed
    }

    fn sentence(&self, asked: &Asked, state: State, rate: f64) -> String {
        let relation = match state {
            State::Failed => "less than",
            _ => "at least",
        };
        let mut text = format!(
            "{} is {}, {relation} the {} asked for; right scenes have {} ({})",
            self.score,
            fixed(asked.value, 2),
            fixed(asked.least, 2),
            fixed(asked.right.mean, 2),
            range(&asked.right, asked.right.low(rate), "at least", rate),
        );
        if let Some(without) = &asked.without {
            let what = if self.is_of_people {
                "rooms without the people"
            } else {
                "rooms with nothing in them"
            };
            let mean = fixed(without.mean, 2);
            let range = range(without, without.high(rate), "at most", rate);
            text.push_str(&format!(", {what} {mean} ({range})"));
        }
        text.push_str(&format!(", over {DRAWS} drawn units."));
        if state == State::Open {
            text.push_str(" So much proves nothing here.");
        }
        text
    }
}

fn range(law: &ScoreDistribution, end: f64, relation: &str, rate: f64) -> String {
    if law.sd == 0.0 {
        return "always".to_owned();
    }
    let (share, end) = (fixed(100.0 * (1.0 - rate), 1), fixed(end, 2));
    format!("{share} % {relation} {end}")
}

/// What would settle a score that proves nothing.
fn remedy(evidence: &Evidence<'_>) -> &'static str {
    match evidence.prior.pattern.from {
        RoomSource::Scene => PROFILE,
        _ => "a recording with more contrast, or a longer one",
    }
}

/// To stand within a sentence: all scores but C begin with a word.
fn lower(text: &str) -> String {
    let mut letters = text.chars();
    match (text.len(), letters.next()) {
        (2.., Some(first)) => first.to_lowercase().chain(letters).collect(),
        _ => text.to_owned(),
    }
}
