//! Scores held against what a right scene would reach, and what a room without its people, or without anything.

use crate::expected::units::{Pick, Scale};
use crate::expected::{DRAWS, ScoreDistribution};
use crate::metrics::foreground::RoomSource;
use crate::metrics::score::Measure;
use crate::thresholds::Thresholds;
use crate::verdict::types::{Asked, Criterion, Evidence, PROFILE, State, Weighed};
use grideye_draw::text::fixed;

/// C and gain, with and without people.
pub(crate) fn scores(evidence: &Evidence<'_>, thresholds: &Thresholds) -> Vec<Weighed> {
    let floor = |measure| evidence.scores.get(measure).floor().unwrap_or(0.0);
    let image = |criterion: ScoreCriterion| criterion.weigh(evidence, thresholds);
    let mut all = vec![
        image(ScoreCriterion {
            name: "correlation",
            title: "C is a right scene's",
            score: "C",
            keys: &[
                "correlation_skill_min",
                "false_alarm_max",
                "pattern_spread_c",
            ],
            scale: Scale::Correlation,
            pick: |statistics| statistics.correlation,
            share: thresholds.correlation_skill_min,
            floor: floor(Measure::Correlation),
            without: Without::Anything,
        }),
        image(ScoreCriterion {
            name: "gain",
            title: "Better than a blank frame",
            score: "The gain over a blank frame",
            keys: &["gain_skill_min", "false_alarm_max", "pattern_spread_c"],
            scale: Scale::Gain,
            pick: |statistics| statistics.gain,
            share: thresholds.gain_skill_min,
            floor: floor(Measure::Gain),
            without: Without::Anything,
        }),
    ];
    if !evidence.prior.has_people {
        return all;
    }
    let people = |criterion: ScoreCriterion| {
        if evidence.prior.shows_people {
            criterion.weigh(evidence, thresholds)
        } else {
            criterion.not_asked("None of the scene's people are in view while it was recorded.")
        }
    };
    all.extend([
        people(ScoreCriterion {
            name: "correlation_above_room",
            title: "C without the empty room",
            score: "With the empty room taken out, C",
            keys: &[
                "above_room_skill_min",
                "false_alarm_max",
                "pattern_spread_c",
            ],
            scale: Scale::Correlation,
            pick: |statistics| statistics.above_room,
            share: thresholds.above_room_skill_min,
            floor: 0.0,
            without: Without::People,
        }),
        people(ScoreCriterion {
            name: "better_than_nobody",
            title: "Better than the scene without its people",
            score: "The gain that the scene's people bring",
            keys: &["nobody_skill_min", "false_alarm_max", "pattern_spread_c"],
            scale: Scale::Plain,
            pick: |statistics| statistics.over_nobody,
            share: thresholds.nobody_skill_min,
            floor: 0.0,
            without: Without::People,
        }),
    ]);
    all
}

/// What a score must not be reached by.
#[derive(Clone, Copy)]
enum Without {
    Anything,
    People,
}

/// A score that a right scene reaches.
struct ScoreCriterion {
    name: &'static str,
    title: &'static str,
    /// To stand at the beginning of a sentence.
    score: &'static str,
    keys: &'static [&'static str],
    scale: Scale,
    pick: Pick,
    /// Of the way from floor to what right scenes reach, so much is asked.
    share: f64,
    floor: f64,
    without: Without,
}

impl ScoreCriterion {
    fn weigh(&self, evidence: &Evidence<'_>, thresholds: &Thresholds) -> Weighed {
        let expected = evidence.expected;
        let right = expected.right(self.scale, self.pick);
        let without = match self.without {
            Without::Anything => expected.blank(self.scale, self.pick),
            Without::People => expected.nobody(self.scale, self.pick),
        };
        let Some(right) = right else {
            return self.nothing_claimed();
        };
        let rate = thresholds.false_alarm_max;
        let low = right.low(rate);
        let least = low.min(self.floor + self.share * (low - self.floor));
        let value = (self.pick)(evidence.found).unwrap_or(self.floor);
        let asked = Asked {
            value,
            least,
            right,
            without,
        };
        // Written so that a value that is not a number falls on the side of failure.
        let is_reached = value >= least;
        let needed = without.map_or(least, |without| least.max(without.high(rate)));
        let gets_by = value < needed;
        let state = match (is_reached, gets_by) {
            (false, _) => State::Failed,
            (true, true) => State::Open,
            (true, false) => State::Met,
        };
        let turn = match state {
            State::Open => remedy(evidence),
            State::Failed => format!("{} of {}", lower(self.score), fixed(needed, 2)),
            _ => format!("{} below {}", lower(self.score), fixed(needed, 2)),
        };
        Weighed {
            criterion: self.criterion(state, self.sentence(&asked, state, rate), Some(asked)),
            margin: Some((value - needed) / (low - self.floor).abs().max(1e-9)),
            turn,
        }
    }

    fn criterion(&self, state: State, sentence: String, asked: Option<Asked>) -> Criterion {
        Criterion {
            name: self.name,
            title: self.title,
            state,
            sentence,
            keys: self.keys,
            asked,
        }
    }

    fn not_asked(&self, why: &str) -> Weighed {
        Weighed {
            criterion: self.criterion(State::NotAsked, why.to_owned(), None),
            margin: None,
            turn: String::new(),
        }
    }

    fn nothing_claimed(&self) -> Weighed {
        let sentence = format!(
            "{} is not defined for a scene in which nothing stands out.",
            self.score
        );
        Weighed {
            criterion: self.criterion(State::Open, sentence, None),
            margin: None,
            turn: "a scene with something warm in view".to_owned(),
        }
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
            let what = match self.without {
                Without::Anything => "rooms with nothing in them",
                Without::People => "rooms without the people",
            };
            text.push_str(&format!(
                ", {what} {} ({})",
                fixed(without.mean, 2),
                range(without, without.high(rate), "at most", rate)
            ));
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
    format!(
        "{} % {relation} {}",
        fixed(100.0 * (1.0 - rate), 1),
        fixed(end, 2)
    )
}

/// What would settle a score that proves nothing.
fn remedy(evidence: &Evidence<'_>) -> String {
    if evidence.prior.pattern_from != RoomSource::Scene {
        return "a recording with more contrast, or a longer one".to_owned();
    }
    PROFILE.to_owned()
}

fn lower(text: &str) -> String {
    match text.strip_prefix("The ").or(text.strip_prefix("With ")) {
        Some(_) => {
            let mut letters = text.chars();
            letters
                .next()
                .map(|first| first.to_lowercase().chain(letters).collect())
                .unwrap_or_default()
        }
        None => text.to_owned(),
    }
}
