//! The two public LINAIGE sessions, beside a plain parse of their lines.

use crate::support::{pixels, said, thermistor};
use grideye_recording::csv::{Reader, Writer};
use grideye_recording::{ClockState, Row};

const SESSIONS: [(&str, &str); 2] = [
    (
        "Session2_2021-07-01_RoomB_v2.csv",
        include_str!("../../../../recordings/linaige/Session2_2021-07-01_RoomB_v2.csv"),
    ),
    (
        "Session3_2021-07-06_RoomA_v2.csv",
        include_str!("../../../../recordings/linaige/Session3_2021-07-06_RoomA_v2.csv"),
    ),
];

fn sessions() -> [Vec<Row>; 2] {
    SESSIONS.map(|(name, text)| {
        let import = said(text, name, "").unwrap();
        assert_eq!(import.labels(), ["people_number", "confidence"]);
        assert_eq!(
            import.account().container,
            "a session of the LINAIGE data set"
        );
        import.map(Result::unwrap).collect()
    })
}

#[test]
fn every_temperature_and_label_is_as_in_the_file() {
    let sessions = sessions();
    assert_eq!(sessions.each_ref().map(Vec::len), [1848, 1672]);
    for (rows, (_, text)) in sessions.iter().zip(SESSIONS) {
        for (index, (row, line)) in rows.iter().zip(text.lines().skip(1)).enumerate() {
            let cells: Vec<&str> = line.split(',').collect();
            let number = |cell: &str| cell.parse::<f64>().unwrap();
            assert_eq!(f64::from(thermistor(row).unwrap()), number(cells[1]));
            let expected: Vec<f64> = cells[2..66].iter().map(|cell| number(cell)).collect();
            assert_eq!(pixels(row).to_vec(), expected, "row {index}");
            assert_eq!(row.labels, cells[66..68]);
            assert_eq!(row.record.seq, u64::try_from(index).unwrap());
        }
    }
}

/// `date -u -d 2021-07-01T18:14:07Z +%s` is 1625163247, and `date -u -d 2021-07-06T18:24:31Z +%s` is 1625595871.
#[test]
fn wall_time_is_as_printed_and_boot_time_starts_at_0() {
    let [second, third] = sessions();
    let of = |row: &Row| (row.record.stamp.t_boot_ns, row.record.stamp.t_utc_ns);
    assert_eq!(of(&second[0]), (0, 1_625_163_247_274_925_000));
    assert_eq!(of(&second[1]), (129_994_000, 1_625_163_247_404_919_000));
    assert_eq!(of(&third[0]), (0, 1_625_595_871_770_024_000));
    let mut clocks = second.iter().map(|row| row.record.stamp.clock);
    assert!(clocks.all(|clock| clock == ClockState::Unsynced));
    // 18_14_07.274925 to 18_17_12.718339, the file's last row.
    assert_eq!(of(&second[1847]).0, 185_443_414_000);
}

/// Row 1055 prints 18_26_18.828315 and the next one 18_12_54.347679: 804.480636 s back.
#[test]
fn the_jump_back_in_session_3_is_a_step_of_the_clock_and_not_of_boot_time() {
    let [_, third] = sessions();
    let stamps: Vec<_> = third.iter().map(|row| row.record.stamp).collect();
    let stepped: Vec<usize> = (0..stamps.len())
        .filter(|index| stamps[*index].clock == ClockState::Stepped)
        .collect();
    assert_eq!(stepped, [1056]);
    let (before, after) = (stamps[1055], stamps[1056]);
    assert_eq!(after.t_utc_ns - before.t_utc_ns, -804_480_636_000);
    assert_eq!(after.t_boot_ns - before.t_boot_ns, 100_000_000);
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
    for (rows, (_, text)) in sessions().iter().zip(SESSIONS) {
        let mut writer = Writer::new(Vec::new()).unwrap();
        let rows = rows.iter().map(|row| Row {
            labels: Vec::new(),
            ..row.clone()
        });
        let rows: Vec<Row> = rows.collect();
        for row in &rows {
            writer.write(row).unwrap();
        }
        let file = String::from_utf8(writer.finish().unwrap()).unwrap();
        let read: Result<Vec<Row>, _> = Reader::new(file.as_bytes()).unwrap().collect();
        assert_eq!(read.unwrap(), rows);
        // The temperatures are spelled as in the source.
        for (ours, theirs) in file.lines().zip(text.lines()).skip(1) {
            let ours = ours.split(',').skip(9);
            assert!(ours.eq(theirs.split(',').skip(1).take(65)));
        }
    }
}

/// Neither file ends with a newline, and both last rows are whole. Behind the pixels a cut costs no more than a label.
#[test]
fn a_last_row_whose_pixels_are_cut_is_no_frame() {
    let (name, text) = SESSIONS[0];
    let four: Vec<&str> = text.lines().take(5).collect();
    let four = four.join("\n");
    let begin = four.rfind('\n').unwrap() + 1;
    for cut in begin + 1..=four.len() {
        let import = said(&four[..cut], name, "").unwrap();
        let rows: Vec<Row> = import.map_while(Result::ok).collect();
        let frames = rows
            .iter()
            .filter(|row| row.record.reading.frame().is_some());
        let expected = if four[..cut].ends_with(",0,") || cut == four.len() {
            4
        } else {
            3
        };
        assert_eq!(frames.count(), expected, "cut at {}", &four[begin..cut]);
    }
}

#[test]
fn a_damaged_row_is_a_missing_frame() {
    let (name, text) = SESSIONS[0];
    for (from, to) in [(",26.5,25.5,", ",26.5,nan,"), (",26.5,", ",")] {
        let mut import = said(text.replacen(from, to, 1), name, "").unwrap();
        assert!(
            import
                .next()
                .unwrap()
                .unwrap()
                .record
                .reading
                .frame()
                .is_none()
        );
        assert_eq!(import.by_ref().map(Result::unwrap).count(), 1847);
        assert_eq!(import.tally().unwrap().damaged, 1);
    }
}

/// `date -u -d DATE +%s`.
#[test]
fn the_day_is_that_in_the_files_name_and_must_be_there() {
    let text = SESSIONS[0].1;
    let first = |name: &str| said(text, name, "").map(|mut import| import.next().unwrap().unwrap());
    let clock_ns = ((18 * 60 + 14) * 60 + 7) * 1_000_000_000 + 274_925_000;
    for name in "2021-07-06.csv|a/2021-07-06|x12021-07-06y|1-2021-07-06".split('|') {
        let stamp = first(name).unwrap().record.stamp;
        assert_eq!(
            stamp.t_utc_ns,
            1_625_529_600_000_000_000 + clock_ns,
            "{name}"
        );
    }
    for name in "|session.csv|2021-13-01.csv|2021_07_06.csv|é2021-07-0é".split('|') {
        let error = first(name).unwrap_err().to_string();
        let expected = format!(
            "file name {name:?}: expected a date as in Session2_2021-07-01_RoomB_v2.csv, found none"
        );
        assert!(error.starts_with(&expected), "{error}");
    }
}

#[test]
fn a_stream_is_named_after_its_file() {
    let stream = |name: &str| {
        let mut import = said(SESSIONS[0].1, name, "").unwrap();
        import.next().unwrap().unwrap().stream
    };
    let session = stream(SESSIONS[0].0);
    assert_eq!(session.device, "linaige");
    assert_eq!(session.boot, "Session2_2021-07-01_RoomB_v2");
    assert_eq!(stream("_ö=a 2021-07-01 b.csv").boot, "a2021-07-01b");
    let long = format!("2021-07-01{}", "x".repeat(100));
    assert_eq!(stream(&long).boot.len(), 64);
    let text = "20.25,".repeat(64) + "\n";
    let unnamed = said(text, "ö", "").unwrap().next().unwrap().unwrap();
    assert_eq!(unnamed.stream.boot, "session");
}
