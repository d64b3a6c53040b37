//! Faults by script: in time, by frame, by chance, from a file; and what a file can have wrong.
#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use amg8833_emulator::script::{
    EVERY_MIN, Lasting, RULES_MAX, Rule, SCRIPT_BYTES_MAX, Script, ScriptError, When,
};
use amg8833_emulator::{
    Address, Bus, BusError, Chance, Clock, Fault, FaultCounts, FaultKind, ManualClock, Options,
    STEPS_MAX,
};
use core::time::Duration;
use embedded_hal::i2c::{I2c, NoAcknowledgeSource};
use grideye_frame::{Celsius, Frame, PixelIndex};
use proptest::prelude::*;
use std::sync::{Arc, Mutex};

const HIGH: u8 = 0x69;
const EXAMPLE: &str = include_str!("../scripts/faults.toml");

type Source = fn(Duration) -> Frame;
type TestBus = Bus<ManualClock, Source>;

const COUNTING: Source = counting;

const fn ms(milliseconds: u64) -> Duration {
    Duration::from_millis(milliseconds)
}

/// The tick of number n shows n quarter degrees, up to 2000 and anew.
fn counting(t: Duration) -> Frame {
    let tick = t.as_millis() / 100 % 2_000;
    Frame::uniform(Celsius::new(f32::from(u16::try_from(tick).unwrap()) / 4.0))
}

fn bus() -> TestBus {
    Bus::with_sensor(ManualClock::new(), Address::High, COUNTING)
}

fn following(rules: Vec<Rule>) -> TestBus {
    let mut bus = bus();
    bus.set_script(Script::new(7, rules).unwrap());
    bus
}

fn from_toml(text: &str) -> TestBus {
    let mut bus = bus();
    bus.set_script(Script::from_toml(text, "test.toml").unwrap());
    bus
}

fn pixels(bus: &mut TestBus) -> Result<Vec<u16>, BusError> {
    let mut bytes = [0; 128];
    bus.write_read(HIGH, &[0x80], &mut bytes)?;
    let words = bytes.chunks(2);
    Ok(words
        .map(|pair| u16::from_le_bytes([pair[0], pair[1]]))
        .collect())
}

fn probe_at(bus: &mut TestBus, milliseconds: u64) -> Result<(), BusError> {
    bus.clock().set(ms(milliseconds));
    bus.write(HIGH, &[])
}

const ABSENT: BusError = BusError::NoAcknowledge {
    address: HIGH,
    source: NoAcknowledgeSource::Address,
};

#[test]
fn a_moment_lasts_its_duration_first_instant_included() {
    let mut bus = from_toml(
        "[[fault]]\nkind = \"nack-address\"\nat = \"12.5 s\"\nduration = \"250 ms\"\naddress = 0x69\n",
    );
    let ns = Duration::from_nanos(1);
    for (at, answer) in [
        (ms(12_500) - ns, Ok(())),
        (ms(12_500), Err(ABSENT)),
        (ms(12_750) - ns, Err(ABSENT)),
        (ms(12_750), Ok(())),
    ] {
        bus.clock().set(at);
        assert_eq!(bus.write(HIGH, &[]), answer, "{at:?}");
    }
    assert_eq!(bus.fault_counts().of(FaultKind::NackAddress), 2);
}

#[test]
fn times_count_from_when_the_script_was_handed_over() {
    let mut bus = bus();
    bus.clock().set(ms(5_000));
    let rule = Rule {
        when: When::Between {
            from: ms(100),
            until: Some(ms(200)),
        },
        ..Rule::new(Fault::BusError)
    };
    bus.set_script(Script::new(0, vec![rule]).unwrap());
    assert_eq!(probe_at(&mut bus, 5_099), Ok(()));
    assert_eq!(probe_at(&mut bus, 5_100), Err(BusError::Bus));
    assert_eq!(probe_at(&mut bus, 5_200), Ok(()));
}

#[test]
fn a_count_is_used_up_and_every_occurrence_has_it_anew() {
    let mut bus = from_toml("[[fault]]\nkind = \"timeout\"\nevery = \"10 s\"\ncount = 2\n");
    assert_eq!(probe_at(&mut bus, 9_999), Ok(()));
    for round in 1..=3 {
        bus.clock().set(ms(10_000 * round));
        // Each attempt that times out takes its second.
        assert_eq!(bus.write(HIGH, &[]), Err(BusError::Timeout));
        assert_eq!(bus.write(HIGH, &[]), Err(BusError::Timeout));
        assert_eq!(bus.write(HIGH, &[]), Ok(()));
    }
    assert_eq!(bus.fault_counts().of(FaultKind::Timeout), 6);
}

#[test]
fn no_occurrence_begins_at_the_end_or_behind_it() {
    let mut bus = from_toml(
        "[[fault]]\nkind = \"brown-out\"\nevery = \"1 s\"\nfrom = \"2 s\"\nuntil = \"5 s\"\n",
    );
    bus.clock().set(ms(60_000));
    bus.advance();
    assert_eq!(
        bus.fault_counts().of(FaultKind::BrownOut),
        2,
        "at 3 and 4 s"
    );
}

#[test]
fn frames_of_a_frozen_sensor_are_missing_whoever_looks_when() {
    let rule = Rule {
        when: When::Between {
            from: ms(1_000),
            until: Some(ms(2_000)),
        },
        address: Some(Address::High),
        ..Rule::new(Fault::Freeze)
    };
    let mut late = following(vec![rule]);
    late.clock().set(ms(3_000));
    late.advance();
    let mut often = following(vec![rule]);
    for step in 0..300 {
        often.clock().set(ms(10 * (step + 1)));
        let shown = pixels(&mut often).unwrap()[0];
        let tick = 10 * (step + 1) / 100;
        let expected = if (10..20).contains(&tick) { 9 } else { tick };
        assert_eq!(u64::from(shown), expected);
    }
    for bus in [&late, &often] {
        assert_eq!(bus.device(Address::High).unwrap().frames(), 20);
        assert_eq!(bus.fault_counts().of(FaultKind::Freeze), 1);
    }
}

#[test]
fn a_frame_by_its_number_is_spoilt_and_no_other() {
    let text = "[[fault]]\nkind = \"pixel-glitch\"\nframe = 17\npixel = 3\nword = 0\n\
                [[fault]]\nkind = \"pixel-glitch\"\nframe = 1\npixel = 3\nword = 0xFFF\n";
    for look_every in [1, 20] {
        let mut bus = from_toml(text);
        for tick in (look_every..=40).step_by(look_every) {
            bus.clock().set(ms(100 * u64::try_from(tick).unwrap()));
            let shown = pixels(&mut bus).unwrap();
            let number = u16::try_from(tick).unwrap();
            let expected = match tick {
                1 => 0xFFF,
                17 => 0,
                _ => number,
            };
            assert_eq!((shown[2], shown[3]), (expected, number));
        }
        assert_eq!(bus.fault_counts().of(FaultKind::PixelGlitch), 2);
    }
}

#[test]
fn a_fault_by_the_number_of_a_frame_is_there_with_it() {
    let mut bus = from_toml(
        "[[fault]]\nkind = \"stuck-high\"\nframe = 5\nframes = 2\n\
         [[fault]]\nkind = \"freeze\"\nframe = 10\nduration = \"1 s\"\n",
    );
    let mut stuck = Vec::new();
    for tick in 1..=30 {
        bus.clock().set(ms(100 * tick));
        if pixels(&mut bus).unwrap() == [0xFFFF; 64] {
            stuck.push(tick);
        }
    }
    assert_eq!(stuck, [5, 6]);
    // Frozen from 1.0 s on, with frame 10 in the registers; at 2.0 s it measures again.
    assert_eq!(bus.device(Address::High).unwrap().frames(), 10 + 11);
}

#[test]
fn frames_count_from_the_script_and_on_with_a_new_sensor() {
    let rule = Rule {
        when: When::Frame(5),
        lasting: Lasting::Frames(1),
        address: Some(Address::High),
        ..Rule::new(Fault::PixelGlitch {
            pixel: PixelIndex::from_number(1),
            word: 0xFFF,
        })
    };
    let mut bus = bus();
    bus.clock().set(ms(1_000));
    bus.set_script(Script::new(0, vec![rule]).unwrap());
    bus.clock().set(ms(1_200));
    assert_eq!(pixels(&mut bus).unwrap()[0], 12);
    bus.unplug(Address::High);
    bus.clock().set(ms(1_250));
    bus.plug(Address::High, COUNTING, Options::default());
    bus.clock().set(ms(1_350));
    assert_eq!(pixels(&mut bus).unwrap()[0], 13, "its first, our third");
    bus.clock().set(ms(1_450));
    assert_eq!(pixels(&mut bus).unwrap()[0], 14, "its second, our fourth");
    bus.clock().set(ms(1_550));
    assert_eq!(pixels(&mut bus).unwrap()[0], 0xFFF, "its third, our fifth");
    bus.clock().set(ms(1_650));
    assert_eq!(pixels(&mut bus).unwrap()[0], 16);
}

#[test]
fn faults_of_one_address_leave_the_other_alone() {
    let mut bus = from_toml("[[fault]]\nkind = \"unplugged\"\naddress = 0x68\n");
    bus.plug(Address::Low, COUNTING, Options::default());
    assert_eq!(bus.write(HIGH, &[]), Ok(()));
    assert!(bus.write(0x68, &[]).is_err());
    assert_eq!(bus.device(Address::Low).unwrap().next_tick_at(), None);
}

#[test]
fn buses_take_their_own_rules_and_draw_apart() {
    let script = Script::from_toml(
        "[[fault]]\nkind = \"nack-address\"\nprobability = 0.5\n\
         [[fault]]\nkind = \"stuck-high\"\nbus = 3\n",
        "test.toml",
    )
    .unwrap();
    let run = |number| {
        let mut bus = bus();
        bus.set_script(script.for_bus(number));
        let hits: Vec<bool> = (0..64).map(|_| bus.write(HIGH, &[]).is_err()).collect();
        let stuck = bus.faults(Address::High).contains(FaultKind::StuckHigh);
        (hits, stuck)
    };
    assert!(!run(1).1 && run(3).1);
    assert_eq!(run(1), run(1));
    assert_ne!(run(1).0, run(3).0);
}

/// Each fault draws from a stream of its own, at places that say what they are about.
#[test]
fn a_fault_that_is_added_changes_nothing_about_the_others() {
    let half = Chance::new(0.5).unwrap();
    let nack = Rule {
        chance: half,
        ..Rule::new(Fault::NackAddress)
    };
    let flip = Rule {
        chance: half,
        ..Rule::new(Fault::BitFlip {
            register: None,
            byte: None,
            bit: None,
        })
    };
    let hits = |rules| {
        let mut bus = following(rules);
        (0..200)
            .map(|_| bus.write(HIGH, &[0x20]).is_err())
            .collect::<Vec<_>>()
    };
    assert_eq!(hits(vec![nack]), hits(vec![nack, flip]));
    assert_ne!(hits(vec![nack]), hits(vec![flip, nack]));
}

/// Of 4,000 stretches at three quarters: 3,000, standard deviation 27.
#[test]
fn a_stretch_is_drawn_once() {
    let rule = Rule {
        when: When::Every {
            period: ms(10),
            from: Duration::ZERO,
            until: None,
        },
        lasting: Lasting::For(ms(5)),
        chance: Chance::new(0.75).unwrap(),
        address: Some(Address::High),
        ..Rule::new(Fault::Unplugged)
    };
    let mut bus = following(vec![rule]);
    let mut absent = 0;
    for occurrence in 1..=4_000 {
        let first = probe_at(&mut bus, 10 * occurrence);
        assert_eq!(first, probe_at(&mut bus, 10 * occurrence + 4), "throughout");
        assert_eq!(probe_at(&mut bus, 10 * occurrence + 5), Ok(()));
        absent += u64::from(first.is_err());
    }
    assert!(absent.abs_diff(3_000) < 6 * 28, "{absent}");
    assert_eq!(bus.fault_counts().of(FaultKind::Unplugged), absent);
}

#[test]
fn faults_by_call_stand_beside_the_script_and_outlive_it() {
    let mut bus = following(vec![Rule::new(Fault::AllZero)]);
    bus.set_fault(Address::High, Fault::Freeze);
    let both: Vec<_> = bus.faults(Address::High).iter().collect();
    assert_eq!(both, [FaultKind::AllZero, FaultKind::Freeze]);
    bus.clear_fault(Address::High);
    bus.set_fault(Address::High, Fault::StuckHigh);
    bus.clear_script();
    let rest: Vec<_> = bus.faults(Address::High).iter().collect();
    assert_eq!(rest, [FaultKind::StuckHigh]);
}

/// The example, followed by a reader every 50 ms: twice the same, and every kind at the times that it names.
#[test]
fn the_example_is_followed_to_the_letter() {
    let run = |seed: Option<u64>| {
        let script = Script::from_toml(EXAMPLE, "faults.toml").unwrap();
        let script = seed.map_or(script.clone(), |seed| script.with_seed(seed));
        let mut bus = bus().with_scl_hz(400_000.try_into().unwrap());
        let seen = Arc::new(Mutex::new(Vec::new()));
        let shared = Arc::clone(&seen);
        bus.set_trace(move |transfer| {
            let faults = transfer.faults;
            shared.lock().unwrap().push((transfer.started, faults));
        });
        bus.set_script(script.for_bus(1));
        let mut answers = Vec::new();
        while bus.clock().now() < ms(39_900) {
            bus.clock().advance(ms(50));
            answers.push(pixels(&mut bus));
        }
        let counts = bus.fault_counts();
        drop(bus);
        let seen = seen.lock().unwrap().clone();
        (answers, counts, seen)
    };
    let (answers, counts, seen) = run(None);
    assert_eq!((answers.clone(), counts, seen.clone()), run(None));
    assert_ne!(answers, run(Some(8)).0);

    let times = |kind| {
        let hits = seen.iter().filter(move |(_, faults)| faults.contains(kind));
        let times: Vec<f64> = hits.map(|(time, _)| time.as_secs_f64()).collect();
        (times[0], times[times.len() - 1])
    };
    let stretches = [
        (FaultKind::NackAddress, 1.0, 4.0),
        (FaultKind::Hang, 5.0, 7.0),
        (FaultKind::BusError, 10.0, 40.0),
        (FaultKind::PixelGlitch, 7.9, 9.3),
        (FaultKind::ClockError, 18.0, 22.0),
        (FaultKind::Torn, 18.0, 19.0),
        (FaultKind::Unplugged, 24.0, 27.0),
        (FaultKind::AdapterGone, 33.0, 34.0),
        (FaultKind::BrownOut, 15.0, 15.1),
    ];
    for (kind, from, until) in stretches {
        let (first, last) = times(kind);
        assert!(
            from <= first && last < until + 0.1,
            "{kind}: {first} to {last}"
        );
    }
    for (kind, exactly) in [
        (FaultKind::BusError, 6),
        (FaultKind::PixelGlitch, 3),
        (FaultKind::BrownOut, 1),
        (FaultKind::Unplugged, 1),
        (FaultKind::AdapterGone, 1),
        (FaultKind::ClockError, 1),
    ] {
        assert_eq!(counts.of(kind), exactly, "{kind}");
    }
    for kind in [FaultKind::NackAddress, FaultKind::BitFlip, FaultKind::Torn] {
        assert!(counts.of(kind) > 0, "{kind}");
    }
    let gone = answers
        .iter()
        .filter(|answer| **answer == Err(BusError::Gone));
    assert_eq!(gone.count(), 20, "a second at 20 a second");
}

#[test]
fn the_documents_first_example_is_a_script() {
    let document = include_str!("../scripts/README.md");
    let example = document
        .split("```toml\n")
        .nth(1)
        .and_then(|rest| rest.split("```").next())
        .unwrap();
    let script = Script::from_toml(example, "README.md").unwrap();
    let expected = Rule {
        when: When::Between {
            from: ms(1_000),
            until: Some(ms(4_000)),
        },
        chance: Chance::new(0.05).unwrap(),
        address: Some(Address::High),
        ..Rule::new(Fault::NackAddress)
    };
    assert_eq!(script.seed(), 7);
    assert_eq!(script.rules().collect::<Vec<_>>(), [&expected]);
}

/// The table of the document has every kind with its unit.
#[test]
fn the_document_knows_every_kind() {
    let document = include_str!("../scripts/README.md");
    for kind in FaultKind::ALL {
        let row = document
            .lines()
            .find(|line| line.starts_with(&format!("| `{kind}` |")))
            .unwrap();
        let unit = format!("{:?}", kind.unit()).to_lowercase();
        assert!(row.contains(&format!("| {unit} |")), "{row}");
    }
}

fn hang(fields: &str) -> String {
    error(&format!("[[fault]]\nkind = \"hang\"\n{fields}\n"))
}

fn error(text: &str) -> String {
    Script::from_toml(text, "f.toml").unwrap_err().to_string()
}

#[test]
fn what_is_wrong_with_a_time_is_said_with_its_place() {
    let rows = [
        (
            hang("at = \"12 s\""),
            "f.toml:1:1: fault 1, `duration`: it is not said how long it lasts\nhint: add `duration = \"2 s\"`, `frames = 3` or `count = 1`; or write `from` instead of `at`",
        ),
        (
            hang("at = \"12\"\nduration = \"1 s\""),
            "f.toml:3:6: fault 1, `at`: `12` is no time\nhint: a number and a unit (ns, us, ms, s, min, h), like \"12.5 s\"",
        ),
        (
            hang("at = 12\nduration = \"1 s\""),
            "f.toml:3:6: invalid type: integer `12`, expected a string\nhint: times and kinds stand in quotes: at = \"12.5 s\", kind = \"hang\"",
        ),
        (
            hang("duration = \"1 s\""),
            "f.toml:3:12: fault 1, `duration`: has no beginning\nhint: add `at = \"12.5 s\"`, `frame = 17` or `every = \"10 s\"`",
        ),
        (
            hang("from = \"1 s\"\nframes = 2"),
            "f.toml:4:10: fault 1, `frames`: has no beginning\nhint: add `at = \"12.5 s\"`, `frame = 17` or `every = \"10 s\"`",
        ),
        (
            hang("at = \"1 s\"\nframe = 3"),
            "f.toml:4:9: fault 1, `frame`: cannot stand beside `at`\nhint: one of `at`, `frame`, `every`, or `from` and `until`, says when",
        ),
        (
            hang("until = \"1 s\"\nframe = 3"),
            "f.toml:3:9: fault 1, `until`: cannot stand beside `frame`\nhint: one of `at`, `frame`, `every`, or `from` and `until`, says when",
        ),
        (
            hang("at = \"1 s\"\ncount = 3\nduration = \"1 s\""),
            "f.toml:4:9: fault 1, `count`: cannot stand beside `duration`\nhint: one of `duration`, `frames`, `count` says how long",
        ),
        (
            hang("from = \"5 s\"\nuntil = \"5 s\""),
            "f.toml:4:9: fault 1, `until`: is not after `from`\nhint: a time after it, like \"20 s\"",
        ),
        (
            hang("at = \"1 s\"\nduration = \"0 s\""),
            "f.toml:4:12: fault 1, `duration`: `0 s` is too short\nhint: 1ns at least",
        ),
        (
            hang("every = \"10 us\"\ncount = 1"),
            "f.toml:3:9: fault 1, `every`: `10 us` is too short\nhint: 1ms at least",
        ),
        (
            hang("frame = 0"),
            "f.toml:3:9: fault 1, `frame`: 0 is not within 1 to 9223372036854775807\nhint: frames count from 1",
        ),
    ];
    for (found, expected) in rows {
        assert_eq!(found, expected);
    }
}

#[test]
fn what_is_wrong_with_a_field_is_said_with_its_place() {
    let rows = [
        (
            hang("probability = 1.5"),
            "f.toml:3:15: fault 1, `probability`: 1.5 is no probability\nhint: 0 to 1",
        ),
        (
            hang("address = 0x69"),
            "f.toml:3:11: fault 1, `address`: `hang` is of the whole bus\nhint: leave it out",
        ),
        (
            hang("pixel = 3"),
            "f.toml:3:9: fault 1, `pixel`: `hang` has no such field\nhint: it belongs to torn, pixel-glitch",
        ),
        (
            hang("bus = -1"),
            "f.toml:3:7: fault 1, `bus`: -1 is not within 0 to 4294967295\nhint: the N of /dev/i2c-N",
        ),
        (
            error("seed = 1\n\n[[fault]]\nkind = \"nack-address\"\naddress = 0x40\n"),
            "f.toml:5:11: fault 1, `address`: no sensor can have 0x40\nhint: 0x68 or 0x69",
        ),
        (
            error(
                "[[fault]]\nkind = \"freeze\"\n[[fault]]\nkind = \"pixel-glitch\"\npixel = 65\nword = 0\n",
            ),
            "f.toml:5:9: fault 2, `pixel`: 65 is not within 1 to 64\nhint: pixels are numbered 1 to 64: `pixel = 28`",
        ),
        (
            error("[[fault]]\nkind = \"pixel-glitch\"\nframe = 3\n"),
            "f.toml:1:1: fault 1, `word`: `pixel-glitch` needs it, and it is not there\nhint: twelve bits as the register has them: `word = 0xFFF`, or 0x000 for 0.0 °C",
        ),
        (
            error("[[fault]]\nkind = \"freeze\"\nfrom = \"1 s\"\ncount = 3\n"),
            "f.toml:4:9: fault 1, `count`: `freeze` is a stretch of time, of which there is nothing to count\nhint: `duration` or `frames` says how long",
        ),
        (
            error("[[fault]]\nkind = \"brown-out\"\nat = \"1 s\"\nduration = \"1 s\"\n"),
            "f.toml:4:12: fault 1, `duration`: `brown-out` is a moment\nhint: a supply that stays away is `unplugged`",
        ),
        (
            error("[[fault]]\nkind = \"brown-out\"\nfrom = \"1 s\"\n"),
            "f.toml:1:1: fault 1, `at`: `brown-out` is a moment, and it is not said which\nhint: add `at = \"12.5 s\"`, `frame = 17` or `every = \"10 s\"`",
        ),
    ];
    for (found, expected) in rows {
        assert_eq!(found, expected);
    }
}

#[test]
fn what_is_no_script_at_all_is_said_with_its_place() {
    let starts = [
        (
            "[[fault]]\nkind = \"nack\"\n",
            "f.toml:2:8: fault 1, `kind`: there is no `nack`\nhint: one of nack-address, nack-byte, ",
        ),
        (
            "[[fault]]\nkind = \"hang\"\nknid = 1\n",
            "f.toml:3:1: unknown field `knid`, expected one of `kind`, `at`",
        ),
        (
            "sede = 1\n",
            "f.toml:1:1: unknown field `sede`, expected `seed` or `fault`",
        ),
        (
            "[[fault]]\nat = \"1 s\"\n",
            "f.toml:1:1: missing field `kind`\nhint: every [[fault]] says what breaks",
        ),
        (
            "seed = -1\n",
            "f.toml:1:8: invalid value: integer `-1`, expected u64",
        ),
        (
            "fault = 3\n",
            "f.toml:1:9: invalid type: integer `3`, expected a sequence",
        ),
        ("[[fault]\n", "f.toml:1:"),
        ("kind = \"a\nb\"", "f.toml:"),
    ];
    for (text, start) in starts {
        let found = error(text);
        assert!(found.starts_with(start), "{text:?}: {found}");
        assert!(!found.ends_with('.'), "{found}");
    }
}

#[test]
fn scripts_are_bounded() {
    let rules = vec![Rule::new(Fault::Hang); RULES_MAX];
    assert!(Script::new(0, rules.clone()).is_ok());
    let text = "[[fault]]\nkind = \"hang\"\n".repeat(RULES_MAX + 1);
    let found = RULES_MAX + 1;
    let too_many = Err(ScriptError::TooManyRules { found });
    assert_eq!(Script::from_toml(&text, "f.toml"), too_many);
    let mut rules = rules;
    rules.push(Rule::new(Fault::Hang));
    assert_eq!(Script::new(0, rules), too_many);

    let long = "#".repeat(SCRIPT_BYTES_MAX);
    assert!(Script::from_toml(&long, "f.toml").is_ok());
    assert_eq!(
        error(&format!("{long}#")),
        format!(
            "f.toml: {} bytes are more than the {SCRIPT_BYTES_MAX} of a script\nhint: this is some other file",
            SCRIPT_BYTES_MAX + 1
        )
    );
}

#[test]
fn rules_from_rust_are_checked_too() {
    let every = Rule {
        when: When::Every {
            period: EVERY_MIN - Duration::from_nanos(1),
            from: Duration::ZERO,
            until: None,
        },
        ..Rule::new(Fault::Hang)
    };
    let counted = Rule {
        lasting: Lasting::Times(3),
        ..Rule::new(Fault::Freeze)
    };
    let long = Rule {
        lasting: Lasting::For(ms(3)),
        ..Rule::new(Fault::BrownOut)
    };
    let fine = Rule::new(Fault::Hang);
    for rule in [every, counted, long] {
        let error = Script::new(0, vec![fine, rule]).unwrap_err();
        assert!(
            matches!(error, ScriptError::Rule { number: 2, .. }),
            "{error}"
        );
    }
}

/// All the rules that there can be are active at once, and each has its place.
#[test]
fn as_many_faults_at_once_as_there_can_be_rules() {
    let rules: Vec<Rule> = (0..RULES_MAX)
        .map(|slot| Rule {
            lasting: Lasting::Times(1),
            ..Rule::new(Fault::BitFlip {
                register: Some(u8::try_from(slot).unwrap()),
                byte: None,
                bit: Some(0),
            })
        })
        .collect();
    let mut bus = following(rules);
    let mut bytes = [0; 256];
    bus.write_read(HIGH, &[0x00], &mut bytes).unwrap();
    let flipped = bytes.iter().filter(|byte| **byte == 1).count();
    assert_eq!(flipped, RULES_MAX);
    bus.write_read(HIGH, &[0x00], &mut bytes).unwrap();
    assert_eq!(bytes, [0; 256], "each of them once");
}

/// When nobody has looked for longer than is gone through one by one, time still comes to where it is.
#[test]
fn a_long_absence_is_left_out_and_the_script_goes_on_where_it_then_is() {
    let every = |period, lasting, fault| Rule {
        when: When::Every {
            period,
            from: Duration::ZERO,
            until: None,
        },
        lasting,
        ..Rule::new(fault)
    };
    let long = EVERY_MIN * STEPS_MAX * 3 + ms(100_000);
    let mut bus = following(vec![
        every(EVERY_MIN, Lasting::Times(1), Fault::BusError),
        every(ms(10_000), Lasting::For(ms(5_000)), Fault::NackAddress),
    ]);
    bus.clock().set(long - Duration::from_micros(500));
    assert_eq!(bus.write(HIGH, &[]), Err(BusError::Bus));
    assert_eq!(
        bus.write(HIGH, &[]),
        Ok(()),
        "the second half of ten seconds"
    );
    bus.clock().set(long + ms(10_000));
    assert_eq!(bus.write(HIGH, &[]), Err(BusError::Bus));
    assert_eq!(bus.write(HIGH, &[]), Err(ABSENT));
}

fn any_fault() -> impl Strategy<Value = Fault> {
    let pixel = (0_usize..=64).prop_map(PixelIndex::from_number);
    prop_oneof![
        prop::sample::select(vec![
            Fault::NackAddress,
            Fault::BusError,
            Fault::ArbitrationLoss,
            Fault::Timeout,
            Fault::Hang,
            Fault::StuckHigh,
            Fault::AllZero,
            Fault::BrownOut,
            Fault::FastWake,
            Fault::Freeze,
            Fault::Unplugged,
            Fault::AdapterGone,
        ]),
        any::<u16>().prop_map(Fault::NackByte),
        (any::<u16>(), any::<u8>()).prop_map(|(byte, bit)| Fault::ShortClock { byte, bit }),
        any::<(Option<u8>, Option<u16>, Option<u8>)>().prop_map(|(register, byte, bit)| {
            Fault::BitFlip {
                register,
                byte,
                bit,
            }
        }),
        pixel.clone().prop_map(|pixel| Fault::Torn { pixel }),
        (pixel, any::<u16>()).prop_map(|(pixel, word)| Fault::PixelGlitch { pixel, word }),
        any::<u16>().prop_map(|word| Fault::ThermistorFailure { word }),
        any::<i32>().prop_map(|ppm| Fault::ClockError { ppm }),
        (1..=u32::MAX).prop_map(|hz| Fault::SclSpeed {
            hz: hz.try_into().unwrap()
        }),
    ]
}

/// Times of a script, mostly within its first 20 s, and now and then anything.
fn any_time() -> impl Strategy<Value = Duration> {
    prop_oneof![
        20 => (0_u64..20_000).prop_map(ms),
        1 => any::<u64>().prop_map(Duration::from_nanos),
        1 => Just(Duration::MAX),
    ]
}

fn any_when() -> impl Strategy<Value = When> {
    prop_oneof![
        Just(When::Always),
        any_time().prop_map(When::At),
        (any_time(), prop::option::of(any_time()))
            .prop_map(|(from, until)| When::Between { from, until }),
        (any_time(), any_time(), prop::option::of(any_time())).prop_map(|(period, from, until)| {
            When::Every {
                period,
                from,
                until,
            }
        }),
        (0_u64..200).prop_map(When::Frame),
    ]
}

fn any_lasting() -> impl Strategy<Value = Lasting> {
    prop_oneof![
        Just(Lasting::ToTheEnd),
        any_time().prop_map(Lasting::For),
        (0_u32..30).prop_map(Lasting::Frames),
        (0_u32..30).prop_map(Lasting::Times),
    ]
}

prop_compose! {
    fn any_rule()(
        fault in any_fault(),
        when in any_when(),
        lasting in any_lasting(),
        chance in 0.0..=1.0_f64,
        address in prop::option::of(prop::sample::select(Address::ALL.to_vec())),
    ) -> Rule {
        Rule { fault, when, lasting, chance: Chance::new(chance).unwrap(), address, bus: None }
    }
}

#[derive(Debug, Clone)]
enum Act {
    Wait(Duration),
    Read(u8, u8, usize),
    Write(u8, Vec<u8>),
    Replug(Address),
    Call(Address, Fault),
}

fn any_act() -> impl Strategy<Value = Act> {
    let to = prop::sample::select(vec![0x69_u8, 0x69, 0x68, 0x42]);
    let place = prop::sample::select(Address::ALL.to_vec());
    prop_oneof![
        6 => (0_u64..2_000).prop_map(|wait| Act::Wait(ms(wait))),
        6 => (to.clone(), any::<u8>(), 0_usize..140).prop_map(|(to, from, count)| Act::Read(to, from, count)),
        3 => (to, prop::collection::vec(any::<u8>(), 0..5)).prop_map(|(to, bytes)| Act::Write(to, bytes)),
        1 => place.clone().prop_map(Act::Replug),
        1 => (place, any_fault()).prop_map(|(place, fault)| Act::Call(place, fault)),
    ]
}

/// What a reader saw: the answer and the bytes.
type Seen = (Result<(), BusError>, Vec<u8>);

fn play(rules: &[Rule], acts: &[Act], seed: u64) -> (TestBus, Vec<Seen>, FaultCounts) {
    let mut bus = bus().with_scl_hz(400_000.try_into().unwrap());
    bus.plug(Address::Low, COUNTING, Options::default());
    if let Ok(script) = Script::new(seed, rules.to_vec()) {
        bus.set_script(script);
    }
    let mut seen = Vec::new();
    for act in acts {
        let mut bytes = Vec::new();
        let answer = match act {
            Act::Wait(time) => {
                bus.clock().advance(*time);
                Ok(())
            }
            Act::Read(to, from, count) => {
                bytes = vec![0xA5; *count];
                bus.write_read(*to, &[*from], &mut bytes)
            }
            Act::Write(to, bytes) => bus.write(*to, bytes),
            Act::Replug(address) => {
                bus.unplug(*address);
                bus.plug(*address, COUNTING, Options::default());
                Ok(())
            }
            Act::Call(address, fault) => {
                bus.set_fault(*address, *fault);
                Ok(())
            }
        };
        seen.push((answer, bytes));
    }
    let counts = bus.fault_counts();
    (bus, seen, counts)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn scripts_are_deterministic_and_leave_nothing_behind(
        rules in prop::collection::vec(any_rule(), 0..8),
        acts in prop::collection::vec(any_act(), 0..40),
        seed in any::<u64>(),
    ) {
        let (mut bus, seen, counts) = play(&rules, &acts, seed);
        let (_, again, counts_again) = play(&rules, &acts, seed);
        prop_assert_eq!(seen, again);
        prop_assert_eq!(counts, counts_again);

        bus.clear_script();
        for address in Address::ALL {
            prop_assert!(bus.clear_fault(address));
        }
        for address in Address::ALL {
            prop_assert!(bus.faults(address).is_empty());
            prop_assert!(bus.set_fault(address, Fault::BrownOut));
        }
        let now = bus.clock().now();
        let mut image = [0xA5; 256];
        for address in Address::ALL {
            bus.write_read(address.bits(), &[0x00], &mut image).unwrap();
            prop_assert_eq!(image, [0; 256]);
        }
        let before = bus.device(Address::High).unwrap().frames();
        bus.clock().set(now + ms(2_050));
        bus.advance();
        prop_assert_eq!(bus.device(Address::High).unwrap().frames() - before, 20);
    }

    /// Whatever a file holds, the answer is a script or an error with its place.
    #[test]
    fn any_text_is_a_script_or_an_error(text in ".{0,200}") {
        if let Err(error) = Script::from_toml(&text, "f.toml") {
            prop_assert!(error.to_string().starts_with("f.toml:"));
        }
    }

    /// Nearly scripts: known keys with unlikely values.
    #[test]
    fn any_fields_are_a_script_or_an_error(
        fields in prop::collection::vec((field(), value()), 0..6),
        kind in prop::sample::select(FaultKind::ALL.to_vec()),
    ) {
        let mut text = format!("[[fault]]\nkind = \"{kind}\"\n");
        for (field, value) in &fields {
            text.push_str(&format!("{field} = {value}\n"));
        }
        match Script::from_toml(&text, "f.toml") {
            Err(error) => prop_assert!(error.to_string().starts_with("f.toml:")),
            Ok(script) => {
                let rules: Vec<Rule> = script.rules().copied().collect();
                prop_assert_eq!(rules.len(), 1);
                play(&rules, &[Act::Wait(ms(3_000)), Act::Read(HIGH, 0x80, 128)], 1);
            }
        }
    }
}

fn field() -> impl Strategy<Value = &'static str> {
    prop::sample::select(vec![
        "at",
        "from",
        "until",
        "every",
        "frame",
        "duration",
        "frames",
        "count",
        "probability",
        "address",
        "bus",
        "byte",
        "bit",
        "register",
        "pixel",
        "word",
        "ppm",
        "hz",
        "seed",
    ])
}

fn value() -> impl Strategy<Value = String> {
    let times = vec![
        "\"1 s\"",
        "\"2.5 ms\"",
        "\"0 s\"",
        "\"99999999999 h\"",
        "\"7 ns\"",
        "\"x\"",
    ];
    prop_oneof![
        3 => prop::sample::select(times).prop_map(String::from),
        3 => prop::sample::select(vec!["0x68", "0x69", "0", "1", "64", "0xFFF", "0.5"]).prop_map(String::from),
        1 => any::<i64>().prop_map(|number| number.to_string()),
        1 => any::<f64>().prop_map(|number| format!("{number:e}")),
        1 => Just("nan".to_owned()),
        1 => Just("[]".to_owned()),
    ]
}
