//! Records: their names, their clocks, and the one binary layout.

use grideye_frame::{NAME_RULE, NoData, PixelWord, Reading, RecordedFrame, ThermistorWord};
use grideye_recording::record::layout::{ByteReader, Form, put};
use grideye_recording::{ClockState, NAME_CHARS_MAX, Record, Stamp, UnknownClockState, check_name};

#[test]
fn every_clock_state_is_parsed_by_name_and_listed_in_the_error() {
    for state in ClockState::ALL {
        assert_eq!(state.name().parse(), Ok(state));
        assert!(UnknownClockState.to_string().contains(state.name()));
    }
    assert_eq!("Synced".parse::<ClockState>(), Err(UnknownClockState));
}

#[test]
fn names_are_bounded_and_of_one_alphabet() {
    let longest = "x".repeat(NAME_CHARS_MAX);
    for good in ["p", "9", "pi-1", "i2c-1:0x69", "A.b_c:d-e", &longest] {
        assert_eq!(check_name(good), Ok(()), "{good}");
    }
    let bad = "=1|+1|-1|@a|.|..|_a|:a|a b|a,b|a\"b|a/b|a\nb|a\0|é|aé||";
    let too_long = "x".repeat(NAME_CHARS_MAX + 1);
    for bad in bad.split('|').chain([too_long.as_str()]) {
        assert!(check_name(bad).is_err(), "{bad:?}");
    }
}

#[test]
fn the_rule_in_the_message_states_the_limit() {
    assert!(NAME_RULE.contains(&format!("1 to {NAME_CHARS_MAX} characters")));
    let found = check_name(&"x".repeat(70)).unwrap_err().found;
    assert!(found.starts_with("70 characters: \"xxx"), "{found}");
}

fn record(reading: Reading<RecordedFrame>) -> Record {
    let stamp = Stamp {
        t_boot_ns: 0x0102,
        t_utc_ns: -2,
        clock: ClockState::Stepped,
    };
    Record {
        seq: 7,
        stamp,
        reading,
    }
}

/// Every form, assembled by hand, reads back, and is rejected if cut.
#[test]
fn each_form_is_laid_down_byte_for_byte() {
    let words = std::array::from_fn(|pixel| PixelWord(if pixel == 63 { 0x0301 } else { 0x0300 }));
    let frame = record(Reading::Frame(RecordedFrame {
        thermistor: Some(ThermistorWord(0x0190)),
        pixels: words,
    }));
    let bare = record(Reading::Frame(RecordedFrame {
        thermistor: None,
        pixels: words,
    }));
    let missing = record(Reading::NoData(NoData::Nack));
    let seq = [7, 0, 0, 0, 0, 0, 0, 0];
    let times = [
        2, 1, 0, 0, 0, 0, 0, 0, 0xFE, 255, 255, 255, 255, 255, 255, 255,
    ];
    let packed = [&[0x90, 1, 0, 3, 1][..], &[0, 0, 0, 0, 0, 0, 0, 0x80]].concat();
    let plain = [&[0x90, 1][..], &[0, 3].repeat(63), &[1, 3]].concat();
    let (only_packed, only_plain) = (packed[2..].to_vec(), plain[2..].to_vec());
    let reason = b"\x04nack".to_vec();
    for (form, record, number, kind, end) in [
        (Form::Wire, frame, &seq[..], &[0x20][..], &packed),
        (Form::Wire, bare, &seq, &[0x23], &only_packed),
        (Form::Spool, bare, &seq, &[2, 3], &only_plain),
        (Form::Chunk, bare, &[], &[0x23], &only_packed),
        (Form::Wire, missing, &seq, &[0x21], &reason),
        (Form::Spool, frame, &seq, &[2, 0], &plain),
        (Form::Spool, missing, &seq, &[2, 1], &reason),
        (Form::Chunk, frame, &[], &[0x22], &packed),
        (Form::Chunk, missing, &[], &[0x21], &reason),
    ] {
        let expected = [number, &times, kind, end].concat();
        let mut bytes = Vec::new();
        put(&mut bytes, &record, form);
        assert_eq!(bytes, expected, "{form:?}");
        let mut reader = ByteReader::new(&bytes);
        let seq = if form == Form::Chunk { 0 } else { 7 };
        assert_eq!(
            reader.record(form),
            Ok(Record { seq, ..record }),
            "{form:?}"
        );
        assert_eq!((reader.at(), reader.left()), (bytes.len(), 0));
        for cut in 0..bytes.len() {
            let read = ByteReader::new(&bytes[..cut]).record(form);
            assert!(read.is_err(), "{form:?} cut at {cut}");
        }
    }
}
