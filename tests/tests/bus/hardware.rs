//! The suite for a real sensor (`tests/hardware`) on the emulated `/dev/i2c-1`, with a device file that declares the
//! emulation.

#![expect(clippy::unwrap_used, reason = "what fails in a helper fails the test")]

use grideye_tests::emulated::run_emulated;
use grideye_tests::programs::{Ended, grideye_hardware, run};
use std::process::Command;

/// The suite's exit code if this computer paused for longer than a frame.
const PAUSED: i32 = 3;

fn suite(source: &[&str], address: &str) -> Ended {
    let folder = tempfile::tempdir().unwrap();
    let device = folder.path().join("device.toml");
    let text =
        format!("what = \"a test\"\nemulated = true\nbus = \"/dev/i2c-1\"\naddress = {address}\n");
    std::fs::write(&device, text).unwrap();
    let mut command = Command::new(grideye_hardware().get_program());
    command.arg(device);
    (0..3)
        .map(|_| run_emulated(source, &command))
        .find(|ended| ended.code != PAUSED)
        .unwrap()
}

#[test]
fn every_check_passes_on_the_emulated_sensor() {
    let ended = suite(&["--scene", "scenes/experiment-1.toml"], "0x69");
    assert_eq!(ended.code, 0, "{ended:?}");
    assert_eq!(ended.stdout.matches("\nok    ").count(), 8, "{ended:?}");
    assert!(
        ended
            .stdout
            .starts_with("a test (emulated), address 0x69 on /dev/i2c-1\n")
    );
}

#[test]
fn a_sensor_that_shows_no_new_frames_fails_by_name() {
    let ended = suite(&["--constant", "25"], "0x69");
    assert_eq!(ended.code, 1, "{ended:?}");
    for check in [
        "10 frames a second",
        "1 frame a second",
        "frames go on after sleep and wake",
    ] {
        assert!(
            ended.stdout.contains(&format!("\nFAIL  {check}")),
            "{ended:?}"
        );
    }
    assert_eq!(ended.stderr, "error: 3 checks failed\n");
}

#[test]
fn without_a_sensor_that_a_device_file_names_nothing_is_checked() {
    let ended = run(&mut grideye_hardware());
    assert_eq!((ended.code, ended.stdout.as_str()), (2, ""));
    assert!(
        ended
            .stderr
            .contains("expected the path of one device file\nhint: "),
        "{ended:?}"
    );
    let wrong = suite(&["--constant", "25"], "0x70");
    assert_eq!((wrong.code, wrong.stdout.as_str()), (2, ""), "{wrong:?}");
    let silent = suite(&["--constant", "25"], "0x68");
    assert_eq!(silent.code, 1, "{silent:?}");
    assert!(silent.stderr.contains("EREMOTEIO"), "{silent:?}");
}
