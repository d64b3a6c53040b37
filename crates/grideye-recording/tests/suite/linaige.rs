//! The two public LINAIGE sessions, compared with an independent parse by the `csv` crate.

use grideye_frame::Reading;
use grideye_frame::word;
use grideye_recording::csv::{self as recording, Writer};
use grideye_recording::linaige::{
    ASSUMED_INTERVAL_NS, Confidence, Date, LinaigeRow, Reader, header, stream_from_file_name,
};
use grideye_recording::{ClockState, Layout, RecordingError, sniff};

const SESSION_2: &str =
    include_str!("../../../../recordings/linaige/Session2_2021-07-01_RoomB_v2.csv");
const SESSION_3: &str =
    include_str!("../../../../recordings/linaige/Session3_2021-07-06_RoomA_v2.csv");

fn open(text: &str) -> Result<Reader<&[u8]>, RecordingError> {
    let date = Date::new(2021, 7, 1).unwrap();
    Reader::new(text.as_bytes(), date, stream_from_file_name("test.csv"))
}

fn session(name: &str, text: &'static str) -> Vec<LinaigeRow> {
    let date = Date::from_file_name(name).unwrap();
    let reader = Reader::new(text.as_bytes(), date, stream_from_file_name(name)).unwrap();
    reader.map(Result::unwrap).collect()
}

fn session_2() -> Vec<LinaigeRow> {
    session("Session2_2021-07-01_RoomB_v2.csv", SESSION_2)
}

fn session_3() -> Vec<LinaigeRow> {
    session("Session3_2021-07-06_RoomA_v2.csv", SESSION_3)
}

/// Every temperature and label of the file, parsed without this crate's code.
fn agrees_with_a_plain_parse(rows: &[LinaigeRow], text: &str) {
    let mut plain = csv::Reader::from_reader(text.as_bytes());
    let mut compared = 0;
    for (record, row) in plain.records().map(Result::unwrap).zip(rows) {
        let Reading::Frame(raw) = row.row.record.reading else {
            panic!("row {compared} is missing");
        };
        let number = |index: usize| record[index].parse::<f32>().unwrap();
        assert_eq!(
            word::thermistor_celsius(raw.thermistor.unwrap()).get(),
            number(1)
        );
        for (index, pixel) in raw.pixels.into_iter().enumerate() {
            assert_eq!(
                word::pixel_celsius(pixel).get(),
                number(2 + index),
                "row {compared}, pixel{index}"
            );
        }
        assert_eq!(row.people.to_string(), record[66]);
        assert_eq!(format!("{:?}", row.confidence).to_lowercase(), record[67]);
        assert_eq!(row.row.record.seq, compared);
        compared += 1;
    }
    assert_eq!(compared, u64::try_from(text.lines().count() - 1).unwrap());
}

#[test]
fn session_2_is_read_whole() {
    let rows = session_2();
    assert_eq!(rows.len(), 1848);
    agrees_with_a_plain_parse(&rows, SESSION_2);
}

#[test]
fn session_3_is_read_whole() {
    let rows = session_3();
    assert_eq!(rows.len(), 1672);
    agrees_with_a_plain_parse(&rows, SESSION_3);
}

/// Counted in the files with another program.
#[test]
fn labels_are_counted_as_in_the_files() {
    let people =
        |rows: &[LinaigeRow], wanted| rows.iter().filter(|row| row.people == wanted).count();
    let sure = |rows: &[LinaigeRow]| {
        rows.iter()
            .filter(|row| row.confidence == Confidence::E)
            .count()
    };
    let (second, third) = (session_2(), session_3());
    assert_eq!(
        [0, 1, 2, 3].map(|count| people(&second, count)),
        [243, 581, 1024, 0]
    );
    assert_eq!(
        [0, 1, 2, 3].map(|count| people(&third, count)),
        [1122, 412, 127, 11]
    );
    assert_eq!((sure(&second), sure(&third)), (1581, 1519));
}

/// `date -u -d 2021-07-01T18:14:07Z +%s` is 1625163247, and `date -u -d 2021-07-06T18:24:31Z +%s` is 1625595871.
#[test]
fn wall_time_is_as_printed_and_boot_time_starts_at_0() {
    let (second, third) = (session_2(), session_3());
    let first = second[0].row.record.stamp;
    assert_eq!(
        (first.t_boot_ns, first.t_utc_ns),
        (0, 1_625_163_247_274_925_000)
    );
    let next = second[1].row.record.stamp;
    assert_eq!(
        (next.t_boot_ns, next.t_utc_ns),
        (129_994_000, 1_625_163_247_404_919_000)
    );
    assert_eq!(
        third[0].row.record.stamp.t_utc_ns,
        1_625_595_871_770_024_000
    );
    assert!(
        second
            .iter()
            .all(|row| row.row.record.stamp.clock == ClockState::Unsynced)
    );
    // 18_14_07.274925 to 18_17_12.718339, the file's last row.
    assert_eq!(second[1847].row.record.stamp.t_boot_ns, 185_443_414_000);
}

/// Row 1055 prints 18_26_18.828315 and the next one 18_12_54.347679: 804.480636 s back.
#[test]
fn the_jump_back_in_session_3_is_a_step_of_the_clock_and_not_of_boot_time() {
    let stamps: Vec<_> = session_3().iter().map(|row| row.row.record.stamp).collect();
    let stepped: Vec<usize> = (0..stamps.len())
        .filter(|index| stamps[*index].clock == ClockState::Stepped)
        .collect();
    assert_eq!(stepped, [1056]);
    assert_eq!(
        stamps[1056].t_utc_ns - stamps[1055].t_utc_ns,
        -804_480_636_000
    );
    assert_eq!(
        stamps[1056].t_boot_ns - stamps[1055].t_boot_ns,
        ASSUMED_INTERVAL_NS
    );
    for (before, after) in stamps.iter().zip(&stamps[1..]) {
        assert!(before.t_boot_ns < after.t_boot_ns);
        if after.clock == ClockState::Unsynced {
            let by_boot = after.t_boot_ns - before.t_boot_ns;
            assert_eq!(i64::try_from(by_boot), Ok(after.t_utc_ns - before.t_utc_ns));
        }
    }
}

#[test]
fn both_sessions_go_through_a_recording_word_for_word() {
    let rows: Vec<_> = [session_2(), session_3()]
        .concat()
        .into_iter()
        .map(|row| row.row)
        .collect();
    let mut writer = Writer::new(Vec::new()).unwrap();
    for row in &rows {
        writer.write(row).unwrap();
    }
    let file = writer.finish().unwrap();
    let read: Result<Vec<_>, _> = recording::Reader::new(file.as_slice()).unwrap().collect();
    assert_eq!(read.unwrap(), rows);
}

#[test]
fn the_temperatures_of_a_recording_are_spelled_as_in_the_source() {
    let mut writer = Writer::new(Vec::new()).unwrap();
    for row in session_2() {
        writer.write(&row.row).unwrap();
    }
    let file = String::from_utf8(writer.finish().unwrap()).unwrap();
    for (ours, theirs) in file.lines().zip(SESSION_2.lines()).skip(1) {
        let ours: Vec<&str> = ours.split(',').skip(9).collect();
        let theirs: Vec<&str> = theirs.split(',').skip(1).take(65).collect();
        assert_eq!(ours, theirs);
    }
}

/// Neither file ends with a newline, and both last rows are intact.
#[test]
fn the_last_row_is_taken_without_its_newline_only_when_it_is_whole() {
    assert!(!SESSION_2.ends_with('\n') && !SESSION_3.ends_with('\n'));
    let three: Vec<&str> = SESSION_2.lines().take(4).collect();
    let text = three.join("\n");
    for cut in 0..=text.len() {
        let lines = text[..cut].lines().count();
        let line_is_whole = text[..cut].lines().last() == three.get(lines.wrapping_sub(1)).copied();
        let Ok(reader) = open(&text[..cut]) else {
            assert!(cut <= header().len(), "cut at {cut}");
            continue;
        };
        let mut items: Vec<_> = reader.collect();
        if !line_is_whole {
            let error = items.pop().unwrap().unwrap_err();
            assert!(
                matches!(error, RecordingError::CutLine { line, .. } if line == u64::try_from(lines).unwrap()),
                "cut at {cut}: {error}"
            );
        }
        let whole = lines - 1 - usize::from(!line_is_whole);
        assert_eq!(
            items.into_iter().filter_map(Result::ok).count(),
            whole,
            "cut at {cut}"
        );
    }
}

#[test]
fn each_fault_in_a_row_is_named_with_line_and_column() {
    let cases = [
        (
            "18_14_07.274925",
            "18:14:07",
            "line 2, column timestamp: expected a time of day as 18_14_07.274925, found \"18:14:07\"",
        ),
        (
            "30.625,",
            "30.62,",
            "line 2, column thermistor: expected a multiple of 0.0625 degrees Celsius that the sensor can report, such as 30.625, found \"30.62\"",
        ),
        (
            ",26.5,25.5,",
            ",26.5,nan,",
            "line 2, column pixel1: expected degrees Celsius as a plain decimal number, found \"nan\"",
        ),
        (
            ",26.5,",
            ",",
            "line 2: expected 68 fields, found 67\nhint: 1 short: every row has a cell for each column of the header, empty ones included",
        ),
        (
            ",0,e",
            ",-1,e",
            "line 2, column people_number: expected an integer from 0 to 9223372036854775807, found \"-1\"",
        ),
        (
            ",0,e",
            ",4294967296,e",
            "line 2, column people_number: expected a number of people, found \"4294967296\"",
        ),
        (
            ",0,e",
            ",0,x",
            "line 2, column confidence: expected e or h, found \"x\"",
        ),
        (
            "pixel0",
            "pixel1",
            "line 1, field 3: expected the column name pixel0, found \"pixel1\"\nhint: recordings/README.md states the columns of each layout",
        ),
    ];
    for (from, to, message) in cases {
        let text = SESSION_2.replacen(from, to, 1);
        let fault = match open(&text) {
            Ok(mut reader) => reader.find_map(Result::err).unwrap(),
            Err(error) => error,
        };
        assert_eq!(fault.to_string(), message);
    }
    assert!(matches!(open(""), Err(RecordingError::Empty { .. })));
}

#[test]
fn the_first_line_identifies_the_layout() {
    assert_eq!(
        sniff(SESSION_2.lines().next().unwrap()),
        Some(Layout::Linaige)
    );
    assert_eq!(sniff(SESSION_3), Some(Layout::Linaige));
}

#[test]
fn dates_are_those_of_the_calendar() {
    // From `date -u -d DATE +%s` divided by 86400.
    let days = [
        ((1970, 1, 1), 0),
        ((2000, 2, 29), 11_016),
        ((2000, 3, 1), 11_017),
        ((2021, 7, 1), 18_809),
        ((2100, 3, 1), 47_541),
        ((2199, 12, 31), 84_005),
    ];
    for ((year, month, day), expected) in days {
        let date = Date::new(year, month, day).unwrap();
        let found = date.midnight_utc_ns();
        assert_eq!(
            found,
            expected * 86_400 * 1_000_000_000,
            "{year}-{month}-{day}"
        );
    }
    let none = [
        (1969, 12, 31),
        (2200, 1, 1),
        (2021, 2, 29),
        (2100, 2, 29),
        (2021, 13, 1),
        (2021, 0, 1),
        (2021, 4, 31),
        (2021, 4, 0),
    ];
    for (year, month, day) in none {
        assert_eq!(Date::new(year, month, day), None, "{year}-{month}-{day}");
    }
}

#[test]
fn the_date_is_found_wherever_it_stands_in_a_name() {
    for name in "2021-07-06.csv|a/2021-07-06|x12021-07-06y|1-2021-07-06".split('|') {
        let found = Date::from_file_name(name).ok();
        assert_eq!(found, Date::new(2021, 7, 6), "{name}");
    }
    for name in "|session.csv|2021-13-01.csv|2021_07_06.csv|é2021-07-0é".split('|') {
        let error = Date::from_file_name(name).unwrap_err();
        let is_named = matches!(error, RecordingError::FileNameWithoutDate { .. });
        assert!(is_named, "{name}: {error}");
    }
}

#[test]
fn a_stream_is_named_after_its_file() {
    assert_eq!(
        stream_from_file_name("Session2_2021-07-01_RoomB_v2.csv").boot,
        "Session2_2021-07-01_RoomB_v2"
    );
    assert_eq!(stream_from_file_name("_ö=a b.csv").boot, "ab");
    assert_eq!(stream_from_file_name("ö").boot, "session");
    assert_eq!(stream_from_file_name(&"x".repeat(100)).boot.len(), 64);
}
