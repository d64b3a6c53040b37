//! numpy's arrays. numpy 2.3 wrote such headings (`numpy.save`); Python's zipfile the archive.

#![expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "quarters of a degree from 20 to 30"
)]

use crate::support::{assert_frames, celsius, guessed, pixels, refusal, rows, said};
use grideye_recording::Row;

fn npy(kind: &str, shape: &str, numbers: &[u8]) -> Vec<u8> {
    let dictionary = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    let padded = format!("{dictionary:117}\n");
    [b"\x93NUMPY\x01\x00\x76\x00", padded.as_bytes(), numbers].concat()
}

fn bytes<const N: usize>(of: impl Fn(f64) -> [u8; N]) -> Vec<u8> {
    (0..3)
        .flat_map(|frame| {
            celsius(frame)
                .into_iter()
                .flat_map(&of)
                .collect::<Vec<u8>>()
        })
        .collect()
}

/// A number of 16 bits by IEEE 754, between 16 and 32.
fn half(value: f64) -> [u8; 2] {
    let fraction = ((value / 16.0 - 1.0) * 1_024.0) as u16;
    ((19 << 10) | fraction).to_le_bytes()
}

#[test]
fn arrays_of_any_number_and_shape_are_frames() {
    let singles = bytes(|value| (value as f32).to_le_bytes());
    for file in [
        npy("<f4", "(3, 8, 8)", &singles),
        npy("<f4", "(3, 64)", &singles),
        npy("<f4", "(3, 1, 8, 8)", &singles),
        npy("<f8", "(3, 8, 8)", &bytes(f64::to_le_bytes)),
        npy(">f8", "(3, 8, 8)", &bytes(f64::to_be_bytes)),
        npy("<f2", "(3, 64)", &bytes(half)),
    ] {
        assert_frames(&rows(file), 3, "an array");
    }
    // Of three frames it is not known whether whole numbers are raw words.
    for file in [
        npy(
            "<i2",
            "(3, 64)",
            &bytes(|value| ((value * 4.0) as i16).to_le_bytes()),
        ),
        npy("|u1", "(3, 64)", &bytes(|value| [(value * 4.0) as u8])),
    ] {
        let read = said(file, "walk.npy", "unit=words").unwrap();
        assert_frames(&read.map(Result::unwrap).collect::<Vec<_>>(), 3, "words");
    }
    let one = npy("<f4", "(8, 8)", &singles[..256]);
    assert_frames(&rows(one), 1, "one frame");
}

#[test]
fn frames_of_nothing_are_gaps_and_a_cut_array_gives_what_is_whole() {
    let mut singles = bytes(|value| (value as f32).to_le_bytes());
    let file = npy("<f4", "(3, 8, 8)", &singles);
    for length in 0..file.len() {
        let whole = length.saturating_sub(128) / 256;
        if whole == 0 {
            assert!(!refusal(&file[..length], "").is_empty(), "{length}");
            continue;
        }
        let read: Vec<_> = guessed(&file[..length]).collect();
        assert!(
            matches!(read.last(), Some(Err(error)) if error.is_break()),
            "{length}"
        );
        assert_eq!(read.len() - 1, whole, "{length}");
    }
    singles[..256].copy_from_slice(&f32::NAN.to_le_bytes().repeat(64));
    let rows: Vec<Row> = rows(npy("<f4", "(3, 8, 8)", &singles));
    assert_eq!(
        rows.iter().map(|row| row.record.seq).collect::<Vec<_>>(),
        [1, 2]
    );
    assert_eq!(pixels(&rows[0]), celsius(1));
}

#[test]
fn an_array_of_something_else_is_refused_with_what_was_expected() {
    let singles = bytes(|value| (value as f32).to_le_bytes());
    for (file, said) in [
        (
            npy("|O", "(3,)", b"pickle"),
            "expected an array of numbers, found one of Python's objects, which is a pickle",
        ),
        (
            npy("<f4", "(3, 2, 8)", &singles),
            "expected the shape (N, 8, 8) or (N, 64), found [3, 2, 8]",
        ),
        (
            npy("<f4", "(2, 24, 32)", &singles.repeat(8)),
            "768 pixels a frame, a Grid-EYE has 64",
        ),
    ] {
        let found = refusal(file, "");
        assert!(found.starts_with(said), "{found}");
    }
    let mut turned = npy("<f4", "(3, 8, 8)", &singles);
    let order = turned.windows(5).position(|five| five == b"False").unwrap();
    turned[order..order + 5].copy_from_slice(b"True ");
    // In Fortran's order frame, row, column vary from the fastest to the slowest: the second number is of the second frame.
    let read = rows(turned);
    assert_eq!(pixels(&read[1])[0], celsius(0)[1]);
    assert_eq!(pixels(&read[0])[8], celsius(0)[3], "one row down");
    assert_eq!(pixels(&read[0])[1], celsius(0)[24], "one column aside");
}
