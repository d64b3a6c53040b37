//! What the engines share of how a record becomes columns, and back.

use crate::store::error::{Result, StoreError};
use grideye_frame::{NoData, RawFrame, Reading, ThermistorWord};
use grideye_recording::record::layout::{WORDS_BYTES, words_of, words_to_bytes};
use grideye_recording::{COUNT_MAX, ClockState, Record, Stamp};

#[derive(Debug, Clone, Copy)]
pub(super) struct Columns {
    pub(super) seq: i64,
    pub(super) t_boot_ns: i64,
    pub(super) t_utc_ns: i64,
    pub(super) clock: i16,
    pub(super) missing: Option<&'static str>,
    pub(super) thermistor: Option<u16>,
    pub(super) pixels: Option<[u8; WORDS_BYTES]>,
}

impl Columns {
    pub(super) fn of(record: &Record) -> Result<Self> {
        let (missing, thermistor, pixels) = match &record.reading {
            Reading::Frame(raw) => (
                None,
                Some(raw.thermistor.0),
                Some(words_to_bytes(&raw.pixels)),
            ),
            Reading::NoData(reason) => (Some(reason.name()), None, None),
        };
        Ok(Self {
            seq: fitting("seq", record.seq)?,
            t_boot_ns: fitting("t_boot_ns", record.stamp.t_boot_ns)?,
            t_utc_ns: record.stamp.t_utc_ns,
            clock: record.stamp.clock.code().into(),
            missing,
            thermistor,
            pixels,
        })
    }
}

/// A record from its columns, each as the engine keeps it.
pub(super) struct Stored<'a> {
    pub(super) seq: i64,
    pub(super) t_boot_ns: i64,
    pub(super) t_utc_ns: i64,
    pub(super) clock: i64,
    pub(super) missing: Option<&'a str>,
    pub(super) thermistor: Option<u16>,
    pub(super) pixels: Option<&'a [u8]>,
}

impl Stored<'_> {
    pub(super) fn record(&self) -> Result<Record> {
        let reading = match (self.missing, self.thermistor, self.pixels) {
            (Some(name), _, _) => Reading::NoData(
                name.parse::<NoData>()
                    .map_err(|unknown| damaged(&format!("{name:?}: {unknown}")))?,
            ),
            (None, Some(thermistor), Some(pixels)) => Reading::Frame(RawFrame {
                thermistor: ThermistorWord(thermistor),
                pixels: pixels
                    .try_into()
                    .map(words_of)
                    .map_err(|_length| damaged(&format!("a frame of {} bytes", pixels.len())))?,
            }),
            _ => return Err(damaged("a frame without its words")),
        };
        Ok(Record {
            seq: unsigned("seq", self.seq)?,
            stamp: Stamp {
                t_boot_ns: unsigned("t_boot_ns", self.t_boot_ns)?,
                t_utc_ns: self.t_utc_ns,
                clock: u8::try_from(self.clock)
                    .ok()
                    .and_then(ClockState::from_code)
                    .ok_or_else(|| damaged(&format!("clock state {}", self.clock)))?,
            },
            reading,
        })
    }
}

/// The wire's limit is the database's as well; this holds for those who come in another way.
pub(super) fn fitting(field: &'static str, value: u64) -> Result<i64> {
    i64::try_from(value).map_err(|_too_large| StoreError::NumberTooLarge {
        field,
        value,
        max: COUNT_MAX,
    })
}

/// A column that is never negative.
pub(super) fn unsigned(column: &str, value: i64) -> Result<u64> {
    u64::try_from(value).map_err(|_negative| damaged(&format!("{value} as {column}")))
}

pub(super) fn count(number: usize) -> i64 {
    i64::try_from(number).unwrap_or(i64::MAX)
}

pub(super) fn damaged(what: &str) -> StoreError {
    StoreError::Failed(format!("the store holds {what}"))
}
