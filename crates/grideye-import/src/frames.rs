//! Rows of cells become records, by the plan of their columns.

use crate::account::Tally;
use crate::cell::{Cell, RawRow};
use crate::columns::Unit;
use crate::moment::{Moment, NS_PER_DAY, parse};
use crate::plan::Plan;
use amg8833::word;
use grideye_frame::{Celsius, NoData, PIXELS, PixelWord, Reading, RecordedFrame, ThermistorWord};
use grideye_recording::{COUNT_MAX, ClockState, Record, Row, Stamp, StreamId, check_name};
use std::collections::BTreeMap;

/// Printed values this close to a step are one.
const PRINTED_CELSIUS: f64 = 1e-5;
/// Twelve bits of two's complement, and more of a driver that does not cut them.
const COUNTS: core::ops::RangeInclusive<f64> = -2048.0..=4095.0;

/// What is assumed of a file that does not say it.
#[derive(Debug, Clone)]
pub(crate) struct Assumed {
    pub(crate) stream: StreamId,
    pub(crate) period_ns: u64,
    /// The day of times without one, in nanoseconds since 1970.
    pub(crate) midnight_ns: Option<i64>,
}

pub(crate) struct Frames {
    plan: Plan,
    assumed: Assumed,
    streams: BTreeMap<StreamId, State>,
    pub(crate) tally: Tally,
}

/// The last record of a stream.
#[derive(Debug, Clone, Copy, Default)]
struct State {
    begun: bool,
    next_seq: u64,
    /// The number in the file that is `seq` 0.
    first_number: Option<i64>,
    last: Option<When>,
    t_boot_ns: u64,
    /// Midnights passed, for times of day.
    days_ns: i64,
}

/// A time of a row, on a scale of its own or since 1970.
#[derive(Debug, Clone, Copy)]
struct When {
    ns: i64,
    is_utc: bool,
    is_clock: bool,
}

impl Frames {
    pub(crate) fn new(plan: Plan, assumed: Assumed) -> Self {
        Self {
            plan,
            assumed,
            streams: BTreeMap::new(),
            tally: Tally::default(),
        }
    }

    /// The row's record; `None` if it has no pixels at all.
    pub(crate) fn row(&mut self, raw: &RawRow) -> Option<Row> {
        let cells = raw.flat();
        let is_whole = cells.len() == self.plan.width;
        let cells = if is_whole { cells } else { Vec::new() };
        let pixels = || {
            self.plan
                .pixels
                .iter()
                .filter_map(|column| cells.get(*column))
        };
        let is_empty = is_whole && pixels().all(Cell::is_empty);
        let frame = if is_empty { None } else { self.frame(&cells) };
        let stream = self.stream(&cells);
        let when = self.when(&cells);
        let number = self
            .plan
            .number
            .and_then(|column| integer(cells.get(column)?));
        let mut state = self.streams.get(&stream).copied().unwrap_or_default();
        let seq = state.seq(number);
        let stamp = state.stamp(when, self.assumed.period_ns);
        self.streams.insert(stream.clone(), state);
        if is_empty {
            self.tally.empty += 1;
            return None;
        }
        self.tally.untimed +=
            u64::from(self.plan.time.is_some() && when.is_none() && frame.is_some());
        let reading = match frame {
            Some(frame) => {
                self.tally.frames += 1;
                Reading::Frame(frame)
            }
            None => {
                self.tally.damaged += 1;
                self.tally.first_damaged.get_or_insert(raw.number);
                Reading::NoData(NoData::ShortTransfer)
            }
        };
        let text = |column: &usize| cells.get(*column).map(|cell| cell.text().into_owned());
        let labels = self
            .plan
            .labels
            .iter()
            .map(|column| text(column).unwrap_or_default());
        Some(Row {
            stream,
            record: Record {
                seq,
                stamp,
                reading,
            },
            t_arrival_ns: None,
            labels: labels.collect(),
        })
    }

    fn frame(&mut self, cells: &[Cell]) -> Option<RecordedFrame> {
        let mut pixels = [PixelWord(0); PIXELS];
        let (mut between, mut farthest_c) = (0, self.tally.farthest_c);
        for (word, column) in pixels.iter_mut().zip(&self.plan.pixels) {
            let value = cells.get(*column)?.number()?;
            *word = match self.plan.unit {
                Unit::Counts => counted(value)?,
                Unit::Degrees => word::pixel_word(celsius(value)).ok()?,
            };
            let away_c = (f64::from(word::pixel_celsius(*word).get()) - value).abs();
            if self.plan.unit == Unit::Degrees && away_c > PRINTED_CELSIUS {
                between += 1;
                farthest_c = away_c.max(farthest_c);
            }
        }
        self.tally.between += between;
        self.tally.farthest_c = farthest_c;
        let thermistor = self
            .plan
            .thermistor
            .and_then(|column| cells.get(column)?.number());
        Some(RecordedFrame {
            thermistor: thermistor.and_then(|value| self.thermistor(value)),
            pixels,
        })
    }

    fn thermistor(&self, value: f64) -> Option<ThermistorWord> {
        // No chip has 130 °C, and raw words of 8 °C are above it.
        if self.plan.unit == Unit::Counts && value.abs() > 127.9375 {
            return counted(value).map(|PixelWord(word)| ThermistorWord(word));
        }
        word::thermistor_word(celsius(value)).ok()
    }

    fn stream(&self, cells: &[Cell]) -> StreamId {
        let named = |column: Option<usize>, assumed: &str| {
            let text = column.and_then(|column| cells.get(column)).map(Cell::text);
            let allowed =
                |character: &char| character.is_ascii_alphanumeric() || "._:-".contains(*character);
            let name: String = text
                .iter()
                .flat_map(|text| text.chars())
                .filter(allowed)
                .collect();
            if check_name(&name).is_ok() {
                name
            } else {
                assumed.to_owned()
            }
        };
        StreamId {
            device: named(self.plan.device, &self.assumed.stream.device),
            sensor: named(self.plan.sensor, &self.assumed.stream.sensor),
            boot: named(self.plan.boot, &self.assumed.stream.boot),
        }
    }

    fn when(&self, cells: &[Cell]) -> Option<When> {
        let time = self.plan.time.as_ref()?;
        let texts: Option<Vec<_>> = time
            .columns
            .iter()
            .map(|column| Some(cells.get(*column)?.text()))
            .collect();
        let midnight_ns = self.assumed.midnight_ns;
        let (ns, is_utc, is_clock) = match (parse(&texts?.join(" "), Some(time.order))?, time.unit)
        {
            (Moment::Number(number), Some((unit, is_utc))) => (number.scaled(unit)?, is_utc, false),
            (Moment::Utc(ns), None) => (ns, true, false),
            (Moment::Day(day), None) => (day.checked_mul(NS_PER_DAY)?, true, false),
            (Moment::Clock(ns), None) => {
                (midnight_ns.unwrap_or(0) + ns, midnight_ns.is_some(), true)
            }
            _ => return None,
        };
        Some(When {
            ns,
            is_utc,
            is_clock,
        })
    }
}

impl State {
    /// The file's own number if it goes on from the one before, else the next.
    fn seq(&mut self, number: Option<i64>) -> u64 {
        let since = number.and_then(|number| {
            let first = *self.first_number.get_or_insert(number);
            u64::try_from(number.checked_sub(first)?).ok()
        });
        let seq = since
            .filter(|since| *since >= self.next_seq)
            .unwrap_or(self.next_seq)
            .min(COUNT_MAX);
        self.next_seq = seq + 1;
        seq
    }

    fn stamp(&mut self, when: Option<When>, period_ns: u64) -> Stamp {
        let mut clock = ClockState::Unsynced;
        let mut passed_ns = if self.begun { period_ns } else { 0 };
        let mut when = when;
        if let (Some(when), Some(last)) = (&mut when, self.last) {
            when.ns = when.ns.saturating_add(self.days_ns);
            // Past midnight a time of day begins again.
            if when.is_clock && last.ns.saturating_sub(when.ns) > NS_PER_DAY / 2 {
                self.days_ns += NS_PER_DAY;
                when.ns = when.ns.saturating_add(NS_PER_DAY);
            }
            match u64::try_from(when.ns.saturating_sub(last.ns)) {
                Ok(passed) => passed_ns = passed,
                // It was set back; how much time passed is not known.
                Err(_) => clock = ClockState::Stepped,
            }
        }
        self.t_boot_ns = self.t_boot_ns.saturating_add(passed_ns).min(COUNT_MAX);
        let step_ns = i64::try_from(period_ns).unwrap_or(i64::MAX);
        let follow = self.last.map(|last| When {
            ns: last.ns.saturating_add(step_ns),
            ..last
        });
        self.last = when.or(follow);
        self.begun = true;
        let t_utc_ns = self
            .last
            .filter(|last| last.is_utc)
            .map_or(0, |last| last.ns);
        Stamp {
            t_boot_ns: self.t_boot_ns,
            t_utc_ns,
            clock,
        }
    }
}

fn integer(cell: &Cell) -> Option<i64> {
    match parse(&cell.text(), None)? {
        Moment::Number(number) => number.scaled(0),
        _ => None,
    }
}

#[expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    reason = "the word of a step is the same for the nearest single"
)]
fn celsius(value: f64) -> Celsius {
    Celsius::new(value as f32)
}

/// The word of a raw count, of either sign.
#[expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    reason = "an integer in the range"
)]
fn counted(value: f64) -> Option<PixelWord> {
    if value.fract() != 0.0 || !COUNTS.contains(&value) {
        return None;
    }
    let count = (value as i32).rem_euclid(4096);
    u16::try_from(count).ok().map(PixelWord)
}
