//! This project's agent, the release program, on the emulated `/dev/i2c-N`: what it says of each kind of adapter, and
//! an hour of frames of which none is torn, none comes twice, and none is missing without its reason.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "what fails in a helper fails the test"
)]

use grideye_tests::emulated::{Words, recording, run_emulated};
use grideye_tests::programs::{Ended, RunningCollector, grideye_agent, is_left_out, run};
use std::collections::{BTreeMap, HashMap};
use std::fmt::Write as _;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::process::Command;

const SCENE: [&str; 2] = ["--scene", "scenes/experiment-1.toml"];

/// `grideye-agent check` on bus 1.
fn check(adapter: &str, address: &str) -> Ended {
    let mut command = Command::new(grideye_agent().get_program());
    command.args(["check", "--bus", "/dev/i2c-1", "--address", address]);
    unhurried(&[&SCENE[..], &["--adapter", adapter]].concat(), &command)
}

/// The check runs in real time: a host that stalls is told apart from a sensor at fault, and asked again.
fn unhurried(source: &[&str], command: &Command) -> Ended {
    (0..3)
        .map(|_| run_emulated(source, command))
        .find(|ended| !format!("{ended:?}").contains("too busy to read in time"))
        .unwrap()
}

const ELSEWHERE: &str = "; one does at 0x69\nhint: say `address = 0x69`";

/// Adapter, address, exit code and words of `grideye-agent check`. The errno are those of the kernel's drivers (the
/// reference on Linux' I2C, and the table of `AdapterMode`).
const CHECKS: [(&str, &str, i32, &[&str]); 13] = [
    ("pi", "0x69", 0, &["20 frames read"]),
    (
        "pi",
        "0x68",
        1,
        &["nack (Remote I/O error (os error 121))", ELSEWHERE],
    ),
    ("pi5", "0x69", 0, &["20 frames read"]),
    (
        "pi5",
        "0x68",
        1,
        &["nack (Remote I/O error (os error 121))", ELSEWHERE],
    ),
    ("usb", "0x69", 0, &["20 frames read"]),
    (
        "usb",
        "0x68",
        1,
        &["nack (No such device or address (os error 6))", ELSEWHERE],
    ),
    (
        "smbus-only",
        "0x69",
        1,
        &[
            "bus-error (Operation not supported (os error 95))",
            "SMBus only cannot read this sensor",
        ],
    ),
    (
        "busy",
        "0x69",
        1,
        &["a kernel driver owns address 0x69", "hint: unbind it"],
    ),
    (
        "busy",
        "0x68",
        1,
        &["a kernel driver owns address 0x68", "hint: unbind it"],
    ),
    (
        "gone",
        "0x69",
        1,
        &[
            "unplugged (No such device (os error 19))",
            "hint: the bus adapter is gone",
        ],
    ),
    (
        "gone",
        "0x68",
        1,
        &[
            "unplugged (No such device (os error 19))",
            "hint: the bus adapter is gone",
        ],
    ),
    ("virtio", "0x69", 0, &["20 frames read"]),
    (
        "virtio",
        "0x68",
        1,
        &[
            "short-transfer (short transfer: expected 1 messages, found 0)",
            ELSEWHERE,
        ],
    ),
];

/// What a person is told on each kind of adapter, where the sensor is and where it is not.
#[test]
fn check_says_of_each_adapter_what_a_raspberry_pi_would_say() {
    std::thread::scope(|scope| {
        for (adapter, address, code, words) in CHECKS {
            scope.spawn(move || {
                let ended = check(adapter, address);
                let context = format!("{adapter}, {address}: {ended:?}");
                assert_eq!(ended.code, code, "{context}");
                let said = format!("{}{}", ended.stdout, ended.stderr);
                // A host that is late misses frames, and then the agent says that it counted by the clock.
                let misses = code == 0 && !said.contains(" read, 0 missing");
                assert!(!misses || said.contains("count-estimated"), "{context}");
                for word in words {
                    assert!(said.contains(word), "{word:?}: {context}");
                }
            });
        }
    });
}

/// Both sensors of one bus, by a configuration: each is checked at its own address, and one that is missing is not looked
/// for at the other's.
#[test]
fn two_sensors_on_one_bus_are_checked_by_their_configuration_each_for_itself() {
    let folder = tempfile::tempdir().unwrap();
    let config = folder.path().join("agent.toml");
    let text = "[[bus]]\npath = \"/dev/i2c-1\"\n[[bus.sensor]]\naddress = 0x68\n[[bus.sensor]]\naddress = 0x69\n";
    std::fs::write(&config, text).unwrap();
    let mut command = Command::new(grideye_agent().get_program());
    command.args(["check", "--config"]).arg(&config);
    let both = [
        "--constant",
        "21.5",
        "--sensor",
        "low=1:0x68",
        "--sensor",
        "high=1:0x69",
    ];
    let checked = unhurried(&both, &command);
    let context = format!("{checked:?}");
    for sensor in ["i2c-1:0x68: ok\n", "i2c-1:0x69: ok\n"] {
        assert!(checked.stdout.contains(sensor), "{context}");
    }
    // A busy machine may miss one.
    let frames = checked.stdout.matches("20 frames read, ");
    assert_eq!(frames.count(), 2, "{context}");
    // No collector is named.
    assert_eq!(checked.code, 1, "{context}");

    let one = unhurried(&both[..4], &command);
    let context = format!("{one:?}");
    assert!(
        one.stdout.contains("i2c-1:0x68: ok\n")
            && one.stdout.contains("i2c-1:0x69: failed\n")
            && one.stdout.contains("hint: nobody answers at this address")
            && !one.stdout.contains("; one does at"),
        "{context}"
    );
}

/// As on a Raspberry Pi whose user is not in the group `i2c`. A file that nobody may open, as far as its mode goes,
/// refuses root too once root has laid down the right to pass over modes.
#[test]
fn a_bus_that_this_user_may_not_open_is_said_with_the_group_to_join() {
    let folder = tempfile::tempdir().unwrap();
    let bus = folder.path().join("i2c-1");
    std::fs::write(&bus, "").unwrap();
    std::fs::set_permissions(&bus, std::fs::Permissions::from_mode(0o000)).unwrap();
    let agent = grideye_agent().get_program().to_owned();
    let mut command = if std::fs::File::open(&bus).is_ok() {
        let mut command = Command::new("setpriv");
        command
            .args([
                "--inh-caps=-all",
                "--bounding-set=-dac_override,-dac_read_search",
            ])
            .arg(agent);
        command
    } else {
        Command::new(agent)
    };
    let refused = run(command.args(["check", "--bus"]).arg(&bus));
    assert_eq!(refused.code, 1, "{refused:?}");
    let said = format!(
        "i2c-1:0x69: failed\nerror: {}: permission denied\nhint: add the user to the group with `sudo usermod -aG i2c $USER` and log in again",
        bus.display()
    );
    assert!(refused.stdout.starts_with(&said), "{refused:?}");
}

/// Frame `index` of a recording in which no two frames are alike, and no part of one occurs in another at its place:
/// the first two pixels hold the index, the others are scattered over -40 to +79.75 °C by it.
fn identifiable(index: usize) -> Words {
    let quarters = |pixel: usize| match pixel {
        0 => index % 512,
        1 => index / 512,
        _ => (index * 2_654_435_761 + pixel * 40_503) / 512 % 480,
    };
    Words {
        pixels: std::array::from_fn(|pixel| {
            let quarters = i16::try_from(quarters(pixel)).unwrap() - 160;
            u16::from_ne_bytes(quarters.to_ne_bytes()) & 0xFFF
        }),
        thermistor: u16::try_from(160 + index % 1000).unwrap(),
    }
}

/// The cells of a row of a recording by column, and its frame as the text of its 64 pixels.
struct Row {
    device: String,
    sensor: String,
    seq: u64,
    missing: String,
    pixels: String,
}

fn rows(csv: &str) -> Vec<Row> {
    csv.lines()
        .skip(1)
        .map(|line| {
            let cells: Vec<&str> = line.splitn(11, ',').collect();
            Row {
                device: cells[0].to_owned(),
                sensor: cells[1].to_owned(),
                seq: cells[3].parse().unwrap(),
                missing: cells[8].to_owned(),
                pixels: cells[10].to_owned(),
            }
        })
        .collect()
}

/// Which frame of the source a stored one is. Nothing else than a whole frame of the source is found.
fn indices(source: &Path) -> HashMap<String, u64> {
    let text = std::fs::read_to_string(source).unwrap();
    let frames: HashMap<String, u64> = rows(&text)
        .into_iter()
        .map(|row| (row.pixels, row.seq))
        .collect();
    assert_eq!(frames.len(), text.lines().count() - 1, "no two are alike");
    frames
}

/// Sixteen buses with two sensors each: what an agent takes at most.
const BUSES: usize = 16;
const SENSORS: usize = 2 * BUSES;
/// Frames of an hour at 10 Hz, and of each sensor.
const HOUR: usize = 36_000;
const FRAMES: usize = HOUR / SENSORS;
/// More frames than are read, for those that pass before the agent is ready and those that it misses.
const SOURCE_FRAMES: usize = FRAMES + 600;

/// The options that put all sensors in, and the agent's configuration for them.
fn a_full_agent(
    folder: &Path,
    source: &Path,
    collector: &RunningCollector,
) -> (Vec<String>, String) {
    let mut options = [
        "--recording",
        source.to_str().unwrap(),
        "--replay",
        "frames",
    ]
    .map(str::to_owned)
    .to_vec();
    // Room for all frames: a machine that is too busy to deliver is not what is tested here.
    let mut config = format!(
        "device = \"pi-1\"\ncollector = \"{}\"\nring_frames = 100000\n",
        collector.url()
    );
    for bus in 1..=BUSES {
        write!(config, "[[bus]]\npath = \"/dev/i2c-{bus}\"\n").unwrap();
        for address in ["0x68", "0x69"] {
            options.extend([
                "--sensor".to_owned(),
                format!("s{bus}-{address}={bus}:{address}"),
            ]);
            write!(config, "[[bus.sensor]]\naddress = {address}\n").unwrap();
        }
    }
    let path = folder.join("agent.toml");
    std::fs::write(&path, config).unwrap();
    (options, path.to_str().unwrap().to_owned())
}

/// An hour of one sensor, told by frames: 36,000 of them, by 32 sensors in real time.
#[test]
fn an_hour_of_frames_arrives_none_torn_none_twice_and_each_gap_with_its_reason() {
    if is_left_out(
        "GRIDEYE_WITHOUT_HOUR",
        "36,000 frames through grideye-agent (two minutes)",
    ) {
        return;
    }
    an_hour();
}

fn an_hour() {
    let folder = tempfile::tempdir().unwrap();
    let frames = (0..SOURCE_FRAMES).map(identifiable);
    let source = recording(folder.path(), "source.csv", frames);
    let collector = RunningCollector::start(folder.path());
    let id = collector.start_recording("hour");
    let (options, config) = a_full_agent(folder.path(), &source, &collector);
    let mut agent = Command::new(grideye_agent().get_program());
    agent.args(["run", "--frames", &FRAMES.to_string(), "--config", &config]);
    let ended = run_emulated(&options, &agent);

    let audit = collector.json("/v1/audit");
    let stored = rows(&collector.recording_csv(id));
    let hour = Hour::of(&stored, &indices(&source), &estimates(&audit));
    println!("{hour}");
    assert_eq!(audit["balanced"], true, "{audit}");
    let sum = |what: &str| -> u64 {
        let streams = audit["streams"].as_array().unwrap();
        let counts = streams.iter().map(|stream| stream[what].as_u64().unwrap());
        counts.sum()
    };
    assert_eq!(sum("read"), u64::try_from(HOUR).unwrap());
    assert_eq!(sum("stored"), sum("read"), "{audit}");
    assert_eq!(
        hour.frames,
        sum("stored"),
        "every stored frame was compared"
    );
    let missing: u64 = hour.missing.values().sum();
    assert_eq!(missing, sum("missing"), "{hour}");
    // A host that stalls costs frames here, and must say so.
    let code = if missing == 0 { 0 } else { 3 };
    assert_eq!(ended.code, code, "{hour}: {ended:?}");
}

/// How often each sensor's agent said that it had to estimate how many frames it had missed.
fn estimates(audit: &serde_json::Value) -> BTreeMap<String, u64> {
    let streams = audit["streams"].as_array().unwrap().iter();
    let of_stream = |stream: &serde_json::Value| {
        let sensor = stream["sensor"].as_str().unwrap().to_owned();
        let estimates = stream["errors"]["count-estimated"].as_u64();
        (sensor, estimates.unwrap_or(0))
    };
    streams.map(of_stream).collect()
}

/// What became of all sensors' frames.
#[derive(Debug, Default)]
struct Hour {
    frames: u64,
    missing: BTreeMap<String, u64>,
    /// Moments at which `seq` was no longer the sensor's own count, each one announced as an estimate.
    moved: u64,
}

impl Hour {
    /// Compares every row with the source.
    fn of(rows: &[Row], indices: &HashMap<String, u64>, estimates: &BTreeMap<String, u64>) -> Self {
        let mut hour = Self::default();
        let mut streams: BTreeMap<&str, Vec<&Row>> = BTreeMap::new();
        for row in rows {
            streams.entry(&row.sensor).or_default().push(row);
        }
        assert_eq!(streams.len(), SENSORS);
        for (sensor, rows) in streams {
            // seq counts the sensor's frames, so its distance to the source's number is the same in every row:
            // a frame that came twice, or was missed and not counted, would move it. Only where the agent says that a
            // stalled host let it do no better than estimate may it move.
            let (mut distance, mut last, mut moved) = (None, None, 0);
            for (expected, row) in (0..).zip(&rows) {
                assert_eq!(
                    row.seq, expected,
                    "{sensor}: neither a gap nor a repetition"
                );
                if !row.missing.is_empty() {
                    *hour.missing.entry(row.missing.clone()).or_default() += 1;
                    continue;
                }
                let index = indices.get(&row.pixels);
                let index = index.unwrap_or_else(|| panic!("{sensor} {}: torn", row.seq));
                assert!(last < Some(*index), "{sensor} {}: comes twice", row.seq);
                last = Some(*index);
                let of_this_row = i128::from(*index) - i128::from(row.seq);
                moved += u64::from(*distance.get_or_insert(of_this_row) != of_this_row);
                distance = Some(of_this_row);
                hour.frames += 1;
            }
            assert!(
                moved <= estimates[sensor],
                "{sensor}: moved {moved} times, and {} were announced",
                estimates[sensor]
            );
            hour.moved += moved;
        }
        hour
    }
}

impl std::fmt::Display for Hour {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            formatter,
            "{} frames of {SENSORS} sensors, each one whole frame of the source, none twice; missing: {:?}; the count moved by estimates: {}",
            self.frames, self.missing, self.moved
        )
    }
}

/// What a fault of the bus is to a stored row, by adapter: errno for errno what the kernel's drivers make of it.
struct Expected {
    fault: &'static str,
    /// On `pi`, `pi5`, `usb`, `virtio`.
    reasons: [&'static str; 4],
}

const ADAPTERS: [&str; 4] = ["pi", "pi5", "usb", "virtio"];

const FAULTS: [Expected; 8] = [
    Expected {
        fault: "kind = \"nack-address\"",
        reasons: ["nack", "nack", "nack", "short-transfer"],
    },
    Expected {
        fault: "kind = \"nack-byte\"\nbyte = 0",
        reasons: ["nack", "nack", "bus-error", "short-transfer"],
    },
    Expected {
        fault: "kind = \"bus-error\"",
        reasons: ["bus-error", "bus-error", "bus-error", "short-transfer"],
    },
    Expected {
        fault: "kind = \"arbitration-loss\"",
        reasons: ["bus-error", "bus-error", "bus-error", "short-transfer"],
    },
    Expected {
        fault: "kind = \"timeout\"",
        reasons: ["bus-timeout", "bus-timeout", "bus-error", "short-transfer"],
    },
    Expected {
        fault: "kind = \"hang\"",
        reasons: ["bus-timeout", "bus-timeout", "bus-error", "short-transfer"],
    },
    // The sensor is off the bus: nobody acknowledges.
    Expected {
        fault: "kind = \"unplugged\"",
        reasons: ["nack", "nack", "nack", "short-transfer"],
    },
    // The adapter is off the computer: ENODEV, whatever it is.
    Expected {
        fault: "kind = \"adapter-gone\"",
        reasons: ["unplugged", "unplugged", "unplugged", "unplugged"],
    },
];

/// What a row may say besides, while the sensor is set up again behind the fault or the host is busy.
const BESIDES: [&str; 4] = [
    "not-ready",
    "all-zero",
    "wrong-configuration",
    "host-stalled",
];

/// A second of a fault in the middle of a run.
fn script(folder: &Path, device: &str, fault: &str) -> String {
    let path = folder.join(format!("{device}-faults.toml"));
    let text = format!("[[fault]]\n{fault}\nfrom = \"1.5 s\"\nuntil = \"2.5 s\"\n");
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

/// A fault is a row with its reason, and never the frame before once more: not even where the adapter gives no errno
/// and leaves the last frame's bytes in the buffer (`virtio`, a short message count).
#[test]
fn each_fault_is_a_missing_row_with_its_reason_and_no_stale_frame_passes_as_fresh() {
    every_fault_on_every_adapter();
}

fn every_fault_on_every_adapter() {
    let folder = tempfile::tempdir().unwrap();
    let source = recording(folder.path(), "source.csv", (0..200).map(identifiable));
    let indices = indices(&source);
    let collector = RunningCollector::start(folder.path());
    let id = collector.start_recording("faults");
    for adapter in ADAPTERS {
        std::thread::scope(|scope| {
            for (number, expected) in FAULTS.iter().enumerate() {
                let (folder, source, collector) = (folder.path(), &source, &collector);
                scope.spawn(move || {
                    let device = format!("{adapter}-{number}");
                    let script = script(folder, &device, expected.fault);
                    let source = source.to_str().unwrap();
                    let shown = ["--recording", source, "--replay", "frames"];
                    let broken = ["--adapter", adapter, "--faults", &script];
                    let options = [shown, broken].concat();
                    let ended = faulty_run(folder, &device, &options, collector);
                    assert_eq!(ended.code, 3, "{device}: data were lost: {ended:?}");
                });
            }
        });
    }
    let stored = rows(&collector.recording_csv(id));
    for (column, adapter) in ADAPTERS.iter().enumerate() {
        for (number, expected) in FAULTS.iter().enumerate() {
            let device = format!("{adapter}-{number}");
            let rows: Vec<&Row> = stored.iter().filter(|row| row.device == device).collect();
            let context = format!("{adapter}, {}", expected.fault.replace('\n', ", "));
            holds_what_it_must(&rows, expected.reasons[column], &indices, &context);
        }
    }
}

fn faulty_run(
    folder: &Path,
    device: &str,
    options: &[&str],
    collector: &RunningCollector,
) -> Ended {
    let config = folder.join(format!("{device}.toml"));
    let text = format!(
        "device = \"{device}\"\ncollector = \"{}\"\n[[bus]]\npath = \"/dev/i2c-1\"\n[[bus.sensor]]\naddress = 0x69\n",
        collector.url()
    );
    std::fs::write(&config, text).unwrap();
    let mut agent = Command::new(grideye_agent().get_program());
    agent
        .args(["run", "--frames", "30", "--config"])
        .arg(&config);
    run_emulated(options, &agent)
}

fn holds_what_it_must(rows: &[&Row], reason: &str, indices: &HashMap<String, u64>, context: &str) {
    let missing: Vec<&str> = rows
        .iter()
        .map(|row| row.missing.as_str())
        .filter(|why| !why.is_empty())
        .collect();
    let count = |of: &str| missing.iter().filter(|why| **why == of).count();
    println!("{context}: {missing:?}");
    // Half of the fault's ten frames, but for those for which the host came too late, which are counted as such.
    let (said, late) = (count(reason), count("host-stalled"));
    assert!(said > 0 && said + late >= 5, "{context}: {missing:?}");
    let others = missing
        .iter()
        .filter(|why| **why != reason && !BESIDES.contains(why));
    assert_eq!(others.count(), 0, "{context}: {missing:?}");
    let mut last = None;
    for row in rows.iter().filter(|row| row.missing.is_empty()) {
        let index = indices.get(&row.pixels);
        let index = *index.unwrap_or_else(|| panic!("{context}, row {}: torn", row.seq));
        assert!(
            last < Some(index),
            "{context}, row {}: frame {index} behind {last:?}",
            row.seq
        );
        last = Some(index);
    }
}
