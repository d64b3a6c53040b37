//! What a counter of people needs: the empty room of a recording or a profile, and counts to judge it by.

use crate::error::{InputError, shown};
use crate::read::TOML_HINT;
use crate::text::open;
use csv::{ReaderBuilder, StringRecord};
use grideye_count::{CLASSES, Count, Counter, Gate, Line, Network, Room, celsius};
use grideye_recording::Record;
use grideye_scene::profile::Profile;
use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::Path;
use std::time::Duration;

/// More than the largest network takes.
const WEIGHTS_BYTES_MAX: u64 = 1 << 20;
/// Names of a column that holds the number of people, whatever their case.
const NAMES: [&str; 7] = [
    "people",
    "people_number",
    "people_count",
    "persons",
    "count",
    "occupancy",
    "label",
];
const WORDS: [(&str, u8); 8] = [
    ("nobody", 0),
    ("none", 0),
    ("empty", 0),
    ("no", 0),
    ("zero", 0),
    ("one", 1),
    ("two", 2),
    ("three", 3),
];

/// How many people one frame of a recording shows.
#[derive(Debug, Clone, Copy)]
pub struct FrameCount {
    /// The frame's number.
    pub seq: u64,
    /// Seconds since the first record, by the device's clock.
    pub at_s: f64,
    /// `None` for a missing frame, and while the empty room is not known yet.
    pub count: Option<Count>,
    /// How many entered and left so far, if there is a line.
    pub crossed: Option<[u64; 2]>,
}

/// Counts the people in the records of one stream, one by one.
pub fn count(
    records: &[Record],
    network: Network<'_>,
    mut counter: Counter,
    line: Option<Line>,
) -> impl Iterator<Item = FrameCount> {
    let mut gate = line.map(Gate::new);
    records
        .iter()
        .zip(times(records))
        .map(move |(record, at_s)| {
            let frame = temperatures(record);
            let count = frame.and_then(|frame| counter.see(&network, at_s, &frame));
            if let (Some(gate), Some(count)) = (&mut gate, &count) {
                gate.see(at_s, &count.excess);
            }
            FrameCount {
                seq: record.seq,
                at_s,
                count,
                crossed: gate.as_ref().map(|gate| [gate.entered, gate.left]),
            }
        })
}

/// Seconds since the first record, by the device's clock.
pub fn times(records: &[Record]) -> impl Iterator<Item = f64> {
    let boot_ns = |record: &Record| record.stamp.t_boot_ns;
    let began_ns = records.first().map_or(0, boot_ns);
    let since = move |record| Duration::from_nanos(boot_ns(record).saturating_sub(began_ns));
    records
        .iter()
        .map(move |record| since(record).as_secs_f64())
}

fn temperatures(record: &Record) -> Option<[f32; 64]> {
    record.reading.frame().map(celsius)
}

/// The bytes of a file of weights.
///
/// # Errors
/// It cannot be read, or is no such file.
pub fn weights(path: &Path) -> Result<Vec<u8>, InputError> {
    let refused = |error: &dyn std::fmt::Display| {
        let shown = shown(path);
        let hint = "hint: tests/peers/counting/run --weights FOLDER writes such a file";
        InputError::new(format!("{shown}: {error}\n{hint}")).of(path)
    };
    let mut bytes = Vec::new();
    let read = open(path)?.take(WEIGHTS_BYTES_MAX).read_to_end(&mut bytes);
    read.map_err(|error| refused(&error))?;
    Network::new(&bytes).map_err(|error| refused(&error))?;
    Ok(bytes)
}

/// The network of [`weights`], or the shipped one.
#[must_use]
pub fn network(weights: Option<&[u8]>) -> Network<'_> {
    match weights.map(Network::new) {
        Some(Ok(own)) => own,
        _ => Network::default(),
    }
}

/// A counter for the records of one stream. It knows the empty room from a profile, learns it as they come if `live`, or from
/// all of them: what each pixel showed in its colder frames.
///
/// # Errors
/// The profile cannot be read, or has no `[background]`.
pub fn counter(
    records: &[Record],
    profile: Option<&Path>,
    live: bool,
) -> Result<Counter, InputError> {
    if let Some(path) = profile {
        return of_profile(&crate::read::profile(path, TOML_HINT)?, path);
    }
    if live {
        return Ok(Counter::new());
    }
    let mut room = Room::default();
    records
        .iter()
        .filter_map(temperatures)
        .for_each(|frame| room.see(&frame));
    Ok(Counter::with_background(room.celsius()))
}

fn of_profile(profile: &Profile, path: &Path) -> Result<Counter, InputError> {
    if profile.background_c.is_none() {
        return Err(InputError::new(format!(
            "{} has no [background], so the empty room is not known from it\nhint: `grideye characterize EMPTY.csv --profile FILE` measures it",
            shown(path)
        ))
        .of(path));
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::as_conversions,
        reason = "degrees of a sensor"
    )]
    let room = profile.in_its_room_c().map(|celsius| celsius as f32);
    Ok(Counter::with_background(room))
}

/// How many people a table says are in view, frame by frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum People {
    /// One number a frame, in their order.
    InOrder(Vec<u8>),
    /// By the frame's number, from the first to the last of each range.
    ByNumber(BTreeMap<u64, (u64, u8)>),
}

impl People {
    /// The number for each record; `None` where the table says nothing.
    ///
    /// # Errors
    /// A table without frame numbers has not as many rows as there are records.
    pub fn of(&self, records: &[Record], path: &Path) -> Result<Vec<Option<u8>>, InputError> {
        match self {
            Self::InOrder(all) if all.len() == records.len() => {
                Ok(all.iter().copied().map(Some).collect())
            }
            Self::InOrder(all) => Err(InputError::new(format!(
                "{} has {} rows, and the recording {} frames\nhint: a column `seq` with the frame's number joins them whatever their number",
                shown(path),
                all.len(),
                records.len()
            ))
            .of(path)),
            Self::ByNumber(ranges) => Ok(records
                .iter()
                .map(|record| {
                    let (_, (last, people)) = ranges.range(..=record.seq).next_back()?;
                    (record.seq <= *last).then_some(*people)
                })
                .collect()),
        }
    }
}

/// Reads a CSV table with a number of people per frame (`column`, or the first of its usual names), in the order of the
/// frames, by a column `seq`, or by `first_seq` and `last_seq` as a recording's labels have them.
///
/// # Errors
/// There is no such column, or a cell says no number of people: the error names the line.
pub fn people(path: &Path, column: Option<&str>) -> Result<People, InputError> {
    let mut reader = ReaderBuilder::new()
        .comment(Some(b'#'))
        .from_reader(open(path)?);
    let broken = |error: csv::Error| {
        let line = error.position().map(csv::Position::line);
        let hint = "hint: a CSV table with a line of names, and one line a frame";
        let told = format!("{}: {error}\n{hint}", shown(path));
        InputError::new(told)
            .of(path)
            .at(line.and_then(|line| usize::try_from(line).ok()))
    };
    let names = reader.headers().map_err(broken)?.clone();
    let place = |wanted: &str| {
        names
            .iter()
            .position(|name| name.trim().eq_ignore_ascii_case(wanted))
    };
    let of_people = match column {
        Some(column) => place(column),
        None => NAMES.into_iter().find_map(place),
    };
    let of_people = of_people.ok_or_else(|| no_column(path, column, &names))?;
    let first = place("seq").or_else(|| place("first_seq"));
    let last = place("last_seq").or(first);
    let mut in_order = Vec::new();
    let mut by_number = BTreeMap::new();
    for row in reader.records() {
        let row = row.map_err(broken)?;
        let cell = |place: usize| row.get(place).unwrap_or("").trim();
        let people = number_of(cell(of_people))
            .ok_or_else(|| no_number(path, &row, cell(of_people), "0, 1, 2 or more people"))?;
        let number = |place: usize| {
            let number = cell(place).parse::<u64>();
            number.map_err(|_error| no_number(path, &row, cell(place), "a frame's number"))
        };
        match (first, last) {
            (Some(first), Some(last)) => {
                by_number.insert(number(first)?, (number(last)?, people));
            }
            _ => in_order.push(people),
        }
    }
    Ok(match first {
        Some(_) => People::ByNumber(by_number),
        None => People::InOrder(in_order),
    })
}

/// From `2`, `2 people`, `two` or `nobody`; 3 for three and more.
fn number_of(text: &str) -> Option<u8> {
    let first = text.split([' ', '+', '_', '-']).next().unwrap_or("");
    let most = u8::try_from(CLASSES - 1).unwrap_or(u8::MAX);
    if let Ok(number) = first.parse::<f64>() {
        let number = Some(number).filter(|number| number.fract() == 0.0 && *number >= 0.0)?;
        let small = (0..most).find(|small| f64::from(*small) >= number);
        return Some(small.unwrap_or(most));
    }
    let known = WORDS
        .into_iter()
        .find(|(word, _)| first.eq_ignore_ascii_case(word));
    known.map(|(_, number)| number)
}

fn no_column(path: &Path, column: Option<&str>, names: &StringRecord) -> InputError {
    let wanted = column.map_or_else(
        || format!("none of the columns {}", NAMES.join(", ")),
        |column| format!("no column {column}"),
    );
    let found: Vec<&str> = names
        .iter()
        .filter(|name| !name.starts_with("pixel"))
        .collect();
    InputError::new(format!(
        "{} has {wanted}\nhint: name one as FILE:COLUMN; there are {}",
        shown(path),
        found.join(", ")
    ))
    .of(path)
}

fn no_number(path: &Path, row: &StringRecord, cell: &str, wanted: &str) -> InputError {
    let line = row.position().map_or(0, csv::Position::line);
    let line = usize::try_from(line).unwrap_or(0);
    let shown = shown(path);
    InputError::new(format!("{shown}:{line}: {cell:?} is not {wanted}\nhint: a whole number, or a word such as nobody or two"))
        .of(path)
        .at(Some(line))
}
