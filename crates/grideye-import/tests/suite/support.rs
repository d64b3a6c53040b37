//! Frames as text, and what is read of them.

use grideye_frame::Celsius;
use grideye_frame::word;
use grideye_import::{Import, ImportError, Options, open};
use grideye_recording::Row;
use std::io::Cursor;

/// 20 to 30 °C in quarters, that go up and down from frame to frame.
pub(crate) fn celsius(frame: usize) -> [f64; 64] {
    std::array::from_fn(|pixel| {
        let steps = u16::try_from((13 * pixel + 29 * frame + 7 * frame * frame) % 41).unwrap();
        20.0 + f64::from(steps) / 4.0
    })
}

pub(crate) fn printed(frame: usize, separator: &str) -> String {
    celsius(frame)
        .map(|value| value.to_string())
        .join(separator)
}

pub(crate) fn said(
    bytes: impl Into<Vec<u8>>,
    name: &str,
    columns: &str,
) -> Result<Import, ImportError> {
    let mut options = Options::default();
    if !columns.is_empty() {
        options.columns = columns.parse()?;
    }
    open(Cursor::new(bytes.into()), name, &options)
}

pub(crate) fn guessed(bytes: impl Into<Vec<u8>>) -> Import {
    said(bytes, "walk.csv", "").unwrap_or_else(|error| panic!("{error}"))
}

pub(crate) fn rows(bytes: impl Into<Vec<u8>>) -> Vec<Row> {
    guessed(bytes).collect::<Result<_, _>>().unwrap()
}

pub(crate) fn refusal(bytes: impl Into<Vec<u8>>, columns: &str) -> String {
    match said(bytes, "walk.csv", columns) {
        Ok(_) => panic!("it was read"),
        Err(error) => error.to_string(),
    }
}

pub(crate) fn pixels(row: &Row) -> [f64; 64] {
    let frame = row.record.reading.frame().unwrap();
    word::pixels(&frame.pixels).map(|pixel| f64::from(pixel.get()))
}

pub(crate) fn thermistor(row: &Row) -> Option<f32> {
    let frame = row.record.reading.frame().unwrap();
    frame
        .thermistor
        .map(word::thermistor_celsius)
        .map(Celsius::get)
}

/// Asserts that the rows are frames 0, 1, 2 …
pub(crate) fn assert_frames(rows: &[Row], count: usize, what: &str) {
    assert_eq!(rows.len(), count, "{what}");
    for (frame, row) in rows.iter().enumerate() {
        assert_eq!(pixels(row), celsius(frame), "{what}");
    }
}
