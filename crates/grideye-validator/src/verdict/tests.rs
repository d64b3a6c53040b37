//! The verdict of hand-built decisions: which criterion fails or stays open, and that its sentence reads well.

use crate::advice::Remedy;
use crate::decision::{Alternative, Alternatively, Contrast, Decision, Statistic};
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
        worst: "it is 0.05 s later than the scene".to_owned(),
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
            told("the scene backwards", Alternative::Backwards),
        ],
        is_empty: false,
        drift_c: 0.0,
        frames: 600,
        pictures: 300,
        strays: 0,
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
fn a_right_recording_agrees_and_says_what_would_not() {
    let judgment = judged(|_, _, _| ());
    assert_eq!(judgment.verdict, Verdict::Agrees);
    assert_eq!(
        judgment.headline,
        "Agrees: `anna` is where and when the scene has them: 0.30 m aside, or 0.20 s later would have been noticed. Judged by 600 of 603 frames."
    );
    assert_eq!(judgment.next_step, "");
    assert_eq!(
        judgment.would_change,
        "It would not agree with a person 0.30 m aside, a recording more than 0.20 s earlier or 0.20 s later, a contrast below 0.40 or above 2.50, or a common offset beyond 2.5 °C."
    );
    assert!(judgment.criteria.iter().all(|one| one.state == State::Met));
}

#[test]
#[expect(clippy::too_many_lines, reason = "a table")]
fn each_criterion_decides_with_its_sentence_and_a_next_step() {
    type Change = fn(&mut Decision, &mut Evidence<'_>, &mut Prior);
    let cases: [(&str, Verdict, &str, &str, Change); 15] = [
        (
            "right",
            Verdict::Disagrees,
            "it is 1.00 s later than the scene.",
            "--start",
            |decision, _, _| {
                decision.right = 0.005;
                decision.worst = "it is 1.00 s later than the scene".to_owned();
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
            "Take the left sensor.",
            |decision, _, prior| {
                decision.right = 0.005;
                prior.remedy = Some(Remedy {
                    found: "90 % of the difference would go with the left sensor.".to_owned(),
                    step: "Take the left sensor.".to_owned(),
                });
            },
        ),
        (
            "contrast",
            Verdict::Disagrees,
            "`anna` has 3.00 times the scene's contrast; 0.40 to 2.50 is what the scene leaves open.",
            "person.clothing",
            |decision, _, _| decision.contrasts[0].found = 3.0,
        ),
        (
            "told_apart",
            Verdict::CannotTell,
            "it could also be the scene backwards.",
            "--profile",
            |decision, _, _| decision.alternatives[1].likeness = 0.3,
        ),
        (
            "told_apart",
            Verdict::CannotTell,
            "it could also be a room with nothing warm.",
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
            "the recording drifts by 2.00 °C against the scene, all pixels together; 0.60 °C is usual in this time.",
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
            "the recording shows nothing but the room and noise, which neither confirms nor refutes a scene.",
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
    for (name, verdict, found, next, change) in cases {
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
        assert!(
            !judgment.would_change.contains("nothing that was asked"),
            "{judgment:?}"
        );
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
            "No other explanation fits (1 considered). This sensor cannot tell it from the scene backwards."
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
