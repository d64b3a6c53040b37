//! Reads text files with one frame per line.

use crate::bare::assumed::{Assumed, no_word, word_of};
use crate::error::RecordingError;
use crate::lines::{Line, Lines, rows_until_error};
use crate::record::{ClockState, Row, Stamp};
use crate::text::quoted;
use grideye_frame::{PIXELS, PixelWord};
use std::io::Read;

/// Times from here on are seconds since 1970, and from `UNIX_MS` on milliseconds since 1970.
const UNIX_S: f64 = 1e9;
const UNIX_MS: f64 = 1e12;
const NS_PER_S: f64 = 1e9;

/// Reads lines of 64 temperatures in °C as an iterator of rows, up to the first error.
///
/// Separators are commas, semicolons, blanks, tabs and brackets. Empty lines, lines starting with `#`, and a first line
/// without a number are skipped. A line of 65 numbers begins with a time: in seconds, or since 1970 in seconds or
/// milliseconds.
#[derive(Debug)]
pub struct RowReader<R> {
    lines: Lines<R>,
    assumed: Assumed,
    seq: u64,
    /// The first and the latest time, in seconds.
    times: Option<(f64, f64)>,
    ended: bool,
}

enum Content {
    Nothing,
    Frame {
        time: Option<f64>,
        pixels: [PixelWord; PIXELS],
    },
}

/// Whether one of a file's first three lines has 64 or 65 numbers.
#[must_use]
pub(crate) fn looks_like_rows(beginning: &str) -> bool {
    beginning.lines().take(3).any(|line| {
        let numbers = numbers_of(line).filter(|text| text.parse::<f64>().is_ok());
        matches!(numbers.count(), 64 | 65)
    })
}

impl<R: Read> RowReader<R> {
    /// Reads nothing yet.
    pub fn new(input: R, assumed: Assumed) -> Self {
        Self {
            lines: Lines::new(input),
            assumed,
            seq: 0,
            times: None,
            ended: false,
        }
    }

    fn row(&mut self) -> Result<Option<Row>, RecordingError> {
        loop {
            let Some(line) = self.lines.next()? else {
                return Ok(None);
            };
            let content = content_of(&line);
            if !line.ended && !matches!(content, Ok(Content::Nothing)) {
                return Err(line.cut());
            }
            let number = line.number;
            if let Content::Frame { time, pixels } = content? {
                let stamp = self.stamp(number, time)?;
                let row = self.assumed.row(self.seq, stamp, pixels);
                self.seq += 1;
                return Ok(Some(row));
            }
        }
    }

    fn stamp(&mut self, line: u64, time: Option<f64>) -> Result<Stamp, RecordingError> {
        let Some(time) = time else {
            return Ok(self.assumed.stamp(self.seq));
        };
        let time_s = if time >= UNIX_MS { time / 1e3 } else { time };
        let (first_s, last_s) = self.times.unwrap_or((time_s, time_s));
        if !time_s.is_finite() || time_s < last_s {
            return Err(RecordingError::Cell {
                line,
                column: "time".to_owned(),
                expected: format!("a time that is not before {last_s} s, the line's before"),
                found: time.to_string(),
            });
        }
        self.times = Some((first_s, time_s));
        let is_unix = time_s >= UNIX_S;
        Ok(Stamp {
            t_boot_ns: nanoseconds(time_s - first_s).unsigned_abs(),
            t_utc_ns: if is_unix { nanoseconds(time_s) } else { 0 },
            clock: ClockState::Unsynced,
        })
    }
}

rows_until_error!(RowReader, Row);

fn content_of(line: &Line<'_>) -> Result<Content, RecordingError> {
    let text = line.text.trim_start_matches('\u{feff}').trim();
    let fields: Vec<&str> = numbers_of(text).collect();
    let is_heading = line.number == 1 && fields.iter().all(|field| field.parse::<f64>().is_err());
    if fields.is_empty() || text.starts_with('#') || is_heading {
        return Ok(Content::Nothing);
    }
    let (time, cells) = match fields.len() {
        PIXELS => (None, fields.as_slice()),
        65 => (Some(number(line.number, "time", fields[0])?), &fields[1..]),
        found => {
            return Err(RecordingError::FieldCount {
                line: line.number,
                expected: PIXELS,
                found,
            });
        }
    };
    let mut pixels = [PixelWord(0); PIXELS];
    for (index, (word, cell)) in pixels.iter_mut().zip(cells).enumerate() {
        let column = format!("pixel{}", index + 1);
        let celsius = number(line.number, &column, cell)?;
        let place = || format!("line {}, column {column}", line.number);
        *word = word_of(celsius).ok_or_else(|| no_word(place(), &quoted(cell)))?;
    }
    Ok(Content::Frame { time, pixels })
}

fn numbers_of(line: &str) -> impl Iterator<Item = &str> {
    line.split(|character: char| character.is_whitespace() || ",;[]()".contains(character))
        .filter(|field| !field.is_empty())
}

fn number(line: u64, column: &str, text: &str) -> Result<f64, RecordingError> {
    text.parse().map_err(|_no_number| RecordingError::Cell {
        line,
        column: column.to_owned(),
        expected: "a number".to_owned(),
        found: quoted(text),
    })
}

#[expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    reason = "a time of 292 years and more saturates"
)]
fn nanoseconds(seconds: f64) -> i64 {
    (seconds * NS_PER_S).round() as i64
}
