//! The verdict word for word, on evidence whose laws are known by hand.
//!
//! Where all drawn units score the same, a right scene reaches that; where `m - d` and `m + d`, 0.001 lies beyond 3.0902 d.

use super::*;
use crate::align::space::Orientation;
use crate::expected::claim::Statistics;
use crate::expected::units::Expected;
use crate::metrics::foreground::RoomSource;
use crate::metrics::score::{Measure, Score, Scores, Shuffled};
use crate::metrics::unclaimed::WarmBlock;
use crate::thresholds::Thresholds;
use crate::verdict::judgment::judge;
use crate::verdict::types::{Evidence, Prior};
use std::time::Duration;

const PROFILE: &str = "a profile of this unit (grideye characterize, then --profile), or a recording that also shows the \
                       room empty";

struct Case {
    scores: Scores,
    real_frames: usize,
    offset_c: f64,
    warm: WarmPixels,
    prior: Prior,
    found: Statistics,
    expected: Expected,
    alike: Vec<Orientation>,
}

fn block(celsius: f64, frame: Option<usize>) -> Option<WarmBlock> {
    Some(WarmBlock {
        celsius,
        row: 0,
        column: 5,
        frame,
    })
}

fn score(measure: Measure, chance: f64, ceiling: f64) -> Score {
    Score {
        measure,
        value: Some(0.5),
        blank: None,
        shuffled: Some(Shuffled {
            mean: chance,
            p95: chance,
            p: None,
        }),
        noise: None,
        ceiling: Some(ceiling),
    }
}

/// A score by two units, as far below as above.
fn both(mean: f64, distance: f64) -> [f64; 2] {
    [mean - distance, mean + distance]
}

impl Case {
    /// A right scene with a person in it, on a recording that tells.
    fn right() -> Self {
        let people = both(0.5, 0.1).into_iter().zip(both(0.0, 0.1));
        let (right, nobody) = people
            .map(|(with, without)| {
                let mut right = Statistics {
                    correlation: Some(0.8),
                    gain: Some(0.5),
                    above_room: Some(0.8),
                    over_nobody: Some(with),
                    upright: vec![(Orientation::Half, 0.5)],
                    ..Statistics::default()
                };
                right.unclaimed.still = block(0.25, None);
                right.unclaimed.moving = block(0.5, Some(0));
                let nobody = Statistics {
                    above_room: Some(0.1),
                    over_nobody: Some(without),
                    ..Statistics::default()
                };
                (right, nobody)
            })
            .unzip();
        let mut found = Statistics {
            correlation: Some(0.7),
            gain: Some(0.42),
            above_room: Some(0.6),
            over_nobody: Some(0.35),
            upright: vec![(Orientation::Half, 0.3)],
            ..Statistics::default()
        };
        found.unclaimed.still = block(0.2, None);
        found.unclaimed.moving = block(0.45, Some(1));
        Self {
            scores: Scores::new(vec![
                score(Measure::Correlation, 0.1, 0.9),
                score(Measure::Gain, 0.0, 0.6),
            ]),
            real_frames: 40,
            offset_c: 0.4,
            warm: WarmPixels {
                real: 4.2,
                claimed: 4.0,
                overlap: None,
            },
            prior: Prior {
                nobody: vec![vec![20.0; 64]],
                has_people: true,
                shows_people: true,
                ..Prior::default()
            },
            found,
            expected: Expected {
                right,
                nobody,
                blank: vec![Statistics {
                    correlation: Some(0.05),
                    gain: Some(0.0),
                    ..Statistics::default()
                }],
            },
            alike: Vec::new(),
        }
    }

    fn judged(&self) -> Judgment {
        let evidence = Evidence {
            scores: &self.scores,
            real_frames: self.real_frames,
            offset_c: self.offset_c,
            warm: self.warm,
            warm_above_c: 0.5,
            lag_frames: 1,
            prior: &self.prior,
            found: &self.found,
            expected: &self.expected,
            alike: &self.alike,
            times: &[Duration::ZERO, Duration::from_millis(400)],
        };
        judge(&evidence, &Thresholds::default())
    }

    fn criterion(&self, name: &str) -> Criterion {
        let judgment = self.judged();
        let mut criteria = judgment.criteria.into_iter();
        criteria.find(|criterion| criterion.name == name).unwrap()
    }

    #[track_caller]
    fn says(&self, name: &str, state: State, sentence: &str) {
        let criterion = self.criterion(name);
        let found = (criterion.state, criterion.sentence.as_str());
        assert_eq!(found, (state, sentence));
    }

    #[track_caller]
    fn cannot_tell(&self, reason: &str, turn: &str) {
        let judgment = self.judged();
        assert_eq!(judgment.verdict, Verdict::CannotTell);
        assert_eq!(judgment.verdict.name(), "cannot_tell");
        assert_eq!(judgment.reasons, [reason]);
        assert_eq!(judgment.would_change, format!("To tell, it takes {turn}."));
    }
}

const LONGER: &str =
    "a recording of at least a second at 10 Hz without gaps, with more contrast or less noise";
const WARMER: &str = "a recording with a person, or another warm thing of the scene, in view";

const MET_BESIDE_C: [&str; 3] = [
    "The gain over a blank frame is 0.42, at least the 0.30 asked for; right scenes have 0.50 (always), rooms with \
     nothing in them 0.00 (always), over 100 drawn units.",
    "With the empty room taken out, C is 0.60, at least the 0.40 asked for; right scenes have 0.80 (always), rooms \
     without the people 0.10 (always), over 100 drawn units.",
    "The gain that the scene's people bring is 0.35, at least the 0.10 asked for; right scenes have 0.50 (99.9 % at \
     least 0.19), rooms without the people 0.00 (99.9 % at most 0.31), over 100 drawn units.",
];

/// 0.1 + 0.6 · 0.7 = 0.52 is asked of C. Margins 0.18 / 0.7, 0.12 / 0.5, 0.2 / 0.8 and (0.35 - 0.309) / 0.191 = 0.21.
#[test]
fn a_right_scene_agrees_by_these_numbers() {
    let judgment = Case::right().judged();
    assert_eq!(judgment.verdict, Verdict::Agrees);
    assert_eq!(judgment.verdict.name(), "agrees");
    let c = "C is 0.70, at least the 0.52 asked for; right scenes have 0.80 (always), rooms with nothing in them 0.05 \
             (always), over 100 drawn units.";
    let level = "The recording is 0.40 °C warmer than the scene all over, within the 2.5 °C that are allowed.";
    let [gain, above_room, over_nobody] = MET_BESIDE_C;
    assert_eq!(judgment.reasons, [c, gain, above_room, over_nobody, level]);
    assert_eq!(
        judgment.would_change,
        "Any of: C below 0.52, the gain over a blank frame below 0.30, with the empty room taken out, C below 0.40, the \
         gain that the scene's people bring below 0.31, or a common offset beyond 2.5 °C. Nearest to its threshold is \
         “Better than the scene without its people”, by 0.21 of skill."
    );
    let others: Vec<_> = judgment
        .criteria
        .iter()
        .filter(|criterion| !judgment.reasons.contains(&criterion.sentence))
        .map(|criterion| (criterion.state, criterion.sentence.as_str()))
        .collect();
    assert_eq!(
        others,
        [
            (
                State::Met,
                "40 frames and 4.2 warm pixels in each are enough to tell."
            ),
            (
                State::Met,
                "Beyond what the scene has there or nearby, no four pixels of the recording are warmer by more than \
                 0.45 °C; 0.50 °C would be needed."
            ),
            (State::Met, "The image lies as the scene has it."),
        ]
    );
}

#[test]
fn what_failed_comes_first_and_says_what_it_takes() {
    let mut case = Case::right();
    case.found.correlation = Some(0.3);
    case.found.unclaimed.moving = block(0.9, Some(1));
    case.found.upright = vec![(Orientation::Half, -0.7)];
    case.offset_c = 3.0;
    let judgment = case.judged();
    assert_eq!(judgment.verdict, Verdict::Disagrees);
    assert_eq!(judgment.verdict.name(), "disagrees");
    let [gain, above_room, over_nobody] = MET_BESIDE_C;
    assert_eq!(
        judgment.reasons,
        [
            "C is 0.30, less than the 0.52 asked for; right scenes have 0.80 (always), rooms with nothing in them 0.05 \
             (always), over 100 drawn units.",
            "0.4 s after the first frame, in rows 1 and 2, columns 6 and 7, the recording is 0.90 °C warmer than the \
             scene has it there or nearby; noise and pattern reach 0.50 °C.",
            "The recording is 3.00 °C warmer than the scene all over, beyond the 2.5 °C that are allowed.",
            "The image is turned by half: so it resembles the scene more than as it was recorded, by 0.70 of likeness, \
             and recordings of the scene as it is hardly ever do.",
            gain,
            above_room,
            over_nobody,
        ]
    );
    assert_eq!(
        judgment.would_change,
        "To agree, it takes C of 0.52, a scene that has something warm there, or a recording without it, a common \
         offset within 2.5 °C, and the image turned back."
    );
}

/// What a room without the people reaches, 0.31, is no proof of them.
#[test]
fn a_score_that_an_empty_room_reaches_proves_nothing() {
    let mut case = Case::right();
    case.found.over_nobody = Some(0.2);
    let reason = "The gain that the scene's people bring is 0.20, at least the 0.10 asked for; right scenes have 0.50 \
                  (99.9 % at least 0.19), rooms without the people 0.00 (99.9 % at most 0.31), over 100 drawn units. So \
                  much proves nothing here.";
    case.cannot_tell(reason, PROFILE);
    case.prior.pattern.from = RoomSource::Profile;
    case.cannot_tell(reason, "a recording with more contrast, or a longer one");
    // As much as is asked is enough, of which a number that is none is not.
    case.expected.right = vec![case.expected.right[0].clone()];
    case.expected.nobody.clear();
    case.found.over_nobody = Some(0.2);
    assert_eq!(case.criterion("better_than_nobody").state, State::Met);
    case.found.over_nobody = Some(f64::NAN);
    assert_eq!(case.criterion("better_than_nobody").state, State::Failed);
}

#[test]
fn a_scene_in_which_nothing_stands_out_has_no_score() {
    let mut case = Case::right();
    for right in &mut case.expected.right {
        right.correlation = None;
    }
    case.cannot_tell(
        "C is not defined for a scene in which nothing stands out.",
        "a scene with something warm in view",
    );
    case.prior.shows_people = false;
    case.says(
        "correlation_above_room",
        State::NotAsked,
        "None of the scene's people are in view while it was recorded.",
    );
}

#[test]
fn a_recording_that_shows_nothing_cannot_tell() {
    let mut case = Case::right();
    case.warm.real = 0.1;
    let shown = "The recording shows nothing warm: 0.10 pixels a frame lie more than 0.50 °C above the background";
    let claims = "the scene claims 4.0 such pixels a frame, which an empty recording neither proves nor refutes";
    case.cannot_tell(&format!("{shown}; {claims}."), WARMER);
    case.warm.claimed = 0.0;
    let none = "the scene claims none either, and any two empty rooms look alike";
    case.cannot_tell(&format!("{shown}; {none}."), WARMER);
    case.warm.real = Thresholds::default().warm_pixels_min;
    assert_eq!(case.judged().verdict, Verdict::Agrees);
    case.scores = Scores::new(vec![score(Measure::Correlation, 0.5, 0.5)]);
    let reason = "The recording does not even resemble itself 1 frame later: C, correlation reaches 0.50 where chance reaches 0.50.";
    case.cannot_tell(reason, LONGER);
    case.real_frames = 1;
    let reason = "The recording holds 1 frame to compare; at least 2 are needed to know what the sensor's noise is worth.";
    case.cannot_tell(reason, "a longer recording of the same scene");
}

/// A difference of exactly the limit is within it.
#[test]
fn warmth_that_is_not_claimed_is_told_from_noise() {
    let mut case = Case::right();
    case.prior.shows_people = false;
    let sentence = |than: &str| {
        format!(
            "The scene shows nobody, and somebody who is up to 0.50 °C warmer on four pixels would not be told from {than}."
        )
    };
    let unit = "noise, nor from this unit's pattern, of which nothing is known";
    case.says("nothing_unclaimed", State::Open, &sentence(unit));
    case.prior.pattern.from = RoomSource::Profile;
    case.says("nothing_unclaimed", State::Open, &sentence("noise"));
    for right in &mut case.expected.right {
        right.unclaimed.moving = block(0.3, Some(0));
    }
    case.found.unclaimed.moving = block(0.3, Some(1));
    case.says("nothing_unclaimed", State::Met, "Beyond what the scene has there or nearby, no four pixels of the recording are warmer by more than 0.30 °C; \
             0.30 °C would be needed.");
    case.found.unclaimed.still = block(0.8, None);
    case.says("nothing_unclaimed", State::Failed, "In rows 1 and 2, columns 6 and 7, the recording is 0.80 °C warmer than the scene has it there or nearby; \
             noise and pattern reach 0.30 °C.");
    case.real_frames = 1;
    case.says(
        "nothing_unclaimed",
        State::NotAsked,
        "Too few frames tell warmth from noise.",
    );
}

#[test]
fn how_the_image_lies_is_told_as_far_as_the_scene_tells_it() {
    let mut case = Case::right();
    for (right, by) in case.expected.right.iter_mut().zip(both(0.0, 0.1)) {
        right.upright = vec![(Orientation::Half, by)];
    }
    case.found.upright = vec![(Orientation::Half, 0.1)];
    case.says("orientation", State::Open, "The image may as well be turned by half: this scene looks too much alike both ways for this recording to \
             tell.");
    case.alike = vec![Orientation::Half];
    case.says("orientation", State::Met, "The image lies as the scene has it. Were it turned by half, it would look the same: the scene is \
             symmetric that way within the noise, and this recording does not tell.");
    case.found.upright = vec![(Orientation::MirroredLeftRight, 0.1)];
    case.prior.turned_back = Some(Orientation::QuarterClockwise);
    case.says(
        "orientation",
        State::Met,
        "The image is turned a quarter clockwise, and was turned back as asked.",
    );
    case.found.upright.clear();
    case.says(
        "orientation",
        State::NotAsked,
        "Nothing in the scene or in the recording tells how the image lies.",
    );
}

#[test]
fn the_level_is_held_against_the_profile_where_there_is_one() {
    let mut case = Case::right();
    case.prior.level_c = Some(0.5);
    case.offset_c = -0.62;
    let level = case.criterion("level");
    assert_eq!(
        (level.state, level.sentence.as_str(), level.keys),
        (
            State::Failed,
            "The recording is 0.62 °C colder than the scene all over, beyond the 0.50 °C that are allowed by this \
             unit's profile.",
            ["level_margin_c"].as_slice()
        )
    );
    case.offset_c = 0.5;
    assert_eq!(case.criterion("level").state, State::Met);
    case.offset_c = -0.004;
    assert_eq!(
        case.criterion("level").sentence,
        "The recording is as warm as the scene all over."
    );
}

#[test]
fn a_faulty_sensor_fails_the_verdict_and_a_sound_one_is_no_reason() {
    let mut case = Case::right();
    let reasons = case.judged().reasons;
    let mut sensor = Criterion {
        name: "rate",
        title: "The rate is the scene's",
        state: State::Met,
        sentence: "Ten frames a second.".to_owned(),
        keys: &["rate_error_max"],
        asked: None,
    };
    case.prior.sensor = vec![sensor.clone()];
    assert_eq!(case.judged().reasons, reasons);
    sensor.state = State::Failed;
    case.prior.sensor = vec![sensor];
    let judgment = case.judged();
    assert_eq!(judgment.verdict, Verdict::Disagrees);
    assert_eq!(judgment.reasons[0], "Ten frames a second.");
    assert_eq!(
        judgment.would_change,
        "To agree, it takes “The rate is the scene's” to hold."
    );
}
