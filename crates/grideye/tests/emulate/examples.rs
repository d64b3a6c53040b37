//! The examples of EMULATE.md, run by a shell as they stand.

use crate::skip::{self, is_part_left_out};
use crate::support::{root, run};
use std::path::Path;
use std::process::Command;

const PAGE: &str = include_str!("../../EMULATE.md");

/// How often a frame in four parts is mixed of two, at three speeds of the bus: each frame of the recording is of one
/// temperature.
const MIXED: &str = r#"
python3 -c 'if True:
    print("seconds", *(f"pixel{n}" for n in range(1, 65)), sep=",")
    for n in range(600):
        print(n / 10, *[20 + n % 40 / 4] * 64, sep=",")' > /tmp/steps.csv
cat > /tmp/parts.py <<'END'
import grideye_i2c

bus, mixed = grideye_i2c.SMBus(1), 0
for _ in range(200):
    parts = [bus.read_i2c_block_data(0x69, 0x80 + at, 32) for at in (0, 32, 64, 96)]
    mixed += len({part[at] for part in parts for at in range(0, 32, 2)}) > 1
    grideye_i2c.pass_time(0.1)
print(mixed, "of 200 frames are mixed")
END
for scl in 100000 400000 instant; do
  grideye emulate --recording /tmp/steps.csv --speed 0 --scl $scl --socket /tmp/parts.sock -- \
    env PYTHONPATH=crates/i2c-emulation/python python3 /tmp/parts.py
done
"#;

/// The commands of the page, each with the words behind its ```` ```sh ````.
fn examples() -> Vec<(&'static str, &'static str)> {
    let blocks = PAGE.split("```sh").skip(1);
    blocks
        .map(|block| {
            let (needs, rest) = block.split_once('\n').unwrap();
            (needs.trim(), rest.split_once("```").unwrap().0)
        })
        .collect()
}

/// What a shell says to the example, with the program under test in its PATH.
fn shell(text: &str) -> crate::support::Ended {
    let folder = Path::new(env!("CARGO_BIN_EXE_grideye")).parent().unwrap();
    let path = format!("{}:{}", folder.display(), std::env::var("PATH").unwrap());
    let mut command = Command::new("sh");
    command
        .args(["-e", "-c", text])
        .env("PATH", path)
        .current_dir(root());
    run(&mut command)
}

fn is_to_be_left_out(needs: &str) -> bool {
    needs.split(' ').any(|need| match need {
        "i2c-tools" => is_part_left_out("GRIDEYE_WITHOUT_I2C_TOOLS", "an example of EMULATE.md with i2c-tools"),
        "python" => is_part_left_out("GRIDEYE_WITHOUT_I2C_TOOLS", "an example of EMULATE.md with Python"),
        "avr" => is_part_left_out("GRIDEYE_WITHOUT_AVR", "the example of EMULATE.md with firmware of an AVR"),
        "usbip" => {
            let is_missing = !Path::new("/sys/devices/platform/vhci_hcd.0").exists();
            if is_missing {
                skip::part("the example of EMULATE.md with --usbip (this kernel has no vhci-hcd; tests/guests runs it)");
            }
            is_missing
        }
        other => panic!("nobody knows what {other:?} needs"),
    })
}

#[test]
fn every_example_of_the_page_runs_as_it_stands() {
    let expected: [&[&str]; 6] = [
        // Eight bytes of four pixels, near the room's 23.5 °C.
        &["0x5", " 0x00"],
        // The session's first row: 30.625 °C.
        &["30.625 °C"],
        &["i2c-tiny-usb"],
        // -5.25 °C is 21 quarters below zero.
        &["0feb 0feb", "read all"],
        // 21.5 °C is 86 quarters.
        &["0x56 0x00\n0x0056"],
        &["no frame", "0x00"],
    ];
    let examples = examples();
    assert_eq!(examples.len(), expected.len());
    for ((needs, text), words) in examples.into_iter().zip(expected) {
        if is_to_be_left_out(needs) {
            continue;
        }
        let ended = shell(text);
        assert_eq!(ended.code, 0, "{text}: {ended:?}");
        for word in words {
            assert!(
                ended.stdout.contains(word),
                "{text} does not say {word:?}: {ended:?}"
            );
        }
    }
    for written in ["/tmp/loose-wire.toml", "/tmp/bus.csv", "/tmp/probe.elf"] {
        // The example that writes it may have been left out.
        let _ = std::fs::remove_file(written);
    }
}

/// The last part begins 954 bits after the first: one frame in ten is mixed at 100 kHz, one in forty at 400.
#[test]
fn as_many_frames_are_mixed_as_the_page_says() {
    assert!(
        PAGE.contains("of 200 frames in parts of 32 bytes 18 are mixed, with `--scl 400000` 5,")
    );
    if is_to_be_left_out("python") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let ended = shell(&MIXED.replace("/tmp/", &format!("{}/", folder.path().display())));
    assert_eq!(ended.code, 0, "{ended:?}");
    let expected =
        "18 of 200 frames are mixed\n5 of 200 frames are mixed\n0 of 200 frames are mixed\n";
    assert_eq!(ended.stdout, expected, "{ended:?}");
}

#[test]
fn the_example_in_the_help_of_emulate_runs() {
    let ended = shell("grideye emulate --help");
    assert_eq!(ended.code, 0);
    let example = ended
        .stdout
        .lines()
        .find(|line| line.contains("-- i2cdetect"))
        .unwrap()
        .trim();
    if is_to_be_left_out("i2c-tools") {
        return;
    }
    let ended = shell(example);
    assert!(ended.stdout.contains(" 69 "), "{ended:?}");
}
