//! Recordings and scenes joined by UTC, against the same frames joined by hand.

use crate::scenes::{SENSOR, record};
use grideye_recording::{ClockState, Record};
use grideye_scene::Scene;
use grideye_validator::calibrate::{self, calibrate};
use grideye_validator::{
    AlignOptions, Comparison, LeftOut, Measure, Options, TimeAlignment, ValidatorError, Verdict,
    compare_scene,
};
use std::collections::BTreeMap;

const SCENE: &str = "[room]
size_mm = [4000, 4000, 2700]
ambient_c = 20
[[agent]]
name = \"ana\"
size_mm = [300, 500, 1700]
temperature_c = 30
trajectory = \"way.csv\"
[[sensor]]
name = \"ceiling\"
preset = \"grid-eye\"
position_mm = [2000, 2000, 2700]
elevation_deg = 90
azimuth_deg = 0
";
const COUNTED: &str = "t_s,x_mm,y_mm\n0,500,1700\n3,2000,2300\n8,3500,1900\n";
const STAMPED: &str = "y_mm,x_mm,utc\n1700,500,2026-11-25T10:00:00.5Z\n2300,2000,2026-11-25T12:00:03.5+02:00\n1900,3500,1795600808.5\n";
/// `date -u -d 2026-11-25T10:00:00.5Z +%s%N`.
const STARTS_NS: i64 = 1_795_600_800_500_000_000;
const FRAMES: u32 = 81;
const PERIOD_NS: i64 = 100_000_000;

fn files(way: &str) -> BTreeMap<String, String> {
    BTreeMap::from([("way.csv".to_owned(), way.to_owned())])
}

fn scene(way: &str) -> Scene {
    Scene::parse(SCENE, "scene.toml", &files(way))
        .unwrap()
        .scene
}

/// The walk as its sensor sees it, with a set clock.
fn walk() -> Vec<Record> {
    let mut records = record(&scene(COUNTED), FRAMES, 3);
    for (stamp, index) in records.iter_mut().map(|record| &mut record.stamp).zip(0..) {
        stamp.clock = ClockState::Synced;
        stamp.t_utc_ns = STARTS_NS + index * PERIOD_NS;
    }
    records
}

fn compared(records: &[Record], way: &str, start_s: Option<f64>) -> Comparison {
    let align = AlignOptions {
        time: TimeAlignment::None,
        ..AlignOptions::default()
    };
    let options = Options {
        shuffles: 20,
        start_s,
        align,
        ..Options::default()
    };
    compare_scene(records, &scene(way), SENSOR, &options).unwrap()
}

fn has_note(comparison: &Comparison, part: &str) -> bool {
    comparison.notes.iter().any(|note| note.contains(part))
}

#[test]
fn a_recording_that_began_late_is_joined_by_its_stamps() {
    let mut records = walk();
    let cut = records.split_off(21);
    let by_hand = compared(&cut, COUNTED, Some(2.1));
    assert_eq!(
        by_hand.judgment.verdict,
        Verdict::Agrees,
        "{:?}",
        by_hand.judgment.reasons
    );
    let by_utc = compared(&cut, STAMPED, None);
    assert!(
        has_note(
            &by_utc,
            "By UTC, the recording begins 2.100 s after the scene's start."
        ),
        "{:?}",
        by_utc.notes
    );
    let by_utc = Comparison {
        notes: by_hand.notes.clone(),
        ..by_utc
    };
    assert_eq!(by_utc, by_hand);

    // The clock was set only after 15 frames; until then it stood at 1970.
    let mut late = cut;
    for record in &mut late[..15] {
        record.stamp.clock = ClockState::Unsynced;
        record.stamp.t_utc_ns = 0;
    }
    let by_utc = compared(&late, STAMPED, None);
    assert_eq!(
        Comparison {
            notes: by_hand.notes.clone(),
            ..by_utc
        },
        by_hand
    );
}

#[test]
fn frames_from_before_the_start_are_left_out() {
    let mut records = record(&scene("t_s,x_mm,y_mm\n0,500,1700\n"), 73, 9);
    records.extend(walk());
    for (record, index) in records.iter_mut().zip(0..) {
        let nanoseconds = index * PERIOD_NS;
        record.seq = u64::try_from(index).unwrap();
        record.stamp.t_boot_ns = 5_000_000_000 + u64::try_from(nanoseconds).unwrap();
        record.stamp.t_utc_ns = STARTS_NS - 7_300_000_000 + nanoseconds;
        record.stamp.clock = ClockState::Synced;
    }
    let found = compared(&records, STAMPED, None);
    assert!(
        has_note(
            &found,
            "By UTC, the recording begins 7.300 s before the scene's start."
        ),
        "{:?}",
        found.notes
    );
    let left_out = &found.alignment.as_ref().unwrap().left_out;
    let outside = left_out
        .iter()
        .find(|left| left.reason == LeftOut::OutsideScene);
    assert_eq!(
        outside.map(|left| (left.rows, left.first_seq)),
        Some((73, 0))
    );
    let correlation = found.score(Measure::Correlation).value.unwrap();
    let whole = compared(&walk(), COUNTED, None);
    let expected = whole.score(Measure::Correlation).value.unwrap();
    assert_eq!(found.real_frames, whole.real_frames);
    assert!(
        (correlation - expected).abs() < 0.02,
        "{correlation}, {expected}"
    );
    // Joined at its first frame, the same recording shows another walk.
    let at_first = compared(&records, STAMPED, Some(0.0));
    assert!(at_first.score(Measure::Correlation).value.unwrap() < expected - 0.2);
}

#[test]
fn a_clock_that_was_never_set_joins_at_the_first_frame() {
    let mut records = walk();
    for record in &mut records {
        record.stamp.clock = ClockState::Unsynced;
        record.stamp.t_utc_ns = 1_000;
    }
    let found = compared(&records, STAMPED, None);
    assert!(
        has_note(&found, "because the device's clock was never set"),
        "{:?}",
        found.notes
    );
    let by_hand = compared(&records, COUNTED, None);
    assert_eq!(
        Comparison {
            notes: by_hand.notes.clone(),
            ..found
        },
        by_hand
    );
}

#[test]
fn without_a_common_moment_both_spans_are_named() {
    let mut records = walk();
    for record in &mut records {
        record.stamp.t_utc_ns -= 3_600_000_000_000;
    }
    let expected = "the recording lasts from 2026-11-25T09:00:00.5Z to 2026-11-25T09:00:08.5Z and the scene from \
        2026-11-25T10:00:00.5Z to 2026-11-25T10:00:08.5Z, so they share no moment\nhint: ";
    let error = compare_scene(&records, &scene(STAMPED), SENSOR, &Options::default()).unwrap_err();
    assert!(matches!(error, ValidatorError::Apart(_)), "{error}");
    assert!(error.to_string().starts_with(expected), "{error}");

    let text = format!("{SCENE}[[uncertain]]\nkey = \"room.ambient_c\"\nbounds = [15, 25]\n");
    let calibrated = |records: &[Record], way: &str| {
        let options = calibrate::Options {
            starts: 1,
            frames: Some(20),
            ..calibrate::Options::default()
        };
        calibrate(
            records,
            (&text, "scene.toml"),
            &files(way),
            SENSOR,
            &options,
            &mut |_| (),
        )
    };
    let error = calibrated(&records, STAMPED).unwrap_err();
    assert!(matches!(error, ValidatorError::Apart(_)), "{error}");
    assert!(error.to_string().starts_with(expected), "{error}");

    // A calibration of the second half of the walk, by hand and by UTC.
    let shifted = "t_s,x_mm,y_mm\n0,2000,2300\n5,3500,1900\n";
    let half = walk().split_off(30);
    let by_hand = calibrated(&half, shifted).unwrap();
    let by_utc = calibrated(&half, STAMPED).unwrap();
    let value = |found: &calibrate::Calibration| found.found[0].value;
    assert!(
        (value(&by_hand) - value(&by_utc)).abs() < 1e-6,
        "{by_utc:?}"
    );
    assert_eq!(by_hand.frames, by_utc.frames);
    assert!((by_hand.rmse_c[1] - by_utc.rmse_c[1]).abs() < 1e-6);
}
