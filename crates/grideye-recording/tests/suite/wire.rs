//! The wire format, tested with hand-written bodies, arbitrary batches and arbitrary bytes.

use crate::made_up::{any_answer, any_batch};
use grideye_frame::{NoData, PixelWord, Reading, RecordedFrame, ThermistorWord};
use grideye_recording::wire::{
    Account, Acknowledgement, Batch, FRAME_BYTES_MAX, FRAMES_MAX, GAPS_MAX, Gap, REASONS_MAX,
    SENSORS_MAX, SensorBatch, WireError, WireFault,
};
use grideye_recording::{COUNT_MAX, ClockState, Record, Stamp};
use proptest::prelude::*;

/// The example of the specification, typed by hand.
fn specimen() -> String {
    let pixels: Vec<String> = (0..64).map(|index| (96 + index).to_string()).collect();
    let pixels = pixels.join(",");
    format!(
        concat!(
            r#"{{"device":"pi-1","boot":"5f0c-9","t_sent_boot_ns":81500000000,"sensors":[{{"sensor":"i2c-1:0x69","#,
            r#""account":{{"read":18,"missing":1,"dropped":{{"ring-full":2}},"spooled":3,"errors":{{"nack":1}}}},"frames":["#,
            r#"{{"seq":17,"t_boot_ns":81000000000,"t_utc_ns":1625163247274925000,"clock":"synced","thermistor_raw":402,"pixels_raw":[{}]}},"#,
            r#"{{"seq":18,"t_boot_ns":81100000000,"t_utc_ns":-5,"clock":"stepped","missing":"nack"}}]}}]}}"#
        ),
        pixels
    )
}

pub(crate) fn specimen_value() -> Batch {
    let mut pixels = [PixelWord(0); 64];
    for (word, value) in pixels.iter_mut().zip(96..) {
        word.0 = value;
    }
    let stamp = |t_boot_ns, t_utc_ns, clock| Stamp {
        t_boot_ns,
        t_utc_ns,
        clock,
    };
    Batch {
        device: "pi-1".to_owned(),
        boot: "5f0c-9".to_owned(),
        t_sent_boot_ns: Some(81_500_000_000),
        sensors: vec![SensorBatch {
            sensor: "i2c-1:0x69".to_owned(),
            account: Some(Account {
                read: 18,
                missing: 1,
                dropped: [("ring-full".to_owned(), 2)].into(),
                spooled: 3,
                errors: [("nack".to_owned(), 1)].into(),
                ended: false,
            }),
            frames: vec![
                Record {
                    seq: 17,
                    stamp: stamp(
                        81_000_000_000,
                        1_625_163_247_274_925_000,
                        ClockState::Synced,
                    ),
                    reading: Reading::Frame(RecordedFrame {
                        thermistor: Some(ThermistorWord(402)),
                        pixels,
                    }),
                },
                Record {
                    seq: 18,
                    stamp: stamp(81_100_000_000, -5, ClockState::Stepped),
                    reading: Reading::NoData(NoData::Nack),
                },
            ],
        }],
    }
}

fn read(body: &str) -> Result<Batch, WireError> {
    Batch::from_json(body.as_bytes())
}

/// The message for the specimen with one piece replaced.
fn refusal(from: &str, to: &str) -> String {
    let body = specimen();
    assert!(body.contains(from), "{from} is not in the specimen");
    read(&body.replacen(from, to, 1)).unwrap_err().to_string()
}

fn refusal_of_answer(body: &str) -> String {
    Acknowledgement::from_json(body.as_bytes())
        .unwrap_err()
        .to_string()
}

#[test]
fn the_hand_written_body_means_what_it_says() {
    assert_eq!(read(&specimen()), Ok(specimen_value()));
}

#[test]
fn a_frame_may_lack_its_thermistor_or_have_null() {
    let mut batch = specimen_value();
    let reading = &mut batch.sensors[0].frames[0].reading;
    *reading = reading.map(|mut frame| {
        frame.thermistor = None;
        frame
    });
    let absent = specimen().replace(r#""thermistor_raw":402,"#, "");
    let null = specimen().replace("402", "null");
    assert_eq!(read(&absent), Ok(batch.clone()));
    assert_eq!(read(&null), Ok(batch.clone()));
    assert_eq!(String::from_utf8(batch.to_json().unwrap()).unwrap(), absent);
}

#[test]
fn the_body_is_written_byte_for_byte_as_specified() {
    let written = String::from_utf8(specimen_value().to_json().unwrap()).unwrap();
    // Field order is free; the writer puts the words last.
    assert_eq!(written, specimen());
}

#[test]
fn optional_fields_and_whole_sensors_may_be_absent() {
    let bare = read(r#"{"device":"d","boot":"b","sensors":[]}"#).unwrap();
    assert_eq!((bare.t_sent_boot_ns, bare.sensors.len()), (None, 0));
    let idle =
        read(r#" {"sensors":[{"frames":[],"sensor":"s"}],"boot":"b","device":"d"} "#).unwrap();
    assert_eq!(idle.sensors[0].account, None);
    assert_eq!(
        idle.to_json().unwrap(),
        br#"{"device":"d","boot":"b","sensors":[{"sensor":"s","frames":[]}]}"#
    );
}

#[test]
fn the_answer_means_what_it_says() {
    let body =
        r#"{"durable_through":{"i2c-1:0x69":17},"gaps":[{"sensor":"i2c-1:0x69","from":3,"to":5}]}"#;
    let answer = Acknowledgement::from_json(body.as_bytes()).unwrap();
    let expected = Acknowledgement {
        durable_through: [("i2c-1:0x69".to_owned(), 17)].into(),
        gaps: vec![Gap {
            sensor: "i2c-1:0x69".to_owned(),
            from: 3,
            to: 5,
        }],
    };
    assert_eq!(answer, expected);
    assert_eq!(answer.to_json().unwrap(), body.as_bytes());
}

const NAME: &str =
    "a name of 1 to 64 characters A-Z a-z 0-9 . _ : - that begins with a letter or a digit";
const COUNT: &str = "an integer from 0 to 9223372036854775807";

#[test]
fn a_fault_in_a_field_is_named_with_its_path() {
    let frame = "sensors[0].frames[0]";
    let nan = specimen().find(",159]").unwrap() + ",N".len();
    let cases = [
        (r#""pi-1""#, r#""=pi""#, format!("device: expected {NAME}, found \"=pi\"")),
        (r#""5f0c-9""#, r#""""#, format!("boot: expected {NAME}, found \"\"")),
        (r#""5f0c-9""#, "7", "boot: expected a string, found integer `7`".to_owned()),
        ("81500000000", "-1", format!("t_sent_boot_ns: expected {COUNT}, found integer `-1`")),
        ("81500000000", "null", format!("t_sent_boot_ns: expected {COUNT}, found null")),
        (r#""i2c-1:0x69""#, r#""../x""#, format!("sensors[0].sensor: expected {NAME}, found \"../x\"")),
        (r#"{"ring-full":2}"#, r#"{"ring-full":2,"ring-full":2}"#, "sensors[0].account.dropped.ring-full: expected at most once, found twice".to_owned()),
        (r#"{"ring-full":2}"#, r#"{"=x":2}"#, format!("sensors[0].account.dropped, a key: expected {NAME}, found \"=x\"")),
        (r#"{"ring-full":2}"#, r#"{"ring-full":2.5}"#, format!("sensors[0].account.dropped.ring-full: expected {COUNT}, found floating point `2.5`")),
        (r#""spooled":3,"#, r#""spooled":3,"ended":1,"#, "sensors[0].account.ended: expected a boolean, found integer `1`".to_owned()),
        (r#""spooled":3,"#, "", "sensors[0].account.spooled: expected a value, found none".to_owned()),
        ("17,", "9223372036854775808,", format!("{frame}.seq: expected {COUNT}, found integer `9223372036854775808`")),
        ("17,", "17.0,", format!("{frame}.seq: expected {COUNT}, found floating point `17.0`")),
        ("17,", "\"17\",", format!("{frame}.seq: expected {COUNT}, found string \"17\"")),
        ("1625163247274925000", "9223372036854775808", format!("{frame}.t_utc_ns: expected a signed 64-bit integer, found integer `9223372036854775808`")),
        (r#""synced""#, r#""Synced""#, format!("{frame}.clock: expected one of unsynced synced stepped, found string \"Synced\"")),
        ("402", "65536", format!("{frame}.thermistor_raw: expected an integer from 0 to 65535, found integer `65536`")),
        (",159]", ",-1]", format!("{frame}.pixels_raw[63]: expected an integer from 0 to 65535, found integer `-1`")),
        (",159]", ",65536]", format!("{frame}.pixels_raw[63]: expected an integer from 0 to 65535, found integer `65536`")),
        (",159]", ",9999999999]", format!("{frame}.pixels_raw[63]: expected an integer from 0 to 65535, found integer `9999999999`")),
        (",159]", ",1e2]", format!("{frame}.pixels_raw[63]: expected an integer from 0 to 65535, found floating point `100.0`")),
        (",159]", ",NaN]", format!("{frame}.pixels_raw[63]: expected JSON, found a fault at line 1 column {nan}: expected value")),
        (",159]", ",[]]", format!("{frame}.pixels_raw[63]: expected an integer from 0 to 65535, found sequence")),
        (",159]", ",0159]", format!("{frame}.pixels_raw[63]: expected JSON, found a fault at line 1 column {}: invalid number", nan + 1)),
        (",159]", ",]", format!("{frame}.pixels_raw: expected JSON, found a fault at line 1 column {nan}: trailing comma")),
        (",159]", "]", format!("{frame}.pixels_raw: expected an array of exactly 64 integers, found 63")),
        (",159]", ",159,160]", format!("{frame}.pixels_raw: expected an array of exactly 64 integers, found a 65th")),
        ("[96,", "[", format!("{frame}.pixels_raw: expected an array of exactly 64 integers, found 63")),
        (r#""missing":"nack""#, r#""missing":"nack","pixels_raw":0"#, "sensors[0].frames[1].pixels_raw: expected an array of exactly 64 integers, found integer `0`".to_owned()),
        (r#""frames":["#, r#""frames":[{"seq":16,"t_boot_ns":1,"t_utc_ns":1,"clock":"synced","thermistor_raw":402,"pixels_raw":0},"#, format!("{frame}.pixels_raw: expected an array of exactly 64 integers, found integer `0`")),
        (r#""missing":"nack""#, r#""missing":"sulking""#, "sensors[0].frames[1].missing: expected the name of a reason why there is no frame, found string \"sulking\"".to_owned()),
        (r#","missing":"nack""#, "", "sensors[0].frames[1].pixels_raw: expected a value, found none".to_owned()),
        (r#""missing":"nack""#, r#""missing":"nack","thermistor_raw":4"#, "sensors[0].frames[1]: expected words, or `missing` with a reason, found `missing` and words".to_owned()),
        (r#""seq":18"#, r#""seq":17"#, "sensors[0].frames[1].seq: expected more than 17, the seq before it, found 17".to_owned()),
        (r#""seq":18"#, r#""seq":18,"seq":18"#, "sensors[0].frames[1].seq: expected at most once, found twice".to_owned()),
        (r#""seq":18"#, r#""seq":18,"no":1"#, "sensors[0].frames[1].no: expected one of `seq`, `t_boot_ns`, `t_utc_ns`, `clock`, `missing`, `thermistor_raw`, `pixels_raw`, found an unknown field".to_owned()),
        (r#""boot":"5f0c-9","#, r#""boot":"5f0c-9","boot":"x","#, "boot: expected at most once, found twice".to_owned()),
        (r#""boot":"5f0c-9","#, "", "boot: expected a value, found none".to_owned()),
        (r#""device":"#, r#""devise":"#, "devise: expected one of `device`, `boot`, `t_sent_boot_ns`, `sensors`, found an unknown field".to_owned()),
        (
            r#""device":"#,
            r#""":"#,
            r#""": expected one of `device`, `boot`, `t_sent_boot_ns`, `sensors`, found an unknown field"#.to_owned(),
        ),
        (
            r#"{"ring-full":2}"#,
            r#"{"":2,"":2}"#,
            r#"sensors[0].account.dropped."": expected at most once, found twice"#.to_owned(),
        ),
    ];
    for (from, to, message) in cases {
        assert_eq!(refusal(from, to), message, "{from} -> {to}");
    }
}

#[test]
fn pixels_are_read_however_json_may_write_them() {
    let expected = read(&specimen()).unwrap();
    for (from, to) in [
        (",", " ,\n\t"),
        ("[", " [ \r"),
        (r#""pixels_raw":["#, r#""pixels_raw" : [ "#),
        ("pixels_raw", r"pixels\u005fraw"),
    ] {
        let body = specimen().replace(from, to);
        assert_ne!(body, specimen());
        assert_eq!(read(&body).unwrap(), expected, "{from} -> {to}");
    }
    // Text that only looks like the key is an ordinary name.
    let body = specimen().replace("pi-1", "pixels_raw");
    assert_eq!(read(&body).unwrap().sensors, expected.sensors);
}

#[test]
fn a_frame_or_a_batch_as_a_bare_array_is_refused() {
    let message = read(r#"["d","b",1,[]]"#).unwrap_err().to_string();
    assert_eq!(
        message,
        "body: expected an object with device, boot and sensors, found sequence"
    );
    let message = read(r#"{"device":"d","boot":"b","sensors":[{"sensor":"s","frames":[[1,2,3,"synced","nack"]]}]}"#)
        .unwrap_err();
    assert_eq!(message.path, "sensors[0].frames[0]");
}

#[test]
fn one_sensor_twice_is_refused() {
    let body = r#"{"device":"d","boot":"b","sensors":[{"sensor":"s","frames":[]},{"sensor":"s","frames":[]}]}"#;
    assert_eq!(
        read(body).unwrap_err().to_string(),
        "sensors[1].sensor: expected each sensor once, found s a second time"
    );
}

#[test]
fn invalid_json_is_rejected_with_line_and_column() {
    let cases = [
        (
            "",
            "body: expected JSON, found a fault at line 1 column 0: EOF while parsing a value",
        ),
        (
            "{\"device\":\"d\",\n\"boot\"",
            "body: expected JSON, found a fault at line 2 column 6: EOF while parsing an object",
        ),
        (
            r#"{"device":"d","boot":"b","sensors":[]} x"#,
            "body: expected JSON, found a fault at line 1 column 40: trailing characters",
        ),
        (
            r#"{"device":"d","boot":"b","sensors":[]}{}"#,
            "body: expected JSON, found a fault at line 1 column 39: trailing characters",
        ),
        (
            "7",
            "body: expected an object with device, boot and sensors, found integer `7`",
        ),
    ];
    for (body, message) in cases {
        assert_eq!(read(body).unwrap_err().to_string(), message, "{body}");
    }
    let invalid_utf8 = b"{\"device\":\"\xff\",\"boot\":\"b\",\"sensors\":[]}";
    let error = Batch::from_json(invalid_utf8).unwrap_err();
    assert_eq!(error.path, "device");
}

#[test]
fn a_faulty_answer_is_refused_with_the_path() {
    let cases = [
        (
            r#"{"gaps":[]}"#,
            "durable_through: expected a value, found none".to_owned(),
        ),
        (
            r#"{"durable_through":{"s":1,"s":1},"gaps":[]}"#,
            "durable_through.s: expected at most once, found twice".to_owned(),
        ),
        (
            r#"{"durable_through":{"s":-1},"gaps":[]}"#,
            format!("durable_through.s: expected {COUNT}, found integer `-1`"),
        ),
        (
            r#"{"durable_through":{"a b":1},"gaps":[]}"#,
            format!("durable_through, a key: expected {NAME}, found \"a b\""),
        ),
        (
            r#"{"durable_through":{},"gaps":[{"sensor":"s","from":5,"to":4}]}"#,
            "gaps[0].to: expected 5 or more, as `from` says, found 4".to_owned(),
        ),
        (
            r#"{"durable_through":{},"gaps":[{"sensor":"s","from":5,"till":6}]}"#,
            "gaps[0].till: expected one of `sensor`, `from`, `to`, found an unknown field"
                .to_owned(),
        ),
        (
            r#"{"durable_through":{},"gaps":[["s",5,6]]}"#,
            "gaps[0]: expected an object with sensor, from and to, found sequence".to_owned(),
        ),
    ];
    for (body, message) in cases {
        assert_eq!(refusal_of_answer(body), message, "{body}");
    }
}

#[test]
fn untrusted_text_is_escaped_and_cut_in_the_message() {
    let long = "A".repeat(1_000_000);
    let bodies = [
        format!(r#"{{"device":"{long}","boot":"b","sensors":[]}}"#),
        format!(r#"{{"{long}":1}}"#),
        format!(
            r#"{{"device":"d","boot":"b","sensors":[{{"sensor":"s","frames":[{{"clock":"{long}"}}]}}]}}"#
        ),
        format!(
            r#"{{"device":"d","boot":"b","sensors":[{{"sensor":"s","account":{{"dropped":{{"{long}":"x"}}}}}}]}}"#
        ),
        r#"{"\u001b[2J":1}"#.to_owned(),
        r#"{"device":"\u001b[2J","boot":"b","sensors":[]}"#.to_owned(),
    ];
    for body in bodies {
        let message = read(&body).unwrap_err().to_string();
        assert!(message.len() < 500, "{} bytes", message.len());
        assert!(!message.contains('\u{1b}'), "{message:?}");
    }
}

/// A body with this many sensors of this many missing frames each.
fn body_of(sensors: usize, frames: usize) -> String {
    let row = |seq: usize| {
        format!(r#"{{"seq":{seq},"t_boot_ns":0,"t_utc_ns":0,"clock":"unsynced","missing":"nack"}}"#)
    };
    let frames: Vec<String> = (0..frames).map(row).collect();
    let frames = frames.join(",");
    let sensors: Vec<String> = (0..sensors)
        .map(|sensor| format!(r#"{{"sensor":"s{sensor}","frames":[{frames}]}}"#))
        .collect();
    format!(
        r#"{{"device":"d","boot":"b","sensors":[{}]}}"#,
        sensors.join(",")
    )
}

#[test]
fn each_limit_is_reached_and_not_passed() {
    let batch = |body: &str| read(body).map_err(|error| error.to_string());
    assert!(batch(&body_of(SENSORS_MAX, FRAMES_MAX / SENSORS_MAX)).is_ok());
    assert_eq!(
        batch(&body_of(SENSORS_MAX + 1, 0)).unwrap_err(),
        "sensors: expected at most 32 sensors, found more\nhint: send smaller batches"
    );
    assert_eq!(
        batch(&body_of(1, FRAMES_MAX + 1)).unwrap_err(),
        "sensors[0].frames: expected at most 4096 frames in all, found more\nhint: send smaller batches"
    );
    // The last frame of the second sensor is one too many: the limit covers all sensors together.
    assert_eq!(
        batch(&body_of(2, FRAMES_MAX / 2 + 1)).unwrap_err(),
        "sensors[1].frames: expected at most 4096 frames in all, found more\nhint: send smaller batches"
    );
    let account = |dropped: &str| {
        format!(
            r#"{{"device":"d","boot":"b","sensors":[{{"sensor":"s","frames":[],"account":{{"read":0,"missing":0,"spooled":0,"errors":{{}},"dropped":{{{dropped}}}}}}}]}}"#
        )
    };
    let named = |count: usize| {
        let named: Vec<String> = (0..count).map(|name| format!(r#""s{name}":1"#)).collect();
        named.join(",")
    };
    assert!(batch(&account(&named(REASONS_MAX))).is_ok());
    assert_eq!(
        batch(&account(&named(REASONS_MAX + 1))).unwrap_err(),
        "sensors[0].account.dropped: expected at most 64 reasons, found more\nhint: send smaller batches"
    );
    let answer = |gaps: usize, sensors: usize| {
        let gaps = vec![r#"{"sensor":"s","from":1,"to":1}"#; gaps].join(",");
        let durable = named(sensors);
        let body = format!(r#"{{"durable_through":{{{durable}}},"gaps":[{gaps}]}}"#);
        Acknowledgement::from_json(body.as_bytes()).map_err(|error| error.path)
    };
    assert!(answer(GAPS_MAX, SENSORS_MAX).is_ok());
    assert_eq!(answer(GAPS_MAX + 1, 2), Err("gaps".to_owned()));
    assert_eq!(
        answer(2, SENSORS_MAX + 1),
        Err("durable_through".to_owned())
    );
}

/// The fault is beyond the limit: a parser that collects first and counts later would report the fault.
#[test]
fn arrays_are_cut_off_while_they_are_parsed() {
    let whole = body_of(1, FRAMES_MAX + 1);
    let (head, _) = whole.split_at(whole.len() - "]}]}".len());
    let body = format!("{head},{{\"garbage\"");
    let error = read(&body).unwrap_err();
    assert_eq!(
        error,
        WireError {
            fault: WireFault::TooMany,
            path: "sensors[0].frames".to_owned(),
            what: "expected at most 4096 frames in all, found more\nhint: send smaller batches"
                .to_owned()
        }
    );
    let pixels = format!(
        r#"{{"device":"d","boot":"b","sensors":[{{"sensor":"s","frames":[{{"pixels_raw":[{}"garbage""#,
        "7,".repeat(65)
    );
    let error = read(&pixels).unwrap_err();
    assert_eq!(error.path, "sensors[0].frames[0].pixels_raw");
    assert_eq!(error.fault, WireFault::WrongValue);
}

#[test]
fn depth_is_bounded() {
    for opening in ["[", r#"{"sensors":["#, r#"{"device":"#] {
        let error = read(&opening.repeat(1_000_000)).unwrap_err();
        assert!(error.to_string().len() < 500);
    }
}

#[test]
fn the_widest_frame_fits_the_named_number_of_bytes() {
    let widest = Record {
        seq: COUNT_MAX,
        stamp: Stamp {
            t_boot_ns: COUNT_MAX,
            t_utc_ns: i64::MIN,
            clock: ClockState::Unsynced,
        },
        reading: Reading::Frame(RecordedFrame {
            thermistor: Some(ThermistorWord(u16::MAX)),
            pixels: [PixelWord(u16::MAX); 64],
        }),
    };
    let with = |frames: Vec<Record>| {
        let sensor = SensorBatch {
            sensor: "s".to_owned(),
            account: None,
            frames,
        };
        let batch = Batch {
            device: "d".to_owned(),
            boot: "b".to_owned(),
            t_sent_boot_ns: None,
            sensors: vec![sensor],
        };
        batch.to_json().unwrap().len()
    };
    assert_eq!(
        with(vec![widest]) - with(vec![]) + ",".len(),
        FRAME_BYTES_MAX
    );
}

#[test]
fn what_would_be_refused_is_not_sent() {
    let spoiled = |spoil: &dyn Fn(&mut Batch)| {
        let mut batch = specimen_value();
        spoil(&mut batch);
        batch.to_json().unwrap_err().path
    };
    assert_eq!(spoiled(&|batch| batch.device = "a b".to_owned()), "device");
    assert_eq!(
        spoiled(&|batch| batch.t_sent_boot_ns = Some(COUNT_MAX + 1)),
        "t_sent_boot_ns"
    );
    assert_eq!(
        spoiled(&|batch| batch.sensors[0].frames.swap(0, 1)),
        "sensors[0].frames[1].seq"
    );
    assert_eq!(
        spoiled(&|batch| batch.sensors[0].frames[1].seq = u64::MAX),
        "sensors[0].frames[1].seq"
    );
    let twice = spoiled(&|batch| {
        let sensor = batch.sensors[0].clone();
        batch.sensors.push(sensor);
    });
    assert_eq!(twice, "sensors[1].sensor");
    let gap = Gap {
        sensor: "s".to_owned(),
        from: 2,
        to: 1,
    };
    let answer = Acknowledgement {
        gaps: vec![gap],
        ..Acknowledgement::default()
    };
    assert_eq!(answer.to_json().unwrap_err().path, "gaps[0].to");
}

proptest! {
    #[test]
    fn a_batch_comes_back_from_its_json(batch in any_batch()) {
        prop_assert_eq!(Batch::from_json(&batch.to_json().unwrap()), Ok(batch));
    }

    #[test]
    fn an_answer_comes_back_from_its_json(answer in any_answer()) {
        prop_assert_eq!(Acknowledgement::from_json(&answer.to_json().unwrap()), Ok(answer));
    }

    #[test]
    fn arbitrary_bytes_are_refused_without_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        prop_assert!(Batch::from_json(&bytes).is_err());
        prop_assert!(Acknowledgement::from_json(&bytes).is_err());
    }

    #[test]
    fn a_body_with_bytes_replaced_is_refused_or_still_sound(
        faults in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
    ) {
        let mut body = specimen().into_bytes();
        for (place, byte) in faults {
            let place = place.index(body.len());
            body[place] = byte;
        }
        match Batch::from_json(&body) {
            Ok(batch) => prop_assert_eq!(Batch::from_json(&batch.to_json().unwrap()), Ok(batch)),
            Err(error) => prop_assert!(!error.path.is_empty()),
        }
    }

    #[test]
    fn a_body_cut_anywhere_is_refused(cut in any::<prop::sample::Index>()) {
        let body = specimen();
        let cut = cut.index(body.len());
        prop_assert!(read(&body[..cut]).is_err());
    }
}
