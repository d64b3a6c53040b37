//! Backgrounds of empty rooms: real recordings with counted people, and planted people.
#![expect(
    clippy::unwrap_used,
    clippy::as_conversions,
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "what fails in a helper fails the test, and its numbers are small"
)]

use grideye_frame::{PIXELS, PixelWord, Reading, RecordedFrame, ThermistorWord};
use grideye_recording::{ClockState, Record, Stamp};
use grideye_scene::profile::Profile;
use grideye_validator::BackgroundFit;
use grideye_validator::background::{
    Background, BackgroundError, Empty, Stretch, background, put_shown_into,
};
use grideye_validator::characterize::{Presence, characterize};
use std::fs::File;
use std::path::Path;
use std::time::Duration;

const SESSION_2: &str = "Session2_2021-07-01_RoomB_v2.csv";
const SESSION_3: &str = "Session3_2021-07-06_RoomA_v2.csv";

/// The records, and the number of people counted in each.
fn session(name: &str) -> (Vec<Record>, Vec<u32>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../recordings/linaige")
        .join(name);
    let rows = grideye_import::open(File::open(path).unwrap(), name, &Default::default());
    rows.unwrap()
        .map(|row| row.unwrap())
        .map(|row| (row.record, row.labels[0].parse::<u32>().unwrap()))
        .unzip()
}

fn is_in(found: &Background, records: &[Record], record: &Record) -> bool {
    let since = record.stamp.t_boot_ns - records[0].stamp.t_boot_ns;
    found
        .stretches
        .iter()
        .any(|stretch| stretch.holds(Duration::from_nanos(since)))
}

/// Compares the frames found empty with those counted as empty.
#[test]
fn empty_stretches_agree_with_the_people_count() {
    for name in [SESSION_2, SESSION_3] {
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

/// A room with a pattern; a person on the pixels `stands` in the frames where `is_there`.
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
                reading: Reading::Frame(RecordedFrame {
                    thermistor: Some(ThermistorWord(400)),
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
fn a_person_standing_still_is_not_background() {
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
fn a_named_stretch_is_used_as_given() {
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
    assert!(
        error.to_string().contains("the recording is 59.9 s long"),
        "{error}"
    );
}

#[test]
fn an_always_occupied_room_has_no_background() {
    let moving = |frame: u32| frame % 40 < 20;
    let found = background(&room(600, moving, &[9, 10, 17, 18]), &Empty::Find);
    assert_eq!(found, Err(BackgroundError::NoneFound));
    assert_eq!(
        background(&room(30, |_| false, &[]), &Empty::Find),
        Err(BackgroundError::NoneFound)
    );
}

#[test]
fn a_stretch_parses_or_is_rejected() {
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

/// Added to the scene's empty room, pattern and background give what was measured.
#[test]
fn pattern_and_background_give_the_empty_room() {
    let found = background(&room(300, |_| false, &[]), &Empty::Find).unwrap();
    let mut profile = Profile::default();
    let empty_room: Vec<f64> = (0..PIXELS)
        .map(|pixel| 19.0 + if pixel == 5 { 4.0 } else { 0.0 })
        .collect();
    found.put_into(&mut profile, Some(&empty_room));
    for (pixel, room) in empty_room.iter().enumerate() {
        let sum = room + profile.in_its_room_c()[pixel];
        assert!((sum - found.celsius[pixel]).abs() < 1e-4);
    }
    found.put_into(&mut profile, None);
    let mut offsets = profile.in_its_room_c();
    offsets.sort_by(f64::total_cmp);
    assert!(
        (offsets[31] + offsets[32]).abs() < 1e-3,
        "above the middle pixel"
    );
}

/// A unit's pattern of known size, and a room with a window side 0.4 °C warmer and a radiator on eight pixels.
#[test]
fn pattern_and_room_are_told_apart() {
    let unit = |pixel: usize| 0.1 * ((pixel * 37 % 11) as f64 - 5.0);
    let slope = |pixel: usize| 0.4 / 7.0 * (pixel % 8) as f64;
    let radiator = |pixel: usize| {
        if pixel >= 48 && (2..6).contains(&(pixel % 8)) {
            3.0
        } else {
            0.0
        }
    };
    let shown = |pixel: usize| 0.6 * unit(pixel) + slope(pixel) + radiator(pixel);
    let mut profile = Profile::default();
    put_shown_into(&mut profile, &std::array::from_fn(shown));
    let pattern = profile.fixed_pattern.offset_c;
    let background = profile.background_c.unwrap();
    let mut squares = 0.0;
    for pixel in 0..PIXELS {
        assert!((pattern[pixel] + background[pixel] - shown(pixel)).abs() < 6e-5);
        if radiator(pixel) == 0.0 {
            squares += (pattern[pixel] - 0.6 * unit(pixel)).powi(2);
        } else {
            assert_eq!(pattern[pixel], 0.0, "a radiator is the room's: {pixel}");
        }
    }
    // The surface takes some of a pattern of 0.19 °C, and the edge of the radiator hides ten pixels of it.
    let error = (squares / 56.0).sqrt();
    assert!(error < 0.15, "{error}");
}

/// A person who sits still all the time, in front of whom another passes, is in every stretch.
#[test]
fn stretches_in_which_something_stays_warm_are_not_certain() {
    let sits = [9, 10, 17, 18];
    let mut records = room(900, |index| (300..340).contains(&index), &[36, 37, 44, 45]);
    let empty = background(&records, &Empty::Find).unwrap();
    assert!(empty.is_certain(None), "{:?}", empty.stretches);
    for record in &mut records {
        if let Reading::Frame(raw) = &mut record.reading {
            sits.iter().for_each(|pixel| raw.pixels[*pixel].0 += 8);
        }
    }
    assert!(!background(&records, &Empty::Find).unwrap().is_certain(None));
    let short = background(&room(99, |_| false, &[]), &Empty::Find).unwrap();
    assert!(!short.is_certain(None), "under ten seconds");
}

/// Half of the room is two degrees warmer, so the median pixel lies in a gap. A person on four pixels of the colder
/// half shifts it, and all levels, by half a degree.
#[test]
fn a_person_who_shifts_the_median_shifts_no_level() {
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

/// A person stands still for all but half a minute of two minutes: the many means with the person are closer together
/// than the few without, and warmer.
#[test]
fn a_person_still_for_most_of_the_recording_is_not_the_room() {
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

/// Both sessions had people in all but a few stretches. These are session 3's longest empty ones, minutes apart,
/// without the one in which its clock jumps.
#[test]
fn real_presence_agrees_with_the_people_count() {
    for name in [SESSION_2, SESSION_3] {
        let presence = characterize(session(name).0).unwrap().presence;
        let Presence::Somebody(spot) = presence else {
            panic!("{name}: {presence:?}");
        };
        assert!((1.0..3.0).contains(&spot.celsius), "{name}: {spot:?}");
    }
    let (rows, _) = session(SESSION_3);
    let empty = [323..434, 605..694, 715..795, 823..938, 1569..1672]
        .into_iter()
        .flat_map(|run| rows[run].to_vec());
    let found = characterize(empty.clone()).unwrap();
    assert_eq!(found.presence, Presence::Nobody);
    // The mean of all frames; the search gives nearly the same.
    let whole = Background::whole(&found).unwrap();
    let mean: Vec<f64> = (0..PIXELS)
        .map(|pixel| {
            let sum: f64 = empty.clone().map(|record| pixels(&record)[pixel]).sum();
            sum / empty.clone().count() as f64
        })
        .collect();
    let apart = |left: &[f64], right: &[f64]| {
        let level = left.iter().zip(right).map(|(l, r)| l - r).sum::<f64>() / 64.0;
        let squares = left.iter().zip(right).map(|(l, r)| (l - r - level).powi(2));
        (squares.sum::<f64>() / 64.0).sqrt()
    };
    assert!(apart(&whole.celsius, &mean) < 0.02);
    let stretches = background(&rows, &Empty::Find).unwrap();
    assert!(apart(&whole.celsius, &stretches.celsius) < 0.08);
    // The pattern alone, beyond a smooth surface, misses an eighth of a degree.
    let smooth = found.profile("smooth").fixed_pattern.offset_c;
    assert!(apart(&smooth, &mean) > 0.1, "{}", apart(&smooth, &mean));
}

/// A room with a slope across it, drifting by half a degree as a whole, where `warms` adds to each pixel.
fn drifting(frames: u32, warms: impl Fn(u32, usize) -> f64) -> Vec<Record> {
    let mut records = room(frames, |_| false, &[]);
    for (index, record) in (0..).zip(&mut records) {
        let Reading::Frame(frame) = &mut record.reading else {
            continue;
        };
        for (pixel, word) in frame.pixels.iter_mut().enumerate() {
            let slope = 0.15 * (pixel % 8) as f64;
            let drift = f64::from(index) / f64::from(frames) / 2.0;
            word.0 += ((slope + drift + warms(index, pixel)) * 4.0).round() as u16;
        }
    }
    records
}

fn presence(frames: u32, warms: impl Fn(u32, usize) -> f64) -> Presence {
    characterize(drifting(frames, warms)).unwrap().presence
}

const MIDDLE: [usize; 4] = [27, 28, 35, 36];

#[test]
fn absent_moving_and_still_people_are_distinguished() {
    assert_eq!(presence(600, |_, _| 0.0), Presence::Nobody);
    let is_there = |seq: u32, pixel: usize, warm: &dyn Fn(u32) -> bool| {
        if MIDDLE.contains(&pixel) && warm(seq) {
            1.5
        } else {
            0.0
        }
    };
    // For three seconds, all but three seconds, a second at the end, half of the time: each counts as a person.
    let cases: [&dyn Fn(u32) -> bool; 4] = [
        &|seq| (300..330).contains(&seq),
        &|seq| !(300..330).contains(&seq),
        &|seq| seq >= 580,
        &|seq| seq >= 300,
    ];
    for (case, warm) in cases.into_iter().enumerate() {
        let found = presence(600, |seq, pixel| is_there(seq, pixel, warm));
        let Presence::Somebody(spot) = found else {
            panic!("{case}: {found:?}");
        };
        assert_eq!((spot.row, spot.column), (3, 3), "{case}");
        assert!((spot.celsius - 1.5).abs() < 0.3, "{case}: {spot:?}");
    }
    let still = presence(600, |seq, pixel| is_there(seq, pixel, &|_| true));
    let Presence::Still(spot) = still else {
        panic!("{still:?}");
    };
    assert_eq!((spot.row, spot.column), (3, 3));
    assert!((1.0..1.6).contains(&spot.celsius), "{spot:?}");
}

/// Thirty means of ten frames are half a minute; with a gap in each hundred, no hundred frames are in a row.
#[test]
fn presence_needs_half_a_minute_without_gaps() {
    assert_eq!(presence(300, |_, _| 0.0), Presence::Nobody);
    assert_eq!(presence(299, |_, _| 0.0), Presence::TooShort);
    let mut gapped = drifting(900, |_, _| 0.0);
    gapped.retain(|record| record.seq % 90 != 0);
    let found = characterize(gapped).unwrap();
    assert_eq!(found.presence, Presence::TooShort);
    assert_eq!(Background::whole(&found), None);
}

#[test]
fn presence_is_in_the_table_and_the_json() {
    let of = |frames: u32, warms: &dyn Fn(u32, usize) -> f64| {
        let found = characterize(drifting(frames, warms)).unwrap();
        let json: serde_json::Value = serde_json::from_str(&found.to_json()).unwrap();
        let lines = found.lines();
        let line = lines
            .iter()
            .find(|line| line.label == "somebody in view")
            .unwrap();
        (
            format!("{} {}", line.value, line.note),
            json["presence"].clone(),
        )
    };
    let (line, json) = of(600, &|_, _| 0.0);
    assert_eq!(line, "no ");
    assert_eq!(
        (json["somebody"].clone(), json["why"].clone()),
        (false.into(), "nothing_moves".into())
    );
    let (line, json) = of(200, &|_, _| 0.0);
    assert_eq!(line, "unknown less than half a minute");
    assert_eq!(
        (json["somebody"].is_null(), json["why"].clone()),
        (true, "too_short".into())
    );
    let (line, json) = of(600, &|seq, pixel| {
        if seq > 400 && MIDDLE.contains(&pixel) {
            2.0
        } else {
            0.0
        }
    });
    assert!(
        line.starts_with("yes rows 4 and 5, columns 4 and 5 change by "),
        "{line}"
    );
    assert!(line.ends_with(" °C"), "{line}");
    assert_eq!(
        (
            json["somebody"].clone(),
            json["row"].clone(),
            json["column"].clone()
        ),
        (true.into(), 4.into(), 4.into())
    );
    let (line, json) = of(600, &|_, pixel| {
        if MIDDLE.contains(&pixel) { 2.0 } else { 0.0 }
    });
    assert!(
        line.starts_with("unknown rows 4 and 5, columns 4 and 5 stay "),
        "{line}"
    );
    assert!(line.ends_with(" °C warm"), "{line}");
    assert_eq!(
        (json["somebody"].is_null(), json["why"].clone()),
        (true, "stays_warm".into())
    );
}

/// A record's frame, °C; both sessions are above zero.
fn pixels(record: &Record) -> [f64; PIXELS] {
    let frame = record.reading.frame().unwrap();
    frame.pixels.map(|word| f64::from(word.0 & 0xFFF) * 0.25)
}

/// A step of 0.25 °C leaves 0.0721688 °C of rounding.
#[test]
fn rounding_alone_does_not_make_a_profile_worse() {
    let fit = |profile_c: f64| BackgroundFit {
        profile_c,
        own_c: 0.05,
        stretches: Vec::new(),
    };
    let limit = 0.05_f64.hypot(0.072_168_784);
    assert!(!fit(limit - 1e-6).is_worse());
    assert!(fit(limit + 1e-6).is_worse());
}
