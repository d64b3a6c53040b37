//! The project to copy, `tests/examples/firmware-ci`: its firmware, and the lines of its page and its workflow.

use crate::kit::{
    Checkout, EXAMPLE, MACHINE, WITHOUT_AVR, WITHOUT_CXX, compiled, compiled_with_sensors,
    on_the_bus, path, read,
};
use grideye_tests::emulated::{Words, recording, run_emulated};
use grideye_tests::programs::{is_left_out, root, run};
use grideye_tests::{python, workflow};
use std::path::Path;
use std::process::Command;

const WORKFLOW: &str = "tests/examples/firmware-ci/.github/workflows/firmware.yml";

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
    let Some(firmware) = compiled(folder.path(), &source, "the example's firmware") else {
        return;
    };
    let command = format!("timeout 10 {} | head -n 1", firmware.display());
    let mut shell = Command::new("sh");
    shell.args(["-c", &command]);
    for (thermistor, printed) in [(0x804, "-0.2500"), (0x940, "-20.0000"), (0x190, "25.0000")] {
        let pixels = std::array::from_fn(|pixel| PIXELS[pixel % PIXELS.len()].0);
        let words = Words { pixels, thermistor };
        let file = recording(folder.path(), "printed.csv", [words]);
        let ended = run_emulated(&["--recording", path(&file)], &shell);
        let expected: Vec<&str> = (0..64)
            .map(|pixel| PIXELS[pixel % PIXELS.len()].1)
            .collect();
        let expected = format!(
            "thermistor {printed} pixels {} warm\r\n",
            expected.join(" ")
        );
        assert_eq!(ended.stdout, expected, "{ended:?}");
    }
}

/// The sensor restarts with its defaults, silently, and the firmware sets its level again.
#[test]
fn the_firmware_notices_a_brown_out() {
    let folder = tempfile::tempdir().unwrap();
    let source = format!("{EXAMPLE}/src/main.cpp");
    let Some(firmware) = compiled_with_sensors(folder.path(), &source, "a brown-out") else {
        return;
    };
    let trace = folder.path().join("bus");
    let line = format!("{} | head -n 25", firmware.display());
    let mut command = on_the_bus("brown-out", &trace, Path::new("sh"));
    let ended = run(command.env("GRIDEYE_CELSIUS", "-20.5").args(["-c", &line]));
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
    let level = |bytes: &str| trace.matches(&format!(" w{bytes}\n")).count();
    assert_eq!((level("08d8"), level("090f")), (2, 2), "{trace}");
}

/// Two pixels become warm in frame 31, 3.1 s after power-on; the sketch waits from 0.25 s on.
#[test]
fn the_interrupt_comes_when_the_sensor_has_it() {
    if is_left_out(WITHOUT_CXX, "interrupts of an Arduino sketch") {
        return;
    }
    let checkout = Checkout::new();
    let machine = root().join(MACHINE).canonicalize().unwrap();
    let line = format!("make build/interrupt SENSORS={}", path(&machine));
    let made = checkout.run(&line, &checkout.folder());
    assert_eq!(made.code, 0, "{made:?}");
    let sketch = checkout.folder().join("build/interrupt");
    let ended = run(&mut on_the_bus("warm", Path::new("/dev/null"), &sketch));
    let expected =
        "pin 1\r\ninterrupt after 28 tenths of a second, pin 0, pixels 1 2 0 0 0 0 0 0\r\n";
    assert_eq!(ended.stdout, expected, "{ended:?}");
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
}

/// In C by assert(), in C++ by doctest; both tests have at most 15 lines.
#[test]
fn the_driver_in_c_is_green_and_one_without_a_sign_is_red() {
    if is_left_out(WITHOUT_CXX, "the example of a driver in C") {
        return;
    }
    let checkout = Checkout::new();
    let ended = checkout.run_page("make -C /tmp/firmware test-c");
    assert_eq!(ended.code, 0, "{ended:?}");
    assert!(ended.stdout.contains("15 passed"), "{ended:?}");
    let ended = checkout.run_page("make -C /tmp/firmware -B -k test-c ");
    assert_eq!(ended.code, 2, "{ended:?}");
    let page = read(&format!("{EXAMPLE}/README.md"));
    for said in [
        "Assertion `pixels_c[0] == -0.25f",
        "CHECK( 1003.5 == -20.5 )",
    ] {
        let all = format!("{}{}", ended.stdout, ended.stderr);
        assert!(all.contains(said) && page.contains(said), "{ended:?}");
    }
    for test in ["test/test_plain.c", "test/test_doctest.cpp"] {
        let text = read(&format!("{EXAMPLE}/{test}"));
        let lines = text.lines().filter(|line| {
            let line = line.trim_start();
            !line.is_empty() && !line.starts_with("//") && !line.starts_with("/*")
        });
        assert!(lines.count() <= 15, "{test}");
    }
}

/// Linked by Debian's compiler and core, for both boards: ELF files for AVR with the TWI's interrupt in use.
#[test]
fn the_firmware_is_built_for_the_boards() {
    if is_left_out(WITHOUT_AVR, "firmware for AVR") {
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

/// The ELF files themselves, in simavr: green, and red without the sign.
#[test]
fn the_firmware_runs_on_both_boards() {
    if is_left_out(WITHOUT_AVR, "firmware on emulated boards") {
        return;
    }
    let checkout = Checkout::new();
    let ended = checkout.run_page("make -C /tmp/firmware test-avr");
    assert_eq!(ended.code, 0, "{ended:?}");
    for board in ["atmega328p", "atmega2560"] {
        assert!(ended.stderr.contains(board), "{ended:?}");
    }
    let line = "make -B uno mega CXXFLAGS=-DWRONG_BELOW_ZERO && make test-avr";
    let ended = checkout.run(line, &checkout.folder());
    assert_eq!(ended.code, 2, "{ended:?}");
    assert!(ended.stdout.contains("pixels 1019.00 "), "{ended:?}");
}

/// Against GitHub's own schema; and its lines are those of the tests above, besides installations.
#[test]
fn a_public_ci_takes_the_workflow_of_the_firmware() {
    let requirements = "tests/examples/requirements.txt";
    let what = "the firmware's workflow against GitHub's schema";
    let Some(programs) = python::programs("examples", requirements, what) else {
        return;
    };
    workflow::check(&programs, "vendor.github-workflows", WORKFLOW);
    let lines = workflow::run_lines(WORKFLOW);
    let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
    let [doctest, library, test, apt, boards, pip, avr] = lines[..] else {
        panic!("{lines:?}");
    };
    assert_eq!(
        (pip, test, boards, avr),
        (
            "pip install grideye-hil",
            "make test",
            "make uno mega",
            "make test-avr"
        )
    );
    assert!(doctest.ends_with(" doctest-dev"), "{doctest}");
    let built = "cargo build --release --manifest-path grideye-hil/Cargo.toml -p amg8833-c";
    assert_eq!(library, built);
    let packages = " gcc-avr avr-libc arduino-core-avr libsimavr-dev";
    assert!(apt.ends_with(packages), "{apt}");
}
