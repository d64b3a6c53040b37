//! Sealed segments: their size, and that every bit is restored.

use grideye_collector::store::segment::{ROWS_MAX, SealedRow, open, seal};
use grideye_frame::{NoData, PixelWord, Reading, RecordedFrame, ThermistorWord};
use grideye_recording::{ClockState, Record, Stamp};

/// A session of a real sensor, as if each batch had brought five frames.
fn session(name: &str) -> Vec<SealedRow> {
    let path = format!(
        "{}/../../recordings/linaige/{name}",
        env!("CARGO_MANIFEST_DIR")
    );
    let file = std::fs::File::open(path).unwrap();
    let rows = grideye_import::open(file, name, &grideye_import::Options::default());
    let rows = rows.unwrap().map(|row| row.unwrap().record);
    rows.enumerate()
        .map(|(index, record)| SealedRow {
            record,
            // A batch every half second, with an unpredictable delay of some milliseconds.
            t_arrival_ns: 1_625_163_247_000_000_000
                + i64::try_from(index / 5).unwrap() * 500_000_000
                + i64::try_from((index / 5).wrapping_mul(0x9E37_79B9) % 8_000_000).unwrap(),
            arrival: 7 + i64::try_from(index / 5).unwrap() * 3,
        })
        .collect()
}

#[test]
fn a_real_session_takes_at_most_32_bytes_a_frame_in_segments_of_a_minute_and_comes_back_bit_for_bit()
 {
    for name in [
        "Session2_2021-07-01_RoomB_v2.csv",
        "Session3_2021-07-06_RoomA_v2.csv",
    ] {
        let rows = session(name);
        let mut bytes = 0;
        for minute in rows.chunks(600) {
            let segment = seal(minute).unwrap();
            bytes += segment.len();
            assert!(open(&segment).unwrap() == minute, "{name}");
        }
        let frames = u32::try_from(rows.len()).unwrap();
        let each = f64::from(u32::try_from(bytes).unwrap()) / f64::from(frames);
        println!("{name}: {each:.2} bytes a frame");
        assert!(each <= 32.0, "{name}: {each:.2} bytes a frame");
    }
}

/// Unpredictable rows.
fn wild(rows: usize) -> Vec<SealedRow> {
    let mut noise = 0x1234_5678_9ABC_DEF1_u64;
    let mut next = move || {
        noise ^= noise << 13;
        noise ^= noise >> 7;
        noise ^= noise << 17;
        noise
    };
    let words = |value: u64| u16::from_le_bytes([value.to_le_bytes()[3], value.to_le_bytes()[5]]);
    let signed = |value: u64| i64::from_le_bytes(value.to_le_bytes());
    (0..rows)
        .map(|row| SealedRow {
            record: Record {
                seq: next() >> 1,
                stamp: Stamp {
                    t_boot_ns: next() >> 1,
                    t_utc_ns: signed(next()),
                    clock: ClockState::ALL[row % 3],
                },
                reading: match row % 5 {
                    0 => Reading::NoData(NoData::ALL[row % NoData::ALL.len()]),
                    _ => Reading::Frame(RecordedFrame {
                        thermistor: (row % 7 > 0).then(|| ThermistorWord(words(next()))),
                        pixels: std::array::from_fn(|_| PixelWord(words(next()))),
                    }),
                },
            },
            t_arrival_ns: signed(next()),
            arrival: signed(next()),
        })
        .collect()
}

#[test]
fn whatever_the_words_and_times_are_they_come_back() {
    for rows in [1, 2, 3, 4, 5, 6, 61, 1000] {
        let rows = wild(rows);
        assert!(open(&seal(&rows).unwrap()).unwrap() == rows);
    }
    let missing: Vec<SealedRow> = wild(51).into_iter().step_by(5).collect();
    let is_missing = |row: &SealedRow| row.record.reading.frame().is_none();
    assert!(missing.iter().all(is_missing));
    assert_eq!(open(&seal(&missing).unwrap()).unwrap(), missing);
}

#[test]
fn a_segment_has_at_least_one_row_and_at_most_the_limit() {
    seal(&[]).unwrap_err();
    let one = wild(1)[0];
    let longest = seal(&vec![one; ROWS_MAX]).unwrap();
    assert_eq!(open(&longest).unwrap().len(), ROWS_MAX);
    seal(&vec![one; ROWS_MAX + 1]).unwrap_err();
}

#[test]
fn a_segment_that_is_cut_or_changed_anywhere_is_refused() {
    let rows = wild(9);
    let segment = seal(&rows).unwrap();
    for cut in 0..segment.len() {
        open(&segment[..cut]).unwrap_err();
    }
    for place in 0..segment.len() {
        for bit in 0..8 {
            let mut changed = segment.clone();
            changed[place] ^= 1 << bit;
            // zstd's own header has meaningless bits; whatever is read must be what was sealed.
            if let Ok(read) = open(&changed) {
                assert!(read == rows, "byte {place}, bit {bit}");
            }
        }
    }
}
