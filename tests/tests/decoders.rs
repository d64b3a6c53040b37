//! What libFuzzer feeds for hours (`tests/fuzz/run`), for a moment: every decoder takes the repository's files, cut and
//! damaged, and never panics; what it reads well it writes and reads again.

#![expect(
    clippy::expect_used,
    clippy::unwrap_used,
    reason = "a test ends at the first surprise, and a decoder that is wrong by a panic"
)]

#[path = "../fuzz/src/decoders.rs"]
mod decoders;

use decoders::DECODERS;
use grideye_frame::{PixelWord, Reading, RecordedFrame, ThermistorWord};
use grideye_recording::wire::{Batch, SensorBatch};
use grideye_recording::{ClockState, Record, Stamp};
use std::path::Path;

/// Of each file: what a decoder says of more of it, it says of this.
const BYTES_MAX: usize = 3000;
const DAMAGES: u64 = 150;

fn inputs() -> Vec<(String, Vec<u8>)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut inputs = Vec::new();
    for folder in [
        "scenes",
        "recordings/golden",
        "recordings/linaige",
        "firmware-config",
    ] {
        for entry in std::fs::read_dir(root.join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.is_file() {
                let mut bytes = std::fs::read(&path).unwrap();
                bytes.truncate(BYTES_MAX);
                inputs.push((path.display().to_string(), bytes));
            }
        }
    }
    let batch = batch();
    inputs.push(("a body in JSON".to_owned(), batch.to_json().unwrap()));
    inputs.push(("a body in bytes".to_owned(), batch.to_binary().unwrap()));
    let join = format!(
        "grideye:https://pc:8833,device=pi-1,token=grideye-12-34,pin=sha256-{:064}",
        0
    );
    inputs.push(("a line to join by".to_owned(), join.into_bytes()));
    inputs.push((
        "columns of zeros".to_owned(),
        [&[1, 0][..], &[0; 172]].concat(),
    ));
    inputs
}

fn batch() -> Batch {
    let record = |seq: u64| Record {
        seq,
        stamp: Stamp {
            t_boot_ns: 1_000 + seq,
            t_utc_ns: -5,
            clock: ClockState::Synced,
        },
        reading: Reading::Frame(RecordedFrame {
            thermistor: Some(ThermistorWord(402)),
            pixels: std::array::from_fn(|pixel| PixelWord(80 + u16::try_from(pixel % 37).unwrap())),
        }),
    };
    Batch {
        device: "pi-1".to_owned(),
        boot: "5f0c1d2e".to_owned(),
        t_sent_boot_ns: Some(9),
        sensors: vec![SensorBatch {
            sensor: "i2c-1:0x69".to_owned(),
            account: None,
            frames: (0..5).map(record).collect(),
        }],
    }
}

/// The same for the same number, so that a failure comes back.
fn damaged(bytes: &[u8], number: u64) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let mut state = number.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut next = |below: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        usize::try_from(state >> 33).unwrap() % below.max(1)
    };
    for _ in 0..=next(4) {
        let place = next(bytes.len());
        match next(4) {
            0 => bytes.truncate(place),
            1 => bytes.insert(place, u8::try_from(next(256)).unwrap()),
            2 if !bytes.is_empty() => drop(bytes.remove(place)),
            _ => {
                if let Some(byte) = bytes.get_mut(place) {
                    *byte = u8::try_from(next(256)).unwrap();
                }
            }
        }
    }
    bytes
}

#[test]
fn every_decoder_takes_whatever_it_is_given() {
    let inputs = inputs();
    assert!(inputs.len() > 30, "the repository's files are there");
    for (name, decode) in DECODERS {
        for (what, whole) in &inputs {
            println!("{name}: {what}");
            decode(whole);
            for number in 0..DAMAGES {
                decode(&damaged(whole, number));
            }
        }
    }
}
