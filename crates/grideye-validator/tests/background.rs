//! The background of an empty room: found on real recordings whose people were counted, and on planted ones.
#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_frame::{PIXELS, PixelWord, RawFrame, Reading, ThermistorWord};
use grideye_recording::linaige::{Date, Reader, stream_from_file_name};
use grideye_recording::{ClockState, Record, Stamp};
use grideye_scene::profile::Profile;
use grideye_validator::background::{Background, BackgroundError, Empty, Stretch, background};
use std::fs::File;
use std::path::Path;
use std::time::Duration;

/// The records, and how many people were counted in each.
fn session(name: &str) -> (Vec<Record>, Vec<u32>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../recordings/linaige")
        .join(name);
    let date = Date::from_file_name(name).unwrap();
    Reader::new(File::open(path).unwrap(), date, stream_from_file_name(name))
        .unwrap()
        .map(|row| row.unwrap())
        .map(|row| (row.row.record, row.people))
        .unzip()
}

fn is_in(found: &Background, records: &[Record], record: &Record) -> bool {
    let since = record.stamp.t_boot_ns - records[0].stamp.t_boot_ns;
    found
        .stretches
        .iter()
        .any(|stretch| stretch.holds(Duration::from_nanos(since)))
}

/// Of the frames that were taken for empty, and of those that people counted as empty.
#[test]
fn what_is_found_empty_was_counted_as_empty() {
    for name in [
        "Session2_2021-07-01_RoomB_v2.csv",
        "Session3_2021-07-06_RoomA_v2.csv",
    ] {
        let (records, people) = session(name);
        let found = background(&records, &Empty::Find).unwrap();
        let taken: Vec<u32> = records
            .iter()
            .zip(&people)
            .filter(|(record, _)| is_in(&found, &records, record))
            .map(|(_, people)| *people)
            .collect();
        let right = taken.iter().filter(|people| **people == 0).count();
        let empty = people.iter().filter(|people| **people == 0).count();
        println!(
            "{name}: {} of {} frames taken were counted as empty; {empty} of {} are; stretches {:?}",
            right,
            taken.len(),
            records.len(),
            found
                .stretches
                .iter()
                .map(ToString::to_string)
                .collect::<Vec<_>>()
        );
        assert!(
            right * 100 >= taken.len() * 95,
            "{name}: {right} of {}",
            taken.len()
        );
        assert!(right * 2 >= empty, "{name}: {right} of {empty}");
    }
}

/// A room with a pattern; somebody at `stands` in the frames that `is_there`.
fn room(frames: u32, is_there: impl Fn(u32) -> bool, stands: &[usize]) -> Vec<Record> {
    let mut state = 9_u64;
    let mut noise = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        u16::try_from((state >> 33) % 4).unwrap()
    };
    (0..frames)
        .map(|index| {
            let pixels = std::array::from_fn(|pixel| {
                let pattern = u16::try_from(pixel * 7 % 5).unwrap();
                let person = if is_there(index) && stands.contains(&pixel) {
                    10
                } else {
                    0
                };
                PixelWord(80 + pattern + person + noise())
            });
            Record {
                seq: u64::from(index),
                stamp: Stamp {
                    t_boot_ns: u64::from(index) * 100_000_000,
                    t_utc_ns: 0,
                    clock: ClockState::Unsynced,
                },
                reading: Reading::Frame(RawFrame {
                    thermistor: ThermistorWord(400),
                    pixels,
                }),
            }
        })
        .collect()
}

/// 20 °C, the pattern in quarters, and the mean of 0 to 3 quarters of noise.
fn truth(pixel: usize) -> f64 {
    20.0 + 0.25 * f64::from(u8::try_from(pixel * 7 % 5).unwrap()) + 0.375
}

fn assert_is_the_room(found: &Background) {
    for (pixel, celsius) in found.celsius.iter().enumerate() {
        assert!(
            (celsius - truth(pixel)).abs() < 0.1,
            "{pixel}: {celsius} {}",
            truth(pixel)
        );
    }
}

#[test]
fn somebody_who_stands_still_for_most_of_the_time_is_not_the_background() {
    let stands = [26, 27, 28, 34, 35, 36];
    let found = background(
        &room(600, |frame| (100..520).contains(&frame), &stands),
        &Empty::Find,
    )
    .unwrap();
    assert_is_the_room(&found);
    for stretch in &found.stretches {
        assert!(
            stretch.to < Duration::from_secs(10) || stretch.from >= Duration::from_secs(52),
            "{stretch}"
        );
    }
    // Each end of a stretch loses a second.
    assert!(found.frames >= 130, "{}", found.frames);
}

#[test]
fn an_empty_recording_is_empty_throughout() {
    let found = background(&room(300, |_| false, &[]), &Empty::Find).unwrap();
    assert_is_the_room(&found);
    assert!(found.frames >= 250, "{}", found.frames);
}

#[test]
fn a_named_stretch_is_believed_and_its_frames_are_counted() {
    let records = room(600, |frame| frame < 300, &[27]);
    let named = |text: &str| background(&records, &Empty::Named(text.parse().unwrap()));
    let found = named("31s..50s").unwrap();
    assert_eq!(found.frames, 191);
    assert_is_the_room(&found);
    let occupied = named("0..20s").unwrap();
    assert!((occupied.celsius[27] - truth(27) - 2.5).abs() < 0.1);
    let error = named("70s..80s").unwrap_err();
    assert!(matches!(
        error,
        BackgroundError::TooFewFrames { frames: 0, .. }
    ));
    assert!(error.to_string().contains("it takes 59.9 s"), "{error}");
}

#[test]
fn where_somebody_always_is_no_background_is_made_up() {
    let moving = |frame: u32| frame % 40 < 20;
    let found = background(&room(600, moving, &[9, 10, 17, 18]), &Empty::Find);
    assert_eq!(found, Err(BackgroundError::NoneFound));
    assert_eq!(
        background(&room(30, |_| false, &[]), &Empty::Find),
        Err(BackgroundError::NoneFound)
    );
}

#[test]
fn a_stretch_is_read_or_refused() {
    let stretch: Stretch = "12s..40.5s".parse().unwrap();
    assert_eq!(
        (stretch.from, stretch.to),
        (Duration::from_secs(12), Duration::from_millis(40_500))
    );
    assert_eq!(stretch.to_string().parse(), Ok(stretch));
    for text in ["12", "40s..12s", "..", "a..b", "-1..3", "1..inf", ""] {
        assert!(
            text.parse::<Stretch>().unwrap_err().contains("12s..40s"),
            "{text}"
        );
    }
}

/// Added to the scene's empty room, the pattern is the background.
#[test]
fn the_background_is_kept_as_a_pattern() {
    let found = background(&room(300, |_| false, &[]), &Empty::Find).unwrap();
    let mut profile = Profile::default();
    let empty_room: Vec<f64> = (0..PIXELS)
        .map(|pixel| 19.0 + if pixel == 5 { 4.0 } else { 0.0 })
        .collect();
    found.put_into(&mut profile, Some(&empty_room));
    for (pixel, room) in empty_room.iter().enumerate() {
        let sum = room + profile.fixed_pattern.offset_c[pixel];
        assert!((sum - found.celsius[pixel]).abs() < 1e-4);
    }
    found.put_into(&mut profile, None);
    let mut offsets = profile.fixed_pattern.offset_c;
    offsets.sort_by(f64::total_cmp);
    assert!(
        (offsets[31] + offsets[32]).abs() < 1e-3,
        "above the middle pixel"
    );
}

/// Half of the room is two degrees warmer, so that the middle pixel lies in the gap between: somebody on four pixels of the
/// colder half moves it by half a degree, and all levels with it. The room is empty all the same where nobody is.
#[test]
fn a_middle_that_somebody_moves_moves_no_level() {
    let mut records = room(600, |index| (100..500).contains(&index), &[9, 10, 17, 18]);
    for record in &mut records {
        if let Reading::Frame(raw) = &mut record.reading {
            raw.pixels[PIXELS / 2..]
                .iter_mut()
                .for_each(|word| word.0 += 8);
        }
    }
    let found = background(&records, &Empty::Find).unwrap();
    let is_empty = |second: u64| {
        found
            .stretches
            .iter()
            .any(|stretch| stretch.holds(Duration::from_secs(second)))
    };
    assert!(
        is_empty(3) && is_empty(7) && is_empty(53) && is_empty(57),
        "{:?}",
        found.stretches
    );
    assert!(
        (10..50).all(|second| !is_empty(second)),
        "{:?}",
        found.stretches
    );
}

/// Of two minutes somebody stands still for all but half a minute: the many means with him lie closer together than the few
/// without, and are warmer.
#[test]
fn who_stands_still_most_of_the_time_is_not_the_room() {
    let records = room(1_200, |index| index >= 300, &[9, 10, 17, 18]);
    let found = background(&records, &Empty::Find).unwrap();
    let last = found.stretches.iter().map(|stretch| stretch.to).max();
    assert!(
        last.unwrap() < Duration::from_secs(30),
        "{:?}",
        found.stretches
    );
    assert_is_the_room(&found);
}
