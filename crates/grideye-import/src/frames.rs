//! Rows of cells become records, by the plan of their columns.

use crate::account::Tally;
use crate::cell::{Cell, RawRow};
use crate::columns::Unit;
use crate::moment::{Decimal, Moment, NS_PER_DAY, parse};
use crate::plan::{Plan, Scale};
use grideye_frame::word;
use grideye_frame::{
    Celsius, NAME_CHARS_MAX, NoData, PIXELS, PixelWord, Reading, RecordedFrame, ThermistorWord,
};
use grideye_recording::{COUNT_MAX, ClockState, Record, Row, Stamp, StreamId, check_name};
use std::collections::BTreeMap;

/// Printed values this close to a step are one.
const PRINTED_CELSIUS: f64 = 1e-5;
/// A chip is never as hot, in °C.
const PRINTED_MAX_C: f64 = 128.0;
/// Twelve bits of two's complement, and more of a driver that does not cut them.
/// The bit of a raw word that is its sign.
const SIGN: i32 = 1 << 11;
const COUNTS: core::ops::RangeInclusive<f64> = -2048.0..=4095.0;
/// Negative words of a driver that keeps sixteen bits.
const SIXTEEN_BITS: core::ops::RangeInclusive<f64> = 63_488.0..=65_535.0;

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
    last_number: Option<i64>,
    last: Option<When>,
    t_boot_ns: u64,
    /// Midnights passed, for times of day; for counters, what they lost by wrapping.
    passed_ns: i64,
    /// The last number of a counter.
    counter: Option<i64>,
    /// The stamp of the last row, and how many rows had it, where several frames share one.
    shared: Option<(i64, i64)>,
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
        let mut cells = raw.flat();
        if raw.is_torn {
            // What stands before a frame is there.
            cells.resize(self.plan.width, Cell::Empty);
        }
        let is_whole = cells.len() == self.plan.width;
        let cells = if is_whole { cells } else { Vec::new() };
        let pixels = || {
            self.plan
                .pixels
                .iter()
                .filter_map(|column| cells.get(*column))
        };
        let is_empty = is_whole && !raw.is_torn && pixels().all(Cell::is_empty);
        let frame = if is_empty { None } else { self.frame(&cells) };
        let stream = self.stream(&cells);
        let number = self
            .plan
            .number
            .and_then(|column| integer(cells.get(column)?));
        let mut state = self.streams.get(&stream).copied().unwrap_or_default();
        let when = self.when(&cells, &mut state);
        let seq = state.seq(number);
        let turn_ns = self
            .plan
            .time
            .as_ref()
            .map_or(NS_PER_DAY, |time| time.turn_ns);
        let stamp = state.stamp(when, self.assumed.period_ns, turn_ns);
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
            let unit = self.plan.unit;
            if unit.is_words() {
                *word = counted(value, unit)?;
                continue;
            }
            let value_c = unit.celsius(value);
            *word = word::pixel_word(celsius(value_c)).ok()?;
            let away_c = (f64::from(word::pixel_celsius(*word).get()) - value_c).abs();
            if away_c > PRINTED_CELSIUS {
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
        let unit = self.plan.unit;
        // No chip has 130 °C, and raw words of 8 °C are above it.
        if unit.is_words() && value.abs() > 127.9375 {
            return counted(value, Unit::Words).map(|PixelWord(word)| ThermistorWord(word));
        }
        // Beside pixels of another unit it may be in °C all the same.
        let value_c = if value > PRINTED_MAX_C || unit == Unit::Fahrenheit {
            unit.celsius(value)
        } else {
            value
        };
        word::thermistor_word(celsius(value_c)).ok()
    }

    fn stream(&self, cells: &[Cell]) -> StreamId {
        let named = |column: Option<usize>, assumed: &str| {
            let text = column.and_then(|column| cells.get(column)).map(Cell::text);
            text.map_or(assumed.to_owned(), |text| name_of(&text, assumed))
        };
        StreamId {
            device: named(self.plan.device, &self.assumed.stream.device),
            sensor: named(self.plan.sensor, &self.assumed.stream.sensor),
            boot: named(self.plan.boot, &self.assumed.stream.boot),
        }
    }

    fn when(&self, cells: &[Cell], state: &mut State) -> Option<When> {
        let time = self.plan.time.as_ref()?;
        let moment = time.moment(cells)?;
        let midnight_ns = self.assumed.midnight_ns;
        let (ns, is_utc, is_clock) = match (moment, time.scale) {
            (Moment::Number(number), Some(scale)) => {
                let passed_by_wrapping_ns = match scale {
                    Scale::Since(_) if number.is_integer() => {
                        state.passed_by_wrapping_ns(number.scaled(0)?, scale.ns(Decimal::ONE)?)
                    }
                    _ => 0,
                };
                (
                    scale.ns(number)?.checked_add(passed_by_wrapping_ns)?,
                    scale.is_utc(),
                    false,
                )
            }
            (Moment::Utc(ns), None) => (ns, true, false),
            (Moment::Local(ns), None) => (ns.checked_sub(time.zone_ns)?, true, false),
            (Moment::Day(day), None) => (day.checked_mul(NS_PER_DAY)?, true, false),
            (Moment::Clock(ns), None) => {
                let ns = ns.checked_sub(if midnight_ns.is_some() {
                    time.zone_ns
                } else {
                    0
                })?;
                (
                    midnight_ns.unwrap_or(0).checked_add(ns)?,
                    midnight_ns.is_some(),
                    true,
                )
            }
            _ => return None,
        };
        let ns = match time.spread {
            Some((period_ns, step_ns)) => ns.checked_add(state.within(ns, period_ns, step_ns)?)?,
            None => ns,
        };
        Some(When {
            ns,
            is_utc,
            is_clock,
        })
    }
}

impl State {
    /// What a counter of 16 or 32 bits lost by wrapping, in nanoseconds.
    fn passed_by_wrapping_ns(&mut self, count: i64, unit_ns: i64) -> i64 {
        if let Some(last) = self.counter.replace(count) {
            self.passed_ns = self
                .passed_ns
                .saturating_add(wrapped(last, count).unwrap_or(0).saturating_mul(unit_ns));
        }
        self.passed_ns
    }

    /// How far behind its stamp a frame is that shares it.
    fn within(&mut self, stamp_ns: i64, period_ns: u64, step_ns: u64) -> Option<i64> {
        let index = match self.shared {
            Some((last, count)) if last == stamp_ns => count + 1,
            _ => 0,
        };
        self.shared = Some((stamp_ns, index));
        let within = i64::try_from(period_ns).ok()?.checked_mul(index)?;
        // More frames than expected stay before the next stamp.
        Some(within.min(i64::try_from(step_ns).ok()? - 1))
    }

    /// The file's own number if it goes on from the one before, else the next.
    fn seq(&mut self, number: Option<i64>) -> u64 {
        let since = number.and_then(|number| {
            if let Some(more) = self
                .last_number
                .replace(number)
                .and_then(|last| wrapped(last, number))
            {
                self.first_number = self.first_number.map(|first| first - more);
            }
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

    fn stamp(&mut self, when: Option<When>, period_ns: u64, turn_ns: i64) -> Stamp {
        let mut clock = ClockState::Unsynced;
        let mut passed_ns = if self.begun { period_ns } else { 0 };
        let mut when = when;
        if let (Some(when), Some(last)) = (&mut when, self.last) {
            when.ns = when
                .ns
                .saturating_add(if when.is_clock { self.passed_ns } else { 0 });
            // Past midnight a time of day begins again.
            if when.is_clock && last.ns.saturating_sub(when.ns) > turn_ns / 2 {
                self.passed_ns += turn_ns;
                when.ns = when.ns.saturating_add(turn_ns);
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

/// The characters of a text that a name may have, or another name if there are none.
pub(crate) fn name_of(text: &str, otherwise: &str) -> String {
    let is_letter = |character: &char| character.is_ascii_alphanumeric();
    let characters = text.chars();
    let name: String = characters
        .filter(|character| is_letter(character) || "._:-".contains(*character))
        .skip_while(|character| !is_letter(character))
        .take(NAME_CHARS_MAX)
        .collect();
    match check_name(&name) {
        Ok(()) => name,
        Err(_) => otherwise.to_owned(),
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
fn counted(value: f64, unit: Unit) -> Option<PixelWord> {
    if value.fract() != 0.0 || !COUNTS.contains(&value) && !SIXTEEN_BITS.contains(&value) {
        return None;
    }
    let count = match value as i32 {
        count if unit == Unit::SignMagnitude && count >= SIGN => SIGN - count,
        count => count,
    };
    u16::try_from(count.rem_euclid(2 * SIGN))
        .ok()
        .map(PixelWord)
}

/// What a counter of 16 or 32 bits lost that was near its end and is near its beginning.
fn wrapped(last: i64, count: i64) -> Option<i64> {
    let near_end = |size: &i64| (size / 8 * 7..*size).contains(&last);
    let sizes = [1_i64 << 16, 1 << 32];
    let unsigned = sizes
        .into_iter()
        .find(|size| near_end(size) && (0..size / 8).contains(&count));
    // The greatest of 32 bits with a sign is followed by the least.
    let signed = sizes
        .into_iter()
        .find(|size| near_end(&(size / 2)) && (-size / 2..-size / 8 * 3).contains(&count));
    unsigned.or(signed)
}
