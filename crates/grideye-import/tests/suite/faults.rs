//! Files that break off, are damaged, or cannot be guessed.

use crate::support::{assert_frames, guessed, pixels, printed, refusal, said};
use grideye_frame::{NoData, Reading};
use grideye_import::ImportError;
use grideye_recording::Row;
use proptest::prelude::*;

fn lines(count: usize) -> Vec<String> {
    (0..count)
        .map(|frame| format!("152100832{frame}.5,{}\n", printed(frame, ",")))
        .collect()
}

#[test]
fn a_file_cut_at_any_byte_gives_the_frames_before_the_cut() {
    let text = lines(4).concat();
    let ends: Vec<usize> = text.match_indices('\n').map(|(at, _)| at + 1).collect();
    for length in ends[0]..text.len() {
        let mut import = guessed(&text[..length]);
        let rows: Vec<Result<Row, ImportError>> = import.by_ref().collect();
        let whole = ends.iter().filter(|end| **end <= length).count();
        let good: Vec<Row> = rows
            .iter()
            .filter_map(|row| row.as_ref().ok())
            .cloned()
            .collect();
        // What is left of the last line is an error, or a damaged row; a frame only if nothing but its newline lacks.
        let kept = |row: &&Row| row.record.reading.frame().is_some();
        let frames: Vec<Row> = good.iter().filter(kept).cloned().collect();
        assert_frames(&frames, frames.len(), &length.to_string());
        let lacks_newline = ends.contains(&(length + 1));
        assert!(frames.len() == whole || lacks_newline, "{length}");
        if let Some(Err(error)) = rows.last() {
            assert!(error.is_break(), "{error}");
        }
    }
}

#[test]
fn a_last_line_without_its_newline_is_used_if_it_is_certainly_whole() {
    let fixed = |text: String| {
        text.split(',')
            .map(|value| format!("{:.2}", value.trim().parse::<f64>().unwrap()))
            .collect::<Vec<_>>()
            .join(",")
    };
    let text: Vec<String> = (0..3).map(|frame| fixed(printed(frame, ","))).collect();
    assert_eq!(guessed(text.join("\n")).filter(Result::is_ok).count(), 3);
    let listed: Vec<String> = (0..3)
        .map(|frame| format!("[{}]", printed(frame, ",")))
        .collect();
    assert_eq!(guessed(listed.join("\n")).filter(Result::is_ok).count(), 3);
    let plain: Vec<String> = (0..3).map(|frame| printed(frame, ",")).collect();
    let kept = |text: &str| guessed(text).filter(Result::is_ok).count();
    // Quarters as Python prints them: 20.75 is whole, 20.7 and 20 may be more.
    let plain = plain.join("\n");
    assert!(plain.ends_with(",20.75"), "{plain}");
    assert_eq!(kept(&plain), 3);
    for less in [1, 2, 3] {
        assert_eq!(kept(&plain[..plain.len() - less]), 2, "{less}");
    }
    // Where the others have other fractions, nobody knows.
    assert_eq!(kept(&format!("{},\n{plain}", "20.3,".repeat(64))), 3);
    let error = guessed(&plain[..plain.len() - 1]).find_map(Result::err);
    assert_eq!(
        error.map(|error| error.to_string()).unwrap(),
        "line 3: the last line has no newline, and may be cut within a number\n\
         hint: the frames before are whole; if this line is whole too, end it with a newline"
    );
}

#[test]
fn a_damaged_row_is_a_missing_frame_and_is_counted() {
    let mut text = lines(8);
    text[2] = text[2].replace(",20,", ",,");
    text[5] = text[5].replacen(",2", "2", 1);
    text[6] = text[6].replacen("3", "x", 9);
    let mut import = guessed(text.concat());
    let rows: Vec<Row> = import.by_ref().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 8);
    for (frame, row) in rows.iter().enumerate() {
        let missing = matches!(row.record.reading, Reading::NoData(NoData::ShortTransfer));
        assert_eq!(missing, [2, 5, 6].contains(&frame), "{frame}");
        assert_eq!(row.record.seq, u64::try_from(frame).unwrap());
    }
    let tally = import.tally().unwrap();
    assert_eq!(
        (tally.frames, tally.damaged, tally.first_damaged),
        (5, 3, Some(3))
    );
    assert!(tally.has_loss());
}

#[test]
fn what_cannot_be_guessed_is_asked_for_by_name() {
    let twin: String = (0..8)
        .map(|frame| {
            format!(
                "{},{}\n",
                printed(frame, ","),
                20.0 + f64::from(u8::try_from(frame % 3).unwrap()) / 4.0
            )
        })
        .collect();
    let found = refusal(twin.as_str(), "");
    assert!(
        found.starts_with("which 64 of 65 columns of numbers are the pixels is not clear\nhint: "),
        "{found}"
    );
    assert!(
        found.contains("--columns pixels=1-64,label=65 if the last is none"),
        "{found}"
    );
    let mut read = said(twin, "walk.csv", "pixels=1-64,label=65").unwrap();
    assert_frames(
        &read.by_ref().map(Result::unwrap).collect::<Vec<_>>(),
        8,
        "as asked for",
    );
    let dates: String = (0..8)
        .map(|frame| format!("03/04/2021 10:00:0{frame},{}\n", printed(frame, ",")))
        .collect();
    assert!(refusal(dates, "").starts_with("whether the day or the month comes first"));
    let fifty = "50,".repeat(64) + "\n";
    assert_eq!(
        refusal(fifty.repeat(4), ""),
        "the unit of the pixels is not clear (whole numbers): their median 50 would be 50.0 °C in celsius, 10.0 °C in fahrenheit, 5.0 °C in tenths, 0.5 °C in hundredths, 12.5 °C in words\n\
         hint: say the unit if you know it: --columns unit=celsius or --columns unit=fahrenheit or --columns unit=tenths or --columns unit=hundredths or --columns unit=words"
    );
    for (unit, read_c) in [("unit=degrees", 50.0), ("unit=counts", 12.5)] {
        let mut import = said(fifty.repeat(4), "walk.csv", unit).unwrap();
        let row = import.next().unwrap().unwrap();
        assert_eq!(pixels(&row), [read_c; 64]);
    }
}

#[test]
fn another_sensor_and_other_files_are_refused_with_what_they_are() {
    let found = refusal("1.5,".repeat(768) + "\n", "");
    assert!(
        found.starts_with("768 pixels a frame, a Grid-EYE has 64") && found.contains("MLX90640"),
        "{found}"
    );
    let found = refusal(("24.5,".repeat(16) + "\n").repeat(3), "");
    assert!(
        found.starts_with("expected rows of 64 numbers, found 16 at most") && found.contains("D6T"),
        "{found}"
    );
    for (pixels, found) in [(768, true), (16, true), (64, false), (63, false)] {
        let names: String = (0..pixels).map(|index| format!(",pixel{index}")).collect();
        let header = format!("timestamp,thermistor{names},people_number,confidence\n");
        let said = refusal(header, "");
        let is_other = said.starts_with(&format!(
            "{pixels} pixels a frame, a Grid-EYE has 64 (8 x 8)\n"
        ));
        assert_eq!(is_other, found, "{said}");
    }
    for text in [
        "",
        "P5 8 8 255\n",
        "a,b\n1,2\n",
        "{\"a\":1}\n",
        "[]",
        "PK\u{3}\u{4}",
    ] {
        assert!(!refusal(text, "").is_empty(), "{text}");
    }
    for columns in [
        "time",
        "time=",
        "pixels=1-63",
        "pixels=none",
        "color=1",
        "time=0",
    ] {
        let found = refusal(lines(3).concat(), columns);
        assert!(
            found.starts_with("expected ROLE=COLUMN, found "),
            "{columns}: {found}"
        );
    }
    assert!(refusal(lines(3).concat(), "time=when").starts_with("there is no column when"));
}

proptest! {
    #[test]
    fn any_bytes_are_read_or_refused_without_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..600), start in 0_usize..6) {
        let start: &[u8] = [&b""[..], b"[[", b"{\"a\":[", b"\x93NUMPY\x01\x00", b"PK\x03\x04", b"PAR1"][start];
        if let Ok(import) = said([start, &bytes].concat(), "x", "") {
            prop_assert!(import.take_while(Result::is_ok).count() <= 600);
        }
    }
}
