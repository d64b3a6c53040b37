//! Error rates of the verdict, on recordings drawn by other code than the validator's.
//!
//! `GRIDEYE_WORLDS=N` draws N of each kind; by default a few. `GRIDEYE_CASES=TEXT` leaves out, of right and wrong recordings,
//! those whose printed name does not begin with that: `walk, More`, or `two, 50 frames`.
#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

mod mistakes;
mod worlds;

use grideye_frame::Reading;
use grideye_recording::Record;
use grideye_validator::{Comparison, KnownScene, Options, State, Verdict, compare_scene};
use std::sync::atomic::{AtomicU64, Ordering};
use worlds::{SENSOR, Truth, Unit, Way, record, scene};

const STAND: &[Way] = &[Way::Stands(0.55, 0.22)];
const WALK: &[Way] = &[Way::Walks { ahead_s: 0.0 }];
const TWO: &[Way] = &[Way::Walks { ahead_s: 0.0 }, Way::Walks { ahead_s: 9.0 }];
const UNIT: Unit = Unit {
    pattern_c: 0.38,
    noise_c: 0.22,
};
const FIRST_SEED: u64 = 77;

fn number(usual: u64) -> u64 {
    let asked = std::env::var("GRIDEYE_WORLDS").ok();
    asked.and_then(|asked| asked.parse().ok()).unwrap_or(usual)
}

fn is_asked(name: &str) -> bool {
    std::env::var("GRIDEYE_CASES").map_or(true, |cases| name.starts_with(&cases))
}

fn float(number: u64) -> f64 {
    f64::from(u32::try_from(number).unwrap())
}

fn share(number: usize) -> f64 {
    f64::from(u32::try_from(number).unwrap())
}

fn options() -> Options {
    Options {
        shuffles: 1,
        frames: Some(10),
        ..Options::default()
    }
}

/// Compares this many recordings on all processors.
fn compared<T: Send>(number: u64, one: impl Fn(u64) -> T + Sync) -> Vec<T> {
    let next = AtomicU64::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= number {
                return done;
            }
            done.push((seed, one(seed)));
        }
    };
    let mut all: Vec<(u64, T)> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..2).map(|_| scope.spawn(work)).collect();
        threads
            .into_iter()
            .flat_map(|thread| thread.join().unwrap())
            .collect()
    });
    all.sort_by_key(|one| one.0);
    all.into_iter().map(|one| one.1).collect()
}

/// Comparisons of recordings of this kind with the scene, which says `more`.
fn judged(
    ways: &[Way],
    frames: u32,
    truth: Truth,
    (unit, more): (Unit, &str),
    number: u64,
) -> Vec<Comparison> {
    let scene = scene(ways, frames, more);
    compared(number, |seed| {
        let records = record(ways, frames, truth, unit, FIRST_SEED + seed);
        compare_scene(&records, &scene, SENSOR, &options()).unwrap()
    })
}

/// How many agree, disagree, and cannot tell; printed.
fn counts(name: &str, all: &[Comparison]) -> [usize; 3] {
    let of = |verdict| {
        all.iter()
            .filter(|one| one.judgment.verdict == verdict)
            .count()
    };
    let counts = [Verdict::Agrees, Verdict::Disagrees, Verdict::CannotTell].map(of);
    println!("{name}: {counts:?}");
    if counts[0] < all.len() {
        let reasons = all
            .iter()
            .filter(|one| one.judgment.verdict != Verdict::Agrees);
        let reasons = reasons.take(3).flat_map(|one| one.judgment.reasons.first());
        reasons.for_each(|reason| println!("    {reason}"));
    }
    counts
}

const ROOMS: [(&str, &[Way]); 3] = [("stand", STAND), ("walk", WALK), ("two", TWO)];

/// 97 of 100, and no fewer with more frames.
#[test]
fn right_recordings_agree() {
    let long = std::env::var_os("GRIDEYE_WORLDS").is_some();
    for (name, ways) in ROOMS {
        let frames: &[u32] = if long { &[50, 300, 1000] } else { &[50] };
        for &frames in frames {
            let name = format!("{name}, {frames} frames, right");
            if !is_asked(&name) {
                continue;
            }
            let number = number(8);
            let all = judged(ways, frames, Truth::Right, (UNIT, ""), number);
            let [agree, ..] = counts(&name, &all);
            // Three standard deviations below.
            let least = 0.97 * float(number) - 3.0 * (0.03 * 0.97 * float(number)).sqrt();
            assert!(share(agree) >= least, "{name}: {agree} of {number}");
        }
    }
}

/// Each alone adds little to what the other shows; together they are no empty room. Whether there are two, it cannot tell.
#[test]
fn people_who_hide_each_other_are_seen() {
    let close = &[Way::Stands(0.55, 0.22), Way::Stands(0.6, 0.25)];
    let all = judged(close, 50, Truth::Right, (UNIT, ""), number(4));
    let [_, refused, _] = counts("two who stand close", &all);
    assert_eq!(refused, 0);
}

const WRONG: [Truth; 12] = [
    Truth::Nobody,
    Truth::Missing,
    Truth::More,
    Truth::Gone,
    Truth::MirroredX,
    Truth::MirroredY,
    Truth::Quarter,
    Truth::Aside(0.5),
    Truth::Late(1.0),
    Truth::Late(5.0),
    Truth::Backwards,
    Truth::Drift(2.0),
];

/// At most one of a hundred of any kind.
#[test]
fn wrong_recordings_do_not_agree() {
    for (name, ways) in ROOMS {
        for truth in WRONG {
            let stands = matches!(ways, [Way::Stands(..)]);
            if stands && matches!(truth, Truth::Late(_) | Truth::Backwards) {
                continue;
            }
            // Two people differ from one in these.
            let is_of_one = matches!(truth, Truth::Missing | Truth::More | Truth::Gone);
            let name = format!("{name}, {truth:?}");
            if ways.len() > 1 && !is_of_one && number(1) == 1 || !is_asked(&name) {
                continue;
            }
            let number = number(1);
            let all = judged(ways, 60, truth, (UNIT, ""), number);
            let [agree, ..] = counts(&name, &all);
            assert!(
                share(agree) <= 0.01 * float(number),
                "{name}: {agree} of {number}"
            );
        }
    }
}

/// Four of 300 in which one more walks along the edge of the image, a little warmer than the scene in each second: no single
/// second says so.
#[test]
fn one_more_who_is_faint_in_each_second_is_seen() {
    let scene = scene(WALK, 60, "");
    for seed in [16, 85, 170, 189] {
        let records = record(WALK, 60, Truth::More, UNIT, FIRST_SEED + seed);
        let found = compare_scene(&records, &scene, SENSOR, &options()).unwrap();
        assert_eq!(found.judgment.verdict, Verdict::Disagrees, "{seed}");
    }
}

/// With all laws twice as wide, none of them agrees either.
#[test]
fn tolerance_does_not_buy_agreement() {
    let wider = "[[uncertain]]\nkey = \"agent.*.aside_m\"\nsd = 0.14\n[[uncertain]]\nkey = \"agent.*.wander_m\"\nsd = 0.14\n\
         [[uncertain]]\nkey = \"agent.*.contrast\"\nsd = 0.5\n[[uncertain]]\nkey = \"recording.start_s\"\nsd = 0.14\n";
    for truth in WRONG {
        let number = number(1);
        let all = judged(WALK, 60, truth, (UNIT, wider), number);
        let [agree, ..] = counts(&format!("walk, laws twice as wide, {truth:?}"), &all);
        assert!(
            share(agree) <= 0.01 * float(number),
            "{truth:?}: {agree} of {number}"
        );
    }
}

/// Kolmogorov and Smirnov, of two samples: the p of right recordings is uniform, so as many of them are refused as are said to
/// be. It is the rank among 266 simulated recordings, which are drawn with the same numbers for every recording. Few recordings
/// tell little: of the same kind, 24 of the seeds from 77 on have a mean of .66, and the 76 after them one of .46.
#[test]
fn the_p_of_right_recordings_is_uniform() {
    let mut are_right = true;
    let long = std::env::var_os("GRIDEYE_WORLDS").is_some();
    let cases = [(50, 0.45), (50, 0.0), (10, 0.2), (300, 0.38)];
    for ((frames, pattern_c), case) in cases.into_iter().zip(1_u64..) {
        let name = format!("{frames} frames, pattern {pattern_c}");
        if case > 1 && !long || !is_asked(&name) {
            continue;
        }
        let number = number(64);
        let unit = Unit { pattern_c, ..UNIT };
        let more = format!("[[uncertain]]\nkey = \"room.background_c\"\nsd = {pattern_c}\n");
        let scene = scene(WALK, frames, &more);
        // The same draws would be no second case.
        let mut shares = compared(number, |seed| {
            let records = record(WALK, frames, Truth::Right, unit, 1_000 * case + seed);
            let found = compare_scene(&records, &scene, SENSOR, &options()).unwrap();
            found.decision.unwrap().right
        });
        shares.sort_by(f64::total_cmp);
        let steps = shares.iter().enumerate();
        let farthest = steps.fold(0.0_f64, |most, (index, p)| {
            let [before, after] = [index, index + 1].map(|index| share(index) / float(number));
            most.max(after - p).max(p - before)
        });
        let limit = 1.63 * (1.0 / float(number) + 1.0 / 266.0).sqrt();
        let mean = shares.iter().sum::<f64>() / float(number);
        let refused = shares.partition_point(|p| *p <= 0.015);
        println!(
            "{name}: D = {farthest:.3}, 99 % below {limit:.3}; mean {mean:.2}, refused {refused}"
        );
        are_right &= farthest < limit;
    }
    assert!(are_right);
}

/// One frame of another time, or that was not read, wherever it stands. Two of 160 frames are a picture.
#[test]
fn a_bad_frame_changes_no_verdict() {
    let rooms = [100, 160].map(|frames| (frames, scene(WALK, frames, "")));
    let number = number(6);
    let is_changed = |seed: u64| {
        let (frames, scene) = &rooms[usize::from(seed % 2 == 1)];
        let whole = record(WALK, *frames, Truth::Right, UNIT, FIRST_SEED + seed);
        let last = whole.len() - 1;
        let at = last * usize::try_from(seed).unwrap() / usize::try_from(number - 1).unwrap();
        let mut stray = whole.clone();
        stray[at].reading = whole[(at + 40) % whole.len()].reading;
        let mut lost = whole.clone();
        // Neither the first nor the last, which say where the recording begins and ends.
        let _ = lost.remove(at.clamp(1, last - 1));
        let verdict = |records: &Vec<Record>| {
            let found = compare_scene(records, scene, SENSOR, &options()).unwrap();
            found.judgment.verdict
        };
        [&stray, &lost]
            .into_iter()
            .any(|bad| verdict(bad) != verdict(&whole))
    };
    let changed = compared(number, is_changed);
    assert_eq!(changed.iter().filter(|changed| **changed).count(), 0);
}

#[test]
fn seeds_change_no_verdict() {
    let scene = scene(WALK, 50, "");
    let records = record(WALK, 50, Truth::Aside(0.25), UNIT, FIRST_SEED);
    let decision = |seed| {
        let options = Options { seed, ..options() };
        compare_scene(&records, &scene, SENSOR, &options)
            .unwrap()
            .decision
    };
    assert_eq!(decision(1), decision(2));
}

/// The change that was made to the recording, and no other.
#[test]
fn the_change_that_would_agree_is_named() {
    let scene = scene(WALK, 100, "");
    let wrong = [
        (Truth::Late(1.5), "Compare with `--start -1."),
        (Truth::Aside(0.6), "Set `position_mm = ["),
        (Truth::MirroredX, "Compare with `--align orientation`"),
        (
            Truth::Contrast(6.0),
            "Change `temperature_c` or `person.clothing`",
        ),
    ];
    let told = compared(4, |kind| {
        let (truth, _) = wrong[usize::try_from(kind).unwrap()];
        let records = record(WALK, 100, truth, UNIT, FIRST_SEED);
        let options = |start_s| Options {
            advises: true,
            start_s,
            ..options()
        };
        let compared = |start_s| compare_scene(&records, &scene, SENSOR, &options(start_s));
        let next_step = compared(None).unwrap().judgment.next_step;
        // The advice itself.
        let start_s = next_step.split_once("--start ");
        let start_s = start_s.and_then(|(_, start)| start.split('`').next()?.parse().ok());
        let then = start_s.map(|start_s| compared(Some(start_s)).unwrap().judgment.verdict);
        (next_step, then)
    });
    for ((truth, sentence), (next_step, then)) in wrong.iter().zip(told) {
        let wanted = [sentence, ": the scene then agrees."];
        assert!(
            wanted.iter().all(|wanted| next_step.contains(wanted)),
            "{truth:?}: {next_step}"
        );
        let is_delay = matches!(truth, Truth::Late(_));
        assert_eq!(then, is_delay.then_some(Verdict::Agrees), "{truth:?}");
    }
}

/// Who stands where the scene has nobody is named with the place; here it is warmer than what any unit's pattern explains.
#[test]
fn one_more_who_stands_is_named_with_the_place() {
    let scene = scene(WALK, 100, "");
    let ways = [WALK, &[Way::Stands(0.5, 0.5)]].concat();
    let records = record(&ways, 100, Truth::Right, UNIT, FIRST_SEED + 2);
    let options = Options {
        advises: true,
        ..options()
    };
    let found = compare_scene(&records, &scene, SENSOR, &options).unwrap();
    let said = found.judgment.to_string();
    let place = said.split_once("one more person was there, longest near [");
    let place = place.and_then(|(_, place)| place.split_once("] mm"));
    let place = place.and_then(|(place, _)| place.split_once(", "));
    let place = place.map(|(x, y)| [x, y].map(|mm| mm.parse::<f64>().unwrap()));
    let is_there = |[x, y]: [f64; 2]| (x - 3500.0).hypot(y - 3500.0) < 300.0;
    assert!(place.is_some_and(is_there), "{said}");
    assert!(said.contains("the scene then agrees"), "{said}");
}

/// A recording in which the image of a recording of this kind lies mirrored.
fn mirrored(truth: Truth) -> Vec<Record> {
    let mut records = record(WALK, 100, truth, UNIT, FIRST_SEED);
    for record in &mut records {
        if let Reading::Frame(frame) = &mut record.reading {
            frame.pixels.chunks_mut(8).for_each(<[_]>::reverse);
        }
    }
    records
}

/// Each of several changes is named, with the share of the difference that it takes away where they are not all.
#[test]
fn what_is_wrong_together_is_named() {
    let scene = scene(WALK, 100, "");
    const TURNED: &str = "the image is mirrored left to right";
    const AGREES: &str = "`--align orientation`, and ";
    const NEARER: &str = "no single change makes it agree";
    let wrong = [
        (Truth::Late(1.5), AGREES, "--start -1."),
        (Truth::Aside(0.7), AGREES, "set `position_mm = ["),
        (Truth::Contrast(6.0), NEARER, "which explains "),
        (Truth::Gone, NEARER, "which explains "),
    ];
    let told = compared(4, |kind| {
        let records = mirrored(wrong[usize::try_from(kind).unwrap()].0);
        let options = Options {
            advises: true,
            ..options()
        };
        compare_scene(&records, &scene, SENSOR, &options)
            .unwrap()
            .judgment
    });
    for ((truth, first, other), judged) in wrong.iter().zip(told) {
        let said = judged.to_string();
        let wanted = [TURNED, first, other];
        assert!(
            wanted.iter().all(|wanted| said.contains(wanted)),
            "{truth:?}: {said}"
        );
    }
}

/// Who is elsewhere or was there at another time is not dressed otherwise.
#[test]
fn no_contrast_is_another_place_or_time() {
    let scene = scene(WALK, 100, "");
    for truth in [Truth::Late(1.5), Truth::Contrast(6.0)] {
        let compared = compare_scene(&mirrored(truth), &scene, SENSOR, &options());
        let judged = compared.unwrap().judgment;
        let found = "is not where or when the scene says";
        assert!(judged.to_string().contains(found), "{judged}");
        assert!(judged.next_step.contains("`--start`"), "{judged}");
        assert!(!judged.to_string().contains("clothing"), "{judged}");
    }
}

/// What an earlier comparison rendered changes nothing.
#[test]
fn a_known_scene_decides_as_a_new_one() {
    let scene = scene(WALK, 50, "");
    let records = record(WALK, 50, Truth::Right, UNIT, FIRST_SEED);
    let mut known = KnownScene::new(scene.clone(), SENSOR);
    for from in [0_u8, 10] {
        let options = Options {
            start_s: Some(0.1 * f64::from(from)),
            ..options()
        };
        let records = &records[from.into()..];
        let again = known.compare(records, &options).unwrap();
        let fresh = compare_scene(records, &scene, SENSOR, &options).unwrap();
        assert_eq!(again.decision, fresh.decision, "from {from}");
    }
}

#[test]
fn short_recordings_cannot_tell() {
    let all = judged(STAND, 3, Truth::Right, (UNIT, ""), 2);
    assert_eq!(counts("3 frames", &all), [0, 0, 2]);
}

/// Whoever stands or walks below the sensor is missed, on drawn recordings and on real ones of an empty room, which the
/// data set's authors counted (LINAIGE: the last column but one). The headline says that nobody is there, and no advice that
/// they are elsewhere. Whoever is out of view is not missed.
#[test]
fn a_missing_person_disagrees() {
    for (name, ways) in ROOMS {
        let number = number(2);
        let scene = scene(ways, 100, "");
        let advised = |records: &[Record]| {
            let options = Options {
                advises: true,
                ..options()
            };
            compare_scene(records, &scene, SENSOR, &options).unwrap()
        };
        let all = compared(number, |seed| {
            advised(&record(ways, 100, Truth::Nobody, UNIT, FIRST_SEED + seed))
        });
        let [agree, refused, _] = counts(&format!("{name}, Nobody, 100 frames"), &all);
        let is_said = |one: &Comparison| one.judgment.headline.contains("shows nobody");
        assert_eq!(all.iter().filter(|one| is_said(one)).count(), refused);
        let missed = share(refused) >= 0.9 * float(number);
        assert!(agree == 0 && missed, "{name}: {refused} of {number}");
        for (session, first) in [("2_2021-07-01_RoomB", 1376), ("3_2021-07-06_RoomA", 823)] {
            let records = empty_room(session, first);
            let found = advised(&records);
            let judgment = &found.judgment;
            let right = judgment.criteria.iter().find(|one| one.name == "right");
            let is_missed = right.unwrap().state == State::Failed;
            assert!(
                is_missed && is_said(&found),
                "{name}, session {session}: {judgment}"
            );
        }
    }
    let aside = &[Way::Stands(2.6, 2.6)];
    let all = judged(aside, 100, Truth::Nobody, (UNIT, ""), 2);
    assert_eq!(counts("out of view, Nobody", &all), [0, 0, 2]);
}

/// A hundred frames of the data set with nobody in them, as warm as the room of the scenes.
fn empty_room(session: &str, first: usize) -> Vec<Record> {
    let name = format!("Session{session}_v2.csv");
    let folder = format!("{}/../../recordings/linaige", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(format!("{folder}/{name}")).unwrap();
    let rows: Vec<&str> = text.lines().skip(1 + first).take(100).collect();
    assert!(rows.iter().all(|row| row.rsplit(',').nth(1) == Some("0")));
    let file = std::fs::File::open(format!("{folder}/{name}")).unwrap();
    let rows = grideye_import::open(file, &name, &Default::default()).unwrap();
    let records = rows.map(|row| row.unwrap().record);
    let colder = |mut record: Record| {
        if let Reading::Frame(frame) = &mut record.reading {
            frame.pixels.iter_mut().for_each(|word| word.0 -= 16);
        }
        record
    };
    records.skip(first).take(100).map(colder).collect()
}

/// Three of four frames begin as the frame before, as when they are read while the sensor writes.
#[test]
fn torn_recordings_are_told_how_to_read_whole_frames() {
    let scene = scene(WALK, 200, "");
    let whole = record(WALK, 200, Truth::Right, UNIT, FIRST_SEED);
    for every in [1, 4] {
        let mut torn = whole.clone();
        for index in (1..torn.len()).filter(|index| index % every != 0) {
            let Reading::Frame(before) = torn[index - 1].reading else {
                continue;
            };
            if let Reading::Frame(frame) = &mut torn[index].reading {
                frame.pixels[..40].copy_from_slice(&before.pixels[..40]);
            }
        }
        let judgment = compare_scene(&torn, &scene, SENSOR, &options())
            .unwrap()
            .judgment;
        let said = judgment.to_string();
        let is_told = said.contains("are torn") && judgment.next_step.contains("in one burst");
        assert_eq!(is_told, every == 4, "{said}");
        assert!(!said.contains("longer"), "{said}");
    }
}

/// Noise that is correlated from frame to frame and differs between pixels refuses no more than two of a hundred.
#[test]
fn other_noise_is_no_reason_to_refuse() {
    let number = number(4);
    let all = judged(WALK, 300, Truth::Correlated, (UNIT, ""), number);
    let [_, refused, _] = counts("walk, correlated noise", &all);
    let most = 0.02 * float(number) + 3.0 * (0.02 * float(number)).sqrt();
    assert!(share(refused) <= most, "{refused} of {number}");
}

/// What is not listed: from which offset and contrast on recordings are refused.
#[test]
fn slightly_wrong_recordings_are_refused_more_and_more() {
    let number = number(2);
    let agreed = |truth| {
        let all = judged(WALK, 60, truth, (UNIT, ""), number);
        counts(&format!("walk, {truth:?}"), &all)[0]
    };
    let aside = [0.1, 0.2, 0.3, 0.4].map(|by_m| agreed(Truth::Aside(by_m)));
    let contrast = [0.25, 0.5, 1.0, 2.0, 4.0].map(|times| agreed(Truth::Contrast(times)));
    assert!(aside[0] > aside[3], "{aside:?}");
    assert!(contrast[2] > contrast[0].max(contrast[4]), "{contrast:?}");
}
