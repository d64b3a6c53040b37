//! Compares scores with those of a right scene, of the room without its people, and of an empty room.

use crate::expected::ScoreDistribution;
use crate::expected::claim::Statistics;
use crate::expected::units::{Pick, Scale};
use crate::metrics::foreground::RoomSource;
use crate::metrics::score::Measure;
use crate::thresholds::Thresholds;
use crate::verdict::types::{Asked, Evidence, Next, PROFILE, Question, State, Weighed, lower};
use grideye_draw::text::fixed;

#[derive(Clone, Copy)]
struct ScoreCriterion {
    question: Question,
    /// Begins a sentence.
    score: &'static str,
    /// What to do if the criterion fails.
    next_step: &'static str,
    scale: Scale,
    pick: Pick,
    /// The share that is required of the way from the floor to the lowest score of a right scene.
    share: f64,
    floor: f64,
    /// Whether the score must beat the room without its people; otherwise, an empty room.
    is_of_people: bool,
}

pub(crate) fn scores(evidence: &Evidence<'_>, thresholds: &Thresholds) -> Vec<Weighed> {
    let floor = |measure| evidence.scores.get(measure).floor().unwrap_or(0.0);
    let correlation = ScoreCriterion {
        question: Question {
            name: "correlation",
            title: "Correlation is a right scene's",
            keys: &[
                "correlation_skill_min",
                "false_alarm_max",
                "pattern_spread_c",
            ],
        },
        score: "Correlation",
        next_step: "Check that the people, the objects and the sensor are where the scene has them; mark uncertain values with [[uncertain]] and run `grideye calibrate`.",
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
        score: "Gain over a blank frame",
        next_step: "Check the temperatures and positions of the people and objects in the scene.",
        scale: Scale::Gain,
        pick: |statistics| statistics.gain,
        share: thresholds.gain_skill_min,
        floor: floor(Measure::Gain),
        is_of_people: false,
    };
    let above_room = ScoreCriterion {
        question: Question {
            name: "correlation_above_room",
            title: "Correlation without the empty room",
            keys: &[
                "above_room_skill_min",
                "false_alarm_max",
                "pattern_spread_c",
            ],
        },
        score: "Correlation without the empty room",
        next_step: "Check where the scene's people are, and in which second of the scene the recording starts (--start).",
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
        score: "Gain from the scene's people",
        next_step: "Check that the scene's people were in view, and their temperatures and positions.",
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
            let why = "None of the scene's people were in view during the recording.";
            return self.question.weighed(State::NotAsked, why, Next::default());
        }
        let expected = evidence.expected;
        let law =
            |draws: &[Statistics]| ScoreDistribution::of(self.scale, draws.iter().map(self.pick));
        let Some(right) = law(&expected.right) else {
            let score = self.score;
            let why = format!("{score} is undefined: nothing stands out in the scene.");
            let next = (
                "Compare with a scene that has something warm in view.",
                "a scene with something warm in view",
            );
            return self.question.weighed(State::Open, why, next);
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
        // Written so that NaN fails.
        let is_reached = value >= least;
        let needed = without.map_or(least, |without| least.max(without.high(rate)));
        let (name, limit) = (lower(self.score), fixed(needed, 2));
        let (state, next): (State, Next) = match (is_reached, value < needed) {
            (false, _) => {
                let turn = format!("{name} of {limit}");
                (State::Failed, (self.next_step, turn).into())
            }
            (true, true) => (State::Open, remedy(evidence).into()),
            (true, false) => (State::Met, ("", format!("{name} below {limit}")).into()),
        };
        let asked = Asked {
            value,
            least,
            right,
            without,
        };
        let sentence = self.sentence(&asked, needed, rate);
        let mut weighed = self.question.weighed(state, sentence, next);
        let (score, found) = (self.score, fixed(value, 2));
        weighed.brief = Some(format!("{score} {found}; {limit} was required."));
        weighed.criterion.asked = Some(asked);
        weighed.margin = Some((value - needed) / (low - self.floor).abs().max(1e-9));
        weighed
    }

    fn sentence(&self, asked: &Asked, needed: f64, rate: f64) -> String {
        let (score, value) = (self.score, fixed(asked.value, 2));
        let right = fixed(asked.right.low(rate), 2);
        let mut text = format!(
            "{score} {value}. A right scene scores at least {right} with this kind of sensor"
        );
        if let Some(without) = &asked.without {
            let room = match self.is_of_people {
                true => "the room without its people",
                false => "an empty room",
            };
            let most = fixed(without.high(rate), 2);
            text.push_str(&format!(", {room} at most {most}"));
        }
        let (limit, share) = (fixed(needed, 2), fixed(100.0 * self.share, 0));
        let from = if self.is_of_people {
            ""
        } else {
            "from chance "
        };
        let required = match needed > asked.least {
            true => format!("; more than {limit} was required."),
            false => {
                format!("; {limit} was required, {share} % of the way {from}to a right scene.")
            }
        };
        text + &required
    }
}

/// How to settle a score that an empty room reaches too.
fn remedy(evidence: &Evidence<'_>) -> (&'static str, &'static str) {
    match evidence.prior.pattern.from {
        RoomSource::Scene => PROFILE,
        _ => (
            "Record for longer, or with something warmer in view.",
            "a recording with more contrast, or a longer one",
        ),
    }
}
