//! A scene is not judged by the frames that it was fitted to.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use crate::calibrate::{EIGHT, UNIT, files, record, run, unknown};
use grideye_frame::Reading;
use grideye_recording::Record;
use grideye_scene::Scene;
use grideye_validator::calibrate::{Half, Options};
use grideye_validator::{Comparison, State, Verdict, compare_scene};

/// The whole walk.
const FRAMES: u32 = 97;

fn fitted(text: &str, records: &[Record], half: Option<Half>) -> String {
    let options = Options {
        half,
        starts: 2,
        ..Options::default()
    };
    let found = run(text, records, &options).unwrap();
    assert_eq!(found.half, half);
    found.scene
}

fn compared(text: &str, records: &[Record]) -> Comparison {
    compared_from(text, records, 0.0)
}

fn compared_from(text: &str, records: &[Record], start_s: f64) -> Comparison {
    let scene = Scene::parse(text, "fitted.toml", &files()).unwrap().scene;
    let options = grideye_validator::Options {
        start_s: Some(start_s),
        ..Default::default()
    };
    compare_scene(records, &scene, "ceiling", &options).unwrap()
}

/// The verdict and the criterion's state.
fn judged(text: &str, records: &[Record]) -> (Verdict, State) {
    let judgment = compared(text, records).judgment;
    let mut criteria = judgment.criteria.iter();
    let apart = criteria.find(|criterion| criterion.name == "judged_apart");
    let state = apart.unwrap().state;
    if judgment.verdict == Verdict::CannotTell {
        assert!(judgment.next_step.contains("--half first"), "{judgment}");
    }
    (judgment.verdict, state)
}

const CANNOT: (Verdict, State) = (Verdict::CannotTell, State::Open);
const AGREES: (Verdict, State) = (Verdict::Agrees, State::Met);

#[test]
fn a_recording_cannot_confirm_the_scene_that_was_fitted_to_it() {
    let records = record(UNIT, 1, FRAMES, 100, 0.0);
    let text = fitted(&unknown(&EIGHT[..3]), &records, None);
    assert_eq!(judged(&text, &records), CANNOT);
    assert_eq!(judged(&text, &record(UNIT, 2, FRAMES, 100, 0.0)), AGREES);
    // Cut, or with other numbers and times, it is the same recording.
    assert_eq!(judged(&text, &records[..60]), CANNOT);
    let late = compared_from(&text, &records[60..90], 6.0).judgment;
    assert_eq!(late.criteria[1].name, "judged_apart");
    assert_eq!(late.criteria[1].state, State::Open);
    let mut renumbered = records.clone();
    for record in &mut renumbered {
        record.seq += 1000;
        record.stamp.t_boot_ns += 40_000_000_000;
    }
    assert_eq!(judged(&text, &renumbered), CANNOT);
}

/// Fitted or not, a scene that the recording contradicts disagrees.
#[test]
fn the_recording_that_a_scene_was_fitted_to_can_still_contradict_it() {
    let records = record(UNIT, 1, FRAMES, 100, 0.0);
    let text = fitted(&unknown(&EIGHT[..1]), &records, None);
    let mirrored = text.replace("azimuth_deg = 90", "azimuth_deg = -90");
    let (verdict, state) = judged(&mirrored, &records);
    assert_eq!((verdict, state), (Verdict::Disagrees, State::Open));
}

#[test]
fn the_half_that_was_left_out_is_judged() {
    let records = record(UNIT, 1, FRAMES, 100, 0.0);
    let text = unknown(&EIGHT[..3]);
    for (half, fitted_to) in [(Half::First, 0..48), (Half::Second, 49..97)] {
        let text = fitted(&text, &records, Some(half));
        assert_eq!(judged(&text, &records), AGREES, "{half:?}");
        let comparison = compared(&text, &records);
        let headline = comparison.judgment.headline;
        let of = headline.rsplit_once(" of ").unwrap().1;
        let (frames, rest) = of.split_once(' ').unwrap();
        assert_eq!(
            rest, "frames that the scene was not fitted to.",
            "{headline}"
        );
        // Half of them, less those that look torn by chance and the one or two next to the other half.
        let frames: usize = frames.parse().unwrap();
        assert!((42..=49).contains(&frames), "{headline}");
        assert!(comparison.real_frames <= frames, "{headline}");
        let start_s = 0.1 * f64::from(u32::try_from(fitted_to.start).unwrap());
        let cut = compared_from(&text, &records[fitted_to], start_s).judgment;
        assert_eq!(cut.criteria[1].state, State::Open, "{half:?}");
        assert_ne!(cut.verdict, Verdict::Agrees);
    }
}

/// What the second half shows must decide: here an image upside down.
#[test]
fn frames_of_the_fitted_half_do_not_decide() {
    let mut records = record(UNIT, 1, FRAMES, 100, 0.0);
    let text = fitted(&unknown(&EIGHT[..3]), &records, Some(Half::First));
    for record in &mut records[50..] {
        if let Reading::Frame(raw) = &mut record.reading {
            raw.pixels.reverse();
        }
    }
    assert_eq!(judged(&text, &records).0, Verdict::Disagrees);
}

#[test]
fn values_of_an_earlier_calibration_keep_its_table() {
    let [one, other] = [1, 2].map(|seed| record(UNIT, seed, FRAMES, 100, 0.0));
    let both = fitted(&unknown(&EIGHT[..2]), &one, None);
    let (front, _) = both.split_once("\n[[uncertain]]\n").unwrap();
    let table = both.split_once("\n[[calibrated]]\n").unwrap().1;
    let ambient = "[[uncertain]]\nkey = \"room.ambient_c\"\nbounds = [15, 25]\n";
    let text = fitted(
        &format!("{front}\n[[calibrated]]\n{table}{ambient}"),
        &other,
        None,
    );
    assert_eq!(text.matches("[[calibrated]]").count(), 2, "{text}");
    assert!(text.contains(table), "{text}");
    assert_eq!([judged(&text, &one), judged(&text, &other)], [CANNOT; 2]);
    let again = text + "[[uncertain]]\nkey = \"agent.person.temperature_c\"\nbounds = [22, 36]\n";
    let third = fitted(&again, &record(UNIT, 3, FRAMES, 100, 0.0), None);
    assert_eq!(third.matches("[[calibrated]]").count(), 1, "{third}");
    assert_eq!([judged(&third, &one), judged(&third, &other)], [AGREES; 2]);
}
