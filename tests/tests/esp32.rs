//! The ESP32's sketch: its core on this machine, with the emulated sensor as a C library and a real collector; the rest against
//! declarations of what it calls.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_frame::{NoData, Reading};
use grideye_recording::Row;
use grideye_recording::csv::Reader;
use grideye_tests::c_library::{compile, succeed};
use grideye_tests::programs::{Ended, RunningCollector, grideye, is_left_out, root, run};
use grideye_tests::skip;
use serde_json::Value;
use std::collections::BTreeSet;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

const WITHOUT_CXX: &str = "GRIDEYE_WITHOUT_CXX";

/// The core with its sensors, on their own clock: no waiting in it is real.
struct Board {
    child: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
}

impl Board {
    /// `None` without a compiler. The sensor's clock is off by parts per million.
    fn start(at: &Path, boot: &str, ring: usize, sensors: usize, clock_ppm: i32) -> Option<Self> {
        if is_left_out(WITHOUT_CXX, "the ESP32's core") {
            return None;
        }
        let program = at.join("board");
        let core = root().join("firmware-config/esp32");
        let flags = [
            "-std=c++11",
            "-fsanitize=address,undefined",
            "-fno-sanitize-recover=all",
            "-I",
        ];
        let flags = [&flags[..], &[core.to_str().unwrap()]].concat();
        compile(
            "c++",
            &flags,
            &[&root().join("tests/esp32/host.cpp")],
            &program,
        );
        let numbers = [ring.to_string(), sensors.to_string(), clock_ppm.to_string()];
        let mut child = Command::new(program)
            .arg(boot)
            .args(numbers)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let (to, from) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
        let from = BufReader::new(from);
        Some(Self { child, to, from })
    }

    /// What the core counts after a command.
    fn tell(&mut self, command: &str, value: impl std::fmt::Display) -> Value {
        writeln!(self.to, "{command} {value}").unwrap();
        let mut line = String::new();
        self.from.read_line(&mut line).unwrap();
        serde_json::from_str(&line).unwrap()
    }

    /// From now on its posts go to this collector.
    fn face(&mut self, collector: &RunningCollector) {
        let port = collector.url().rsplit_once(':').unwrap().1;
        self.tell("port", port);
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn count(counts: &Value, name: &str) -> u64 {
    let sensors = counts["sensors"].as_array().unwrap();
    sensors
        .iter()
        .map(|sensor| sensor[name].as_u64().unwrap())
        .sum()
}

/// Posts until nothing is kept, then checks that read = stored + dropped for every stream.
fn check_account(board: &mut Board, collector: &RunningCollector) -> (Value, Value) {
    let mut counts = board.tell("run", 1);
    for _ in 0..200 {
        // Between two frames, the post before has been answered.
        counts = board.tell("run", 35);
        if count(&counts, "kept") == 0 {
            break;
        }
    }
    assert_eq!(count(&counts, "kept"), 0, "{counts}");
    let audit = collector.json("/v1/audit");
    for stream in audit["streams"].as_array().unwrap() {
        let dropped: u64 = stream["dropped"]
            .as_object()
            .unwrap()
            .values()
            .filter_map(Value::as_u64)
            .sum();
        let [read, stored] = ["read", "stored"].map(|name| stream[name].as_u64().unwrap());
        assert_eq!(read, stored + dropped, "{stream}");
    }
    (counts, audit)
}

/// The number that a frame's pixels tell: which measurement of the sensor it is.
fn measurement(row: &Row) -> Option<u64> {
    let frame = row.record.reading.frame()?;
    let digits = (0..4)
        .rev()
        .map(|pixel| u64::from(frame.pixels[pixel].0 - 80));
    Some(digits.fold(0, |number, digit| number * 32 + digit))
}

fn rows(csv: &str, sensor: &str) -> Vec<Row> {
    let rows = Reader::new(csv.as_bytes()).unwrap().map(Result::unwrap);
    rows.filter(|row| row.stream.sensor == sensor).collect()
}

#[test]
fn nothing_is_lost_uncounted_over_restarts_lost_answers_and_a_full_ring() {
    let at = tempfile::tempdir().unwrap();
    let Some(mut board) = Board::start(at.path(), "b1", 200, 2, -60_000) else {
        return;
    };
    let store = at.path().join("store.sqlite");
    let start = || RunningCollector::start_on(&store);
    // Nobody is there yet.
    board.tell("run", 5_000);
    let mut collector = start();
    let recording = collector.start_recording("esp");
    board.face(&collector);
    board.tell("run", 20_000);
    for _ in 0..3 {
        collector.kill();
        board.tell("run", 8_000);
        collector = start();
        board.face(&collector);
        board.tell("run", 4_000);
    }
    // Its posts arrive, and the answers get lost; then nothing arrives, for longer than the ring reaches.
    board.tell("deaf", 1);
    board.tell("run", 6_000);
    board.tell("deaf", 0);
    board.tell("port", 1);
    board.tell("run", 60_000);
    board.face(&collector);
    board.tell("run", 20_000);
    let (counts, audit) = check_account(&mut board, &collector);
    println!("{counts}");
    assert!(count(&counts, "dropped") > 400, "{counts}");
    assert_eq!(count(&counts, "missing"), 0, "{counts}");
    assert_eq!(audit["balanced"], true, "{audit}");
    let csv = collector.recording_csv(recording);
    for sensor in ["0x68", "0x69"] {
        // One frame of the sensor is one record, with its number.
        let rows = rows(&csv, sensor);
        let first = measurement(&rows[0]).unwrap() - rows[0].record.seq;
        for row in rows {
            assert_eq!(measurement(&row).unwrap() - first, row.record.seq);
        }
    }
    assert_eq!(collector.stop().code, 0);
}

#[test]
fn frames_are_numbered_as_the_sensor_measures_whatever_its_clock_and_missed_ones_are_counted() {
    for clock_ppm in [-60_000, 0, 60_000] {
        let at = tempfile::tempdir().unwrap();
        let Some(mut board) = Board::start(at.path(), "b1", 600, 1, clock_ppm) else {
            return;
        };
        let collector = RunningCollector::start(at.path());
        let recording = collector.start_recording("esp");
        board.face(&collector);
        board.tell("run", 60_000);
        let (counts, _) = check_account(&mut board, &collector);
        assert_eq!(count(&counts, "missing"), 0, "{clock_ppm}: {counts}");
        // The host cannot read for a while: numbers go on as the sensor's do.
        for stalled_ms in [150, 410, 1_730] {
            board.tell("stall", stalled_ms);
            board.tell("run", 3_000);
        }
        // The sensor is away for three seconds, and starts again.
        board.tell("unplug", 1);
        board.tell("run", 3_000);
        board.tell("unplug", 0);
        board.tell("run", 5_000);
        let (counts, audit) = check_account(&mut board, &collector);
        println!("{clock_ppm} ppm: {counts}");
        let csv = collector.recording_csv(recording);
        let rows = rows(&csv, "0x69");
        let numbers: Vec<u64> = rows.iter().map(|row| row.record.seq).collect();
        assert!(
            numbers.windows(2).all(|pair| pair[1] == pair[0] + 1),
            "{clock_ppm} ppm: numbers are left out"
        );
        // Until it is unplugged, which ends its count.
        let gone = rows
            .iter()
            .position(|row| row.record.reading == Reading::NoData(NoData::Nack));
        let before = rows[..gone.unwrap()].iter();
        let before = before.filter_map(|row| Some((row.record.seq, measurement(row)?)));
        let offsets: BTreeSet<u64> = before.map(|(seq, number)| 1_000 + number - seq).collect();
        assert_eq!(offsets.len(), 1, "{clock_ppm} ppm: {offsets:?}");
        assert!(
            audit["streams"][0]["errors"]["nack"].as_u64() > Some(0),
            "{audit}"
        );
        assert_eq!(collector.stop().code, 0);
    }
}

#[test]
fn the_sketch_fits_the_header_that_enrolling_prints() {
    if is_left_out(WITHOUT_CXX, "the ESP32's sketch") {
        return;
    }
    let at = tempfile::tempdir().unwrap();
    let enroll = |more: &[&str]| {
        run(grideye()
            .arg("enroll")
            .args(more)
            .args(["--esp32", "--access"])
            .arg(at.path().join("access")))
    };
    let Ended { code, stderr, .. } =
        enroll(&["esp-1", "esp-2", "--url", "https://192.168.1.20:8833"]);
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("--esp32 is for one device"), "{stderr}");
    let header = enroll(&["esp-1", "--url", "https://192.168.1.20:8833"]).stdout;
    std::fs::write(at.path().join("collector.h"), &header).unwrap();
    // What the header says, by the compiler, is what the folder of tokens has.
    std::fs::write(
        at.path().join("say.cpp"),
        "#include \"collector.h\"\n#include <stdio.h>\nint main() { fputs(COLLECTOR_AUTHORITY, stdout); fputs(COLLECTOR_URL \" \" COLLECTOR_DEVICE, stderr); return COLLECTOR_TOKEN[0] == 0; }\n",
    )
    .unwrap();
    let say = at.path().join("say");
    succeed(
        Command::new("c++")
            .arg(at.path().join("say.cpp"))
            .arg("-o")
            .arg(&say),
    );
    let said = succeed(&mut Command::new(say));
    let authority = std::fs::read_to_string(at.path().join("access/authority.pem")).unwrap();
    assert_eq!(said.stdout.trim(), authority.trim());
    assert_eq!(said.stderr, "https://192.168.1.20:8833 esp-1");
    let core = root().join("firmware-config/esp32");
    let includes = [
        root().join("tests/esp32/stub"),
        at.path().to_owned(),
        core.clone(),
    ];
    for (source, more) in [
        ("esp32.ino", &["-std=c++11", "-include", "stub.h"][..]),
        ("esphome.h", &["-std=c++17", "-DESPHOME"]),
    ] {
        let mut command = Command::new("c++");
        command
            .args(["-fsyntax-only", "-Wall", "-Wextra", "-Werror"])
            .args(more);
        for include in &includes {
            command.arg("-I").arg(include);
        }
        succeed(
            command
                .args(["-x", "c++"])
                .arg("-include")
                .arg(core.join(source))
                .arg("/dev/null"),
        );
    }
}

/// With the program `esphome` that a variable names: its wheel and what it needs are 250 MB.
#[test]
fn esphome_takes_the_package() {
    let Some(esphome) = std::env::var_os("GRIDEYE_ESPHOME") else {
        skip::test("set GRIDEYE_ESPHOME to the program esphome");
        return;
    };
    let at = tempfile::tempdir().unwrap();
    for file in ["esphome.yaml", "esphome.h", "grideye.h"] {
        let from = root().join("firmware-config/esp32").join(file);
        std::fs::copy(from, at.path().join(file)).unwrap();
    }
    let own = "packages: {grideye: !include esphome.yaml}\nesphome: {name: esp-1}\nesp32: {board: esp32dev, framework: {type: esp-idf}}\nwifi: {ssid: a, password: bbbbbbbb}\nmqtt: {broker: 192.168.1.20}\ntime: [{platform: sntp}]\n";
    let file = at.path().join("own.yaml");
    std::fs::write(&file, own).unwrap();
    let said = succeed(Command::new(esphome).arg("config").arg(file));
    let said = said.stdout + &said.stderr;
    assert!(said.contains("Configuration is valid"), "{said}");
}
