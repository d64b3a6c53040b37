//! Every fault that a sensor and its bus were seen to have, each on a bus of its own under one agent, followed to the
//! collector: the rows with their reason, the counts by kind in the audit and on the live page's data, and what the
//! others lose by it: nothing.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "what fails in a helper fails the test"
)]

use grideye_tests::emulated::{Words, pixel_c, recording, run_emulated};
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
    /// The reasons of its rows: its own, and what is found while the sensor is set up again.
    reasons: &'static [&'static str],
    /// How many rows there have to be, at least and at most.
    rows: (usize, usize),
}

impl Case {
    /// Whether the sensor starts over, so that the agent has to estimate what it missed.
    fn starts_over(&self) -> bool {
        self.reasons.len() > 1
    }
}

/// Frames of the longest pause between two attempts at a sensor that does not answer, and of that between two set-ups.
const RETRY: usize = 10;
const SET_UP: usize = 20;
/// Frames after a set-up within which the first has to come.
const FIRST: usize = 10;

/// The rows of a fault that lasts as long as so many frames: those whose whole time in the registers it covers, and at most
/// those that it meets and those of the pauses behind it.
const fn rows_of(frames: usize, pauses: usize) -> (usize, usize) {
    (frames - 1, frames + 1 + pauses)
}

const fn case(
    fault: &'static str,
    until_s: f64,
    reasons: &'static [&'static str],
    rows: (usize, usize),
) -> Case {
    Case {
        fault,
        until_s,
        counted: reasons[0],
        reasons,
        rows,
    }
}

/// Frames that the sensors show, one after the other.
const SOURCE_FRAMES: usize = 1024;
/// Frames of each sensor.
const FRAMES: usize = 160;
/// Equal frames that are believed.
const EQUAL_FRAMES: usize = 100;

/// The reference's list; a second of each, which is ten frames, unless what is seen of it takes longer.
fn cases() -> Vec<Case> {
    const SETTINGS: &str = "wrong-configuration";
    let sound = || case("", 0.0, &[""], (0, 0));
    let second = rows_of(10, RETRY);
    let second_and_set_up = rows_of(10, RETRY + FIRST);
    let glitch = |fault| case(fault, 2.5, &["glitch-pixel"], (0, 0));
    vec![
        sound(),
        case("kind = \"nack-address\"", 2.5, &["nack"], second),
        case("kind = \"bus-error\"", 2.5, &["bus-error"], second),
        case("kind = \"timeout\"", 2.5, &["bus-timeout"], second),
        case("kind = \"hang\"", 2.5, &["bus-timeout"], second),
        // The sensor is pulled out and put back: it has lost its settings.
        case(
            "kind = \"unplugged\"",
            2.5,
            &["nack", SETTINGS],
            second_and_set_up,
        ),
        // The adapter is.
        case(
            "kind = \"adapter-gone\"",
            2.5,
            &["unplugged", SETTINGS],
            second_and_set_up,
        ),
        // Its registers are zero until it has measured.
        case(
            "kind = \"brown-out\"",
            0.0,
            &[SETTINGS, "all-zero"],
            rows_of(2, FIRST),
        ),
        sound(),
        // Of 125 equal frames a hundred are believed.
        case(
            "kind = \"freeze\"",
            14.0,
            &["frozen", "all-zero"],
            rows_of(125 - EQUAL_FRAMES, SET_UP + FIRST),
        ),
        case(
            "kind = \"stuck-high\"",
            2.5,
            &["stuck-high", SETTINGS],
            second_and_set_up,
        ),
        case(
            "kind = \"all-zero\"",
            2.5,
            &["all-zero", SETTINGS],
            second_and_set_up,
        ),
        glitch("kind = \"pixel-glitch\"\nword = 0x000"),
        glitch("kind = \"pixel-glitch\"\nword = 0xFFF"),
        // A flipped bit in the register of the frame rate, as it is read back after five seconds.
        case(
            "kind = \"bit-flip\"\nregister = 0x02\nbit = 0",
            8.0,
            &[SETTINGS, "all-zero"],
            rows_of(30, SET_UP + FIRST),
        ),
        // One bit in ten milliseconds: 131 bytes of nine bits do not come back for 11.8 seconds.
        Case {
            counted: "bus-hung",
            ..case(
                "kind = \"scl-speed\"\nhz = 100",
                2.0,
                &["bus-timeout"],
                rows_of(118, RETRY),
            )
        },
    ]
}

/// Frames without glitches, each of which is told from all others.
fn frame(index: usize) -> Words {
    let above = |pixel: usize| match pixel {
        63 => index / 64,
        _ => (5 * index + 3 * pixel) % 64,
    };
    Words {
        pixels: std::array::from_fn(|pixel| u16::try_from(80 + above(pixel)).unwrap()),
        thermistor: 400,
    }
}

/// Which frame of the source these pixels are, in °C, and whether all of them are: one may be a glitch, but not the last,
/// which tells frames apart.
fn shown(pixels: &[f64]) -> Option<(usize, bool)> {
    (0..SOURCE_FRAMES).find_map(|index| {
        let words = frame(index).pixels.map(pixel_c);
        let pairs = words.iter().zip(pixels);
        let same = pairs.filter(|(word, pixel)| word == pixel).count();
        (same >= 63 && words[63] == pixels[63]).then_some((index, same == 64))
    })
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
    every_fault();
}

fn every_fault() {
    let folder = tempfile::tempdir().unwrap();
    let source = recording(folder.path(), "source.csv", (0..SOURCE_FRAMES).map(frame));
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
    // A rate that arrives inverted is written and read back so: by the moment of each, the sensor runs at 1 Hz meanwhile.
    options.extend(["--scl", "instant"].map(str::to_owned));
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
    let ended = run_emulated(&options, &agent);
    assert_eq!(ended.code, 3, "data were lost: {ended:?}");

    let audit = by_sensor(&collector.json("/v1/audit")["streams"]);
    let live = by_sensor(&collector.json("/v1/sensors")["sensors"]);
    let csv = collector.recording_csv(id);
    for (sensor, stream) in &audit {
        println!(
            "{sensor}: missing {}, {}",
            stream["missing"], stream["errors"]
        );
    }
    for (index, case) in cases().iter().enumerate() {
        let sensor = format!("i2c-{}:0x69", index + 1);
        let context = format!("{sensor}, {}", case.fault.replace('\n', ", "));
        let stream = &audit[&sensor];
        assert_eq!(stream["balanced"], true, "{context}: {stream}");
        assert_eq!(stream["stored"], FRAMES, "{context}");
        assert_eq!(stream["errors"], live[&sensor]["errors"], "{context}");
        holds(case, stream, &Rows::of(&csv, &sensor), &context);
    }
    assert!(
        ended
            .stderr
            .contains("/dev/i2c-16: transfer has been stuck"),
        "{}",
        ended.stderr
    );
}

fn holds(case: &Case, stream: &Value, rows: &Rows, context: &str) {
    let count = |kind: &str| stream["errors"][kind].as_u64().unwrap_or(0);
    assert_eq!(stream["missing"], rows.missing.len(), "{context}");
    assert_eq!(
        stream["stored"].as_u64(),
        u64::try_from(rows.frames.len() + rows.others).ok(),
        "{context}"
    );
    // The bit flips in what is written too, and then sets 1 Hz, at which a frame is the mean of ten (AMG88 spec §4-11-3).
    assert!(
        rows.others == 0 || case.fault.contains("bit-flip"),
        "{context}: {} frames that the sensor did not show",
        rows.others
    );
    // What a host that is busy costs is no fault of the sensor.
    let (of_host, of_fault): (Vec<&str>, Vec<&str>) = rows
        .missing
        .iter()
        .map(String::as_str)
        .partition(|why| *why == "host-stalled");
    let stalled = of_host.len();
    assert!(
        of_fault.iter().all(|why| case.reasons.contains(why)),
        "{context}: {of_fault:?}"
    );
    let glitches_of = match case.counted {
        "glitch-pixel" => rows_of(10, 0),
        _ => (0, 0),
    };
    // Of a fault during which the host stalled all the time nothing is seen.
    if case.rows.0.max(glitches_of.0) > stalled {
        assert!(count(case.counted) > 0, "{context}: {stream}");
    }
    // One row for each frame of the sensor, no more and no less: only where it starts over, or the host stalls for long, is
    // their number an estimate, which may be one too few.
    let estimates = if case.starts_over() || stalled > 0 {
        count("count-estimated")
    } else {
        0
    };
    assert!(rows.moved() <= estimates, "{context}: {:?}", rows.frames);
    let (least, most) = case.rows;
    let too_few = stalled + usize::try_from(estimates).unwrap();
    assert!(
        (least.saturating_sub(too_few)..=most).contains(&of_fault.len()),
        "{context}: {} rows, {of_fault:?}",
        of_fault.len()
    );
    let glitches = rows.frames.iter().filter(|frame| !frame.is_whole).count();
    assert_eq!(
        u64::try_from(glitches).unwrap(),
        count("glitch-pixel"),
        "{context}"
    );
    let (least, most) = glitches_of;
    assert!(
        (least.saturating_sub(stalled)..=most).contains(&glitches),
        "{context}: {glitches}"
    );
    let equal = match case.counted {
        "frozen" if count("frozen") > 0 => EQUAL_FRAMES,
        "frozen" => rows.longest_equal().min(EQUAL_FRAMES),
        _ => 1,
    };
    assert_eq!(rows.longest_equal(), equal, "{context}");
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

/// What the collector has of one sensor.
#[derive(Default)]
struct Rows {
    frames: Vec<Stored>,
    /// Frames that are none of the source.
    others: usize,
    /// The reasons of the missing frames, in order.
    missing: Vec<String>,
}

/// A row with a frame.
#[derive(Debug)]
struct Stored {
    seq: usize,
    /// Which frame of the source it is.
    index: usize,
    is_whole: bool,
}

impl Rows {
    /// Panics unless every number is there once, in order.
    fn of(csv: &str, sensor: &str) -> Self {
        let mut rows = Self::default();
        let mut lines = csv.lines().filter(|line| !line.starts_with('#'));
        let header: Vec<&str> = lines.next().unwrap().split(',').collect();
        let place = |name: &str| header.iter().position(|column| *column == name).unwrap();
        let columns = ["sensor", "seq", "missing", "pixel1"].map(place);
        for line in lines {
            let cells: Vec<&str> = line.split(',').collect();
            let [name, seq, missing, _] = columns.map(|at| cells[at]);
            if name != sensor {
                continue;
            }
            let seq: usize = seq.parse().unwrap();
            let before = rows.frames.len() + rows.others + rows.missing.len();
            assert_eq!(seq, before, "{sensor}");
            if !missing.is_empty() {
                rows.missing.push(missing.to_owned());
                continue;
            }
            let pixels = cells[columns[3]..].iter().map(|cell| cell.parse().unwrap());
            match shown(&pixels.collect::<Vec<f64>>()) {
                Some((index, is_whole)) => rows.frames.push(Stored {
                    seq,
                    index,
                    is_whole,
                }),
                None => rows.others += 1,
            }
        }
        rows
    }

    /// How often the row's number moved against the sensor's. Equal frames in a row are those of a sensor that stopped.
    fn moved(&self) -> u64 {
        let mut fresh: Vec<&Stored> = self.frames.iter().collect();
        fresh.dedup_by_key(|frame| frame.index);
        let distance = |frame: &Stored| {
            i128::try_from(frame.index).unwrap() - i128::try_from(frame.seq).unwrap()
        };
        let moved = fresh
            .windows(2)
            .filter(|pair| distance(pair[0]) != distance(pair[1]));
        u64::try_from(moved.count()).unwrap()
    }

    /// The most equal frames in a row.
    fn longest_equal(&self) -> usize {
        let equal = self.frames.chunk_by(|one, next| one.index == next.index);
        equal.map(<[Stored]>::len).max().unwrap_or(0)
    }
}
