//! The CSV recording format, tested with its golden file, damaged files, hostile readers and arbitrary rows.

use crate::golden;
use crate::made_up::any_records;
use grideye_frame::{NoData, PixelWord, Reading, RecordedFrame, ThermistorWord};
use grideye_recording::csv::{COLUMNS, Reader, STREAMS_MAX, Writer, header};
use grideye_recording::{COUNT_MAX, Record, RecordingError, Row, StreamId, is_recording};
use proptest::prelude::*;
use std::io::{self, Read, Write};

const GOLDEN: &str = include_str!("../../../../recordings/golden/two-sensors.csv");

fn write(rows: &[Row]) -> Result<String, RecordingError> {
    let mut writer = Writer::new(Vec::new())?;
    for row in rows {
        writer.write(row)?;
    }
    Ok(String::from_utf8(writer.finish()?).unwrap())
}

/// The rows before the first error, and its message.
fn read(text: &str) -> (Vec<Row>, Option<String>) {
    let reader = match Reader::new(text.as_bytes()) {
        Ok(reader) => reader,
        Err(error) => return (Vec::new(), Some(error.to_string())),
    };
    let mut rows = Vec::new();
    let mut faults = Vec::new();
    for item in reader {
        match item {
            Ok(row) => rows.push(row),
            Err(error) => faults.push(error.to_string()),
        }
    }
    assert!(
        faults.len() <= 1,
        "a reader stops at the first error: {faults:?}"
    );
    (rows, faults.pop())
}

/// The message for the golden file with the first occurrence of a piece replaced.
fn refusal(from: &str, to: &str) -> String {
    assert!(GOLDEN.contains(from), "{from} is not in the golden file");
    read(&GOLDEN.replacen(from, to, 1)).1.unwrap_or_default()
}

#[test]
fn the_golden_file_is_written_byte_for_byte() {
    assert_eq!(write(&golden::rows()).unwrap(), GOLDEN);
}

#[test]
fn the_golden_file_is_read_back_word_for_word() {
    assert_eq!(read(GOLDEN), (golden::rows(), None));
}

/// The datasheet's printed strings for the words (AMG88 spec §4-11-11), and both extremes of the format.
#[test]
fn the_golden_file_says_what_the_datasheet_says() {
    let printed = [
        "25", "0.25", "0", "-0.25", "125", "-25", "-55", "511.75", "-512",
    ];
    let mut independent = csv::Reader::from_reader(GOLDEN.as_bytes());
    let names = independent.headers().unwrap().clone();
    assert_eq!((names.len(), COLUMNS), (74, 74));
    assert_eq!((&names[10], &names[73]), ("pixel1", "pixel64"));
    let records: Vec<csv::StringRecord> = independent.records().map(Result::unwrap).collect();
    for (turn, record) in [(0, &records[0]), (1, &records[2]), (2, &records[4])] {
        for pixel in 0..64 {
            assert_eq!(&record[10 + pixel], printed[(pixel + turn) % 9]);
        }
    }
    let thermistors: Vec<&str> = records.iter().map(|record| &record[9]).collect();
    assert_eq!(thermistors, ["25", "25.0625", "-0.25", "", "-0", "25.0625"]);
    assert_eq!(&records[3][8], "nack");
    assert!(records[3].iter().skip(9).all(str::is_empty));
}

#[test]
fn the_specification_shows_rows_of_the_golden_file_and_names_every_reason() {
    let specification = include_str!("../../../../recordings/README.md");
    let mut shown = 0;
    for example in specification
        .lines()
        .filter(|line| line.starts_with("pi-1,"))
    {
        let beginning = example.trim_end_matches('…');
        assert!(
            GOLDEN.lines().any(|line| line.starts_with(beginning)),
            "{example}"
        );
        shown += 1;
    }
    assert_eq!(shown, 3);
    for reason in NoData::ALL {
        assert!(specification.contains(&format!("`{reason}`")), "{reason}");
    }
    for column in header().split(',').take(10) {
        assert!(
            specification.contains(&format!("\n| `{column}` |")),
            "{column}"
        );
    }
}

#[test]
fn a_file_cut_at_any_byte_is_read_up_to_the_cut_and_the_place_is_named() {
    let rows = golden::rows();
    for cut in 0..GOLDEN.len() {
        let whole_lines = GOLDEN[..cut].matches('\n').count();
        let into_line = cut - GOLDEN[..cut].rfind('\n').map_or(0, |newline| newline + 1);
        let (read, fault) = read(&GOLDEN[..cut]);
        assert_eq!(read, rows[..whole_lines.saturating_sub(1)], "cut at {cut}");
        let line = whole_lines + 1;
        let expected = match (whole_lines, into_line) {
            (0, 0) => Some("line 1: expected a header that begins with device,sensor,boot,seq, found nothing\nhint: the file is empty; its writer stopped before the header".to_owned()),
            (_, 0) => None,
            _ => Some(format!("line {line}: expected a newline at its end, found the end of the file after {into_line} bytes\nhint: the file was cut here, or its last row only lacks a newline: add one if the row is whole")),
        };
        assert_eq!(fault, expected, "cut at {cut}");
    }
}

#[test]
fn each_fault_in_a_row_is_named_with_line_and_column() {
    let name =
        "a name of 1 to 64 characters A-Z a-z 0-9 . _ : - that begins with a letter or a digit";
    let count = "an integer from 0 to 9223372036854775807";
    let cases = [
        ("\npi-1,", "\n=pi,", format!("line 2, column device: expected {name}, found \"=pi\"")),
        ("i2c-1:0x68", "@x", format!("line 2, column sensor: expected {name}, found \"@x\"")),
        ("5f0c", "", format!("line 2, column boot: expected {name}, found \"\"")),
        ("5f0c,0,", "5f0c,+0,", format!("line 2, column seq: expected {count}, found \"+0\"")),
        ("81000000000", "-1", format!("line 2, column t_boot_ns: expected {count}, found \"-1\"")),
        (",-1,", ",-1.5,", "line 2, column t_utc_ns: expected a signed 64-bit integer, found \"-1.5\"".to_owned()),
        ("unsynced", "set", "line 2, column clock: expected one of unsynced synced stepped, found \"set\"".to_owned()),
        (",1625163247250000000,", ",soon,", "line 2, column t_arrival_ns: expected a signed 64-bit integer, found \"soon\"".to_owned()),
        (",nack,", ",sulking,", format!("line 5, column missing: expected nothing, or one of {}, found \"sulking\"", NoData::ALL.iter().map(ToString::to_string).collect::<Vec<_>>().join(" "))),
        (",nack,,", ",nack,25,", "line 5, column thermistor: expected an empty cell, since the frame is missing (nack), found \"25\"".to_owned()),
        (",,\npi-1,i2c-1:0x68,5f0c,2", ",,7\npi-1,i2c-1:0x68,5f0c,2", "line 5, column pixel64: expected an empty cell, since the frame is missing (nack), found \"7\"".to_owned()),
        (",nack,", ",,", "line 5, column pixel1: expected degrees Celsius as a plain decimal number, found an empty cell".to_owned()),
        ("25.0625", "25.06", "line 3, column thermistor: expected a multiple of 0.0625 degrees Celsius that the sensor can report, such as 25.0625, found \"25.06\"".to_owned()),
        ("25.0625", "128", "line 3, column thermistor: expected -127.9375 to 127.9375 degrees Celsius, found \"128\"".to_owned()),
        (",511.75,", ",512,", "line 2, column pixel8: expected -512 to 511.75 degrees Celsius, found \"512\"".to_owned()),
        (",-512,", ",-512.25,", "line 2, column pixel9: expected -512 to 511.75 degrees Celsius, found \"-512.25\"".to_owned()),
        (",23.25,", ",23.3,", "line 3, column pixel1: expected a multiple of 0.25 degrees Celsius that the sensor can report, such as 23.25, found \"23.3\"".to_owned()),
        (",23.25,", ",NaN,", "line 3, column pixel1: expected degrees Celsius as a plain decimal number, found \"NaN\"".to_owned()),
        (",23.25,", ",,", "line 3, column pixel1: expected degrees Celsius as a plain decimal number, found an empty cell".to_owned()),
        (",23.25,", ",\"23.25\",", "line 3, column pixel1: expected degrees Celsius as a plain decimal number, found \"\"23.25\"\"".to_owned()),
        (",23.25,", ",", "line 3: expected 74 fields, found 73\nhint: 1 short: every row has a cell for each column of the header, empty ones included".to_owned()),
        (",23.25,", ",23.25,23.25,", "line 3: expected 74 fields, found 75".to_owned()),
        ("\npi-1,i2c-1:0x69", "\n\npi-1,i2c-1:0x69", "line 3: expected 74 fields, found 1".to_owned()),
        ("0x68,5f0c,1,", "0x68,5f0c,0,", "line 4, column seq: expected more than 0 in stream pi-1 i2c-1:0x68 5f0c, found 0\nhint: each frame appears once, in order; was the file joined from two?".to_owned()),
        (",pixel64\n", "\n", "line 1, field 74: expected the column name pixel64, found the end of the line\nhint: recordings/README.md states the columns of each layout".to_owned()),
        (",pixel64\n", ",pixel64,x\n", "line 2: expected 75 fields, found 74\nhint: 1 short: every row has a cell for each column of the header, empty ones included".to_owned()),
        ("boot", "start", "line 1, field 3: expected the column name boot, found \"start\"\nhint: recordings/README.md states the columns of each layout".to_owned()),
    ];
    for (from, to, message) in cases {
        assert_eq!(refusal(from, to), message, "{from:?} -> {to:?}");
    }
}

#[test]
fn rows_before_a_fault_are_given_and_none_after() {
    let (rows, fault) = read(&GOLDEN.replacen(",nack,", ",sulking,", 1));
    assert_eq!(rows, golden::rows()[..3]);
    assert!(fault.is_some());
}

#[test]
fn the_same_seq_may_come_again_in_another_stream() {
    let mut rows = golden::rows();
    for index in 0..3 {
        let mut other = rows[index].clone();
        other.stream.boot = format!("boot-{index}");
        rows.push(other);
    }
    assert_eq!(read(&write(&rows).unwrap()), (rows, None));
}

#[test]
fn a_recording_without_frames_is_a_header() {
    let empty = write(&[]).unwrap();
    assert_eq!(empty, header() + "\n");
    assert_eq!(read(&empty), (Vec::new(), None));
}

#[test]
fn files_saved_by_spreadsheets_are_read() {
    let spreadsheet = GOLDEN.replace('\n', "\r\n");
    assert_eq!(read(&spreadsheet), (golden::rows(), None));
    let table = GOLDEN.replace(",25,", ",25.0,").replace(",-0,", ",-0.0,");
    assert_eq!(read(&table), (golden::rows(), None));
}

#[test]
fn a_file_that_is_not_text_is_rejected_with_the_place() {
    let mut bytes = GOLDEN.as_bytes().to_vec();
    bytes[header().len() + 3] = 0xFF;
    let error = Reader::new(bytes.as_slice())
        .unwrap()
        .next()
        .unwrap()
        .unwrap_err();
    assert_eq!(
        error.to_string(),
        "line 2: expected text in UTF-8, found byte 0xff at column 3"
    );
}

#[test]
fn an_endless_line_fails_at_the_limit() {
    let error = Reader::new(io::repeat(b'x')).unwrap_err();
    assert_eq!(
        error.to_string(),
        "line 1: expected at most 4096 bytes, found more"
    );
    let endless = GOLDEN.as_bytes().chain(io::repeat(b'7'));
    // A reader that did not stop at its first error would never end: twenty items prove it.
    let items: Vec<_> = Reader::new(endless).unwrap().take(20).collect();
    assert_eq!(items.len(), golden::rows().len() + 1);
    let last = items.last().unwrap().as_ref().unwrap_err();
    let too_long = "line 8: expected at most 4096 bytes, found more";
    assert_eq!(last.to_string(), too_long);
    let line_of = |bytes: usize| {
        let file = format!("{}\n{}\n", header(), "x".repeat(bytes - 1));
        Reader::new(file.as_bytes())
            .unwrap()
            .next()
            .unwrap()
            .unwrap_err()
            .to_string()
    };
    assert!(line_of(4096).starts_with("line 2: expected 74 fields, found 1"));
    let too_long = "line 2: expected at most 4096 bytes, found more";
    assert_eq!(line_of(4097), too_long);
    // The widest possible row is far shorter.
    let name = "x".repeat(64);
    let widest = Row {
        stream: StreamId {
            device: name.clone(),
            sensor: name.clone(),
            boot: name,
        },
        record: Record {
            seq: COUNT_MAX,
            stamp: grideye_recording::Stamp {
                t_boot_ns: COUNT_MAX,
                t_utc_ns: i64::MIN,
                ..golden::rows()[0].record.stamp
            },
            reading: Reading::Frame(RecordedFrame {
                thermistor: Some(ThermistorWord(0xFFF)),
                pixels: [PixelWord(0x801); 64],
            }),
        },
        t_arrival_ns: Some(i64::MIN),
        labels: Vec::new(),
    };
    let row = write(&[widest]).unwrap().len() - header().len() - 1;
    assert_eq!(row, 3 * 65 + 20 + 20 + 21 + 9 + 21 + 1 + 10 + 64 * 8);
}

#[test]
fn the_number_of_streams_is_limited_for_writer_and_reader() {
    let row = |number: usize| {
        let mut row = golden::rows().remove(3);
        row.stream.boot = format!("b{number}");
        row
    };
    let rows: Vec<Row> = (0..STREAMS_MAX).map(row).collect();
    let most = write(&rows).unwrap();
    assert_eq!(read(&most), (rows, None));
    let mut writer = Writer::new(Vec::new()).unwrap();
    for number in 0..STREAMS_MAX {
        writer.write(&row(number)).unwrap();
    }
    let message = "line 4098: expected at most 4096 streams in one recording, found one more\nhint: record fewer sensors at a time";
    assert_eq!(
        writer.write(&row(STREAMS_MAX)).unwrap_err().to_string(),
        message
    );
    let last = most.lines().last().unwrap().replace(",b4095,", ",c,");
    assert_eq!(read(&format!("{most}{last}\n")).1.as_deref(), Some(message));
}

#[test]
fn the_writer_refuses_what_the_reader_would_and_goes_on() {
    let mut writer = Writer::new(Vec::new()).unwrap();
    let rows = golden::rows();
    writer.write(&rows[2]).unwrap();
    let spoiled = |spoil: &dyn Fn(&mut Row)| {
        let mut row = rows[4].clone();
        spoil(&mut row);
        row
    };
    let refused = [
        (
            spoiled(&|row| row.stream.device = "a,b".to_owned()),
            "line 3, column device: ",
        ),
        (
            spoiled(&|row| row.stream.sensor = "+1".to_owned()),
            "line 3, column sensor: ",
        ),
        (
            spoiled(&|row| row.stream.boot = "a\nb".to_owned()),
            "line 3, column boot: ",
        ),
        (
            spoiled(&|row| row.record.seq = COUNT_MAX + 1),
            "line 3, column seq: ",
        ),
        (
            spoiled(&|row| row.record.stamp.t_boot_ns = u64::MAX),
            "line 3, column t_boot_ns: ",
        ),
        (
            rows[2].clone(),
            "line 3, column seq: expected more than 1 in stream",
        ),
        (
            rows[0].clone(),
            "line 3, column seq: expected more than 1 in stream",
        ),
    ];
    for (row, beginning) in refused {
        let message = writer.write(&row).unwrap_err().to_string();
        assert!(message.starts_with(beginning), "{message}");
    }
    writer.write(&rows[4]).unwrap();
    assert_eq!(writer.rows(), 2);
    let text = String::from_utf8(writer.finish().unwrap()).unwrap();
    assert_eq!(read(&text), (vec![rows[2].clone(), rows[4].clone()], None));
}

/// A disk with this many bytes left.
#[derive(Debug)]
struct NearlyFull(usize);

impl Write for NearlyFull {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let taken = bytes.len().min(self.0);
        self.0 -= taken;
        match taken {
            0 => Err(io::Error::new(
                io::ErrorKind::StorageFull,
                "no space left on device",
            )),
            _ => Ok(taken),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn after_half_a_row_nothing_more_is_written() {
    let mut writer = Writer::new(NearlyFull(GOLDEN.len() - 200)).unwrap();
    let rows = golden::rows();
    for row in &rows[..5] {
        writer.write(row).unwrap();
    }
    assert_eq!(
        writer.write(&rows[5]).unwrap_err().to_string(),
        "line 7: no space left on device"
    );
    let broken = "line 7: expected an intact file, found one with a failed last row";
    assert_eq!(writer.write(&rows[5]).unwrap_err().to_string(), broken);
    assert_eq!(writer.finish().unwrap_err().to_string(), broken);
    assert!(matches!(
        Writer::new(NearlyFull(3)),
        Err(RecordingError::Io { line: 1, .. })
    ));
}

/// Gives one byte at a time, with an interrupt before each; counts the bytes given.
struct Dribble<'b> {
    bytes: &'b [u8],
    interrupted: bool,
}

impl Read for Dribble<'_> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        self.interrupted = !self.interrupted;
        if self.interrupted {
            return Err(io::ErrorKind::Interrupted.into());
        }
        self.bytes.read(&mut into[..1])
    }
}

#[test]
fn how_the_bytes_arrive_does_not_matter() {
    let dribble = Dribble {
        bytes: GOLDEN.as_bytes(),
        interrupted: false,
    };
    let rows: Result<Vec<Row>, _> = Reader::new(dribble).unwrap().collect();
    assert_eq!(rows.unwrap(), golden::rows());
}

#[test]
fn a_disk_that_fails_is_reported_with_the_line() {
    struct Failing;
    impl Read for Failing {
        fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
            Err(io::Error::other("input/output error"))
        }
    }
    let items: Vec<_> = Reader::new(GOLDEN.as_bytes().chain(Failing))
        .unwrap()
        .take(20)
        .collect();
    assert_eq!(items.len(), 7);
    assert_eq!(
        items[6].as_ref().unwrap_err().to_string(),
        "line 8: input/output error"
    );
}

/// A recording generated while it is read; counts the requested rows.
struct Endless<'c> {
    rows_made: &'c std::cell::Cell<u64>,
    waiting: Vec<u8>,
}

impl Read for Endless<'_> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        if self.waiting.is_empty() {
            let seq = self.rows_made.get();
            let row = format!("d,s,b,{seq},0,0,synced,,,25{}\n", ",-0.25".repeat(64));
            self.waiting = row.into_bytes();
            self.rows_made.set(seq + 1);
        }
        let taken = self.waiting.len().min(into.len());
        into[..taken].copy_from_slice(&self.waiting[..taken]);
        self.waiting.drain(..taken);
        Ok(taken)
    }
}

/// An hour at 10 Hz. A reader that collected all rows first would never end.
#[test]
fn a_recording_of_any_length_is_read_as_it_comes() {
    let rows_made = std::cell::Cell::new(0);
    let endless = Endless {
        rows_made: &rows_made,
        waiting: Vec::new(),
    };
    let file = header() + "\n";
    let reader = Reader::new(file.as_bytes().chain(endless)).unwrap();
    for (seq, row) in (0..36_000).zip(reader) {
        assert_eq!(row.unwrap().record.seq, seq);
        assert!(rows_made.get() - seq < 64, "read ahead of row {seq}");
    }
}

#[test]
fn the_first_line_identifies_a_recording() {
    assert!(is_recording(GOLDEN));
    assert!(!is_recording(b"\x89PNG"));
    assert!(!is_recording(""));
}

#[test]
fn a_frame_without_a_thermistor_has_an_empty_cell() {
    let mut rows = golden::rows();
    let text = write(&rows).unwrap();
    rows[1].record.reading = rows[1].record.reading.map(|mut frame| {
        frame.thermistor = None;
        frame
    });
    let without = write(&rows).unwrap();
    let line = |text: &str| text.lines().nth(2).unwrap().to_owned();
    let expected = line(&text).replace(",,25.0625,", ",,,");
    assert_eq!(line(&without), expected);
    assert_eq!(read(&without), (rows, None));
}

/// The row as the format keeps it.
fn kept(mut row: Row) -> Row {
    row.record.reading = row.record.reading.map(|frame| RecordedFrame {
        thermistor: frame.thermistor.map(|word| ThermistorWord(word.0 & 0xFFF)),
        pixels: frame.pixels.map(|word| PixelWord(word.0 & 0xFFF)),
    });
    row
}

fn any_rows() -> impl Strategy<Value = Vec<Row>> {
    let name = "[A-Za-z0-9][A-Za-z0-9._:-]{0,63}";
    let stream = (name, name, name, any_records(), any::<Option<i64>>());
    prop::collection::vec(stream, 0..3).prop_map(|streams| {
        let mut rows = Vec::new();
        for (number, (device, sensor, boot, records, t_arrival_ns)) in
            streams.into_iter().enumerate()
        {
            // A unique number prevents two streams with the same name.
            let device = format!("{number}{}", &device[..device.len().min(63)]);
            let stream = StreamId {
                device,
                sensor,
                boot,
            };
            rows.extend(records.into_iter().map(|record| Row {
                stream: stream.clone(),
                record,
                t_arrival_ns,
                labels: Vec::new(),
            }));
        }
        rows
    })
}

proptest! {
    #[test]
    fn rows_round_trip_except_the_upper_four_bits(rows in any_rows()) {
        let text = write(&rows).unwrap();
        let kept: Vec<Row> = rows.into_iter().map(kept).collect();
        prop_assert_eq!(read(&text), (kept, None));
    }

    #[test]
    fn a_long_recording_cut_anywhere_loses_the_cut_row_alone(rows in any_rows(), cut in any::<prop::sample::Index>()) {
        let text = write(&rows).unwrap();
        let cut = cut.index(text.len());
        let (read, fault) = read(&text[..cut]);
        let whole = text[..cut].matches('\n').count();
        prop_assert_eq!(read.len(), whole.saturating_sub(1));
        prop_assert_eq!(fault.is_none(), text[..cut].ends_with('\n'));
    }

    #[test]
    fn a_file_with_bytes_replaced_is_refused_or_still_sound(
        faults in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
    ) {
        let mut bytes = GOLDEN.as_bytes().to_vec();
        for (place, byte) in faults {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        let Ok(reader) = Reader::new(bytes.as_slice()) else { return Ok(()) };
        let rows: Vec<Row> = reader.map_while(Result::ok).collect();
        prop_assert_eq!(read(&write(&rows).unwrap()), (rows, None));
    }

    #[test]
    fn arbitrary_bytes_after_the_header_are_refused_without_a_panic(bytes in prop::collection::vec(any::<u8>(), 1..400)) {
        let file = [(header() + "\n").into_bytes(), bytes].concat();
        prop_assert!(Reader::new(file.as_slice()).unwrap().any(|row| row.is_err()));
    }
}

#[test]
fn a_byte_order_mark_is_skipped() {
    let marked = format!("\u{feff}{GOLDEN}");
    assert!(is_recording(&marked));
    let rows = |text: &str| {
        let reader = Reader::new(text.as_bytes()).unwrap();
        reader.collect::<Result<Vec<_>, _>>().unwrap()
    };
    assert_eq!(rows(&marked), rows(GOLDEN));
}
