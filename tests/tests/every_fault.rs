//! Every fault that a sensor and its bus were seen to have, each on a bus of its own under one agent, followed to the
//! collector: the rows with their reason, the counts by kind in the audit and on the live page's data, and what the
//! others lose by it: nothing.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "what fails in a helper fails the test"
)]

use grideye_tests::emulated::{Way, Words, recording, run_emulated};
use grideye_tests::programs::{RunningCollector, grideye_agent};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

/// One fault, as the emulator has it and as the agent has to see it.
struct Case {
    /// In the script of faults, without bus and time.
    fault: &'static str,
    /// From 1.5 s after the first transfer on to this, in seconds.
    until_s: f64,
    /// The kind under which it is counted.
    counted: &'static str,
    /// The reason of the rows; none for what costs no frame.
    row: Option<&'static str>,
    /// How many rows there have to be, at least and at most.
    rows: (usize, usize),
}

const fn case(
    fault: &'static str,
    until_s: f64,
    counted: &'static str,
    rows: (usize, usize),
) -> Case {
    let row = if rows.1 == 0 { None } else { Some(counted) };
    Case {
        fault,
        until_s,
        counted,
        row,
        rows,
    }
}

/// Frames of each sensor.
const FRAMES: usize = 160;
/// Where nothing fails.
const SOUND: [usize; 2] = [0, 8];

/// The reference's list; a second of each, which is ten frames, and what the pauses between attempts and the set-up
/// behind it take.
fn cases() -> Vec<Case> {
    let sound = || case("", 0.0, "", (0, 0));
    vec![
        sound(),
        case("kind = \"nack-address\"", 2.5, "nack", (3, 40)),
        case("kind = \"bus-error\"", 2.5, "bus-error", (3, 40)),
        case("kind = \"timeout\"", 2.5, "bus-timeout", (3, 40)),
        case("kind = \"hang\"", 2.5, "bus-timeout", (3, 40)),
        // The sensor is pulled out and put back: it has lost its settings.
        case("kind = \"unplugged\"", 2.5, "nack", (3, 40)),
        // The adapter is.
        case("kind = \"adapter-gone\"", 2.5, "unplugged", (3, 40)),
        // Found when the settings are read back, every five seconds.
        case("kind = \"brown-out\"", 0.0, "wrong-configuration", (0, 20)),
        sound(),
        // A hundred equal frames are believed.
        case("kind = \"freeze\"", 14.0, "frozen", (0, 30)),
        case("kind = \"stuck-high\"", 2.5, "stuck-high", (3, 40)),
        case("kind = \"all-zero\"", 2.5, "all-zero", (3, 40)),
        case(
            "kind = \"pixel-glitch\"\nword = 0x000",
            2.5,
            "glitch-pixel",
            (0, 0),
        ),
        case(
            "kind = \"pixel-glitch\"\nword = 0xFFF",
            2.5,
            "glitch-pixel",
            (0, 0),
        ),
        // Somebody else's bit in the register of the frame rate, as it is read back.
        case(
            "kind = \"bit-flip\"\nregister = 0x02\nbit = 0",
            8.0,
            "wrong-configuration",
            (0, 60),
        ),
        // One bit in twelve milliseconds: a transfer that does not come back for twelve seconds.
        Case {
            row: Some("bus-timeout"),
            ..case("kind = \"scl-speed\"\nhz = 100", 2.0, "bus-hung", (90, 160))
        },
    ]
}

/// Frames without glitches, none like the one before.
fn frame(index: usize) -> Words {
    Words {
        pixels: std::array::from_fn(|pixel| {
            u16::try_from(80 + (5 * index + 3 * pixel) % 64).unwrap()
        }),
        thermistor: 400,
    }
}

fn script(folder: &Path) -> String {
    let mut text = String::new();
    for (bus, case) in (1..).zip(cases()) {
        if case.fault.is_empty() {
            continue;
        }
        let when = if case.until_s == 0.0 {
            "at = \"1.5 s\"".to_owned()
        } else {
            format!("from = \"1.5 s\"\nuntil = \"{} s\"", case.until_s)
        };
        write!(text, "[[fault]]\n{}\nbus = {bus}\n{when}\n", case.fault).unwrap();
    }
    let path = folder.join("faults.toml");
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn every_fault_is_counted_by_kind_at_the_collector_and_costs_the_others_nothing() {
    std::thread::scope(|scope| {
        for way in Way::to_a_device_file("every fault under one agent") {
            scope.spawn(move || every_fault(way));
        }
    });
}

fn every_fault(way: Way) {
    let folder = tempfile::tempdir().unwrap();
    let source = recording(folder.path(), "source.csv", (0..1024).map(frame));
    let script = script(folder.path());
    let collector = RunningCollector::start(folder.path());
    let id = collector.start_recording("faults");
    let mut options: Vec<String> = [
        "--recording",
        source.to_str().unwrap(),
        "--replay",
        "frames",
        "--faults",
        &script,
    ]
    .map(str::to_owned)
    .to_vec();
    let mut config = format!("device = \"pi-1\"\ncollector = \"{}\"\n", collector.url());
    for bus in 1..=cases().len() {
        options.extend(["--sensor".to_owned(), format!("s{bus}={bus}:0x69")]);
        write!(
            config,
            "[[bus]]\npath = \"/dev/i2c-{bus}\"\n[[bus.sensor]]\naddress = 0x69\n"
        )
        .unwrap();
    }
    let path = folder.path().join("agent.toml");
    std::fs::write(&path, config).unwrap();
    let mut agent = Command::new(grideye_agent().get_program());
    agent
        .args(["run", "--frames", &FRAMES.to_string(), "--config"])
        .arg(&path);
    let ended = run_emulated(way, &options, &agent);
    assert_eq!(ended.code, 3, "{way:?}: data were lost: {ended:?}");

    let audit = by_sensor(&collector.json("/v1/audit")["streams"]);
    let live = by_sensor(&collector.json("/v1/sensors")["sensors"]);
    let csv = collector.recording_csv(id);
    for (sensor, stream) in &audit {
        println!(
            "{way:?}, {sensor}: missing {}, {}",
            stream["missing"], stream["errors"]
        );
    }
    for (index, case) in cases().iter().enumerate() {
        let sensor = format!("i2c-{}:0x69", index + 1);
        let context = format!("{way:?}, {sensor}, {}", case.fault.replace('\n', ", "));
        let stream = &audit[&sensor];
        assert_eq!(stream["balanced"], true, "{context}: {stream}");
        assert_eq!(stream["stored"], FRAMES, "{context}");
        assert_eq!(stream["errors"], live[&sensor]["errors"], "{context}");
        holds(case, index, stream, &missing(&csv, &sensor), &context);
    }
    assert!(
        ended.stderr.contains("/dev/i2c-16: hangs in a transfer"),
        "{}",
        ended.stderr
    );
}

fn holds(case: &Case, index: usize, stream: &Value, rows: &[String], context: &str) {
    assert_eq!(stream["missing"], rows.len(), "{context}");
    if SOUND.contains(&index) {
        // What a host that is busy costs is no fault of the others.
        assert!(
            rows.iter().all(|why| why == "host-stalled"),
            "{context}: {rows:?}"
        );
        return;
    }
    let count = stream["errors"][case.counted].as_u64().unwrap_or(0);
    assert!(count > 0, "{context}: {stream}");
    let with_reason = rows
        .iter()
        .filter(|why| Some(why.as_str()) == case.row)
        .count();
    let (least, most) = case.rows;
    assert!(
        (least..=most).contains(&with_reason),
        "{context}: {with_reason} of {rows:?}"
    );
}

fn by_sensor(streams: &Value) -> BTreeMap<String, Value> {
    let streams = streams
        .as_array()
        .unwrap_or_else(|| panic!("no array: {streams}"));
    let named = |stream: &Value| {
        (
            stream["sensor"].as_str().unwrap().to_owned(),
            stream.clone(),
        )
    };
    streams.iter().map(named).collect()
}

/// The reasons of a sensor's missing frames, in order.
fn missing(csv: &str, sensor: &str) -> Vec<String> {
    let rows = csv.lines().skip(1).filter_map(|line| {
        let cells: Vec<&str> = line.splitn(11, ',').collect();
        (cells[1] == sensor && !cells[8].is_empty()).then(|| cells[8].to_owned())
    });
    rows.collect()
}
