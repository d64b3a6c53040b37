//! The compact body: the same batches, checks and limits as JSON, compared with bytes assembled by hand.

use super::made_up::any_batch;
use super::wire::specimen_value;
use grideye_recording::Record;
use grideye_recording::wire::{
    Account, Batch, FRAMES_MAX, REASONS_MAX, SENSORS_MAX, SensorBatch, WireError, WireFault,
};
use proptest::prelude::*;

/// The specimen of the JSON tests, assembled by hand from the specification in `src/wire.rs`.
fn by_hand() -> Vec<u8> {
    let mut body = head_by_hand();
    body.extend([96, 0, 6]); // 64 words from 96 on: each has its own six bits
    for four in (0..64_u32).step_by(4) {
        let bits = four | (four + 1) << 6 | (four + 2) << 12 | (four + 3) << 18;
        body.extend(&bits.to_le_bytes()[..3]);
    }
    body.extend(tail_by_hand());
    body
}

fn head_by_hand() -> Vec<u8> {
    let mut body = b"GEB\x02".to_vec();
    body.extend(b"\x04pi-1");
    body.extend(b"\x065f0c-9");
    body.push(1);
    body.extend(81_500_000_000_u64.to_le_bytes());
    body.push(1); // sensors
    body.extend(b"\x0ai2c-1:0x69");
    body.push(1); // an account
    body.extend([18, 1, 3]); // read, missing, spooled
    body.extend(b"\x01\x09ring-full\x02");
    body.extend(b"\x01\x04nack\x01");
    body.push(2); // frames
    body.extend(17_u64.to_le_bytes());
    body.extend(81_000_000_000_u64.to_le_bytes());
    body.extend(1_625_163_247_274_925_000_i64.to_le_bytes());
    body.push(0x10); // synced, with pixels
    body.extend([0x92, 0x01]); // 402
    body
}

fn tail_by_hand() -> Vec<u8> {
    let mut body = Vec::new();
    body.extend(18_u64.to_le_bytes());
    body.extend(81_100_000_000_u64.to_le_bytes());
    body.extend((-5_i64).to_le_bytes());
    body.push(0x21); // stepped, missing
    body.extend(b"\x04nack");
    body
}

fn read(body: &[u8]) -> Result<Batch, WireError> {
    Batch::from_binary(body)
}

#[test]
fn the_body_is_laid_down_byte_for_byte_as_specified() {
    assert_eq!(read(&by_hand()), Ok(specimen_value()));
    assert_eq!(specimen_value().to_binary().unwrap(), by_hand());
}

/// The message for the body with one byte replaced.
fn refusal(offset: usize, byte: u8) -> String {
    let mut body = by_hand();
    assert_ne!(body[offset], byte);
    body[offset] = byte;
    read(&body).unwrap_err().to_string()
}

/// Size of the specimen's first frame.
const FRAME: usize = 27 + 3 + 48;

#[test]
fn a_fault_is_named_with_its_field_and_its_place() {
    let account = 4 + 5 + 7 + 9 + 1 + 11;
    let frames = account + 1 + 3 + 12 + 7 + 1;
    for (offset, byte, message) in [
        (
            0,
            b'g',
            "body: expected the bytes 47 45 42 at byte 0, found 67 45 42",
        ),
        (3, 1, "version: expected 2, found 1"),
        (3, 3, "version: expected 2, found 3"),
        (
            4,
            65,
            "device: expected a length of at most 64 at byte 4, found the byte 0x41",
        ),
        (
            5,
            0xFF,
            "device: expected a name at byte 4, found bytes that are no text",
        ),
        (5, b'=', r#"device: expected a name of 1 to 64 characters"#),
        (
            16,
            7,
            "t_sent_boot_ns: expected 0 or 1 at byte 16, found the byte 0x07",
        ),
        (
            24,
            0x80,
            "t_sent_boot_ns: expected an integer from 0 to 9223372036854775807",
        ),
        (
            account,
            3,
            "sensors[0].account: expected 0 to 2 at byte 37, found the byte 0x03",
        ),
        (
            frames + 24,
            0x30,
            "sensors[0].frames[0].clock: expected a clock of 0 to 2",
        ),
        (
            frames + 24,
            0x12,
            "sensors[0].frames[0]: expected a kind of 0, 1 or 3",
        ),
        (
            frames + 27 + 2,
            17,
            "sensors[0].frames[0].pixels_raw: expected 64 words, as the lowest, a width of at most 16 bits",
        ),
        (
            frames + FRAME,
            17,
            "sensors[0].frames[1].seq: expected more than 17, the seq before it, found 17",
        ),
        (
            frames + FRAME + 26,
            b'h',
            r#"sensors[0].frames[1].missing: expected the name of a reason why there is no frame, found "hack""#,
        ),
    ] {
        let found = refusal(offset, byte);
        assert!(found.starts_with(message), "{offset}: {found}");
    }
}

#[test]
fn what_follows_the_last_frame_is_refused() {
    let mut long = by_hand();
    long.push(0);
    let found = read(&long).unwrap_err().to_string();
    assert_eq!(
        found,
        format!(
            "body: expected the end of the body at byte {}, found 1 more bytes",
            long.len() - 1
        )
    );
}

#[test]
fn each_limit_is_reached_and_not_passed() {
    let batch = |sensors: usize, frames: usize| {
        let frame = specimen_value().sensors[0].frames[1];
        let of = |sensor| SensorBatch {
            sensor: format!("s{sensor}"),
            account: None,
            frames: (0..)
                .map(|seq| Record { seq, ..frame })
                .take(frames)
                .collect(),
        };
        Batch {
            sensors: (0..sensors).map(of).collect(),
            ..specimen_value()
        }
    };
    let read = |batch: &Batch| {
        let read = read(&batch.to_binary().unwrap());
        read.map_err(|error| error.to_string())
    };
    let full = batch(SENSORS_MAX, FRAMES_MAX / SENSORS_MAX);
    assert_eq!(read(&full), Ok(full));
    for (sensors, frames, refusal) in [
        (
            SENSORS_MAX + 1,
            1,
            "sensors: expected at most 32 sensors, found more",
        ),
        (
            1,
            FRAMES_MAX + 1,
            "sensors[0].frames: expected at most 4096 frames in all",
        ),
        (
            2,
            FRAMES_MAX / 2 + 1,
            "sensors[1].frames: expected at most 4096 frames in all",
        ),
    ] {
        let found = read(&batch(sensors, frames)).unwrap_err();
        assert!(found.starts_with(refusal), "{found}");
    }
    let mut account = Account::default();
    let mut told = |reasons: usize| {
        account.errors = (0..reasons)
            .map(|reason| (format!("r{reason}"), 1))
            .collect();
        let mut batch = batch(1, 1);
        batch.sensors[0].account = Some(account.clone());
        read(&batch)
    };
    told(REASONS_MAX).unwrap();
    let found = told(REASONS_MAX + 1).unwrap_err();
    let refusal = "sensors[0].account.errors: expected at most 64 reasons";
    assert!(found.starts_with(refusal), "{found}");
}

#[test]
fn a_count_of_frames_that_are_not_there_takes_no_memory() {
    let mut body = b"GEB\x02\x01d\x01b\x00\x01\x01s\x00".to_vec();
    body.extend([0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x01]);
    let error = read(&body).unwrap_err();
    assert_eq!(error.fault, WireFault::TooMany, "{error}");
}

#[test]
fn one_byte_marks_an_ended_boot() {
    let mut specimen = specimen_value();
    specimen.sensors[0].account.as_mut().unwrap().ended = true;
    let mut body = by_hand();
    body[4 + 5 + 7 + 9 + 1 + 11] = 2;
    assert_eq!(specimen.to_binary().unwrap(), body);
    assert_eq!(read(&body), Ok(specimen));
}

#[test]
fn what_would_be_refused_is_not_sent() {
    let mut batch = specimen_value();
    batch.sensors[0].frames[1].seq = 3;
    assert_eq!(
        batch.to_binary().unwrap_err().path,
        "sensors[0].frames[1].seq"
    );
}

proptest! {
    #[test]
    fn a_batch_comes_back_from_its_bytes_and_means_what_its_json_means(batch in any_batch()) {
        let from_bytes = read(&batch.to_binary().unwrap());
        let from_json = Batch::from_json(&batch.to_json().unwrap());
        prop_assert_eq!(&from_bytes, &Ok(batch));
        prop_assert_eq!(from_bytes, from_json);
    }

    #[test]
    fn arbitrary_bytes_are_refused_without_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        prop_assert!(read(&bytes).is_err());
        let marked = [b"GEB\x02", bytes.as_slice()].concat();
        if let Ok(batch) = read(&marked) {
            prop_assert_eq!(batch.to_binary().unwrap(), marked);
        }
    }

    #[test]
    fn a_body_with_bytes_replaced_is_refused_or_means_exactly_what_it_says(
        faults in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
    ) {
        let mut body = by_hand();
        for (place, byte) in faults {
            let place = place.index(body.len());
            body[place] = byte;
        }
        if let Ok(batch) = read(&body) {
            let again = batch.to_binary().unwrap();
            prop_assert_eq!(&again, &body);
            prop_assert_eq!(read(&again), Ok(batch));
        }
    }

    #[test]
    fn a_body_cut_anywhere_is_refused(cut in any::<prop::sample::Index>()) {
        let body = by_hand();
        prop_assert!(read(&body[..cut.index(body.len())]).is_err());
    }
}
