//! The verdict word for word, on evidence with distributions known by hand.
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
use crate::verdict::sensor_criteria::Inspection;
use crate::verdict::types::{Evidence, Prior};
use std::time::Duration;

const PROFILE: (&str, &str) = (
    "Measure this sensor with `grideye characterize` on a recording of the empty room, and pass the result with --profile.",
    "a profile of this unit (grideye characterize, then --profile), or a recording that also shows the room empty",
);

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
    fn cannot_tell(&self, reason: &str, (next, turn): (&str, &str)) {
        let judgment = self.judged();
        assert_eq!(judgment.verdict, Verdict::CannotTell);
        assert_eq!(judgment.verdict.name(), "cannot_tell");
        assert_eq!(judgment.reasons, [format!("{reason} {next}")]);
        assert_eq!(judgment.next_step, next);
        assert_eq!(judgment.would_change, format!("To tell, it takes {turn}."));
    }
}

const LONGER: (&str, &str) = (
    "Record for at least a second at 10 Hz without gaps, with something warmer in view.",
    "a recording of at least a second at 10 Hz without gaps, with more contrast or less noise",
);
const WARMER: (&str, &str) = (
    "Record again with a person, or another warm object of the scene, in view.",
    "a recording with a person, or another warm object of the scene, in view",
);

/// 0.1 + 0.6 · 0.7 = 0.52 is required of the correlation. Margins 0.18 / 0.7, 0.12 / 0.5, 0.2 / 0.8 and
/// (0.35 - 0.309) / 0.191 = 0.21.
#[test]
fn a_right_scene_agrees_by_these_numbers() {
    let mut case = Case::right();
    case.prior.recorded_frames = 300;
    let judgment = case.judged();
    assert_eq!(judgment.verdict, Verdict::Agrees);
    assert_eq!(judgment.verdict.name(), "agrees");
    assert_eq!(
        judgment.headline,
        "Agrees: correlation 0.70. A right scene scores at least 0.80 with this kind of sensor, an empty room at most \
         0.05; 0.52 was required, 60 % of the way from chance to a right scene. Compared 40 of 300 frames."
    );
    assert_eq!(
        judgment.reasons,
        [
            "Correlation 0.70; 0.52 was required.",
            "Gain over a blank frame 0.42; 0.30 was required.",
            "Correlation without the empty room 0.60; 0.40 was required.",
            "Gain from the scene's people 0.35; 0.31 was required.",
            "The recording is 0.40 °C warmer than the scene overall; the sensor's accuracy allows 2.5 °C.",
        ]
    );
    assert_eq!(
        judgment.would_change,
        "Any of: correlation below 0.52, gain over a blank frame below 0.30, correlation without the empty room below \
         0.40, gain from the scene's people below 0.31, or a common offset beyond 2.5 °C. Nearest to its limit is \
         “Better than the scene without its people”: 21 % of the way from chance to a right scene are left."
    );
    let found: Vec<_> = judgment
        .criteria
        .iter()
        .skip(2)
        .map(|criterion| (criterion.state, criterion.sentence.as_str()))
        .collect();
    assert_eq!(
        found,
        [
            "Gain over a blank frame 0.42. A right scene scores at least 0.50 with this kind of sensor, an empty room at \
             most 0.00; 0.30 was required, 60 % of the way from chance to a right scene.",
            "Correlation without the empty room 0.60. A right scene scores at least 0.80 with this kind of sensor, the \
             room without its people at most 0.10; 0.40 was required, 50 % of the way to a right scene.",
            "Gain from the scene's people 0.35. A right scene scores at least 0.19 with this kind of sensor, the room \
             without its people at most 0.31; more than 0.31 was required.",
            "No four pixels are more than 0.45 °C warmer than the scene there or nearby; noise and fixed pattern explain \
             0.50 °C.",
            "The recording is 0.40 °C warmer than the scene overall; the sensor's accuracy allows 2.5 °C.",
            "The image has the scene's orientation.",
        ]
        .map(|sentence| (State::Met, sentence))
    );
}

#[test]
fn what_failed_is_the_headline_and_the_reasons_and_says_what_it_takes() {
    let mut case = Case::right();
    case.found.correlation = Some(0.3);
    case.found.unclaimed.moving = block(0.9, Some(1));
    case.found.upright = vec![(Orientation::Half, -0.7)];
    case.offset_c = 3.0;
    let judgment = case.judged();
    assert_eq!(judgment.verdict, Verdict::Disagrees);
    assert_eq!(judgment.verdict.name(), "disagrees");
    assert_eq!(
        judgment.headline,
        "Disagrees: correlation 0.30. A right scene scores at least 0.80 with this kind of sensor, an empty room at most \
         0.05; 0.52 was required, 60 % of the way from chance to a right scene. Compared 40 of 40 frames."
    );
    let [correlation, unclaimed, level, orientation] = [
        "Check that the people, the objects and the sensor are where the scene has them; mark uncertain values with \
         [[uncertain]] and run `grideye calibrate`.",
        "Add the warm person or object to the scene, or correct its position; or record again without it.",
        "Measure the air in the room and set ambient_c in the scene. If it is right already, measure the sensor's level \
         with `grideye characterize`.",
        "Check how the sensor is mounted, and azimuth_deg and roll_deg in the scene; or compare with --align orientation.",
    ];
    assert_eq!(judgment.next_step, correlation);
    assert_eq!(
        judgment.reasons,
        [
            format!("Correlation 0.30; 0.52 was required. {correlation}"),
            format!(
                "0.4 s after the first frame, in rows 1 and 2, columns 6 and 7, the recording is 0.90 °C warmer than the \
                 scene there or nearby; noise and fixed pattern explain at most 0.50 °C. {unclaimed}"
            ),
            format!(
                "The recording is 3.00 °C warmer than the scene overall; the sensor's accuracy allows 2.5 °C. {level}"
            ),
            format!(
                "If the image were turned by half, it would fit the scene better by 0.70 of correlation; a sensor mounted so \
                 gives at least 0.50. {orientation}"
            ),
        ]
    );
    assert_eq!(
        judgment.would_change,
        "To agree, it takes correlation of 0.52, a scene that has something warm there, or a recording without it, a \
         common offset within 2.5 °C, and the image turned back."
    );
    let text = format!("{}\n  Next: {correlation}\n", judgment.headline);
    assert!(judgment.to_string().starts_with(&text), "{judgment}");
}

/// How to bring each criterion into each state that is not good.
type Change = fn(&mut Case);

const NOT_MET: [(&str, State, Change); 22] = [
    ("enough_to_tell", State::Open, |case| case.real_frames = 1),
    ("enough_to_tell", State::Open, |case| case.warm.real = 0.1),
    ("enough_to_tell", State::Open, |case| {
        case.scores = Scores::new(vec![score(Measure::Correlation, 0.5, 0.5)]);
    }),
    ("correlation", State::Failed, |case| {
        case.found.correlation = Some(0.3);
    }),
    ("correlation", State::Open, |case| {
        case.expected.blank[0].correlation = Some(0.75);
    }),
    ("correlation", State::Open, |case| {
        for right in &mut case.expected.right {
            right.correlation = None;
        }
    }),
    ("gain", State::Failed, |case| case.found.gain = Some(0.1)),
    ("gain", State::Open, |case| {
        case.expected.blank[0].gain = Some(0.45);
    }),
    ("correlation_above_room", State::Failed, |case| {
        case.found.above_room = Some(0.1);
    }),
    ("correlation_above_room", State::Open, |case| {
        for nobody in &mut case.expected.nobody {
            nobody.above_room = Some(0.7);
        }
    }),
    ("better_than_nobody", State::Failed, |case| {
        case.found.over_nobody = Some(0.05);
    }),
    ("better_than_nobody", State::Open, |case| {
        case.found.over_nobody = Some(0.2);
    }),
    ("better_than_nobody", State::Open, |case| {
        case.found.over_nobody = Some(0.2);
        case.prior.pattern.from = RoomSource::Profile;
    }),
    ("nothing_unclaimed", State::Failed, |case| {
        case.found.unclaimed.still = block(0.8, None);
    }),
    ("nothing_unclaimed", State::Open, |case| {
        case.prior.shows_people = false;
    }),
    ("nothing_unclaimed", State::Open, |case| {
        case.prior.shows_people = false;
        case.prior.pattern.from = RoomSource::Recording;
    }),
    ("level", State::Failed, |case| case.offset_c = 3.0),
    ("level", State::Failed, |case| {
        case.prior.level_c = Some(0.3);
    }),
    ("orientation", State::Failed, |case| {
        case.found.upright = vec![(Orientation::Half, -0.5)];
    }),
    ("orientation", State::Failed, |case| {
        for right in &mut case.expected.right {
            right.upright = vec![(Orientation::MirroredLeftRight, 0.5)];
        }
        case.found.upright = vec![(Orientation::MirroredLeftRight, -0.5)];
    }),
    ("orientation", State::Failed, |case| {
        case.found.upright = vec![(Orientation::Half, -0.2)];
    }),
    ("orientation", State::Open, |case| {
        for (right, by) in case.expected.right.iter_mut().zip(both(0.0, 0.1)) {
            right.upright = vec![(Orientation::Half, by)];
        }
        case.found.upright = vec![(Orientation::Half, 0.1)];
    }),
];

#[test]
fn every_criterion_that_is_not_met_says_what_to_do_next() {
    let faulty = Inspection::faulty().criteria(&Thresholds::default(), 10.0, 20.0);
    let mut cases: Vec<(&str, State, Case)> = Vec::new();
    for (name, state, change) in NOT_MET {
        let mut case = Case::right();
        change(&mut case);
        cases.push((name, state, case));
    }
    for criterion in faulty {
        let mut case = Case::right();
        let name = criterion.name;
        case.prior.sensor = vec![criterion];
        cases.push((name, State::Failed, case));
    }
    for (name, state, case) in &cases {
        let judgment = case.judged();
        let criterion = case.criterion(name);
        assert_eq!(criterion.state, *state, "{criterion:?}");
        for criterion in &judgment.criteria {
            let is_needed = matches!(criterion.state, State::Failed | State::Open);
            assert_eq!(!criterion.next_step.is_empty(), is_needed, "{criterion:?}");
            assert!(
                !is_needed || criterion.next_step.ends_with('.'),
                "{criterion:?}"
            );
        }
        let is_reason = |reason: &String| reason.ends_with(&criterion.next_step);
        assert!(judgment.reasons.iter().any(is_reason), "{name}: {judgment}");
        let words = judgment.headline.split_whitespace().count();
        assert!(words <= 45, "{words} words: {}", judgment.headline);
        assert!(judgment.headline.contains(". Compared "), "{judgment}");
    }
    // A new criterion needs a row above.
    for criterion in Case::right().judged().criteria {
        let is_tried = cases.iter().any(|(name, ..)| *name == criterion.name);
        assert!(is_tried, "{}", criterion.name);
    }
}

/// A person elsewhere than in the scene makes some orientation fit better, but not as well as a sensor mounted that way.
#[test]
fn an_orientation_that_explains_little_is_no_reason_beside_another() {
    let mut case = Case::right();
    case.found.upright = vec![(Orientation::Half, -0.2)];
    let sentence = "If the image were turned by half, it would fit the scene better by 0.20 of correlation; a sensor \
                    mounted so gives at least 0.50, so something else is wrong.";
    case.says("orientation", State::Failed, sentence);
    assert!(
        case.judged()
            .headline
            .contains("if the image were turned by half")
    );
    case.found.correlation = Some(0.3);
    case.says("orientation", State::Failed, sentence);
    let judgment = case.judged();
    assert_eq!(judgment.verdict, Verdict::Disagrees);
    assert_eq!(judgment.reasons.len(), 1, "{:?}", judgment.reasons);
    assert!(judgment.reasons[0].starts_with("Correlation 0.30"));
    // 0.6 · 0.5 is enough.
    case.found.upright = vec![(Orientation::Half, -0.31)];
    assert_eq!(case.judged().reasons.len(), 2);
}

/// What a room without the people reaches, 0.31, is no proof of them.
#[test]
fn a_score_that_an_empty_room_reaches_proves_nothing() {
    let mut case = Case::right();
    case.found.over_nobody = Some(0.2);
    let reason = "Gain from the scene's people 0.20; 0.31 was required.";
    case.cannot_tell(reason, PROFILE);
    case.prior.pattern.from = RoomSource::Profile;
    let longer = (
        "Record for longer, or with something warmer in view.",
        "a recording with more contrast, or a longer one",
    );
    case.cannot_tell(reason, longer);
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
        "Correlation is undefined: nothing stands out in the scene.",
        (
            "Compare with a scene that has something warm in view.",
            "a scene with something warm in view",
        ),
    );
    case.prior.shows_people = false;
    case.says(
        "correlation_above_room",
        State::NotAsked,
        "None of the scene's people were in view during the recording.",
    );
}

#[test]
fn a_recording_that_shows_nothing_cannot_tell() {
    let mut case = Case::right();
    case.warm.real = 0.1;
    let shown = "The recording shows nothing warm: 0.10 pixels per frame are more than 0.50 °C above the background";
    let claims = "the scene has 4.0, which an empty recording neither confirms nor refutes";
    case.cannot_tell(&format!("{shown}; {claims}."), WARMER);
    case.warm.claimed = 0.0;
    let none = "the scene has none either, and any two empty rooms look alike";
    case.cannot_tell(&format!("{shown}; {none}."), WARMER);
    case.warm.real = Thresholds::default().warm_pixels_min;
    assert_eq!(case.judged().verdict, Verdict::Agrees);
    case.scores = Scores::new(vec![score(Measure::Correlation, 0.5, 0.5)]);
    let reason = "The recording does not even resemble itself 1 frame later: its correlation is 0.50, and chance reaches 0.50.";
    case.cannot_tell(reason, LONGER);
    case.real_frames = 1;
    let reason =
        "The recording holds 1 frame to compare; measuring the sensor's noise takes at least 2.";
    let longer = (
        "Record the same scene for longer.",
        "a longer recording of the same scene",
    );
    case.cannot_tell(reason, longer);
}

/// A difference of exactly the limit is within it.
#[test]
fn warmth_that_is_not_claimed_is_told_from_noise() {
    let mut case = Case::right();
    case.prior.shows_people = false;
    let sentence = |hides: &str| {
        format!(
            "The scene shows nobody, but {hides} could hide a person who makes four pixels up to 0.50 °C warmer."
        )
    };
    let unit = "noise and the unknown fixed pattern of this sensor";
    case.says("nothing_unclaimed", State::Open, &sentence(unit));
    case.prior.pattern.from = RoomSource::Profile;
    case.says("nothing_unclaimed", State::Open, &sentence("noise"));
    for right in &mut case.expected.right {
        right.unclaimed.moving = block(0.3, Some(0));
    }
    case.found.unclaimed.moving = block(0.3, Some(1));
    case.says("nothing_unclaimed", State::Met, "No four pixels are more than 0.30 °C warmer than the scene there or nearby; noise and fixed pattern explain \
             0.30 °C.");
    case.found.unclaimed.still = block(0.8, None);
    case.says("nothing_unclaimed", State::Failed, "In rows 1 and 2, columns 6 and 7, the recording is 0.80 °C warmer than the scene there or nearby; \
             noise and fixed pattern explain at most 0.30 °C.");
    case.real_frames = 1;
    case.says(
        "nothing_unclaimed",
        State::NotAsked,
        "Too few frames to tell warmth from noise.",
    );
}

#[test]
fn how_the_image_lies_is_told_as_far_as_the_scene_tells_it() {
    let mut case = Case::right();
    for (right, by) in case.expected.right.iter_mut().zip(both(0.0, 0.1)) {
        right.upright = vec![(Orientation::Half, by)];
    }
    case.found.upright = vec![(Orientation::Half, 0.1)];
    case.says(
        "orientation",
        State::Open,
        "The image may be turned by half: the scene looks too similar both ways.",
    );
    case.alike = vec![Orientation::Half];
    case.says("orientation", State::Met, "The image has the scene's orientation. The scene is symmetric within the noise: an image turned by half \
             would look the same.");
    case.found.upright = vec![(Orientation::MirroredLeftRight, 0.1)];
    case.prior.turned_back = Some(Orientation::QuarterClockwise);
    case.says(
        "orientation",
        State::Met,
        "The image is turned a quarter clockwise, which was corrected as asked.",
    );
    case.found.upright.clear();
    case.says(
        "orientation",
        State::NotAsked,
        "Neither scene nor recording shows an orientation.",
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
            "The recording is 0.62 °C colder than the scene overall; this sensor's profile allows 0.50 °C.",
            ["level_margin_c"].as_slice()
        )
    );
    case.offset_c = 0.5;
    assert_eq!(case.criterion("level").state, State::Met);
    case.offset_c = -0.004;
    assert_eq!(
        case.criterion("level").sentence,
        "The recording is as warm as the scene overall."
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
        sentence: "Ten frames per second.".to_owned(),
        next_step: "Look.".to_owned(),
        keys: &["rate_error_max"],
        asked: None,
    };
    case.prior.sensor = vec![sensor.clone()];
    assert_eq!(case.judged().reasons, reasons);
    sensor.state = State::Failed;
    case.prior.sensor = vec![sensor];
    let judgment = case.judged();
    assert_eq!(judgment.verdict, Verdict::Disagrees);
    assert_eq!(judgment.reasons[0], "Ten frames per second. Look.");
    assert_eq!(
        judgment.would_change,
        "To agree, it takes “The rate is the scene's” to be met."
    );
}
