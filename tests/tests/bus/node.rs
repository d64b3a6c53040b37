//! Node's `i2c-bus`, as published, on the emulated sensor. Its plain reads and writes use pread() and pwrite().

use grideye_tests::emulated::{Way, Words, recording, run_emulated};
use grideye_tests::programs::{is_left_out, root, run, target};
use serde_json::{Value, json};
use std::process::Command;

const WITHOUT_NODE: &str = "GRIDEYE_WITHOUT_NODE";

#[test]
fn i2c_bus_reads_the_frame_by_every_call_that_it_has() {
    if is_left_out(WITHOUT_NODE, "Node's i2c-bus") {
        return;
    }
    let packages = target().join("node");
    let ended = run(Command::new(root().join("tests/node/set-up")).arg(&packages));
    assert!(
        ended.code == 0,
        "i2c-bus could not be installed: {ended:?}\n\
         hint: install Node.js with npm, make and g++, or set {WITHOUT_NODE}=1 to leave this test out"
    );
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
    node.arg(root().join("tests/node/frame.js"))
        .arg(packages.canonicalize().unwrap());
    for way in Way::to_a_device_file("Node's i2c-bus") {
        let ended = run_emulated(way, &["--recording", file.to_str().unwrap()], &node);
        assert_eq!(ended.code, 0, "{way:?}: {ended:?}");
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
        assert_eq!(said, expected, "{way:?}");
    }
}
