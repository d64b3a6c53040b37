//! Packages of npm, as published, with the emulated sensor: `i2c-bus`, whose plain reads and writes use pread() and pwrite(),
//! and `rp2040js`, in which firmware of an RP2040 runs.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_tests::emulated::{Words, recording, run_emulated};
use grideye_tests::programs::{grideye, is_left_out, root, run, target};
use grideye_tests::skip;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Command;

const WITHOUT_NODE: &str = "GRIDEYE_WITHOUT_NODE";

/// The folder of the packages; `None` if they are left out here.
fn packages(what: &str) -> Option<PathBuf> {
    if is_left_out(WITHOUT_NODE, what) {
        return None;
    }
    let packages = target().join("node");
    let ended = run(Command::new(root().join("tests/node/set-up")).arg(&packages));
    assert!(
        ended.code == 0,
        "npm's packages could not be installed: {ended:?}\n\
         hint: install Node.js with npm, make and g++, or set {WITHOUT_NODE}=1 to leave this test out"
    );
    Some(packages.canonicalize().unwrap())
}

#[test]
fn i2c_bus_reads_the_frame_by_every_call_that_it_has() {
    let Some(packages) = packages("Node's i2c-bus") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let words = Words {
        pixels: std::array::from_fn(|pixel| u16::try_from(0x105 + 7 * pixel).unwrap()),
        thermistor: 0x191,
    };
    let file = recording(folder.path(), "frame.csv", [words]);
    let bytes: Vec<u8> = words
        .pixels
        .iter()
        .flat_map(|word| word.to_le_bytes())
        .collect();
    let mut node = Command::new("node");
    node.arg(root().join("tests/node/frame.js")).arg(packages);
    let ended = run_emulated(&["--recording", file.to_str().unwrap()], &node);
    assert_eq!(ended.code, 0, "{ended:?}");
    let said: Value = serde_json::from_str(&ended.stdout).unwrap();
    let expected = json!({
        "lengths": [1, 128, 1, 128],
        "addresses": [0x69],
        "i2cWriteSync, i2cReadSync": bytes,
        "readI2cBlockSync": bytes,
        "readWordSync": bytes,
        "i2cWrite, i2cRead": bytes,
        "readI2cBlock": bytes,
    });
    assert_eq!(said, expected);
}

/// Compiles the firmware of tests/firmware for the RP2040's RAM; `None` without Rust for its processor.
fn rp2040_firmware(folder: &Path) -> Option<PathBuf> {
    const TARGET: &str = "thumbv6m-none-eabi";
    let sources = root().join("tests/firmware");
    let elf = folder.join("rp2040.elf");
    let mut compiler = Command::new("rustc");
    compiler.args(["--edition", "2024", "--target", TARGET]);
    compiler.args(["-C", "opt-level=s", "-C", "panic=abort", "-C"]);
    compiler.arg(format!("link-arg=-T{}", sources.join("rp2040.x").display()));
    let ended = run(compiler.arg("-o").arg(&elf).arg(sources.join("rp2040.rs")));
    if ended.stderr.contains("target may not be installed") {
        skip::test(&format!(
            "firmware of an RP2040 (`rustup target add {TARGET}`)"
        ));
        return None;
    }
    assert_eq!(ended.code, 0, "{ended:?}");
    Some(elf)
}

#[test]
fn an_rp2040_reads_a_frame_and_waits_for_the_interrupt() {
    let Some(packages) = packages("firmware of an RP2040 in rp2040js") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let Some(elf) = rp2040_firmware(folder.path()) else {
        return;
    };
    // 25.5 °C, and one pixel of 31 °C from the fourth frame on.
    let frame = |at: usize| Words {
        pixels: std::array::from_fn(|pixel| if pixel == 9 && at > 2 { 124 } else { 102 }),
        thermistor: 0x191,
    };
    let file = recording(folder.path(), "frames.csv", (0..12).map(frame));
    let client = root().join("crates/i2c-emulation/javascript/grideye_rp2040.mjs");
    let run_it = |ends: &[&str]| {
        let mut command = grideye();
        command.args([
            "emulate",
            "--quiet",
            "--replay",
            "frames",
            "--speed",
            "0",
            "--scl",
            "instant",
            "--recording",
        ]);
        command
            .arg(&file)
            .arg("--socket")
            .arg(folder.path().join("bus"));
        command
            .args(["--", "node"])
            .arg(&client)
            .arg(&elf)
            .args(ends);
        run(command.current_dir(&packages))
    };
    let ended = run_it(&["--until", "interrupt\n", "--int", "0=2", "--seconds", "2"]);
    let pixels = "0066 ".repeat(64);
    let expected = format!("0191\n{pixels}\nnobody\nread all\ninterrupt\n");
    assert_eq!((ended.code, &*ended.stdout), (0, &*expected), "{ended:?}");
    let seconds = ended.stderr.split(" s of an RP2040").next().unwrap();
    let seconds: f64 = seconds.rsplit(' ').next().unwrap().parse().unwrap();
    assert!((0.1..0.5).contains(&seconds), "{}", ended.stderr);
    // Without the wire the pin stays as it is: low.
    let ended = run_it(&["--until", "never", "--seconds", "0.01"]);
    assert_eq!(ended.code, 124, "{ended:?}");
    assert!(ended.stdout.ends_with("interrupt\n"), "{ended:?}");
}
