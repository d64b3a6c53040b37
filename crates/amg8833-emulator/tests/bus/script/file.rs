//! Scripts from text: the example, the document, and every error.

use super::support::*;
use amg8833_emulator::script::{
    EVERY_MIN, Lasting, RULES_MAX, Rule, SCRIPT_BYTES_MAX, Script, ScriptError, When,
};
use amg8833_emulator::{Address, BusError, Chance, Clock, Fault, FaultKind};
use core::time::Duration;
use std::sync::{Arc, Mutex};

/// Runs the example with a read every 50 ms: two runs agree, and every kind strikes at its times.
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
    let document = include_str!("../../../scripts/README.md");
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

/// The document's table lists every kind with its unit.
#[test]
fn the_document_knows_every_kind() {
    let document = include_str!("../../../scripts/README.md");
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
fn an_invalid_time_is_reported_with_its_place() {
    let rows = [
        (
            hang("at = \"12 s\""),
            "f.toml:1:1: fault 1, `duration`: does not say how long the fault lasts\nhint: add `duration = \"2 s\"`, `frames = 3` or `count = 1`; or write `from` instead of `at`",
        ),
        (
            hang("at = \"12\"\nduration = \"1 s\""),
            "f.toml:3:6: fault 1, `at`: `12` is not a time\nhint: a number and a unit (ns, us, ms, s, min, h), like \"12.5 s\"",
        ),
        (
            hang("at = 12\nduration = \"1 s\""),
            "f.toml:3:6: invalid type: integer `12`, expected a string\nhint: put times and kinds in quotes: at = \"12.5 s\", kind = \"hang\"",
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
            "f.toml:4:9: fault 1, `frame`: cannot be combined with `at`\nhint: one of `at`, `frame`, `every`, or `from` and `until`, says when",
        ),
        (
            hang("until = \"1 s\"\nframe = 3"),
            "f.toml:3:9: fault 1, `until`: cannot be combined with `frame`\nhint: one of `at`, `frame`, `every`, or `from` and `until`, says when",
        ),
        (
            hang("at = \"1 s\"\ncount = 3\nduration = \"1 s\""),
            "f.toml:4:9: fault 1, `count`: cannot be combined with `duration`\nhint: one of `duration`, `frames`, `count` says how long",
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
fn an_invalid_field_is_reported_with_its_place() {
    let rows = [
        (
            hang("probability = 1.5"),
            "f.toml:3:15: fault 1, `probability`: 1.5 is not a probability\nhint: 0 to 1",
        ),
        (
            hang("address = 0x69"),
            "f.toml:3:11: fault 1, `address`: `hang` affects the whole bus\nhint: leave it out",
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
            "f.toml:1:1: fault 1, `word`: `pixel-glitch` requires this field\nhint: the twelve bits of the register: `word = 0xFFF`, or 0x000 for 0.0 °C",
        ),
        (
            error("[[fault]]\nkind = \"freeze\"\nfrom = \"1 s\"\ncount = 3\n"),
            "f.toml:4:9: fault 1, `count`: `freeze` lasts, so there is nothing to count\nhint: `duration` or `frames` says how long",
        ),
        (
            error("[[fault]]\nkind = \"brown-out\"\nat = \"1 s\"\nduration = \"1 s\"\n"),
            "f.toml:4:12: fault 1, `duration`: `brown-out` has no length\nhint: for a lasting loss of power, use `unplugged`",
        ),
        (
            error("[[fault]]\nkind = \"brown-out\"\nfrom = \"1 s\"\n"),
            "f.toml:1:1: fault 1, `at`: `brown-out` has no time\nhint: add `at = \"12.5 s\"`, `frame = 17` or `every = \"10 s\"`",
        ),
    ];
    for (found, expected) in rows {
        assert_eq!(found, expected);
    }
}

#[test]
fn an_invalid_file_is_reported_with_its_place() {
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
            "f.toml:1:1: missing field `kind`\nhint: every [[fault]] needs a kind",
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
    let too_many = Err(ScriptError::TooManyRules(RULES_MAX + 1));
    assert_eq!(Script::from_toml(&text, "f.toml"), too_many);
    let mut rules = rules;
    rules.push(Rule::new(Fault::Hang));
    assert_eq!(Script::new(0, rules), too_many);

    let long = "#".repeat(SCRIPT_BYTES_MAX);
    assert!(Script::from_toml(&long, "f.toml").is_ok());
    assert_eq!(
        error(&format!("{long}#")),
        format!(
            "f.toml: {} bytes, at most {SCRIPT_BYTES_MAX} are possible\nhint: is this a fault script?",
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
        assert!(matches!(error, ScriptError::Rule(2, _)), "{error}");
    }
}
