//! Firmware of AVR microcontrollers in simavr, with the emulated sensor at its TWI. avr-gcc compiles it, without any library of
//! Arduino's; what it reads is asserted from the datasheet's words.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_tests::emulated::{Words, recording};
use grideye_tests::programs::{Ended, grideye, is_left_out, root, run};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const MCUS: [&str; 2] = ["atmega328p", "atmega2560"];

/// A folder with firmware that does this; `None` if this machine has no compiler for it.
fn built(what: &str, mcu: &str) -> Option<(tempfile::TempDir, PathBuf)> {
    if is_left_out(
        "GRIDEYE_WITHOUT_AVR",
        "firmware of an AVR on the emulated sensor",
    ) {
        return None;
    }
    let folder = tempfile::tempdir().unwrap();
    let elf = folder.path().join("probe.elf");
    let mut compiler = Command::new("avr-gcc");
    compiler
        .arg(format!("-mmcu={mcu}"))
        .arg(format!("-DDO_{what}"));
    compiler
        .args(["-Os", "-Wall", "-Werror", "-DF_CPU=16000000UL", "-o"])
        .arg(&elf);
    let ended = run(compiler.arg(root().join("tests/firmware/probe.c")));
    assert_eq!(ended.code, 0, "{ended:?}");
    Some((folder, elf))
}

fn emulate(firmware: &Path, arguments: &[&str]) -> Ended {
    run(&mut emulating(firmware, arguments))
}

fn emulating(firmware: &Path, arguments: &[&str]) -> Command {
    let mut command = grideye();
    command
        .arg("emulate")
        .args(arguments)
        .arg("--")
        .arg(firmware);
    command
}

/// Pixels 1 to 64 from -40 to +75.75 °C.
fn words() -> Words {
    Words {
        pixels: std::array::from_fn(|pixel| {
            let quarters = i16::try_from(pixel).unwrap() * 7 - 160;
            u16::from_ne_bytes(quarters.to_ne_bytes()) & 0xFFF
        }),
        thermistor: 0x191,
    }
}

#[test]
fn an_avr_reads_the_words_of_a_frame_in_one_transaction() {
    for mcu in MCUS {
        let Some((folder, elf)) = built("READ", mcu) else {
            return;
        };
        let known = recording(folder.path(), "known.csv", [words()]);
        let known = known.to_str().unwrap();
        let trace = folder.path().join("bus.csv");
        let arguments = ["--recording", known, "--until", "read all\n", "--trace"];
        let arguments = [&arguments[..], &[trace.to_str().unwrap()]].concat();
        let ended = emulate(&elf, &arguments);
        assert_eq!(ended.code, 0, "{ended:?}");
        let trace = std::fs::read_to_string(&trace).unwrap();
        let starts = trace
            .lines()
            .skip(1)
            .map(|line| line.split(',').next().unwrap());
        let starts: Vec<f64> = starts.map(|time| time.parse().unwrap()).collect();
        // An address and a register of nine bits each at 400 kHz, and the instructions between.
        let bits = (starts[1] - starts[0]) * 400_000.0;
        assert!((18.0..24.0).contains(&bits), "{mcu}: {bits}");
        let pixels: Vec<String> = words()
            .pixels
            .iter()
            .map(|word| format!("{word:04x}"))
            .collect();
        // 0x20: SLA+W sent, not acknowledged (DS40002061, table 22-2).
        let expected = format!("0191\n{}\n0020\nread all\n", pixels.join(" "));
        assert_eq!(ended.stdout, expected, "{mcu}");
        assert!(
            ended.stderr.contains(&format!("of an {mcu} in")),
            "{}",
            ended.stderr
        );
        assert!(ended.stderr.contains("times real time"), "{}", ended.stderr);
        assert!(
            ended.stderr.contains("1 addresses not acknowledged"),
            "{}",
            ended.stderr
        );
    }
}

#[test]
fn intel_hex_is_read_too_for_the_microcontroller_that_is_named() {
    let Some((folder, elf)) = built("READ", "atmega2560") else {
        return;
    };
    let hex = folder.path().join("probe.hex");
    let mut copy = Command::new("avr-objcopy");
    assert_eq!(run(copy.args(["-O", "ihex"]).arg(&elf).arg(&hex)).code, 0);
    let arguments = [
        "--constant",
        "-0.25",
        "--mcu",
        "atmega2560@16000000",
        "--until",
        "read all",
    ];
    let ended = emulate(&hex, &arguments);
    assert_eq!(ended.code, 0, "{ended:?}");
    // -0.25 °C is one quarter below zero: 0xFFF (AMG88 spec §4-11-11).
    assert!(
        ended.stdout.contains(&["0fff"; 64].join(" ")),
        "{}",
        ended.stdout
    );
}

#[test]
fn serial_input_goes_in_and_the_exit_code_comes_out() {
    let Some((_folder, elf)) = built("ECHO", "atmega328p") else {
        return;
    };
    let mut command = emulating(&elf, &["--constant", "20", "--quiet"]);
    let command = command.stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = command.spawn().unwrap();
    child
        .stdin
        .take()
        .unwrap()
        .write_all(b"seventeen letters\n")
        .unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.stdout, b"seventeen letters\n");
    assert_eq!(output.status.code(), Some(18));
}

/// One second of 20 °C, then one warm pixel: INT falls at the frame that has it, and the firmware wakes.
#[test]
fn the_interrupt_reaches_a_port_pin_at_the_frame_that_raises_it() {
    let Some((folder, elf)) = built("INT", "atmega328p") else {
        return;
    };
    let frame = |warm: bool| Words {
        pixels: std::array::from_fn(|pixel| if warm && pixel == 9 { 124 } else { 80 }),
        thermistor: 0x191,
    };
    let frames = (0..20).map(|at| frame(at >= 10));
    let known = recording(folder.path(), "warm.csv", frames);
    let known = ["--recording", known.to_str().unwrap(), "--replay", "frames"];
    let ended = emulate(
        &elf,
        &[&known[..], &["--int", "PD2", "--seconds", "5"]].concat(),
    );
    // Pixel 10 is bit 1 of the second row of the table (AMG88 spec §4-11-9).
    assert_eq!(ended.stdout, "interrupt 0002000000000000\n", "{ended:?}");
    assert_eq!(ended.code, 0, "{ended:?}");
    let seconds: f64 = ended
        .stderr
        .split(" s of an")
        .next()
        .unwrap()
        .rsplit(' ')
        .next()
        .unwrap()
        .parse()
        .unwrap();
    assert!((0.9..1.3).contains(&seconds), "{}", ended.stderr);
    // Without the wire it sleeps forever.
    let ended = emulate(&elf, &[&known[..], &["--seconds", "5"]].concat());
    assert_eq!((ended.stdout.as_str(), ended.code), ("", 0), "{ended:?}");
}

/// The sensor's clock is the firmware's: a slow sensor repeats frames to a firmware that reads every 100 ms.
#[test]
fn sensor_and_firmware_have_one_clock() {
    let Some((folder, elf)) = built("TIME", "atmega328p") else {
        return;
    };
    let frames = (0..40).map(|at| Words {
        pixels: [at; 64],
        thermistor: 0x191,
    });
    let known = recording(folder.path(), "counting.csv", frames);
    let known = ["--recording", known.to_str().unwrap(), "--replay", "frames"];
    let read = |error: &str| {
        let ended = emulate(&elf, &[&known[..], &["--clock-error", error]].concat());
        assert_eq!(ended.code, 0, "{ended:?}");
        let words = ended
            .stdout
            .lines()
            .map(|line| u16::from_str_radix(line, 16).unwrap());
        words.collect::<Vec<u16>>()
    };
    let [slow, fast] = ["-100000", "100000"].map(read);
    // 30 reads span 2.9 s: 26 periods of a sensor that is 10 % slow, 31 or 32 of one that is 10 % fast.
    let span = |words: &[u16]| words.last().unwrap() - words[0];
    assert!((25..=27).contains(&span(&slow)), "{slow:?}");
    assert!((31..=33).contains(&span(&fast)), "{fast:?}");
    assert_eq!(read("-100000"), slow, "the same run twice");
}

#[test]
fn firmware_that_cannot_run_is_named_with_the_fix() {
    let Some((folder, elf)) = built("NOTHING", "atmega2560") else {
        return;
    };
    let refused = |file: &Path, arguments: &[&str], words: &[&str]| {
        let ended = emulate(file, &[&["--constant", "20"][..], arguments].concat());
        assert_eq!(ended.code, 2, "{ended:?}");
        for word in words.iter().chain(&["hint: "]) {
            assert!(ended.stderr.contains(word), "{word}: {}", ended.stderr);
        }
    };
    refused(
        &elf,
        &["--mcu", "atmega9"],
        &["no such microcontroller", "--list-cores"],
    );
    refused(&elf, &["--int", "PZ9"], &["no such pin", "PD2"]);
    refused(&elf, &["--scl", "400000"], &["--scl", "firmware"]);
    refused(&elf, &["--adapter", "usb"], &["--adapter"]);
    // An ELF header of 32 bits for Xtensa, without segments (ELF specification, figure 1-3).
    let other = folder.path().join("esp32.elf");
    let mut header = b"\x7fELF\x01\x01\x01".to_vec();
    header.resize(52, 0);
    header[18] = 94;
    std::fs::write(&other, header).unwrap();
    refused(
        &other,
        &[],
        &["esp32.elf is firmware for Xtensa", "rp2040js"],
    );
    let broken = folder.path().join("broken.hex");
    std::fs::write(&broken, ":10000000\n").unwrap();
    refused(&broken, &[], &["Intel HEX"]);
    let (_folder, crash) = built("CRASH", "atmega328p").unwrap();
    refused(
        &crash,
        &["--seconds", "1"],
        &["the firmware crashed", "--mcu"],
    );
    let mut small = emulating(
        &elf,
        &["--constant", "20", "--until", "never", "--seconds", "0.2"],
    );
    let ended = run(&mut small);
    assert_eq!(
        (ended.code, ended.stdout.as_str()),
        (124, "idle\n"),
        "{ended:?}"
    );
    assert!(
        ended.stderr.contains("sent nothing by TWI"),
        "{}",
        ended.stderr
    );
    let ended = run(emulating(
        Path::new("/bin/true"),
        &["--constant", "20", "--until", "x"],
    )
    .env("PATH", "/bin"));
    assert_eq!(ended.code, 2, "{ended:?}");
    assert!(
        ended.stderr.contains("--until is for firmware"),
        "{}",
        ended.stderr
    );
}

#[test]
fn a_machine_without_simavr_is_told_its_package() {
    let Some((folder, elf)) = built("NOTHING", "atmega328p") else {
        return;
    };
    for (compiler, words) in [
        (None, "cannot be compiled"),
        (
            Some("#!/bin/sh\necho 'fatal error: simavr/sim_avr.h: No such file' >&2\nexit 1\n"),
            "simavr is missing",
        ),
    ] {
        let path = folder.path().join("bin");
        let _ = std::fs::create_dir(&path);
        if let Some(script) = compiler {
            let cc = path.join("cc");
            std::fs::write(&cc, script).unwrap();
            assert_eq!(run(Command::new("chmod").arg("+x").arg(&cc)).code, 0);
        }
        let ended = run(emulating(&elf, &["--constant", "20"]).env("PATH", &path));
        assert_eq!(ended.code, 2, "{ended:?}");
        assert!(ended.stderr.contains(words), "{}", ended.stderr);
        assert!(
            ended.stderr.contains("apt-get install gcc libsimavr-dev"),
            "{}",
            ended.stderr
        );
    }
}
