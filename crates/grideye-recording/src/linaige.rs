//! The layout of the LINAIGE data set (Xie, Daghero et al., arXiv 2304.06059): real Grid-EYE recordings with labels.
//!
//! ```text
//! timestamp,thermistor,pixel0,…,pixel63,people_number,confidence
//! 18_14_07.274925,30.625,26.5,…,25.5,0,e
//! ```
//!
//! Where the layout is silent, this module decides:
//!
//! - **Date**: taken from the file's name by [`Date::from_file_name`].
//! - **Time zone**: UTC is assumed, with the clock [`Unsynced`](ClockState::Unsynced).
//! - **Sequence numbers** count rows from 0. The layout cannot mark a missed frame.
//! - **Boot time** starts at 0 and follows the printed times. Where these jump back (session 3, or past midnight), the
//!   row's clock is [`Stepped`](ClockState::Stepped), and boot time advances by [`ASSUMED_INTERVAL_NS`].
//! - **Last line**: it may lack its newline, because its last field is one letter, so a cut row cannot look complete.

use crate::cell::{Cell, Column};
use crate::csv::check_header;
use crate::error::RecordingError;
use crate::lines::{Line, Lines, rows_until_error};
use crate::record::{ClockState, Record, Row, Stamp, StreamId, check_name};
use crate::text::quoted;
use grideye_frame::{PIXELS, PixelWord, Reading, RecordedFrame};
use std::io::Read;

/// How far boot time advances when the printed time jumps back: one period of the data set, which was recorded at 10
/// Hz.
pub const ASSUMED_INTERVAL_NS: u64 = 100_000_000;

/// Fields of a row: time, thermistor, pixels, two labels.
const COLUMNS: usize = PIXELS + 4;

/// The columns of the labels.
pub const LABELS: [&str; 2] = ["people_number", "confidence"];

/// One row with its labels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LinaigeRow {
    /// The row of a recording, without `t_arrival_ns`.
    pub row: Row,
    /// `people_number`: how many people the authors saw in the sensor's view.
    pub people: u32,
    /// `confidence`: how sure they were.
    pub confidence: Confidence,
}

impl LinaigeRow {
    /// The row with its labels as texts, for the columns of [`LABELS`].
    #[must_use]
    pub fn labeled(self) -> Row {
        let confidence = match self.confidence {
            Confidence::E => "e",
            Confidence::H => "h",
        };
        Row {
            labels: vec![self.people.to_string(), confidence.to_owned()],
            ..self.row
        }
    }
}

/// The column `confidence`. The files do not define its letters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Confidence {
    /// `e`, the common one: probably "easy".
    E,
    /// `h`: probably "hard".
    H,
}

/// A day of the Gregorian calendar, from 1970 to 2199.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Date {
    days_since_1970: i64,
}

impl Date {
    /// The day with this year, month (1 to 12) and day (1 to 31); `None` if it does not exist or is not within 1970 to
    /// 2199.
    #[must_use]
    pub fn new(year: i64, month: i64, day: i64) -> Option<Self> {
        let days_since_1970 = grideye_frame::days_since_1970(year, month, day)?;
        Some(Self { days_since_1970 })
    }

    /// The date in a file's name, as in `2021-07-01`.
    ///
    /// ```
    /// use grideye_recording::linaige::Date;
    /// assert_eq!(Date::from_file_name("Session2_2021-07-01_RoomB_v2.csv").ok(), Date::new(2021, 7, 1));
    /// ```
    ///
    /// # Errors
    /// [`RecordingError::FileNameWithoutDate`] if there is none.
    pub fn from_file_name(name: &str) -> Result<Self, RecordingError> {
        name.as_bytes()
            .windows("2021-07-01".len())
            .find_map(|window| match window {
                [y1, y2, y3, y4, b'-', m1, m2, b'-', d1, d2] => Self::new(
                    digits(&[*y1, *y2, *y3, *y4])?,
                    digits(&[*m1, *m2])?,
                    digits(&[*d1, *d2])?,
                ),
                _ => None,
            })
            .ok_or_else(|| RecordingError::FileNameWithoutDate(quoted(name)))
    }

    /// Midnight at the start of the day, in nanoseconds since 1970-01-01 UTC.
    #[must_use]
    pub const fn midnight_utc_ns(self) -> i64 {
        self.days_since_1970 * 86_400 * NS_PER_S
    }
}

/// The stream for a file of this layout: device `linaige`, sensor `grid-eye`, and as boot the characters of the file's
/// name that a name may have, or else `session`.
#[must_use]
pub fn stream_from_file_name(name: &str) -> StreamId {
    let stem = name.strip_suffix(".csv").unwrap_or(name);
    let boot: String = stem
        .chars()
        .filter(|character| character.is_ascii_alphanumeric() || "._:-".contains(*character))
        .skip_while(|character| !character.is_ascii_alphanumeric())
        .take(grideye_frame::NAME_CHARS_MAX)
        .collect();
    StreamId {
        device: "linaige".to_owned(),
        sensor: "grid-eye".to_owned(),
        boot: match check_name(&boot) {
            Ok(()) => boot,
            Err(_) => "session".to_owned(),
        },
    }
}

/// The header of this layout, without its newline.
#[must_use]
pub fn header() -> String {
    let mut names = vec!["timestamp".to_owned(), "thermistor".to_owned()];
    names.extend((0..PIXELS).map(|index| format!("pixel{index}")));
    names.extend(LABELS.map(str::to_owned));
    names.join(",")
}

/// Reads a file of this layout row by row, as an iterator that ends with the first error.
#[derive(Debug)]
pub struct Reader<R> {
    lines: Lines<R>,
    date: Date,
    stream: StreamId,
    /// The stamp of the previous row.
    previous: Option<Stamp>,
    seq: u64,
    ended: bool,
}

impl<R: Read> Reader<R> {
    /// Reads the header at once. `stream` names the rows because the layout does not; [`stream_from_file_name`] makes
    /// one.
    ///
    /// # Errors
    /// [`RecordingError`] if the first line is not the header of this layout.
    pub fn new(input: R, date: Date, stream: StreamId) -> Result<Self, RecordingError> {
        let mut lines = Lines::new(input);
        let _no_labels = check_header(&mut lines, &header(), "timestamp,thermistor,pixel0")?;
        Ok(Self {
            lines,
            date,
            stream,
            previous: None,
            seq: 0,
            ended: false,
        })
    }

    fn row(&mut self) -> Result<Option<LinaigeRow>, RecordingError> {
        let Some(line) = self.lines.next()? else {
            return Ok(None);
        };
        let parsed = parse(&line).map_err(|error| if line.ended { error } else { line.cut() })?;
        let stamp = stamp(
            self.previous,
            self.date.midnight_utc_ns() + parsed.time_of_day_ns,
        );
        let record = Record {
            seq: self.seq,
            stamp,
            reading: Reading::Frame(parsed.frame),
        };
        self.previous = Some(stamp);
        self.seq += 1;
        Ok(Some(LinaigeRow {
            row: Row {
                stream: self.stream.clone(),
                record,
                t_arrival_ns: None,
                labels: Vec::new(),
            },
            people: parsed.people,
            confidence: parsed.confidence,
        }))
    }
}

rows_until_error!(Reader, LinaigeRow);

const NS_PER_S: i64 = 1_000_000_000;

struct Parsed {
    time_of_day_ns: i64,
    frame: RecordedFrame,
    people: u32,
    confidence: Confidence,
}

fn parse(line: &Line<'_>) -> Result<Parsed, RecordingError> {
    let [time, thermistor, pixels @ .., people, confidence] = line.fields::<COLUMNS>()?;
    let number = line.number;
    let cell = |column, text| Cell {
        line: number,
        column,
        text,
    };
    let named = |name, text| cell(Column::Named(name), text);
    let time = named("timestamp", time);
    let mut frame = RecordedFrame {
        thermistor: Some(named("thermistor", thermistor).thermistor()?),
        pixels: [PixelWord(0); PIXELS],
    };
    for (index, (word, text)) in frame.pixels.iter_mut().zip(pixels).enumerate() {
        *word = cell(Column::Pixel(index), text).pixel()?;
    }
    let people = named("people_number", people);
    let confidence = named("confidence", confidence);
    Ok(Parsed {
        time_of_day_ns: time_of_day_ns(time.text)
            .ok_or_else(|| time.refused("a time of day as 18_14_07.274925"))?,
        frame,
        people: u32::try_from(people.count()?)
            .ok()
            .ok_or_else(|| people.refused("a number of people"))?,
        confidence: match confidence.text {
            "e" => Confidence::E,
            "h" => Confidence::H,
            _ => return Err(confidence.refused("e or h")),
        },
    })
}

fn stamp(previous: Option<Stamp>, t_utc_ns: i64) -> Stamp {
    let (t_boot_ns, clock) = match previous {
        None => (0, ClockState::Unsynced),
        Some(before) => match u64::try_from(t_utc_ns - before.t_utc_ns) {
            Ok(passed) => (before.t_boot_ns + passed, ClockState::Unsynced),
            // The difference is negative: the clock was set back.
            Err(_) => (before.t_boot_ns + ASSUMED_INTERVAL_NS, ClockState::Stepped),
        },
    };
    Stamp {
        t_boot_ns,
        t_utc_ns,
        clock,
    }
}

/// `HH_MM_SS.ffffff` in nanoseconds since midnight.
fn time_of_day_ns(text: &str) -> Option<i64> {
    let [h1, h2, b'_', m1, m2, b'_', s1, s2, b'.', micros @ ..] = text.as_bytes() else {
        return None;
    };
    let (hours, minutes, seconds) = (
        digits(&[*h1, *h2])?,
        digits(&[*m1, *m2])?,
        digits(&[*s1, *s2])?,
    );
    if hours > 23 || minutes > 59 || seconds > 59 || micros.len() != 6 {
        return None;
    }
    Some(((hours * 60 + minutes) * 60 + seconds) * NS_PER_S + digits(micros)? * 1000)
}

/// Parses a short number of digits only.
fn digits(text: &[u8]) -> Option<i64> {
    text.iter().try_fold(0, |number, byte| {
        byte.is_ascii_digit()
            .then(|| number * 10 + i64::from(byte - b'0'))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_day_are_exact_and_strict() {
        assert_eq!(time_of_day_ns("00_00_00.000001"), Some(1_000));
        assert_eq!(time_of_day_ns("18_14_07.274925"), Some(65_647_274_925_000));
        assert_eq!(time_of_day_ns("23_59_59.999999"), Some(86_399_999_999_000));
        let wrong = "|18:14:07.274925|24_00_00.000000|18_60_00.000000|18_14_60.000000|18_14_07|\
                     18_14_07.27492|18_14_07.2749250|18_14_07.27492x|-1_14_07.274925";
        for text in wrong.split('|') {
            assert_eq!(time_of_day_ns(text), None, "{text}");
        }
    }
}
