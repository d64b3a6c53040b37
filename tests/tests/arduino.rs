//! Arduino sketches and libraries on this host: the core of `crates/i2c-emulation/arduino`, compiled by g++, on the real
//! `grideye emulate`; and the project to copy, `tests/examples/firmware-ci`.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "what fails in a helper fails the test"
)]

use grideye_tests::emulated::{Way, Words, recording, run_emulated};
use grideye_tests::programs::{self, Ended, grideye, is_left_out, root, run, wait_for};
use grideye_tests::python;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

const WITHOUT_CXX: &str = "GRIDEYE_WITHOUT_CXX";
const WITHOUT_AVR_GCC: &str = "GRIDEYE_WITHOUT_AVR_GCC";
const CORE: &str = "crates/i2c-emulation/arduino";
const EXAMPLE: &str = "tests/examples/firmware-ci";
const WORKFLOW: &str = "tests/examples/firmware-ci/.github/workflows/firmware.yml";

/// A sketch or a test with the core, as the head of `Arduino.h` says; `None` if the compiler is left out.
fn compiled(folder: &Path, source: &str, flags: &[&str], what: &str) -> Option<PathBuf> {
    if is_left_out(WITHOUT_CXX, what) {
        return None;
    }
    let core = root().join(CORE);
    let out = folder.join("sketch");
    let ended = run(Command::new("g++")
        .args([
            "-std=c++11",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-DARDUINO=10819",
        ])
        .args(flags)
        .arg("-I")
        .arg(&core)
        .arg("-I")
        .arg(root().join(EXAMPLE).join("lib/grid_eye"))
        .args(["-include", "Arduino.h", "-x", "c++"])
        .arg(root().join(source))
        .args(["-x", "none"])
        .arg(root().join(EXAMPLE).join("lib/grid_eye/grid_eye.cpp"))
        .arg(core.join("arduino.cpp"))
        .arg("-o")
        .arg(&out));
    assert_eq!(ended.code, 0, "{source}: {ended:?}");
    Some(out)
}

/// On an emulated bus as a microcontroller has it: without an adapter between.
fn on_the_bus(source: &[&str], program: &Path, arguments: &[&str]) -> Ended {
    let folder = tempfile::tempdir().unwrap();
    let mut command = grideye();
    command.args(["emulate", "--quiet", "--via", "preload", "--socket"]);
    command.arg(folder.path().join("bus")).args(source);
    run(command.arg("--").arg(program).args(arguments))
}

fn path(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// `prints.txt` is what an ATmega328P printed with Debian's arduino-core-avr 1.8.7 in simavr 1.6.
#[test]
fn a_sketch_prints_what_an_avr_prints() {
    let folder = tempfile::tempdir().unwrap();
    let what = "what Arduino's Serial prints";
    let Some(sketch) = compiled(folder.path(), "tests/arduino/prints.ino", &[], what) else {
        return;
    };
    let ended = run(&mut Command::new(sketch));
    let printed = std::fs::read_to_string(root().join("tests/arduino/prints.txt")).unwrap();
    assert_eq!(ended.stdout.replace('\r', ""), printed, "{ended:?}");
    assert_eq!(ended.code, 0, "{ended:?}");
}

/// The AVR's Wire.cpp: what does not fit is dropped, from a transmission and from a request, and no code tells.
#[test]
fn wire_has_the_buffers_of_an_avr() {
    let folder = tempfile::tempdir().unwrap();
    let trace = folder.path().join("bus.csv");
    let what = "Arduino's Wire";
    let Some(program) = compiled(folder.path(), "tests/arduino/wire.cpp", &[], what) else {
        return;
    };
    let source = ["--constant", "21.5", "--trace", path(&trace)];
    let ended = on_the_bus(&source, &program, &["buffers"]);
    let expected = "taken one by one 32, write error 1\ntaken at once 40\nsent 0\n\
         requested 128, arrived 32, available 32\npeek 86, read 86, left 31\nas a stream 31\nbeyond the end -1 -1\n\
         requested 0, arrived 0\n";
    assert_eq!(ended.stdout, expected, "{ended:?}");
    let transactions = transactions(&trace);
    // The held address of the request for nothing is not sent.
    let lengths: Vec<Vec<usize>> = transactions.into_iter().map(|t| t.lengths).collect();
    assert_eq!(lengths, [vec![32], vec![1, 32]]);
}

#[test]
fn wire_sends_what_is_held_with_what_follows() {
    let folder = tempfile::tempdir().unwrap();
    let trace = folder.path().join("bus.csv");
    let what = "transactions of Arduino's Wire";
    let Some(program) = compiled(folder.path(), "tests/arduino/wire.cpp", &[], what) else {
        return;
    };
    let sensors = ["--sensor", "one=1:0x69", "--sensor", "two=2:0x68"];
    let source = [
        &["--constant", "-4.75", "--trace", path(&trace)],
        &sensors[..],
    ]
    .concat();
    let ended = on_the_bus(&source, &program, &["transactions"]);
    // -4.75 + 4.5 °C is -0.25 °C, of the thermistor 0x804 (AMG88 spec §4-11-9).
    let expected = "register by request 2: 04 08\ntwo starts 0, rate 1 1\nsecond bus 0\n";
    assert_eq!(ended.stdout, expected, "{ended:?}");
    let lengths: Vec<Vec<usize>> = transactions(&trace)
        .into_iter()
        .map(|t| t.lengths)
        .collect();
    // Two writes of one transfer are two transactions on the emulated bus.
    assert_eq!(lengths, [vec![1, 2], vec![0], vec![2], vec![1, 1], vec![0]]);
}

/// The codes of Wire.h on the bare bus, and what an adapter leaves of them.
#[test]
fn a_fault_becomes_the_code_of_an_avr() {
    let folder = tempfile::tempdir().unwrap();
    let what = "faults in Arduino's Wire";
    let Some(program) = compiled(folder.path(), "tests/arduino/wire.cpp", &[], what) else {
        return;
    };
    let mut codes = Command::new(&program);
    codes.arg("codes");
    let faults = [
        ("kind = \"nack-address\"", "2 0 0\n", "2 0 0\n"),
        ("kind = \"nack-byte\"\nbyte = 1", "3 2 0\n", "2 2 0\n"),
        ("kind = \"bus-error\"", "4 0 0\n", "4 0 0\n"),
        ("kind = \"timeout\"", "5 0 1\n", "5 0 1\n"),
    ];
    for (fault, on_the_bare_bus, by_an_adapter) in faults {
        let script = folder.path().join("faults.toml");
        std::fs::write(&script, format!("[[fault]]\n{fault}\n")).unwrap();
        let source = ["--constant", "21.5", "--faults", path(&script)];
        let ended = on_the_bus(&source, &program, &["codes"]);
        assert_eq!(ended.stdout, on_the_bare_bus, "{fault}: {ended:?}");
        let ended = run_emulated(Way::Preload, &source, &codes);
        assert_eq!(ended.stdout, by_an_adapter, "{fault}: {ended:?}");
    }
}

#[test]
fn a_program_without_its_bus_says_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let what = "an Arduino program without a bus";
    let Some(program) = compiled(folder.path(), "tests/arduino/wire.cpp", &[], what) else {
        return;
    };
    let without = |variables: &[(&str, &str)]| {
        let mut command = Command::new(&program);
        run(command.arg("buffers").envs(variables.iter().copied()))
    };
    let says = |ended: &Ended, error: &str, hint: &str| {
        assert_eq!((ended.code, ended.stdout.as_str()), (3, ""), "{ended:?}");
        assert_eq!(ended.stderr, format!("error: {error}\nhint: {hint}\n"));
    };
    says(
        &without(&[("GRIDEYE_I2C_BUS", "250")]),
        "/dev/i2c-250: No such file or directory",
        "start the program on an emulated sensor: grideye emulate --constant 21.5 -- PROGRAM",
    );
    says(
        &without(&[("GRIDEYE_I2C_SOCKET", "/nowhere")]),
        "the socket /nowhere of GRIDEYE_I2C_SOCKET: No such file or directory",
        "is it there? grideye emulate --constant 21.5 --socket PATH -- PROGRAM",
    );
    let shell = |program: &Path| format!("GRIDEYE_I2C_BUS=7 exec {} buffers", path(program));
    says(
        &on_the_bus(
            &["--constant", "21.5"],
            Path::new("sh"),
            &["-c", &shell(&program)],
        ),
        "there is no bus 7; the server has 1",
        "GRIDEYE_I2C_BUS=N makes bus N the first: Wire",
    );

    let socket = folder.path().join("bus");
    let mut server = grideye();
    server.args([
        "emulate",
        "--quiet",
        "--constant",
        "21.5",
        "--seconds",
        "1",
        "--socket",
    ]);
    let mut server = server.arg(&socket).spawn().unwrap();
    wait_for("the socket", || socket.exists().then_some(()));
    let mut command = Command::new(&program);
    let ended = run(command.arg("forever").env("GRIDEYE_I2C_SOCKET", &socket));
    server.wait().unwrap();
    assert_eq!((ended.code, ended.stdout.as_str()), (3, ""), "{ended:?}");
    let said = "error: the emulated bus went away: ";
    assert!(ended.stderr.starts_with(said), "{ended:?}");
}

#[test]
fn serial_reads_standard_input_and_no_interrupt_is_promised() {
    let folder = tempfile::tempdir().unwrap();
    let what = "Arduino's Serial";
    let Some(program) = compiled(folder.path(), "tests/arduino/wire.cpp", &[], what) else {
        return;
    };
    let line = format!("printf 'go on\\n7' | {} input", program.display());
    let ended = run(Command::new("sh").args(["-c", &line]));
    assert_eq!(ended.stdout, "go on, then 1: 7\npin 1\n", "{ended:?}");
    assert!(
        ended.stderr.starts_with("note: no interrupt comes: "),
        "{ended:?}"
    );
}

/// A transaction in a trace: when it began, and the bytes of each of its messages.
struct Transaction {
    start_s: f64,
    lengths: Vec<usize>,
}

fn transactions(trace: &Path) -> Vec<Transaction> {
    let mut transactions: Vec<Transaction> = Vec::new();
    for row in std::fs::read_to_string(trace).unwrap().lines().skip(1) {
        let cells: Vec<&str> = row.split(',').collect();
        let length = cells[6].split_whitespace().count();
        match (cells[3], transactions.last_mut()) {
            ("Sr", Some(transaction)) => transaction.lengths.push(length),
            _ => transactions.push(Transaction {
                start_s: cells[0].parse().unwrap(),
                lengths: vec![length],
            }),
        }
    }
    transactions
}

/// Frames of one temperature each, and each with its own; no byte of one is in the next.
fn ticking(folder: &Path) -> PathBuf {
    let frames = (0..250).map(|frame| Words {
        pixels: [frame + 0x100 * (frame % 7); 64],
        thermistor: 0x190,
    });
    recording(folder, "ticking.csv", frames)
}

/// What a way of reading gave, beside what the bus time says of it.
#[derive(Default, Debug)]
struct Count {
    reads: usize,
    torn: usize,
    predicted: usize,
    differ: usize,
    expected: f64,
}

/// The sensor has a frame each 0.1 s of the trace's clock, and a transaction holds the one of its START (reference, 1.4).
/// So a frame is torn exactly if the START of its last transaction is not in the same tenth of a second as the first's.
fn count(printed: &str, trace: &Path, way: &str) -> Count {
    let mut transactions = transactions(trace).into_iter();
    let mut count = Count::default();
    for (number, line) in printed.lines().enumerate() {
        let each = match line.split_once(':').unwrap().0 {
            "one burst" => 1,
            "32-byte parts" => 4,
            _ => 64,
        };
        let starts: Vec<f64> = transactions
            .by_ref()
            .take(each)
            .map(|t| t.start_s)
            .collect();
        // The recording begins with the first transfer, and its first frame lasts for two.
        if number < 3 || !line.starts_with(way) || starts.len() < each {
            continue;
        }
        let (first, last) = (starts[0] / 0.1, starts[each - 1] / 0.1);
        let is_torn = line.contains("torn");
        let is_predicted = first.floor() < last.floor();
        count.reads += 1;
        count.torn += usize::from(is_torn);
        count.predicted += usize::from(is_predicted);
        count.differ += usize::from(is_torn != is_predicted);
        count.expected += last - first;
    }
    count
}

fn reads(flags: &[&str], seconds: &str) -> Option<(String, tempfile::TempDir)> {
    let folder = tempfile::tempdir().unwrap();
    let what = "how Arduino sketches tear frames";
    let source = format!("{EXAMPLE}/sketches/reads/reads.ino");
    let sketch = compiled(folder.path(), &source, flags, what)?;
    let ticking = ticking(folder.path());
    let trace = folder.path().join("bus.csv");
    let source = ["--recording", path(&ticking), "--replay", "frames"];
    let bus = ["--scl", "100000", "--trace", path(&trace)];
    let ended = on_the_bus(
        &[&source[..], &bus].concat(),
        Path::new("timeout"),
        &[seconds, path(&sketch)],
    );
    assert_eq!(ended.code, 124, "{ended:?}");
    Some((ended.stdout, folder))
}

/// One burst is cut to 32 bytes, and what the sketch takes for the rest is -1: -0.25 °C. The other ways tear, each of the
/// frames that the bus time says.
#[test]
fn each_way_of_reading_tears_the_frames_that_the_bus_time_says() {
    let Some((printed, folder)) = reads(&[], "8") else {
        return;
    };
    let trace = folder.path().join("bus.csv");
    let mut table = String::new();
    for way in ["32-byte parts", "by pixel"] {
        let Count {
            reads,
            torn,
            predicted,
            differ,
            expected,
        } = count(&printed, &trace, way);
        writeln!(
            table,
            "{way}: {torn} of {reads} torn, {predicted} predicted, by time {expected:.1}"
        )
        .unwrap();
        assert!(reads > 40 && differ == 0, "{differ} {table}");
    }
    print!("{table}");
    assert!(count(&printed, &trace, "by pixel").torn > 10, "{table}");
    let bursts = printed.lines().filter(|line| line.starts_with("one burst"));
    for burst in bursts {
        assert_eq!(burst, "one burst: 32 bytes, torn at pixel 17: -0.25");
    }
}

/// With the buffer of an ESP32 the burst is whole, and never torn.
#[test]
fn one_burst_in_a_larger_buffer_is_never_torn() {
    let Some((printed, folder)) = reads(&["-DBUFFER_LENGTH=128"], "4") else {
        return;
    };
    let count = count(&printed, &folder.path().join("bus.csv"), "one burst");
    assert!(count.reads > 20 && count.torn == 0, "{count:?}");
    for burst in printed.lines().filter(|line| line.starts_with("one burst")) {
        assert_eq!(burst, "one burst: 128 bytes, whole");
    }
}

/// Panasonic's printed words (AMG88 spec §4-11-11, §4-11-9) as the firmware of the example prints them.
#[test]
fn the_firmware_prints_what_panasonic_printed() {
    const PIXELS: [(u16, &str); 7] = [
        (0xFFF, "-0.25"),
        (0xF9C, "-25.00"),
        (0xF24, "-55.00"),
        (0x000, "0.00"),
        (0x001, "0.25"),
        (0x064, "25.00"),
        (0x1F4, "125.00"),
    ];
    let folder = tempfile::tempdir().unwrap();
    let source = format!("{EXAMPLE}/src/main.cpp");
    let Some(firmware) = compiled(folder.path(), &source, &[], "the example's firmware") else {
        return;
    };
    let command = format!("timeout 10 {} | head -n 1", firmware.display());
    let mut shell = Command::new("sh");
    shell.args(["-c", &command]);
    for (thermistor, printed) in [(0x804, "-0.2500"), (0x940, "-20.0000"), (0x190, "25.0000")] {
        let pixels = std::array::from_fn(|pixel| PIXELS[pixel % PIXELS.len()].0);
        let words = Words { pixels, thermistor };
        let file = recording(folder.path(), "printed.csv", [words]);
        let mut ways = Way::to_a_device_file("the example's firmware");
        ways.retain(|way| *way == Way::Fuse || thermistor == 0x804);
        for way in ways {
            let ended = run_emulated(way, &["--recording", path(&file)], &shell);
            let expected: Vec<&str> = (0..64)
                .map(|pixel| PIXELS[pixel % PIXELS.len()].1)
                .collect();
            let expected = format!(
                "thermistor {printed} pixels {} warm\r\n",
                expected.join(" ")
            );
            assert_eq!(ended.stdout, expected, "{way:?}: {ended:?}");
        }
    }
}

/// The sensor restarts with its defaults, silently, and the firmware sets its level again.
#[test]
fn the_firmware_notices_a_brown_out() {
    let folder = tempfile::tempdir().unwrap();
    let source = format!("{EXAMPLE}/src/main.cpp");
    let Some(firmware) = compiled(folder.path(), &source, &[], "a brown-out") else {
        return;
    };
    let (faults, trace) = (
        folder.path().join("faults.toml"),
        folder.path().join("bus.csv"),
    );
    std::fs::write(&faults, "[[fault]]\nkind = \"brown-out\"\nat = \"1.2 s\"\n").unwrap();
    let source = [
        "--constant",
        "-20.5",
        "--faults",
        path(&faults),
        "--trace",
        path(&trace),
    ];
    let ended = on_the_bus(&source, Path::new("timeout"), &["3", path(&firmware)]);
    let lines: Vec<&str> = ended.stdout.lines().collect();
    let restarted: Vec<usize> = (0..lines.len())
        .filter(|at| lines[*at] == "the sensor restarted")
        .collect();
    let [at] = restarted[..] else {
        panic!("{ended:?}");
    };
    for line in lines[..at].iter().chain(&lines[at + 1..]) {
        assert!(
            line.starts_with("thermistor -16.0000 pixels -20.50 -20.50"),
            "{line}"
        );
    }
    assert!(at > 3 && lines.len() - at > 3, "{ended:?}");
    // -10 °C is 0xFD8 (AMG88 spec §4-11-8).
    let trace = std::fs::read_to_string(trace).unwrap();
    let level = |byte: &str| trace.matches(&format!(",write,{byte},ack")).count();
    assert_eq!((level("0x08 0xd8"), level("0x09 0x0f")), (2, 2), "{trace}");
}

/// The example's folder as the page has it made, and a line of the page or the workflow run in there.
struct Checkout(tempfile::TempDir);

impl Checkout {
    fn new() -> Self {
        let checkout = Self(tempfile::tempdir().unwrap());
        let page = read(&format!("{EXAMPLE}/README.md"));
        let copy = page
            .lines()
            .find(|line| line.starts_with("cp -r "))
            .unwrap();
        let ended = checkout.run(copy, &root());
        assert_eq!(ended.code, 0, "{ended:?}");
        checkout
    }

    fn folder(&self) -> PathBuf {
        self.0.path().join("firmware")
    }

    fn run(&self, line: &str, here: &Path) -> Ended {
        let line = line.replace("/tmp/firmware", path(&self.folder()));
        let mut search = programs::folder().canonicalize().unwrap().into_os_string();
        search.push(":");
        search.push(std::env::var_os("PATH").unwrap());
        let mut shell = Command::new("bash");
        run(shell
            .args(["-e", "-c", &line])
            .current_dir(here)
            .env("PATH", search))
    }

    /// A line of the page that begins like this.
    fn run_page(&self, start: &str) -> Ended {
        let page = read(&format!("{EXAMPLE}/README.md"));
        let line = page.lines().find(|line| line.starts_with(start)).unwrap();
        self.run(line, &root())
    }
}

fn read(file: &str) -> String {
    std::fs::read_to_string(root().join(file)).unwrap()
}

#[test]
fn the_examples_driver_is_green_and_one_without_a_sign_is_red() {
    if is_left_out(WITHOUT_CXX, "the example of firmware in CI") {
        return;
    }
    let checkout = Checkout::new();
    let ended = checkout.run("make test", &checkout.folder());
    assert_eq!(ended.code, 0, "{ended:?}");
    let ended = checkout.run_page("make -C /tmp/firmware -B test-driver CXXFLAGS=-DWRONG");
    assert_eq!(ended.code, 2, "{ended:?}");
    let said: Vec<&str> = ended
        .stdout
        .lines()
        .filter(|line| line.starts_with("FAIL"))
        .collect();
    let [first, last] = [
        "FAIL pixel 1: 1003.5, expected -20.5",
        "FAIL pixel 64: 1003.5, expected -20.5",
    ];
    assert_eq!(said, [first, last]);
    assert!(read(&format!("{EXAMPLE}/README.md")).contains(first));
    // The firmware's own test sees it, too: a freezer at 1003 °C is warm.
    let ended = checkout.run(
        "make -B test-firmware CXXFLAGS=-DWRONG_BELOW_ZERO",
        &checkout.folder(),
    );
    assert_eq!(ended.code, 2, "{ended:?}");
}

/// Linked by Debian's compiler and core, for both boards: ELF files for AVR with the TWI's interrupt in use.
#[test]
fn the_firmware_is_built_for_the_boards() {
    if is_left_out(WITHOUT_AVR_GCC, "firmware for AVR") {
        return;
    }
    let checkout = Checkout::new();
    let ended = checkout.run_page("make -C /tmp/firmware uno mega");
    assert_eq!(ended.code, 0, "{ended:?}");
    for board in ["uno", "mega"] {
        let file = checkout
            .folder()
            .join("build")
            .join(board)
            .join("firmware.elf");
        let elf = std::fs::read(&file).unwrap();
        // EM_AVR.
        assert_eq!((&elf[..4], elf[18]), (&b"\x7fELF"[..], 83), "{board}");
        let names = run(Command::new("avr-nm").arg(&file));
        assert!(names.stdout.contains("twi_"), "{board}: {names:?}");
    }
}

/// Against GitHub's own schema; and its lines are those of the tests above, besides installations.
#[test]
fn a_public_ci_takes_the_workflow_of_the_firmware() {
    let requirements = "tests/examples/requirements.txt";
    let what = "the firmware's workflow against GitHub's schema";
    let Some(programs) = python::programs("examples", requirements, what) else {
        return;
    };
    let checked = run(Command::new(programs.join("check-jsonschema"))
        .args(["--builtin-schema", "vendor.github-workflows"])
        .arg(root().join(WORKFLOW)));
    assert_eq!(checked.code, 0, "{checked:?}");
    let workflow = read(WORKFLOW);
    let lines = workflow
        .lines()
        .map(|line| line.trim_start_matches([' ', '-']));
    let run_lines: Vec<&str> = lines
        .filter_map(|line| line.strip_prefix("run: "))
        .collect();
    let [pip, test, apt, boards] = run_lines[..] else {
        panic!("{run_lines:?}");
    };
    assert_eq!(
        (pip, test, boards),
        ("pip install grideye-hil", "make test", "make uno mega")
    );
    assert!(apt.ends_with(" gcc-avr avr-libc arduino-core-avr"), "{apt}");
}
