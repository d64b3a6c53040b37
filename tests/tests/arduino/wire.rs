//! `Wire` and `Serial` of the core beside an AVR's.

use crate::kit::{compiled, compiled_with_sensors, on_the_bus, path, transactions};
use grideye_tests::emulated::run_emulated;
use grideye_tests::programs::{Ended, root, run};
use std::path::Path;
use std::process::Command;

/// `prints.txt` is what an ATmega328P printed with Debian's arduino-core-avr 1.8.7 in simavr 1.6.
#[test]
fn a_sketch_prints_what_an_avr_prints() {
    let folder = tempfile::tempdir().unwrap();
    let what = "what Arduino's Serial prints";
    let Some(sketch) = compiled(folder.path(), "tests/arduino/prints.ino", what) else {
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
    let trace = folder.path().join("bus");
    let what = "Arduino's Wire";
    let Some(program) = compiled_with_sensors(folder.path(), "tests/arduino/wire.cpp", what) else {
        return;
    };
    let ended = run(on_the_bus("", &trace, &program).arg("buffers"));
    let expected = "taken one by one 32, write error 1\ntaken at once 40\nsent 0\n\
         requested 128, arrived 32, available 32\npeek 86, read 86, left 31\nas a stream 31\nbeyond the end -1 -1\n\
         requested 0, arrived 0\n";
    assert_eq!(ended.stdout, expected, "{ended:?}");
    let transactions = transactions(&trace);
    // The last is the address held for the request for nothing.
    let lengths: Vec<Vec<usize>> = transactions.into_iter().map(|t| t.lengths).collect();
    assert_eq!(lengths, [vec![32], vec![1, 32], vec![1]]);
}

#[test]
fn wire_sends_what_is_held_with_what_follows() {
    let folder = tempfile::tempdir().unwrap();
    let trace = folder.path().join("bus");
    let what = "transactions of Arduino's Wire";
    let Some(program) = compiled_with_sensors(folder.path(), "tests/arduino/wire.cpp", what) else {
        return;
    };
    let mut command = on_the_bus("two buses", &trace, &program);
    let ended = run(command.arg("transactions").env("GRIDEYE_CELSIUS", "-4.75"));
    // -4.75 + 4.5 °C is -0.25 °C, of the thermistor 0x804 (AMG88 spec §4-11-9).
    let expected = "register by request 2: 04 08\ntwo starts 0, rate 1 1\nsecond bus 0\n";
    assert_eq!(ended.stdout, expected, "{ended:?}");
    let lengths: Vec<Vec<usize>> = transactions(&trace)
        .into_iter()
        .map(|t| t.lengths)
        .collect();
    // As an AVR sends it: the address alone, and a repeated START to write.
    assert_eq!(lengths, [vec![1, 2], vec![0, 2], vec![1, 1], vec![0]]);
}

/// The codes of Wire.h on the bare bus, and what an adapter leaves of them.
#[test]
fn a_fault_becomes_the_code_of_an_avr() {
    let folder = tempfile::tempdir().unwrap();
    let what = "faults in Arduino's Wire";
    let Some(by_device) = compiled(folder.path(), "tests/arduino/wire.cpp", what) else {
        return;
    };
    let with_sensors = tempfile::tempdir().unwrap();
    let program =
        compiled_with_sensors(with_sensors.path(), "tests/arduino/wire.cpp", what).unwrap();
    let mut codes = Command::new(by_device);
    codes.arg("codes");
    let faults = [
        ("kind = \"nack-address\"", "2 2 0 0\n", "2 0 0 0\n"),
        ("kind = \"nack-byte\"\nbyte = 1", "3 0 2 0\n", "2 0 2 0\n"),
        ("kind = \"bus-error\"", "4 4 0 0\n", "4 0 0 0\n"),
        ("kind = \"timeout\"", "5 5 0 1\n", "5 0 0 1\n"),
    ];
    for (fault, on_the_bare_bus, by_an_adapter) in faults {
        let script = folder.path().join("faults.toml");
        std::fs::write(&script, format!("[[fault]]\n{fault}\n")).unwrap();
        let source = ["--constant", "21.5", "--faults", path(&script)];
        let kind = fault.split('"').nth(1).unwrap();
        let ended = run(on_the_bus(kind, Path::new("/dev/null"), &program).arg("codes"));
        assert_eq!(ended.stdout, on_the_bare_bus, "{fault}: {ended:?}");
        let ended = run_emulated(&source, &codes);
        assert_eq!(ended.stdout, by_an_adapter, "{fault}: {ended:?}");
    }
}

#[test]
fn a_program_without_its_bus_says_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let what = "an Arduino program without a bus";
    let Some(program) = compiled(folder.path(), "tests/arduino/wire.cpp", what) else {
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
}

#[test]
fn serial_reads_standard_input_and_no_interrupt_is_promised() {
    let folder = tempfile::tempdir().unwrap();
    let what = "Arduino's Serial";
    let Some(program) = compiled(folder.path(), "tests/arduino/wire.cpp", what) else {
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
