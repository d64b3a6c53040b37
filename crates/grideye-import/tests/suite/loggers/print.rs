//! Numbers, times, lines and tables as programs print them.

use super::scene::Shot;
use grideye_frame::{COLUMNS, day_of};

pub(crate) type Number = fn(f64) -> String;

/// `19.75`, as C and Arduino print.
pub(crate) fn two(celsius: f64) -> String {
    format!("{celsius:.2}")
}

/// `19.8`.
pub(crate) fn one(celsius: f64) -> String {
    format!("{celsius:.1}")
}

/// `19.5` and `20.0`, as Python prints.
pub(crate) fn python(celsius: f64) -> String {
    format!("{celsius:?}")
}

/// `19.5` and `20`, as JavaScript prints.
pub(crate) fn short(celsius: f64) -> String {
    celsius.to_string()
}

/// `19.5` and `20.`, as numpy prints.
pub(crate) fn numpy(celsius: f64) -> String {
    python(celsius).trim_end_matches('0').to_owned()
}

/// One of the usual ways to print a temperature without loss.
pub(crate) const USUAL: [Number; 5] = [two, one, python, short, |celsius| format!("{celsius:.3}")];

/// The day and the time of day of a moment.
pub(crate) struct Civil {
    pub(crate) date: (i64, i64, i64),
    pub(crate) hour: i64,
    pub(crate) minute: i64,
    pub(crate) second: i64,
    pub(crate) ms: i64,
}

pub(crate) const MONTHS: [&str; 12] = [
    "Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec",
];

impl Civil {
    pub(crate) fn of(ns: i64) -> Self {
        let ms = ns.div_euclid(1_000_000);
        let second = ms.div_euclid(1_000);
        Self {
            date: day_of(second.div_euclid(86_400)),
            hour: second.rem_euclid(86_400) / 3_600,
            minute: second.rem_euclid(3_600) / 60,
            second: second.rem_euclid(60),
            ms: ms.rem_euclid(1_000),
        }
    }

    /// `2025-11-24`.
    pub(crate) fn day(&self) -> String {
        let (year, month, day) = self.date;
        format!("{year}-{month:02}-{day:02}")
    }

    /// `16:00:00`.
    pub(crate) fn clock(&self) -> String {
        format!("{:02}:{:02}:{:02}", self.hour, self.minute, self.second)
    }

    pub(crate) fn month(&self) -> &'static str {
        MONTHS[usize::try_from(self.date.1).unwrap() - 1]
    }

    /// The day of the week, from a Thursday on.
    pub(crate) fn weekday(ns: i64) -> &'static str {
        let days = ns.div_euclid(86_400_000_000_000).rem_euclid(7);
        ["Thu", "Fri", "Sat", "Sun", "Mon", "Tue", "Wed"][usize::try_from(days).unwrap()]
    }
}

/// `16:00:00.123`, with that sign before the milliseconds.
pub(crate) fn clock(ns: i64, point: &str) -> String {
    let civil = Civil::of(ns);
    format!("{}{point}{:03}", civil.clock(), civil.ms)
}

/// `2025-11-24T16:00:00.123`, with those signs before the time and the milliseconds.
pub(crate) fn iso(ns: i64, middle: &str, point: &str) -> String {
    format!("{}{middle}{}", Civil::of(ns).day(), clock(ns, point))
}

/// `1764000000.123`.
pub(crate) fn unix(ns: i64) -> String {
    format!("{}.{:03}", ns / 1_000_000_000, ns / 1_000_000 % 1_000)
}

/// Each frame as one text.
pub(crate) fn each(shots: &[Shot], text: impl Fn(&Shot) -> String) -> String {
    shots.iter().map(text).collect()
}

/// The 64 numbers.
pub(crate) fn joined(shot: &Shot, number: impl Fn(f64) -> String, separator: &str) -> String {
    shot.celsius().map(number).join(separator)
}

/// Eight lines of eight numbers.
pub(crate) fn grid(shot: &Shot, number: impl Fn(f64) -> String, separator: &str) -> Vec<String> {
    let numbers = shot.celsius().map(number);
    numbers
        .chunks(COLUMNS)
        .map(|row| row.join(separator))
        .collect()
}

/// `[[…], …]`.
pub(crate) fn nested(shot: &Shot, number: impl Fn(f64) -> String, separator: &str) -> String {
    let rows = grid(shot, number, ", ");
    let rows: Vec<String> = rows.iter().map(|row| format!("[{row}]")).collect();
    format!("[{}]", rows.join(separator))
}

/// A name, and a value for each frame.
pub(crate) type Column = (String, Vec<String>);

pub(crate) fn column(name: &str, shots: &[Shot], value: impl Fn(&Shot) -> String) -> Column {
    (name.to_owned(), shots.iter().map(value).collect())
}

pub(crate) fn pixels(
    shots: &[Shot],
    name: impl Fn(usize) -> String,
    number: impl Fn(f64) -> String,
) -> Vec<Column> {
    let pixel = |place: usize| {
        column(&name(place), shots, |shot| {
            number(f64::from(shot.steps[place]) / 4.0)
        })
    };
    (0..64).map(pixel).collect()
}

/// `p0` to `p63`.
pub(crate) fn p(place: usize) -> String {
    format!("p{place}")
}

/// A line of names, and a line for each frame.
pub(crate) fn table(separator: &str, columns: &[Column]) -> String {
    let names: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
    format!("{}\n{}", names.join(separator), body(separator, columns))
}

/// A line for each frame.
pub(crate) fn body(separator: &str, columns: &[Column]) -> String {
    let count = columns.first().map_or(0, |(_, values)| values.len());
    let line = |row: usize| {
        let values: Vec<&str> = columns
            .iter()
            .map(|(_, values)| values[row].as_str())
            .collect();
        values.join(separator) + "\n"
    };
    (0..count).map(line).collect()
}

/// A table of a time, the pixels `p0` to `p63`, and what follows them.
pub(crate) fn timed(
    name: &str,
    shots: &[Shot],
    stamp: impl Fn(&Shot) -> String,
    after: Vec<Column>,
) -> String {
    let mut columns = vec![column(name, shots, stamp)];
    columns.extend(pixels(shots, p, two));
    columns.extend(after);
    table(",", &columns)
}
