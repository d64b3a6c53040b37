//! Orientation, long and late recordings, and frames left out.

use crate::alignment::bench::{SENSOR, WALK, Walk, compared, fewer_seeds, record, row, with};
use grideye_frame::{PixelWord, Reading};
use grideye_recording::Record;
use grideye_scene::Simulator;
use grideye_validator::align::{AlignOptions, Orientation, TimeAlignment};
use grideye_validator::{KnownUnit, LeftOut, Options, Verdict, compare_scene};
use std::time::Duration;

/// A mirrored or turned image is reported, and turned back only on request.
#[test]
fn a_turned_image_is_reported_and_turned_back_on_request() {
    let scene = WALK.scene();
    for orientation in Orientation::ALL {
        let mut found = 0;
        for seed in 0..fewer_seeds() {
            let records: Vec<Record> = record(&scene, seed, |time_s| time_s)
                .into_iter()
                .map(|record| turned(record, orientation))
                .collect();
            let silent = compared(&records, &scene, AlignOptions::default(), seed);
            let seen = silent.alignment.as_ref().unwrap().orientation.unwrap();
            found += u64::from(seen.orientation == orientation);
            assert!(!seen.applied);
            let asked = AlignOptions {
                orientation: true,
                ..AlignOptions::default()
            };
            let turned = compared(&records, &scene, asked, seed);
            assert_eq!(
                turned.judgment.verdict,
                Verdict::Agrees,
                "{orientation} {seed}"
            );
            let said = format!("The image, which is {orientation}, was turned back, as requested.");
            let is_said = turned.judgment.headline.ends_with(&said);
            assert_eq!(is_said, orientation != Orientation::Upright, "{said}");
            if orientation != Orientation::Upright {
                assert_eq!(
                    silent.judgment.verdict,
                    Verdict::Disagrees,
                    "{orientation} {seed}"
                );
                let told = silent
                    .notes
                    .iter()
                    .any(|note| note.starts_with(&format!("The image is {orientation}")));
                assert!(told, "{:?}", silent.notes);
            }
        }
        println!("{orientation:<40} found {found} of {}", fewer_seeds());
        assert_eq!(found, fewer_seeds(), "{orientation}");
    }
}

/// The unit's pattern lies as its pixels do, and the background of its room, heater and all, as it sees it: both are turned
/// back with the image.
#[test]
fn a_profile_is_turned_back_with_the_image() {
    let scene = WALK.scene();
    let steps: [u16; 64] = std::array::from_fn(|pixel| (pixel * 37 % 7) as u16);
    for orientation in [
        Orientation::MirroredLeftRight,
        Orientation::QuarterClockwise,
    ] {
        let records = record(&scene, 1, |time_s| time_s).into_iter();
        let records = records.map(|record| {
            let mut record = turned(record, orientation);
            if let Reading::Frame(raw) = &mut record.reading {
                let words = raw.pixels.iter_mut().zip(steps);
                words.for_each(|(word, steps)| word.0 += steps);
            }
            record
        });
        let records: Vec<Record> = records.collect();
        let empty = Simulator::new(&scene, SENSOR).unwrap();
        let empty = empty.without_agents(Duration::ZERO).celsius;
        let room_c = orientation.apply(&std::array::from_fn(|pixel| empty[pixel] - 21.0));
        let own_c = |pixel: usize| 0.25 * f64::from(steps[pixel]) + room_c[pixel];
        let unit = KnownUnit {
            pattern_c: std::array::from_fn(own_c),
            has_background: true,
            wander_c: 0.0,
            bias_c: 1.0,
            spread_c: 0.05,
        };
        let options = Options {
            unit: Some(unit),
            align: AlignOptions {
                orientation: true,
                ..AlignOptions::default()
            },
            ..Options::default()
        };
        let judged = compare_scene(&records, &scene, SENSOR, &options)
            .unwrap()
            .judgment;
        assert_eq!(judged.verdict, Verdict::Agrees, "{orientation}: {judged}");
    }
}

fn turned(record: Record, orientation: Orientation) -> Record {
    let reading = record.reading.map(|mut raw| {
        let words = raw.pixels.map(|word| f64::from(word.0));
        raw.pixels = orientation.apply(&words).map(|word| PixelWord(word as u16));
        raw
    });
    Record { reading, ..record }
}

/// Two hundred seconds back and forth at 10 Hz with a clock 3 % fast: the rate is found to 0.0002.
#[test]
fn two_thousand_frames_are_aligned() {
    let way = "1200,1500,0\n3800,1700,0\n3300,3600,0\n1600,3300,0\n".repeat(16);
    let scene = Walk {
        way: Box::leak(way.into_boxed_str()),
        ..WALK
    }
    .scene();
    let records = record(&scene, 4, |time_s| time_s + 0.2 + 0.03 * time_s);
    let records = &records[..records.len().min(2_000)];
    for time in [TimeAlignment::None, TimeAlignment::Rate] {
        let begin = std::time::Instant::now();
        let found = compared(records, &scene, with(time, 0.5), 1);
        println!(
            "{} frames, {}: {:.2} s",
            records.len(),
            time.name(),
            begin.elapsed().as_secs_f64()
        );
        if time == TimeAlignment::Rate {
            let time = found.alignment.unwrap().time.unwrap();
            println!("shift {:.4} s, rate {:.5}", time.shift_s, time.rate);
            assert!((time.shift_s - 0.2).abs() < 0.02, "{time:?}");
            assert!((time.rate - 0.03).abs() < 0.000_2, "{time:?}");
        }
    }
}

/// A recording that begins in mid-walk: the delay counts at its own first frame, at any second of the scene, and
/// without that second nothing is found.
#[test]
fn a_recording_that_begins_later_is_aligned_from_its_first_frame() {
    let way = WALK.way.repeat(4);
    let scene = Walk {
        way: Box::leak(way.into_boxed_str()),
        ..WALK
    }
    .scene();
    let scene_s = |time_s: f64| time_s + 20.0 + 0.2 + 0.03 * time_s;
    let end_s = scene.duration().as_secs_f64();
    let mut records = record(&scene, 6, scene_s);
    let seen = (0..records.len())
        .filter(|&index| scene_s(index as f64 / 10.0) < end_s)
        .count();
    records.truncate(seen);
    let found = |start_s: f64| {
        let options = Options {
            start_s: Some(start_s),
            shuffles: 20,
            align: with(TimeAlignment::Rate, 0.5),
            ..Options::default()
        };
        let found = compare_scene(&records, &scene, SENSOR, &options).unwrap();
        found.alignment.unwrap().time.unwrap()
    };
    let time = found(20.0);
    assert!(time.applied, "{time:?}");
    assert!((time.shift_s - 0.2).abs() < 0.1, "{time:?}");
    assert!((time.rate - 0.03).abs() < 0.01, "{time:?}");
    let other = found(0.0);
    assert!(
        !other.applied || other.likeness < time.likeness,
        "{other:?}"
    );
}

/// Planted faults, and nothing else, are left out, each with its reason.
#[test]
fn faulty_frames_are_left_out_with_their_reason() {
    let scene = WALK.scene();
    let mut records = record(&scene, 3, |time_s| time_s);
    let pixels = |records: &[Record], index: usize| records[index].reading.frame().unwrap().pixels;
    let put = |records: &mut Vec<Record>, index: usize, from: std::ops::Range<usize>| {
        let before = pixels(records, index - 1);
        let mut now = pixels(records, index);
        now[from.clone()].copy_from_slice(&before[from]);
        records[index] = row(index as u32, index as f64 / 10.0, now);
    };
    put(&mut records, 10, 40..64);
    put(&mut records, 20, 0..64);
    for index in 40..46 {
        put(&mut records, index, 0..64);
    }
    records[5].reading = Reading::NoData(grideye_frame::NoData::Nack);
    // A stall of a second, and three rows that came at once.
    for (index, record) in records.iter_mut().enumerate().skip(60) {
        let late_s = if index < 63 {
            1.0 + 0.002 * (index - 60) as f64 - (index - 60) as f64 / 10.0
        } else {
            1.0
        };
        record.stamp.t_boot_ns = 7_000_000_000 + ((index as f64 / 10.0 + late_s) * 1e9) as u64;
    }
    let found = compared(&records, &scene, AlignOptions::default(), 1);
    let left: Vec<(LeftOut, usize, u64)> = found
        .alignment
        .unwrap()
        .left_out
        .iter()
        .map(|left| (left.reason, left.rows, left.first_seq))
        .filter(|left| left.0 != LeftOut::OutsideScene)
        .collect();
    println!("{left:?}");
    assert_eq!(
        left,
        [
            (LeftOut::Missing(grideye_frame::NoData::Nack), 1, 5),
            (LeftOut::Torn, 1, 10),
            (LeftOut::Duplicate, 1, 20),
            (LeftOut::Stalled, 6, 40),
            (LeftOut::Burst, 2, 61),
        ]
    );
}

/// A sensor without noise repeats itself in a still room, which is no fault of the recording.
#[test]
fn a_noise_free_sensor_has_no_duplicates() {
    let scene = Walk {
        way: "2000,2000,0\n",
        speed: 600.0,
        ..WALK
    }
    .scene();
    let simulator = Simulator::new(&scene, SENSOR).unwrap();
    let image = simulator.image(Duration::ZERO).celsius;
    let records: Vec<Record> = (0..50)
        .map(|index| {
            row(
                index,
                f64::from(index) / 10.0,
                std::array::from_fn(|pixel| PixelWord((image[pixel] * 4.0).round() as u16)),
            )
        })
        .collect();
    let found = compared(&records, &scene, AlignOptions::default(), 1);
    assert!(found.alignment.unwrap().left_out.is_empty());
}

#[test]
fn bounds_out_of_range_are_refused() {
    let scene = WALK.scene();
    let records = record(&scene, 1, |time_s| time_s);
    for align in [
        AlignOptions {
            shift_max: Duration::from_millis(60_001),
            ..AlignOptions::default()
        },
        AlignOptions {
            rate_max: 0.201,
            ..AlignOptions::default()
        },
        AlignOptions {
            rate_max: f64::NAN,
            ..AlignOptions::default()
        },
    ] {
        let options = Options {
            align,
            ..Options::default()
        };
        let error = compare_scene(&records, &scene, SENSOR, &options).unwrap_err();
        assert!(error.to_string().starts_with("setting `max-"), "{error}");
    }
    // The largest allowed values pass.
    let most = AlignOptions {
        shift_max: grideye_validator::align::SHIFT_MAX,
        rate_max: grideye_validator::align::RATE_MAX,
        ..AlignOptions::default()
    };
    compared(&records, &scene, most, 1);
}
