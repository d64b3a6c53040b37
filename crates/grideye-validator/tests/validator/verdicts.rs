//! Verdicts on frames of a toy sensor: right and wrong scenes, floors and ceilings, and rejected input.

use crate::toy::{
    AMBIENT_C, Blob, PERSON, SHAPE, UNIT, Unit, clean, recording, settings, simulation,
};
use grideye_validator::{
    Asked, Comparison, FRAMES_MAX, Measure, Protocol, RealFrame, SHUFFLES_MAX, Settings, Side,
    SimulatedFrame, ValidatorError, Verdict, compare,
};

fn compare_static(real: &[Blob], claimed: &[Blob], unit: Unit, seed: u64) -> Comparison {
    let real = recording(10, unit, seed, |_| real.to_vec());
    let simulated = simulation(10, seed + 1_000, |_| claimed.to_vec());
    compare(SHAPE, &real, &simulated, &settings(Protocol::Static)).unwrap()
}

#[track_caller]
fn verdict_over_seeds(expected: Verdict, real: &[Blob], claimed: &[Blob], unit: Unit) {
    for seed in 0..50 {
        let judgment = compare_static(real, claimed, unit, seed).judgment;
        assert_eq!(
            judgment.verdict, expected,
            "seed {seed}: {:#?}",
            judgment.reasons
        );
    }
}

#[test]
fn the_right_scene_agrees_over_50_seeds() {
    verdict_over_seeds(Verdict::Agrees, &[PERSON], &[PERSON], UNIT);
}

#[test]
fn the_right_scene_agrees_on_a_unit_that_is_a_degree_off() {
    let unit = Unit {
        offset_c: -1.2,
        ..UNIT
    };
    verdict_over_seeds(Verdict::Agrees, &[PERSON], &[PERSON], unit);
    let unit = Unit {
        offset_c: 1.2,
        ..UNIT
    };
    verdict_over_seeds(Verdict::Agrees, &[PERSON], &[PERSON], unit);
}

#[test]
fn a_mirrored_scene_disagrees() {
    let mirrored = Blob {
        column: 7.0 - PERSON.column,
        ..PERSON
    };
    verdict_over_seeds(Verdict::Disagrees, &[PERSON], &[mirrored], UNIT);
}

#[test]
fn a_transposed_scene_disagrees() {
    let transposed = Blob {
        column: PERSON.row,
        row: PERSON.column,
        ..PERSON
    };
    verdict_over_seeds(Verdict::Disagrees, &[PERSON], &[transposed], UNIT);
}

/// From 2.5 m above the floor, a meter is 2.8 pixels of an 8 x 8 sensor with 60 degrees.
#[test]
fn a_person_moved_by_a_meter_disagrees() {
    let moved = Blob {
        column: PERSON.column + 2.8,
        ..PERSON
    };
    verdict_over_seeds(Verdict::Disagrees, &[PERSON], &[moved], UNIT);
}

#[test]
fn a_missing_person_disagrees() {
    verdict_over_seeds(Verdict::Disagrees, &[PERSON], &[], UNIT);
}

#[test]
fn an_extra_radiator_disagrees() {
    let radiator = Blob {
        column: 7.0,
        row: 1.0,
        contrast_c: 4.0,
    };
    verdict_over_seeds(Verdict::Disagrees, &[PERSON], &[PERSON, radiator], UNIT);
}

#[test]
fn a_person_twice_as_warm_disagrees() {
    let hot = Blob {
        contrast_c: 2.2 * PERSON.contrast_c,
        ..PERSON
    };
    verdict_over_seeds(Verdict::Disagrees, &[PERSON], &[hot], UNIT);
}

/// Units of the assumed spread, drawn by other code than the validator's: their scores must follow the predicted
/// distribution.
#[test]
fn right_recordings_score_as_predicted() {
    let unit = Unit {
        pattern_c: 0.25,
        ..UNIT
    };
    for name in ["correlation", "gain"] {
        let (mut values, mut stated) = (Vec::new(), Vec::new());
        for seed in 0..60 {
            let comparison = compare_static(&[PERSON], &[PERSON], unit, seed);
            let asked = asked(&comparison, name);
            values.push(asked.value);
            stated.push(asked.right);
        }
        let mean = |values: &[f64]| values.iter().sum::<f64>() / 60.0;
        let found = mean(&values);
        let squares: Vec<f64> = values.iter().map(|value| (value - found).powi(2)).collect();
        let sd = mean(&squares).sqrt();
        let law_mean = mean(&stated.iter().map(|law| law.mean).collect::<Vec<_>>());
        let law_sd = mean(&stated.iter().map(|law| law.sd).collect::<Vec<_>>());
        println!("{name}: found {found:.3} ± {sd:.3}, stated {law_mean:.3} ± {law_sd:.3}");
        // 60 recordings determine the mean to 0.13 standard deviations, and the standard deviation to 9 %.
        assert!((found - law_mean).abs() < 0.5 * sd, "{name}");
        assert!((0.7..1.4).contains(&(law_sd / sd)), "{name}");
    }
}

/// The verdict is read from the printed scores.
#[test]
fn the_verdict_uses_the_printed_scores() {
    let comparison = compare_static(&[PERSON], &[PERSON], UNIT, 3);
    for (name, measure) in [
        ("correlation", Measure::Correlation),
        ("gain", Measure::Gain),
    ] {
        let printed = comparison.score(measure).value.unwrap();
        assert!(
            (asked(&comparison, name).value - printed).abs() < 1e-12,
            "{name}"
        );
    }
}

fn asked(comparison: &Comparison, name: &str) -> Asked {
    let criteria = &comparison.judgment.criteria;
    let criterion = criteria.iter().find(|criterion| criterion.name == name);
    criterion.unwrap().asked.unwrap()
}

#[test]
fn an_empty_room_cannot_tell() {
    verdict_over_seeds(Verdict::CannotTell, &[], &[], UNIT);
    verdict_over_seeds(Verdict::CannotTell, &[], &[PERSON], UNIT);
    let judgment = compare_static(&[], &[PERSON], UNIT, 1).judgment;
    assert!(
        judgment.reasons[0].contains("shows nothing warm"),
        "{:?}",
        judgment.reasons
    );
    assert!(
        judgment.reasons[0].contains("the scene has"),
        "{:?}",
        judgment.reasons
    );
}

/// Both counts use the threshold that the report prints. The gain's threshold for a claim is far lower.
#[test]
fn warm_pixels_of_both_sides_are_counted_alike() {
    let comparison = compare_static(&[PERSON], &[PERSON], UNIT, 1);
    let threshold_c = AMBIENT_C + comparison.warm_above_c;
    let above = |limit_c: f64| -> f64 {
        let warm = |&celsius: &f64| f64::from(u8::from(celsius > limit_c));
        clean(&[PERSON]).iter().map(warm).sum()
    };
    let by_gain_c = AMBIENT_C + comparison.union_above_c / 2.0;
    assert!(above(by_gain_c) > above(threshold_c), "the rules differ");
    assert_eq!(comparison.warm.claimed, above(threshold_c));
}

#[test]
fn an_offset_of_three_degrees_is_noticed_either_way() {
    for offset_c in [3.0, -3.0] {
        let unit = Unit { offset_c, ..UNIT };
        verdict_over_seeds(Verdict::Disagrees, &[PERSON], &[PERSON], unit);
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

fn walk(speed: f64, start: f64) -> impl Fn(u32) -> Vec<Blob> {
    move |index| {
        vec![Blob {
            column: start + speed * f64::from(index),
            ..PERSON
        }]
    }
}

fn compare_walk(
    real: impl Fn(u32) -> Vec<Blob>,
    claimed: impl Fn(u32) -> Vec<Blob>,
    seed: u64,
) -> Comparison {
    let real = recording(70, UNIT, seed, real);
    let simulated = simulation(70, seed + 1_000, claimed);
    compare(SHAPE, &real, &simulated, &settings(Protocol::Dynamic)).unwrap()
}

#[test]
fn a_walk_agrees_with_itself_and_not_with_another() {
    for seed in 0..10 {
        let verdict = |real: (f64, f64), claimed: (f64, f64)| {
            compare_walk(walk(real.0, real.1), walk(claimed.0, claimed.1), seed)
                .judgment
                .verdict
        };
        assert_eq!(verdict((0.12, -0.5), (0.12, -0.5)), Verdict::Agrees);
        assert_eq!(verdict((0.12, -0.5), (-0.12, 7.5)), Verdict::Disagrees);
        assert_eq!(verdict((0.12, -0.5), (0.12, 2.3)), Verdict::Disagrees);
    }
}

/// A moving person must not be compared by all pairs: the same walk under the static protocol does not agree.
#[test]
fn a_walk_under_the_static_protocol_does_not_agree() {
    let real = recording(70, UNIT, 1, walk(0.12, -0.5));
    let simulated = simulation(70, 2, walk(0.12, -0.5));
    let comparison = compare(SHAPE, &real, &simulated, &settings(Protocol::Static)).unwrap();
    assert_eq!(comparison.pairs, 4_900);
    assert_ne!(comparison.judgment.verdict, Verdict::Agrees);
}

#[test]
fn one_frame_or_no_repeat_cannot_tell() {
    let simulated = simulation(10, 2, |_| vec![PERSON]);
    let mut real = recording(10, UNIT, 1, |_| vec![PERSON]);
    let one = compare(SHAPE, &real[..1], &simulated, &settings(Protocol::Static)).unwrap();
    assert_eq!(one.judgment.verdict, Verdict::CannotTell);
    assert!(one.judgment.reasons[0].contains("holds 1 frame to compare"));
    for frame in &mut real {
        frame.later = None;
    }
    let alone = compare(SHAPE, &real, &simulated, &settings(Protocol::Static)).unwrap();
    assert_eq!(alone.judgment.verdict, Verdict::CannotTell);
    assert!(
        alone.judgment.reasons[0].contains("the highest possible correlation is unknown"),
        "{:?}",
        alone.judgment.reasons
    );
    assert_eq!(alone.noise_sigma_c, None);
}

/// A recording with repeats that have nothing in common with it: the person is elsewhere in each.
#[test]
fn a_recording_that_does_not_resemble_itself_cannot_tell() {
    let mut real = recording(10, UNIT, 1, |_| vec![PERSON]);
    let elsewhere = recording(10, UNIT, 2, |_| {
        vec![Blob {
            column: 6.0,
            row: 0.5,
            ..PERSON
        }]
    });
    for (frame, other) in real.iter_mut().zip(elsewhere) {
        frame.later = Some(other.celsius);
    }
    let simulated = simulation(10, 2, |_| vec![PERSON]);
    let judgment = compare(SHAPE, &real, &simulated, &settings(Protocol::Static))
        .unwrap()
        .judgment;
    assert_eq!(
        judgment.verdict,
        Verdict::CannotTell,
        "{:?}",
        judgment.reasons
    );
    assert!(judgment.reasons[0].contains("does not even resemble itself"));
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
    let grey = comparison.score(Measure::MutualInformationGrey);
    let step = comparison.score(Measure::MutualInformationBinned);
    let parts =
        |score: grideye_validator::Score| score.value.unwrap() - score.shuffled.unwrap().mean;
    assert!(parts(grey) < 0.3 * parts(step), "{grey:?} {step:?}");
    let correlation = comparison.score(Measure::Correlation);
    assert_eq!(correlation.blank, None);
    assert!(correlation.shuffled.unwrap().mean.abs() < 0.15);
    assert!(correlation.chance().unwrap() > correlation.floor().unwrap());
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
fn refused(
    real: &[RealFrame],
    simulated: &[SimulatedFrame],
    settings: &Settings,
    expected: &ValidatorError,
) {
    let error = compare(SHAPE, real, simulated, settings).unwrap_err();
    assert_eq!(error.to_string(), expected.to_string());
}

#[test]
fn missing_and_too_many_frames_are_refused() {
    let (real, simulated) = (
        recording(3, UNIT, 1, |_| vec![PERSON]),
        simulation(3, 1, |_| vec![PERSON]),
    );
    let fixed = settings(Protocol::Static);
    refused(
        &[],
        &simulated,
        &fixed,
        &ValidatorError::NoFrames { side: Side::Real },
    );
    refused(
        &real,
        &[],
        &fixed,
        &ValidatorError::NoFrames {
            side: Side::Simulated,
        },
    );
    let unpaired = ValidatorError::Unpaired {
        real: 3,
        simulated: 2,
    };
    refused(
        &real,
        &simulated[..2],
        &settings(Protocol::Dynamic),
        &unpaired,
    );
    let many = vec![real[0].clone(); FRAMES_MAX + 1];
    let too_many = ValidatorError::TooManyFrames {
        side: Side::Real,
        limit: FRAMES_MAX,
        found: FRAMES_MAX + 1,
    };
    refused(&many, &simulated, &fixed, &too_many);
    assert!(compare(SHAPE, &many[..FRAMES_MAX], &simulated[..1], &fixed).is_ok());
}

#[test]
fn frames_with_holes_or_of_another_size_are_refused_with_their_place() {
    let (real, simulated) = (
        recording(3, UNIT, 1, |_| vec![PERSON]),
        simulation(3, 1, |_| vec![PERSON]),
    );
    let fixed = settings(Protocol::Static);
    let mut holed = real.clone();
    holed[2].celsius[17] = f64::NAN;
    let error = compare(SHAPE, &holed, &simulated, &fixed)
        .unwrap_err()
        .to_string();
    assert!(
        error.starts_with("pixel index 17 of real frame 2 is not a finite number\nhint: "),
        "{error}"
    );
    let mut short = simulated.clone();
    short[1].noise_free.pop();
    let size = ValidatorError::FrameSize {
        side: Side::Simulated,
        index: 1,
        expected: 64,
        found: 63,
    };
    refused(&real, &short, &fixed, &size);
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let (real, simulated) = (
        recording(3, UNIT, 1, |_| vec![PERSON]),
        simulation(3, 1, |_| vec![PERSON]),
    );
    let fixed = settings(Protocol::Static);
    let named = |settings: Settings| match compare(SHAPE, &real, &simulated, &settings).unwrap_err()
    {
        ValidatorError::Setting { name, .. } => name,
        other => panic!("{other}"),
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

/// Chunks have 4,096 pairs: 70 x 70 pairs are two chunks, one per thread.
#[test]
fn any_number_of_threads_gives_the_same_result() {
    let real = recording(70, UNIT, 3, |_| vec![PERSON]);
    let simulated = simulation(70, 4, |_| vec![PERSON]);
    let with = |threads| {
        let settings = Settings {
            threads,
            ..settings(Protocol::Static)
        };
        let comparison = compare(SHAPE, &real, &simulated, &settings).unwrap();
        Comparison {
            settings: self::settings(Protocol::Static),
            ..comparison
        }
    };
    let one = with(1);
    assert_eq!(one.pairs, 4_900);
    for threads in [2, 3, 64] {
        assert_eq!(with(threads), one);
    }
    for threads in [0, 65] {
        let settings = Settings {
            threads,
            ..settings(Protocol::Static)
        };
        let refused = compare(SHAPE, &real, &simulated, &settings).unwrap_err();
        assert!(refused.to_string().contains("threads"), "{refused}");
    }
}

/// A right claim finds the person's place, a wrong one does not, and noise finds nothing.
#[test]
fn the_measures_of_places_tell_right_from_wrong() {
    let right = compare_static(&[PERSON], &[PERSON], UNIT, 1);
    let moved = Blob {
        column: PERSON.column + 2.0,
        ..PERSON
    };
    let wrong = compare_static(&[PERSON], &[moved], UNIT, 1);
    let value = |comparison: &Comparison, measure| comparison.score(measure).value.unwrap();
    let both = |measure| (value(&right, measure), value(&wrong, measure));

    let (near, far) = both(Measure::CentroidErrorPixels);
    assert!(near < 0.35 && (far - 2.0).abs() < 0.35, "{near} {far}");
    // Two of 8 pixels over 60 degrees, near the middle of the view: about 8 degrees each.
    let (near, far) = both(Measure::CentroidErrorDegrees);
    assert!(near < 2.9 && (13.0..18.0).contains(&far), "{near} {far}");
    let (near, far) = both(Measure::WarmOverlap);
    assert!(near > 0.6 && far < 0.5, "{near} {far}");
    let (near, far) = both(Measure::ForegroundRmse);
    assert!(near < 0.5 && far > 1.0, "{near} {far}");
    let (near, far) = both(Measure::ContrastSlope);
    assert!((near - 1.0).abs() < 0.1 && far < 0.5, "{near} {far}");
    let (near, far) = both(Measure::StructuralSimilarity);
    assert!(near > far + 0.1, "{near} {far}");
    let (near, far) = both(Measure::ChiSquaredPerDegree);
    // The unit's fixed pattern of 0.15 on top of noise of 0.25 makes 1.36 of the right scene's 1.
    assert!((1.1..1.7).contains(&near) && far > 3.0, "{near} {far}");
    let noise = right.score(Measure::Correlation).noise.unwrap();
    assert!(noise.abs() < 0.1, "{noise}");
    let noise = right.score(Measure::WarmOverlap).noise.unwrap();
    assert!(noise < 0.05, "{noise}");
}

/// Half the contrast: the recording rises by half a degree where the claim rises by one.
#[test]
fn contrast_and_p_values_are_right() {
    let claimed = Blob {
        contrast_c: 2.0 * PERSON.contrast_c,
        ..PERSON
    };
    let comparison = compare_static(&[PERSON], &[claimed], UNIT, 5);
    let slope = comparison.score(Measure::ContrastSlope).value.unwrap();
    assert!((slope - 0.5).abs() < 0.05, "{slope}");
    // The ceiling is corrected for the repeat's noise; otherwise it would be 0.8.
    let ceiling = comparison.score(Measure::ContrastSlope).ceiling.unwrap();
    assert!((ceiling - 1.0).abs() < 0.05, "{ceiling}");

    let p =
        |comparison: &Comparison, measure| comparison.score(measure).shuffled.unwrap().p.unwrap();
    assert_eq!(p(&comparison, Measure::Correlation), 1.0 / 21.0);
    let nobody = compare_static(&[], &[], UNIT, 6);
    assert!(p(&nobody, Measure::MutualInformationBinned) > 0.05);
}

#[test]
fn a_recording_that_warms_up_drifts() {
    let mut real = recording(30, UNIT, 3, |_| vec![PERSON]);
    for (index, frame) in (0_u32..).zip(&mut real) {
        let warmer = |celsius: &f64| celsius + 0.02 * f64::from(index);
        frame.celsius = frame.celsius.iter().map(warmer).collect();
    }
    let simulated = simulation(30, 4, |_| vec![PERSON]);
    let comparison = compare(SHAPE, &real, &simulated, &settings(Protocol::Dynamic)).unwrap();
    // 0.02 degrees per frame at 10 frames per second.
    let drift = comparison.drift_c_per_min.unwrap();
    assert!((drift - 12.0).abs() < 1.5, "{drift}");
}
