//! Workbooks that openpyxl wrote (`tests/workbooks/write.py`).

use crate::support::{assert_frames, celsius, guessed, pixels, refusal, said};
use grideye_import::Import;
use grideye_recording::Row;

const EVENING: &[u8] = include_bytes!("../workbooks/evening.xlsx");
const TWO: &[u8] = include_bytes!("../workbooks/two.xlsx");
const DAMAGED: &[u8] = include_bytes!("../workbooks/damaged.xlsx");
const OTHER: &[u8] = include_bytes!("../workbooks/other.xlsx");
const TALL: &[u8] = include_bytes!("../workbooks/tall.xlsx");
const WIDE: &[u8] = include_bytes!("../workbooks/wide.xlsx");
/// `date -u -d 2021-07-01T18:14:07 +%s`, and the fraction.
const START_NS: i64 = 1_625_163_247_274_925_000;

fn all(import: &mut Import) -> Vec<Row> {
    import.by_ref().map(Result::unwrap).collect()
}

/// Excel counts days in floating point: it knows a moment of today to 0.6 µs.
fn assert_times(rows: &[Row], first: i64) {
    for (row, frame) in rows.iter().zip(first..) {
        let expected_ns = START_NS + frame * 100_000_000;
        let away_ns = (row.record.stamp.t_utc_ns - expected_ns).abs();
        assert!(away_ns <= 1_000, "frame {frame}: {away_ns} ns");
    }
}

#[test]
fn the_sheet_with_frames_is_read_with_its_dates_and_labels() {
    let mut import = guessed(EVENING);
    let account = import.account().to_string();
    assert!(
        account.starts_with("read as the sheet Evening of a workbook\n"),
        "{account}"
    );
    let rows = all(&mut import);
    assert_frames(&rows, 6, "a workbook");
    assert_times(&rows, 0);
    assert_eq!(import.labels(), ["people"]);
    let people: Vec<&str> = rows.iter().map(|row| row.labels[0].as_str()).collect();
    assert_eq!(people, ["", "1", "2", "3", "4", "5"]);
}

#[test]
fn of_several_sheets_with_frames_one_is_asked_for() {
    assert_eq!(
        refusal(TWO, ""),
        "2 sheets of the workbook have frames\n\
         hint: choose one: --columns sheet=1 (Morning), --columns sheet=2 (Late, too)"
    );
    for (columns, first) in [("sheet=Morning", 0_u8), ("sheet=1", 0), ("sheet=2", 1)] {
        let rows = all(&mut said(TWO, "two.xlsx", columns).unwrap());
        assert_eq!(rows.len(), 4, "{columns}");
        assert_eq!(pixels(&rows[0]), celsius(first.into()), "{columns}");
        assert_times(&rows, first.into());
    }
    assert_eq!(
        refusal(TWO, "sheet=Evening"),
        "there is no sheet Evening\nhint: the workbook has Morning, Late, too"
    );
    assert!(refusal(TWO, "sheet=3").starts_with("there is no sheet 3"));
    assert!(refusal(EVENING, "sheet=Notes").starts_with("expected rows of 64 numbers"));
    let text = "20.5,".repeat(64) + "\n";
    assert_eq!(
        refusal(text, "sheet=1"),
        "there is no sheet 1\nhint: only a workbook (.xlsx) has sheets: leave sheet= out"
    );
}

#[test]
fn failed_formulas_and_cleared_rows_are_no_frames() {
    let mut import = guessed(DAMAGED);
    let rows = all(&mut import);
    let read: Vec<u64> = (0..)
        .zip(&rows)
        .filter_map(|(_, row)| {
            row.record
                .reading
                .frame()
                .map(|_| row.record.stamp.t_boot_ns)
        })
        .collect();
    // Frame 2 has the formula, frame 3 was cleared.
    assert_eq!(read, [0, 250_000_000, 1_000_000_000]);
    let tally = import.tally().unwrap();
    assert_eq!(
        (tally.frames, tally.damaged, tally.first_damaged),
        (3, 1, Some(3))
    );
}

#[test]
fn what_is_no_recording_is_refused_with_what_it_is() {
    assert!(refusal(OTHER, "").starts_with("768 pixels a frame, a Grid-EYE has 64 (8 x 8)\n"));
    for large in [WIDE, TALL] {
        let found = refusal(large, "");
        let limits = "expected at most 2048 columns and 1048576 rows, found a larger one, Sheet\n";
        assert!(found.starts_with(limits), "{found}");
    }
    for length in [EVENING.len() - 1, EVENING.len() / 2] {
        let found = refusal(&EVENING[..length], "");
        let hints = found.contains("\nhint: save it in Excel or LibreOffice as .xlsx");
        assert!(
            found.starts_with("expected a whole workbook, found ") && hints,
            "{found}"
        );
    }
}
