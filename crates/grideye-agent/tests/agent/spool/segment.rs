//! A segment reads back as written, except damaged parts.

use grideye_agent::spool::segment::{
    Encoder, Entries, Entry, FRAME_BYTES, Fault, HEADER_BYTES, PAYLOAD_BYTES_MAX, check_header,
    crc32c,
};
use grideye_frame::{NoData, PIXELS, PixelWord, Reading, RecordedFrame, ThermistorWord};
use grideye_recording::wire::Account;
use grideye_recording::{ClockState, Record, Stamp, StreamId};
use proptest::prelude::*;
use std::sync::Arc;

fn id(boot: &str) -> Arc<StreamId> {
    Arc::new(StreamId {
        device: "pi-1".to_owned(),
        sensor: "i2c-1:0x69".to_owned(),
        boot: boot.to_owned(),
    })
}

fn any_record() -> impl Strategy<Value = Record> {
    let clock = prop::sample::select(ClockState::ALL.to_vec());
    let missing = prop::sample::select(NoData::ALL.to_vec());
    let pixels = prop::collection::vec(any::<u16>(), PIXELS);
    let frame = (any::<u16>(), pixels).prop_map(|(thermistor, pixels)| {
        let mut words = [PixelWord(0); PIXELS];
        words
            .iter_mut()
            .zip(pixels)
            .for_each(|(word, pixel)| *word = PixelWord(pixel));
        Reading::Frame(RecordedFrame {
            thermistor: Some(ThermistorWord(thermistor)),
            pixels: words,
        })
    });
    let reading = prop_oneof![frame, missing.prop_map(Reading::NoData)];
    (any::<u64>(), any::<u64>(), any::<i64>(), clock, reading).prop_map(
        |(seq, t_boot_ns, t_utc_ns, clock, reading)| Record {
            seq,
            stamp: Stamp {
                t_boot_ns,
                t_utc_ns,
                clock,
            },
            reading,
        },
    )
}

fn any_account() -> impl Strategy<Value = Account> {
    let counts = || prop::collection::btree_map("[a-z][a-z-]{0,20}", any::<u64>(), 0..5);
    (any::<u64>(), any::<u64>(), any::<u64>(), counts(), counts()).prop_map(
        |(read, missing, spooled, dropped, errors)| Account {
            read,
            missing,
            spooled,
            dropped,
            errors,
            ended: false,
        },
    )
}

fn read_all(number: u64, bytes: &[u8]) -> (Vec<Entry>, Option<Fault>) {
    let mut entries = Vec::new();
    for entry in Entries::of_segment(number, bytes).unwrap() {
        match entry {
            Ok((_, entry)) => entries.push(entry),
            Err(fault) => return (entries, Some(fault)),
        }
    }
    (entries, None)
}

#[test]
fn the_checksum_is_crc32c() {
    // RFC 3720 appendix B.4, and the check value of the CRC catalogue.
    assert_eq!(crc32c(&[b"123456789"]), 0xE306_9283);
    assert_eq!(crc32c(&[b"12345", b"6789"]), 0xE306_9283);
    assert_eq!(crc32c(&[&[0; 32]]), 0x8A91_36AA);
    assert_eq!(crc32c(&[&[0xFF; 32]]), 0x62A8_AB43);
}

proptest! {
    #[test]
    fn a_segment_round_trips_and_a_cut_loses_only_the_rest(
        records in prop::collection::vec((0..3_usize, any_record()), 1..20),
        account in any_account(),
        cut in 0.0..1.0_f64,
    ) {
        let ids = ["b1", "b2", "b3"].map(id);
        let mut encoder = Encoder::new(7);
        let mut bytes = encoder.header();
        encoder.account(&mut bytes, &ids[0], &account);
        let mut ends = Vec::new();
        for (stream, record) in &records {
            let (begin, _) = encoder.record(&mut bytes, &ids[*stream], record);
            let is_frame = record.reading.frame().is_some();
            prop_assert!(!is_frame || bytes.len() - begin == FRAME_BYTES);
            ends.push(bytes.len());
        }
        let (entries, fault) = read_all(7, &bytes);
        prop_assert_eq!(fault, None);
        let mut streams: Vec<Arc<StreamId>> = Vec::new();
        let mut read = Vec::new();
        for entry in entries {
            match entry {
                Entry::Stream(_, id) => streams.push(id),
                Entry::Record(stream, record) => read.push((Arc::clone(&streams[usize::from(stream)]), record)),
                Entry::Account(_, read) => prop_assert_eq!(&read, &account),
            }
        }
        let expected: Vec<_> = records.iter().map(|(stream, record)| (Arc::clone(&ids[*stream]), *record)).collect();
        prop_assert_eq!(read, expected);

        let span = bytes.len() - HEADER_BYTES;
        #[expect(clippy::as_conversions, clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_precision_loss, reason = "a place within a short file")]
        let cut = HEADER_BYTES + (cut * span as f64) as usize;
        let (entries, _) = read_all(7, &bytes[..cut]);
        let left = entries.iter().filter(|entry| matches!(entry, Entry::Record(..))).count();
        prop_assert_eq!(left, ends.iter().filter(|end| **end <= cut).count());
    }

    #[test]
    fn a_flipped_bit_is_found_and_reading_stops_there(
        records in prop::collection::vec(any_record(), 2..8),
        place in 0.0..1.0_f64,
        bit in 0..8_u32,
    ) {
        let mut encoder = Encoder::new(1);
        let mut bytes = encoder.header();
        let mut begins = Vec::new();
        for record in &records {
            begins.push(encoder.record(&mut bytes, &id("b"), record).0);
        }
        let span = bytes.len() - HEADER_BYTES;
        #[expect(clippy::as_conversions, clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_precision_loss, reason = "a place within a short file")]
        let place = HEADER_BYTES + (place * span as f64) as usize;
        bytes[place] ^= 1 << bit;
        let (entries, fault) = read_all(1, &bytes);
        prop_assert!(fault.is_some());
        let read: Vec<Record> = entries.iter().filter_map(|entry| match entry {
            Entry::Record(_, record) => Some(*record),
            _ => None,
        }).collect();
        let whole = begins.iter().skip(1).filter(|begin| **begin <= place).count();
        prop_assert_eq!(read.as_slice(), &records[..whole]);
    }

    #[test]
    fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..400), declared in 0..4_u16) {
        let _ = Entries::of_segment(1, &bytes).map(Iterator::count);
        let _ = Entries::within(1, &bytes, 0, declared).count();
    }
}

#[test]
fn the_header_of_another_segment_is_rejected() {
    let header = Encoder::new(5).header();
    assert_eq!(header.len(), HEADER_BYTES);
    assert_eq!(check_header(5, &header), Ok(()));
    assert_eq!(check_header(6, &header), Err(Fault::OtherNumber(5)));
    for cut in 0..HEADER_BYTES {
        let found = check_header(5, &header[..cut]);
        assert_eq!(found, Err(Fault::NoHeader), "{cut}");
    }
    let mut newer = header.clone();
    newer[8] = 2;
    let found = check_header(5, &newer);
    assert_eq!(found, Err(Fault::NoHeader), "a flipped bit");
    let crc = crc32c(&[&newer[..HEADER_BYTES - 4]]).to_le_bytes();
    newer[HEADER_BYTES - 4..].copy_from_slice(&crc);
    assert_eq!(check_header(5, &newer), Err(Fault::OtherVersion(2)));
    let mut damaged = header;
    damaged[13] ^= 1;
    assert_eq!(check_header(5, &damaged), Err(Fault::NoHeader));
}

#[test]
fn a_record_of_another_segment_does_not_pass() {
    let record = super::record(7);
    let mut stale = Vec::new();
    Encoder::new(4).record(&mut stale, &id("b"), &record);
    let mut bytes = Encoder::new(5).header();
    bytes.extend(stale);
    let fault = Some(Fault::Damaged(HEADER_BYTES));
    assert_eq!(read_all(5, &bytes), (vec![], fault));
}

#[test]
fn a_record_of_a_stream_that_was_never_declared_or_a_length_beyond_the_limit_is_damage() {
    let mut encoder = Encoder::new(5);
    let header = encoder.header();
    // An account, and a stream that is too long, with right checksums.
    let account = vec![3, 0, 0];
    let stream = vec![1; PAYLOAD_BYTES_MAX + 1];
    for payload in [account, stream] {
        let bytes = [header.clone(), sealed(5, &payload)].concat();
        let fault = read_all(5, &bytes).1;
        assert_eq!(fault, Some(Fault::Damaged(HEADER_BYTES)));
    }
    // An impossible length, with nothing after it.
    let bytes = [&header[..], &[0xFF; 8]].concat();
    let fault = read_all(5, &bytes).1;
    assert_eq!(fault, Some(Fault::Damaged(HEADER_BYTES)));
    // A frame of a declared stream, cut.
    let mut bytes = header;
    encoder.account(&mut bytes, &id("b"), &Account::default());
    let declared = bytes.len();
    bytes.extend(sealed(5, &[2, 0, 0, 9]));
    assert_eq!(read_all(5, &bytes).1, Some(Fault::Damaged(declared)));
}

/// A payload of the segment with this number, after its length and checksum.
fn sealed(number: u64, payload: &[u8]) -> Vec<u8> {
    let length = u32::try_from(payload.len()).unwrap().to_le_bytes();
    let crc = crc32c(&[&number.to_le_bytes(), &length, payload]).to_le_bytes();
    [&length, &crc, payload].concat()
}
