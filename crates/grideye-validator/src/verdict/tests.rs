//! The verdict of hand-built decisions: which criterion fails or stays open, and that its sentence reads well.

use crate::advice::Remedy;
use crate::align::Orientation;
use crate::decision::{Alternative, Alternatively, Contrast, Decision, Statistic};
use crate::frames::fitted::FittedShare;
use crate::frames::{LeftOut, LeftOutCount};
use crate::thresholds::Thresholds;
use crate::verdict::judgment::judge;
use crate::verdict::sensor_criteria::Inspection;
use crate::verdict::types::{Evidence, Judgment, Prior, State, Verdict};

/// A recording that a right scene could have made.
fn right() -> Decision {
    let told = |what: &str, of| Alternatively {
        what: what.to_owned(),
        of,
        likeness: 0.9,
        limit: 0.4,
        power: 1.0,
        is_alike: false,
    };
    Decision {
        right: 0.4,
        worst: "the recording is 0.05 s later than the scene".to_owned(),
        cause: Statistic::Lag,
        contrasts: vec![Contrast {
            of: Some("anna".to_owned()),
            found: 1.1,
            range: [0.4, 2.5],
        }],
        delay_s: 0.05,
        delay_range_s: [-0.2, 0.2],
        refused_aside_m: Some(0.3),
        alternatives: vec![
            told("a room with nothing warm", Alternative::Nobody),
            told("the scene in reverse", Alternative::Backwards),
        ],
        is_empty: false,
        drift_c: 0.0,
        frames: 600,
        pictures: 300,
        strays: 0,
    }
}

const fn left_out(reason: LeftOut, rows: usize) -> LeftOutCount {
    LeftOutCount {
        reason,
        rows,
        first_seq: 1,
    }
}

fn judged(change: impl FnOnce(&mut Decision, &mut Evidence<'_>, &mut Prior)) -> Judgment {
    let mut decision = right();
    let mut prior = Prior {
        recorded_frames: 603,
        has_people: true,
        drift_c: [0.1, 0.6],
        ..Prior::default()
    };
    let none = Prior::default();
    let mut evidence = Evidence {
        real_frames: 100,
        has_repeat: true,
        offset_c: 0.4,
        prior: &none,
    };
    change(&mut decision, &mut evidence, &mut prior);
    prior.decision = Some(decision);
    evidence.prior = &prior;
    judge(&evidence, &Thresholds::default())
}

#[test]
fn a_right_recording_agrees_and_says_what_would_have_been_noticed() {
    let judgment = judged(|_, _, _| ());
    assert_eq!(judgment.verdict, Verdict::Agrees);
    assert_eq!(
        judgment.headline,
        "Agrees: `anna` is where and when the scene says. A person 0.30 m aside or a start 0.20 s later would have been noticed. Based on 600 of 603 frames."
    );
    assert_eq!(judgment.next_step, "");
    assert!(judgment.criteria.iter().all(|one| one.state == State::Met));
}

type Change = fn(&mut Decision, &mut Evidence<'_>, &mut Prior);

/// The criterion that decides, the verdict, what is found, what is next, and why.
#[rustfmt::skip]
const CASES: [(&str, Verdict, &str, &str, Change); 15] = [
        (
            "right",
            Verdict::Disagrees,
            "the recording is 1.00 s later than the scene.",
            "--start",
            |decision, _, _| {
                decision.right = 0.005;
                decision.worst = "the recording is 1.00 s later than the scene".to_owned();
            },
        ),
        (
            "right",
            Verdict::Disagrees,
            "",
            "that the scene lacks",
            |decision, _, _| {
                decision.right = 0.005;
                decision.cause = Statistic::Block {
                    is_warmer: true,
                    stays: false,
                };
            },
        ),
        (
            "right",
            Verdict::Disagrees,
            "",
            "was there",
            |decision, _, _| {
                decision.right = 0.005;
                decision.cause = Statistic::Block {
                    is_warmer: false,
                    stays: false,
                };
            },
        ),
        (
            "right",
            Verdict::Disagrees,
            "",
            "[[uncertain]]",
            |decision, _, _| {
                decision.right = 0.005;
                decision.cause = Statistic::Misfit;
            },
        ),
        (
            "right",
            Verdict::Disagrees,
            "",
            "azimuth_deg",
            |decision, _, prior| {
                decision.right = 0.005;
                prior.remedy = Some(Remedy {
                    found: "Most likely the sensor is turned by 12°, which explains 90 % of the difference.".to_owned(),
                    step: "Set `azimuth_deg = 12` of the sensor: the scene then agrees.".to_owned(),
                });
            },
        ),
        (
            "contrast",
            Verdict::Disagrees,
            "the contrast of `anna` to the room is 3.00 times the scene's; 0.40 to 2.50 is allowed.",
            "person.clothing",
            |decision, _, _| decision.contrasts[0].found = 3.0,
        ),
        (
            "told_apart",
            Verdict::CannotTell,
            "it would also fit the scene in reverse.",
            "--profile",
            |decision, _, _| decision.alternatives[1].likeness = 0.3,
        ),
        (
            "told_apart",
            Verdict::CannotTell,
            "it would also fit a room with nothing warm.",
            "--profile",
            |decision, _, _| decision.alternatives[0].is_alike = true,
        ),
        (
            "level",
            Verdict::Disagrees,
            "the recording is 3.00 °C colder than the scene overall; the sensor's accuracy allows 2.5 °C.",
            "ambient_c",
            |_, evidence, _| evidence.offset_c = -3.0,
        ),
        (
            "level",
            Verdict::Disagrees,
            "the recording is 0.90 °C warmer than the scene overall; this sensor's profile allows 0.80 °C.",
            "ambient_c",
            |_, evidence, prior| {
                evidence.offset_c = 0.9;
                prior.level_c = Some(0.8);
            },
        ),
        (
            "drift",
            Verdict::Disagrees,
            "all pixels together drift by 2.00 °C against the scene; 0.60 °C is usual in this time.",
            "warm up",
            |_, _, prior| prior.drift_c[0] = 2.0,
        ),
        (
            "enough_to_tell",
            Verdict::CannotTell,
            "the recording holds 1 frame to compare; measuring the sensor's noise takes at least 2.",
            "for longer",
            |_, evidence, _| evidence.real_frames = 1,
        ),
        (
            "enough_to_tell",
            Verdict::CannotTell,
            "the recording shows only the room and noise, which fits an empty room as well as the scene.",
            "with a person",
            |decision, _, _| decision.is_empty = true,
        ),
        (
            "enough_to_tell",
            Verdict::CannotTell,
            "the recording has no two frames in a row, so the sensor's noise is unknown.",
            "for longer",
            |_, evidence, _| evidence.has_repeat = false,
        ),
        (
            "told_apart",
            Verdict::CannotTell,
            "the scene has no people",
            "--profile",
            |_, _, prior| prior.has_people = false,
        ),
];

/// Each verdict that these tests judge, for the list of sentences.
pub(crate) fn judgments() -> Vec<Judgment> {
    let judged_as = |(_, _, _, _, change): (&str, Verdict, &str, &str, Change)| judged(change);
    let mut all: Vec<Judgment> = CASES.into_iter().map(judged_as).collect();
    all.insert(0, judged(|_, _, _| ()));
    all.insert(
        1,
        judged(|decision, _, _| {
            decision.contrasts[0].of = None;
            decision.refused_aside_m = None;
            decision.delay_range_s = [0.0; 2];
        }),
    );
    all.insert(
        2,
        judged(|decision, _, _| {
            decision.contrasts = vec![decision.contrasts[0].clone(); 2];
            let more = decision.alternatives[0].clone();
            decision.alternatives.push(Alternatively {
                of: Alternative::Follower(1.0),
                ..more
            });
        }),
    );
    all.push(judged(|decision, _, _| decision.contrasts[0].found = 0.02));
    all.push(judged(|decision, _, _| {
        (decision.right, decision.is_empty, decision.worst) = (
            0.001,
            true,
            "the recording shows nobody, only the room and noise".to_owned(),
        );
    }));
    all.push(judged(|_, _, prior| prior.turned = Orientation::Half));
    all.push(judged(|_, _, prior| {
        prior.fitted = Some(FittedShare {
            fitted: 600,
            of: 603,
        });
    }));
    all.push(judged(|_, evidence, prior| {
        evidence.real_frames = 1;
        prior.recorded_frames = 100;
        prior.left_out = vec![left_out(LeftOut::Torn, 80)];
    }));
    all.push(judged(|decision, _, prior| {
        decision.frames = 542;
        prior.left_out = vec![
            left_out(LeftOut::Duplicate, 9),
            left_out(LeftOut::OutsideScene, 61),
        ];
    }));
    let faults = Inspection::faulty().criteria(&Thresholds::default(), 10.0, 20.0);
    all.push(judged(|_, _, prior| prior.sensor = faults));
    all
}

#[test]
fn each_criterion_decides_with_its_sentence_and_a_next_step() {
    for (name, verdict, found, next, change) in CASES {
        let judgment = judged(change);
        assert_eq!(judgment.verdict, verdict, "{judgment}");
        let state = match verdict {
            Verdict::Disagrees => State::Failed,
            _ => State::Open,
        };
        let mut off = judgment.criteria.iter().filter(|one| one.state == state);
        assert_eq!(off.next().map(|one| one.name), Some(name), "{judgment}");
        assert_eq!(off.next(), None, "{judgment}");
        assert!(judgment.headline.contains(found), "{judgment}");
        assert!(judgment.next_step.contains(next), "{judgment}");
    }
}

/// A mirror image that is the scene itself is named, and settles nothing.
#[test]
fn an_explanation_that_is_the_scene_itself_does_not_count() {
    let judgment = judged(|decision, _, _| {
        let backwards = &mut decision.alternatives[1];
        (backwards.is_alike, backwards.power, backwards.likeness) = (true, 0.5, 0.0);
    });
    assert_eq!(judgment.verdict, Verdict::Agrees);
    let told = judgment
        .criteria
        .iter()
        .find(|one| one.name == "told_apart");
    assert_eq!(
        told.map(|one| one.sentence.as_str()),
        Some(
            "The recording would not fit a room with nothing warm. To this sensor, the scene looks the same as the scene in reverse."
        )
    );
}

/// What fails counts before what is open, but not on a single frame.
#[test]
fn a_failure_counts_before_what_is_open() {
    let nothing_warm = |decision: &mut Decision, evidence: &mut Evidence<'_>, _: &mut Prior| {
        decision.is_empty = true;
        evidence.offset_c = 3.0;
    };
    assert_eq!(judged(nothing_warm).verdict, Verdict::Disagrees);
    let one_frame = |_: &mut Decision, evidence: &mut Evidence<'_>, _: &mut Prior| {
        evidence.real_frames = 1;
        evidence.offset_c = 3.0;
    };
    assert_eq!(judged(one_frame).verdict, Verdict::CannotTell);
}

#[test]
fn every_fault_of_a_sensor_has_its_next_step() {
    let criteria = Inspection::faulty().criteria(&Thresholds::default(), 10.0, 20.0);
    let names: Vec<_> = criteria.iter().map(|one| one.name).collect();
    assert_eq!(
        names,
        ["moving_pixels", "steps", "thermistor", "frame_rate"]
    );
    for one in &criteria {
        assert_eq!(one.state, State::Failed, "{one:?}");
        assert!(!one.next_step.is_empty(), "{one:?}");
    }
    let judgment = judged(|_, _, prior| prior.sensor = criteria);
    assert_eq!(judgment.verdict, Verdict::Disagrees);
    assert_eq!(judgment.reasons.len(), 4, "{judgment}");
}
