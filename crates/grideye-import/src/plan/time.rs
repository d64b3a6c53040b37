//! Which columns are the time, and how to read them.

use super::facts::Stamps;
use super::guess::Guess;
use super::names;
use crate::cell::Cell;
use crate::columns::{Columns, Place, Role};
use crate::error::ImportError;
use crate::moment::{
    Decimal, Moment, NS_PER_DAY, NS_PER_S, Order, has_two_parts, is_past_the_hour, parse,
    zone_letters,
};

/// The columns of the time, and how to read them.
#[derive(Debug)]
pub(crate) struct Time {
    /// One, or those of the day and of the time of day.
    pub(crate) columns: Vec<usize>,
    pub(crate) order: Order,
    /// For numbers.
    pub(crate) scale: Option<Scale>,
    /// Of stamps without a zone, nanoseconds east of UTC.
    pub(crate) zone_ns: i64,
    /// Where several frames have the same stamp: the time from frame to frame, and from stamp to stamp.
    pub(crate) spread: Option<(u64, u64)>,
    /// After how long a time without a day begins again: a day, or an hour where there are only minutes and seconds.
    pub(crate) turn_ns: i64,
}

/// How a number is a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Scale {
    /// The power of ten between its unit and nanoseconds, since 1970.
    Unix(i32),
    /// The same since some start.
    Since(i32),
    /// Days since 1899-12-30, as spreadsheets count.
    Days,
    /// Tenths of a microsecond since the year 1, as .NET counts.
    Ticks,
}

/// 2001-09-09 and 2100-01-01 in seconds since 1970.
const UNIX_S: core::ops::Range<i64> = 1_000_000_000..4_102_444_800;
/// 2000-01-01 and 2100-01-01 in days since 1899-12-30.
const DAYS: core::ops::Range<i64> = 36_526..73_051;
/// Days from 1899-12-30 to 1970.
const DAYS_TO_1970: i64 = 25_569;
/// Ticks of .NET from the year 1 to 2001, to 2100, and to 1970.
const TICKS: core::ops::Range<i64> = 631_139_040_000_000_000..662_380_416_000_000_000;
const TICKS_TO_1970: i64 = 621_355_968_000_000_000;

impl Time {
    /// What the cells of a row say.
    pub(crate) fn moment(&self, cells: &[Cell]) -> Option<Moment> {
        let texts = self.columns.iter();
        let texts = texts.map(|column| Some(cells.get(*column)?.text()));
        let texts: Vec<_> = texts.collect::<Option<_>>()?;
        parse(&texts.join(" "), Some(self.order))
    }
}

impl Scale {
    /// The moment of a number in nanoseconds.
    pub(crate) fn ns(self, number: Decimal) -> Option<i64> {
        match self {
            Self::Unix(unit) | Self::Since(unit) => number.scaled(unit),
            Self::Ticks => number
                .scaled(0)?
                .checked_sub(TICKS_TO_1970)?
                .checked_mul(100),
            Self::Days => {
                // 14 digits of a day are nanoseconds.
                let days =
                    i128::from(number.scaled(14)?) - i128::from(DAYS_TO_1970) * 100_000_000_000_000;
                i64::try_from(days * i128::from(NS_PER_DAY) / 100_000_000_000_000).ok()
            }
        }
    }

    /// Whether times since some start become those since 1970.
    pub(super) fn is_set_between(self, times: &[i64]) -> bool {
        let jumps = times
            .windows(2)
            .any(|pair| pair[1] - pair[0] > UNIX_S.start / 2 * NS_PER_S);
        !self.is_utc() && jumps
    }

    pub(crate) const fn is_utc(self) -> bool {
        !matches!(self, Self::Since(_))
    }

    /// Of a column of numbers: what its name says, then what its size does.
    pub(super) fn of(name: &str, numbers: &[Decimal]) -> Option<Self> {
        let first = numbers.first()?.scaled(0)?;
        let named = names::unit(name);
        let per_second = |unit: i32| {
            10_i64
                .checked_pow(u32::try_from(9 - unit).unwrap_or(0))
                .unwrap_or(i64::MAX)
        };
        for unit in [9, 6, 3, 0] {
            if named.is_none_or(|named| named == unit)
                && UNIX_S.contains(&(first / per_second(unit)))
            {
                return Some(Self::Unix(unit));
            }
        }
        if TICKS.contains(&first) {
            return Some(Self::Ticks);
        }
        if let Some(unit) = named {
            return Some(Self::Since(unit));
        }
        // Nanoseconds, which no other scale has as fine.
        let steps = || {
            numbers
                .windows(2)
                .filter_map(|pair| Some(pair[1].scaled(9)? - pair[0].scaled(9)?))
        };
        let is_slow = steps().all(|step| (0..NS_PER_S / 500).contains(&step));
        if DAYS.contains(&first)
            && numbers.len() > 1
            && is_slow
            && !numbers.iter().all(|number| number.is_integer())
        {
            return Some(Self::Days);
        }
        if !numbers.iter().all(|number| number.is_integer()) {
            return Some(Self::Since(9));
        }
        let mut steps: Vec<i64> = steps().map(|step| step / NS_PER_S).collect();
        steps.sort_unstable();
        // Frames come every tenth of a second to every ten.
        Some(Self::Since(match steps.get(steps.len() / 2) {
            Some(20_000_000..) => 0,
            Some(20_000..) => 3,
            Some(20..) => 6,
            _ => 9,
        }))
    }
}

/// What the stamps of the first rows ask about, if they do.
pub(super) fn ask(stamps: &[String], has_zone: bool) -> Result<(), ImportError> {
    let letters = stamps.iter().find_map(|text| zone_letters(text));
    if let Some(zone) = letters.filter(|_| !has_zone) {
        return Err(ImportError::refused(
            format!("the times are in {zone}, and letters do not say how far that is from UTC"),
            "say it: --columns zone=+01:00, or --columns time=none takes the frames' rate",
        ));
    }
    let is_two = |text: &&String| has_two_parts(text);
    if let Some(text) = stamps
        .first()
        .filter(|_| !stamps.is_empty() && stamps.iter().all(|text| is_two(&text)))
    {
        return Err(ImportError::refused(
            format!(
                "whether times like {text} are hours and minutes or minutes and seconds is not clear"
            ),
            "take the frames' rate: --columns time=none --rate 10",
        ));
    }
    Ok(())
}

/// What times that repeat say: nothing, that several frames share a stamp, or that the stamps are all the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Repeats {
    None,
    /// The time from frame to frame, and from stamp to stamp.
    Spread(u64, u64),
    All,
}

impl Repeats {
    pub(super) fn of(times: &[i64]) -> Self {
        let mut runs: Vec<(i64, u64)> = Vec::new();
        for time in times {
            match runs.last_mut() {
                Some((last, count)) if last == time => *count += 1,
                _ => runs.push((*time, 1)),
            }
        }
        let repeated = times.len() - runs.len();
        if times.len() < 3 || repeated * 3 < times.len() {
            return Self::None;
        }
        if runs.len() == 1 {
            return Self::All;
        }
        let mut steps: Vec<u64> = runs
            .windows(2)
            .filter_map(|pair| u64::try_from(pair[1].0 - pair[0].0).ok())
            .collect();
        steps.sort_unstable();
        let Some(step) = steps.get(steps.len() / 2).copied().filter(|step| *step > 0) else {
            return Self::None;
        };
        // The first and the last may be cut.
        let inner = if runs.len() > 2 {
            &runs[1..runs.len() - 1]
        } else {
            &runs[..]
        };
        let mut counts: Vec<u64> = inner.iter().map(|(_, count)| *count).collect();
        counts.sort_unstable();
        let count = if runs.len() > 2 {
            counts[counts.len() / 2]
        } else {
            counts[counts.len() - 1]
        };
        Self::Spread(step / count.max(1), step)
    }
}

/// The times of some rows, in nanoseconds, where they can be read.
pub(super) fn times<'r>(rows: impl Iterator<Item = &'r Vec<Cell>>, time: &Time) -> Vec<i64> {
    let ns = |row: &Vec<Cell>| match (time.moment(row)?, time.scale) {
        (Moment::Number(number), Some(scale)) => scale.ns(number),
        (Moment::Utc(ns) | Moment::Local(ns) | Moment::Clock(ns), None) => Some(ns),
        (Moment::Day(day), None) => day.checked_mul(NS_PER_DAY),
        _ => None,
    };
    rows.filter_map(ns).collect()
}

impl Guess {
    /// The time of the columns that may have it: a stamp with its day before all, then a day beside a time of day, then
    /// numbers since 1970, then others. The rest become labels.
    pub(super) fn time(&mut self, said: &Columns) -> Result<Option<Time>, ImportError> {
        let is_time = |column: &usize| self.roles[*column] == Some(Role::Time);
        let all: Vec<usize> = (0..self.roles.len()).filter(is_time).collect();
        // Of several the one that is in UTC.
        let is_utc = |column: &usize| self.names[*column].to_lowercase().contains("utc");
        let utc_first = || {
            all.iter()
                .filter(|column| is_utc(column))
                .chain(&all)
                .copied()
        };
        let of =
            |stamps: Stamps| utc_first().find(|column| self.facts[*column].stamps == Some(stamps));
        let scales = all
            .iter()
            .filter_map(|column| Some((*column, self.scale(*column)?)));
        let scales: Vec<(usize, Scale)> = scales.collect();
        let absolute = scales.iter().find(|(_, scale)| scale.is_utc());
        let (columns, scale) = match (of(Stamps::Whole), of(Stamps::Day), of(Stamps::Clock)) {
            (Some(whole), ..) => (vec![whole], None),
            (None, Some(day), Some(clock)) => (vec![day, clock], None),
            (None, _, Some(clock)) if absolute.is_none() => (vec![clock], None),
            _ => match absolute.or(scales.first()) {
                Some((column, scale)) => (vec![*column], Some(*scale)),
                None => (Vec::new(), None),
            },
        };
        for column in all {
            if !columns.contains(&column) {
                self.roles[column] = Some(Role::Label);
            }
        }
        if columns.is_empty() {
            return self.no_time(said);
        }
        let order = self.order.map_err(|()| {
            ImportError::refused(
                "whether the day or the month comes first in the dates is not clear",
                "write them as 2021-07-01, or take the frames' rate: --columns time=none",
            )
        });
        let mut time = Time {
            columns,
            order: order?,
            scale,
            zone_ns: said.zone_ns.unwrap_or(0),
            spread: None,
            turn_ns: NS_PER_DAY,
        };
        self.ask_about(&mut time, said.zone_ns.is_some())?;
        self.spread(time, scales.len() > 1)
    }

    /// What must be asked of a time before it is read.
    fn ask_about(&self, time: &mut Time, has_zone: bool) -> Result<(), ImportError> {
        let last = time.columns[time.columns.len() - 1];
        if time.scale.is_none() {
            let texts: Vec<String> = self
                .rows
                .iter()
                .map(|row| row[last].text().into_owned())
                .collect();
            ask(&texts, has_zone)?;
            if texts.iter().all(|text| is_past_the_hour(text)) {
                time.turn_ns = NS_PER_DAY / 24;
            }
        } else if self.has_names
            && time.scale == Some(Scale::Since(9))
            && names::is_coarse(&self.names[last])
        {
            return Err(ImportError::refused(
                format!(
                    "the times of {} are not in seconds or a part of them",
                    self.names[last]
                ),
                "write them in seconds, or take the frames' rate: --columns time=none --rate 10",
            ));
        }
        Ok(())
    }

    /// The time, if its values go on: those that repeat are spread.
    fn spread(&mut self, mut time: Time, has_others: bool) -> Result<Option<Time>, ImportError> {
        let times = times(self.first_stream(), &time);
        if time.scale.is_some_and(|scale| scale.is_set_between(&times)) {
            return Err(ImportError::refused(
                "the clock was set during the recording: the times begin near 0 and go on since 1970",
                "cut the file there, or take the frames' rate: --columns time=none --rate 10",
            ));
        }
        if times.len() > 2 && times.windows(2).all(|pair| pair[1] < pair[0]) {
            return Err(ImportError::refused(
                "the times go backwards: the last frame comes first",
                "turn the file around (tac), or take its order and the frames' rate: --columns time=none --rate 10",
            ));
        }
        match Repeats::of(&times) {
            Repeats::None => {}
            Repeats::Spread(..) if has_others && time.scale.is_some_and(Scale::is_utc) => {
                return Err(ImportError::refused(
                    "the time is in two columns, of which one has the parts of a second",
                    "write it into one, or take the frames' rate: --columns time=none --rate 10",
                ));
            }
            Repeats::Spread(period_ns, step_ns) => {
                self.notes.push(format!(
                    "several frames have the same time: they are placed every {} ms",
                    period_ns / 1_000_000
                ));
                time.spread = Some((period_ns, step_ns));
            }
            Repeats::All => {
                self.notes
                    .push("all times are the same: the frames' rate is taken".to_owned());
                return Ok(None);
            }
        }
        Ok(Some(time))
    }

    /// A column that is said to be the time, or is called so, must hold some.
    pub(super) fn no_time(&self, said: &Columns) -> Result<Option<Time>, ImportError> {
        let is_said = said
            .said
            .iter()
            .any(|(role, place)| *role == Role::Time && *place != Place::Nowhere);
        let is_called = |column: &usize| {
            let name = &self.names[*column];
            let facts = &self.facts[*column];
            self.has_names
                && self.roles[*column].is_none()
                && names::role(name) == Some(Role::Time)
                && !facts.is_nothing
                && !facts.is_number
        };
        let called = (0..self.roles.len())
            .find(is_called)
            .filter(|_| !self.never.contains(&Role::Time));
        let example = called.and_then(|column| {
            self.rows
                .iter()
                .map(|row| row[column].text())
                .find(|text| !text.is_empty())
        });
        match (is_said, example) {
            (false, None) => Ok(None),
            (_, example) => Err(ImportError::refused(
                match example {
                    Some(text) => {
                        format!("the column of the time holds no times that are read, but {text:?}")
                    }
                    None => "the column of the time holds no times".to_owned(),
                },
                "a time is Unix time, ISO 8601 or a time of day; --columns time=none takes the frames' rate",
            )),
        }
    }

    /// How a column of numbers is a time.
    pub(super) fn scale(&self, column: usize) -> Option<Scale> {
        let texts = self.first_stream().map(|row| row[column].text());
        let numbers: Vec<Decimal> = texts.filter_map(|text| Decimal::parse(&text)).collect();
        Scale::of(&self.names[column], &numbers)
    }
}
