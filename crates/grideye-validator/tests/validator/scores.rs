//! Scores of frames of a toy sensor, floors and ceilings, and rejected input. Frames without a scene have no verdict.

use crate::toy::{Blob, PERSON, UNIT, Unit, recording, settings, simulation};
use grideye_validator::{
    Comparison, FRAMES_MAX, Measure, Protocol, RealFrame, SHUFFLES_MAX, Settings, SimulatedFrame,
    Verdict, compare,
};

fn compare_static(real: &[Blob], claimed: &[Blob], unit: Unit, seed: u64) -> Comparison {
    let real = recording(10, unit, seed, |_| real.to_vec());
    let simulated = simulation(10, seed + 1_000, |_| claimed.to_vec());
    compare(&real, &simulated, &settings(Protocol::Static)).unwrap()
}

#[test]
fn frames_without_a_scene_cannot_tell() {
    let judgment = compare_static(&[PERSON], &[PERSON], UNIT, 1).judgment;
    assert_eq!(judgment.verdict, Verdict::CannotTell);
    let why = "Frames without a scene decide nothing.";
    assert!(judgment.reasons[0].contains(why), "{:?}", judgment.reasons);
}

#[test]
fn an_offset_of_three_degrees_is_noticed_either_way() {
    for offset_c in [3.0, -3.0] {
        let unit = Unit { offset_c, ..UNIT };
        let comparison = compare_static(&[PERSON], &[PERSON], unit, 3);
        assert!(
            (comparison.offset_c - offset_c).abs() < 0.2,
            "{}",
            comparison.offset_c
        );
        let direction = if offset_c > 0.0 { "warmer" } else { "colder" };
        let reason = &comparison.judgment.reasons[0];
        assert!(
            reason.contains(direction) && reason.contains("allows 2.5 °C"),
            "{reason}"
        );
    }
}

#[test]
fn one_frame_or_no_repeat_cannot_tell() {
    let simulated = simulation(10, 2, |_| vec![PERSON]);
    let mut real = recording(10, UNIT, 1, |_| vec![PERSON]);
    let one = compare(&real[..1], &simulated, &settings(Protocol::Static)).unwrap();
    assert_eq!(one.judgment.verdict, Verdict::CannotTell);
    assert!(one.judgment.reasons[0].contains("holds 1 frame to compare"));
    for frame in &mut real {
        frame.later = None;
    }
    let alone = compare(&real, &simulated, &settings(Protocol::Static)).unwrap();
    assert_eq!(alone.judgment.verdict, Verdict::CannotTell);
    assert!(
        alone.judgment.reasons[0].contains("no two frames in a row"),
        "{:?}",
        alone.judgment.reasons
    );
    assert_eq!(alone.noise_sigma_c, None);
}

#[test]
fn the_same_input_gives_the_same_comparison() {
    assert_eq!(
        compare_static(&[PERSON], &[PERSON], UNIT, 4),
        compare_static(&[PERSON], &[PERSON], UNIT, 4)
    );
}

/// What the paper's measures hide (README, "What each score hides"), on a scene like the paper's.
#[test]
fn floors_and_ceilings_show_what_the_papers_measures_hide() {
    let comparison = compare_static(&[PERSON], &[PERSON], UNIT, 5);
    let similarity = comparison.score(Measure::ImageSimilarity);
    assert!(similarity.blank.unwrap() > 0.85);
    assert!(similarity.value.unwrap() > similarity.blank.unwrap());
    let grey = comparison.score(Measure::MutualInformation);
    let shuffled = grey.shuffled.unwrap().mean;
    assert!(shuffled > 0.7 * grey.value.unwrap(), "{grey:?}");
    let correlation = comparison.score(Measure::Correlation);
    assert_eq!(correlation.blank, None);
    assert!(correlation.shuffled.unwrap().mean.abs() < 0.15);
    assert!(correlation.shuffled.unwrap().p95 > correlation.shuffled.unwrap().mean);
}

/// The repeat must give back noise of 0.25 degrees plus rounding to steps of 0.25 (0.072).
#[test]
fn noise_is_found_and_counted_once_in_the_ceiling() {
    let comparison = compare_static(
        &[PERSON],
        &[PERSON],
        Unit {
            pattern_c: 0.0,
            ..UNIT
        },
        6,
    );
    let expected = 0.25_f64.hypot(0.072);
    assert!((comparison.noise_sigma_c.unwrap() - expected).abs() < 0.03);
    let ceiling = comparison.score(Measure::Rmse).ceiling.unwrap();
    assert!((ceiling - expected).abs() < 0.03, "{ceiling}");
    // The simulation adds its own noise, 0.2 degrees, to the sensor's.
    let value = comparison.score(Measure::Rmse).value.unwrap();
    assert!((value - expected.hypot(0.2)).abs() < 0.03, "{value}");
}

#[track_caller]
fn refused(real: &[RealFrame], simulated: &[SimulatedFrame], settings: &Settings, expected: &str) {
    let error = compare(real, simulated, settings).unwrap_err().to_string();
    assert_eq!(error.lines().next(), Some(expected));
}

#[test]
fn missing_and_too_many_frames_are_refused() {
    let (real, simulated) = (
        recording(3, UNIT, 1, |_| vec![PERSON]),
        simulation(3, 1, |_| vec![PERSON]),
    );
    let fixed = settings(Protocol::Static);
    refused(&[], &simulated, &fixed, "no real frame to compare");
    refused(&real, &[], &fixed, "no simulated frame to compare");
    let unpaired = "3 real frames cannot be paired with 2 simulated frames";
    refused(
        &real,
        &simulated[..2],
        &settings(Protocol::Dynamic),
        unpaired,
    );
    let many = vec![real[0].clone(); FRAMES_MAX + 1];
    let found = FRAMES_MAX + 1;
    let too_many = format!("{found} real frames, expected at most {FRAMES_MAX}");
    refused(&many, &simulated, &fixed, &too_many);
    assert!(compare(&many[..FRAMES_MAX], &simulated[..1], &fixed).is_ok());
}

#[test]
fn frames_with_holes_are_refused_with_their_place() {
    let (real, simulated) = (
        recording(3, UNIT, 1, |_| vec![PERSON]),
        simulation(3, 1, |_| vec![PERSON]),
    );
    let fixed = settings(Protocol::Static);
    let mut holed = real.clone();
    holed[2].celsius[17] = f64::NAN;
    let error = compare(&holed, &simulated, &fixed).unwrap_err().to_string();
    assert!(
        error.starts_with("pixel index 17 of real frame 2 is not a finite number\nhint: "),
        "{error}"
    );
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let (real, simulated) = (
        recording(3, UNIT, 1, |_| vec![PERSON]),
        simulation(3, 1, |_| vec![PERSON]),
    );
    let fixed = settings(Protocol::Static);
    let named = |settings: Settings| {
        let refused = compare(&real, &simulated, &settings)
            .unwrap_err()
            .to_string();
        refused.split('`').nth(1).unwrap_or_default().to_owned()
    };
    assert_eq!(
        named(Settings {
            shuffles: 0,
            ..fixed
        }),
        "shuffles"
    );
    assert_eq!(
        named(Settings {
            shuffles: SHUFFLES_MAX + 1,
            ..fixed
        }),
        "shuffles"
    );
    assert_eq!(
        named(Settings {
            step_c: 0.0,
            ..fixed
        }),
        "step_c"
    );
    assert_eq!(
        named(Settings {
            step_c: f64::NAN,
            ..fixed
        }),
        "step_c"
    );
    assert_eq!(
        named(Settings {
            ambient_c: f64::NAN,
            ..fixed
        }),
        "ambient_c"
    );
    assert_eq!(
        named(Settings {
            noise_sigma_c: -1.0,
            ..fixed
        }),
        "noise_sigma_c"
    );
}

/// A right claim finds the person's place, a wrong one does not.
#[test]
fn the_centroid_tells_right_from_wrong() {
    let right = compare_static(&[PERSON], &[PERSON], UNIT, 1);
    let moved = Blob {
        column: PERSON.column + 2.0,
        ..PERSON
    };
    let wrong = compare_static(&[PERSON], &[moved], UNIT, 1);
    let [near, far] = [right, wrong].map(|comparison| comparison.score(Measure::CentroidError));
    let (value, skill) = (near.value.unwrap(), near.skill().unwrap());
    assert!(value < 0.35 && skill > 0.8, "{near:?}");
    assert!((far.value.unwrap() - 2.0).abs() < 0.35, "{far:?}");
}

#[test]
fn a_recording_that_warms_up_drifts() {
    let mut real = recording(30, UNIT, 3, |_| vec![PERSON]);
    for (index, frame) in (0_u32..).zip(&mut real) {
        let warmer = |celsius: f64| celsius + 0.02 * f64::from(index);
        frame.celsius = frame.celsius.map(warmer);
    }
    let simulated = simulation(30, 4, |_| vec![PERSON]);
    let comparison = compare(&real, &simulated, &settings(Protocol::Dynamic)).unwrap();
    // 0.02 degrees per frame, and the noise of a mean of 32 pixels at both ends.
    let drift_c = comparison.drift_c;
    assert!((drift_c - 0.58).abs() < 0.15, "{drift_c}");
}
