//! What the engines share of how a record becomes columns, and back.

use crate::store::error::StoreError;
use grideye_frame::{NoData, PIXELS, PixelWord, RawFrame, Reading, ThermistorWord};
use grideye_recording::{COUNT_MAX, ClockState, Record, Stamp};

/// The bytes of a frame's pixels: 64 words of 16 bits, little-endian.
pub(super) const PIXELS_BYTES: usize = 2 * PIXELS;

/// A record as columns.
#[derive(Debug, Clone, Copy)]
pub(super) struct Columns {
    pub(super) seq: i64,
    pub(super) t_boot_ns: i64,
    pub(super) t_utc_ns: i64,
    pub(super) clock: i16,
    pub(super) missing: Option<&'static str>,
    pub(super) thermistor: Option<u16>,
    pub(super) pixels: Option<[u8; PIXELS_BYTES]>,
}

impl Columns {
    pub(super) fn of(record: &Record) -> Result<Self, StoreError> {
        let (missing, thermistor, pixels) = match &record.reading {
            Reading::Frame(raw) => (None, Some(raw.thermistor.0), Some(words_to_bytes(raw))),
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
    pub(super) fn record(&self) -> Result<Record, StoreError> {
        let reading = match (self.missing, self.thermistor, self.pixels) {
            (Some(name), _, _) => Reading::NoData(
                name.parse::<NoData>()
                    .map_err(|unknown| damaged(&format!("{name:?}: {unknown}")))?,
            ),
            (None, Some(thermistor), Some(pixels)) => Reading::Frame(RawFrame {
                thermistor: ThermistorWord(thermistor),
                pixels: bytes_to_words(pixels)?,
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

/// Little-endian, as the bus delivered them.
fn words_to_bytes(raw: &RawFrame) -> [u8; PIXELS_BYTES] {
    let mut bytes = [0; PIXELS_BYTES];
    for (pair, PixelWord(word)) in bytes.chunks_exact_mut(2).zip(&raw.pixels) {
        pair.copy_from_slice(&word.to_le_bytes());
    }
    bytes
}

fn bytes_to_words(bytes: &[u8]) -> Result<[PixelWord; PIXELS], StoreError> {
    let mut words = [PixelWord::default(); PIXELS];
    if bytes.len() != PIXELS_BYTES {
        return Err(damaged(&format!("a frame of {} bytes", bytes.len())));
    }
    for (word, pair) in words.iter_mut().zip(bytes.chunks_exact(2)) {
        *word = PixelWord(u16::from_le_bytes([pair[0], pair[1]]));
    }
    Ok(words)
}

/// The wire's limit is the database's as well; this holds for those who come in another way.
pub(super) fn fitting(field: &'static str, value: u64) -> Result<i64, StoreError> {
    i64::try_from(value).map_err(|_too_large| StoreError::NumberTooLarge {
        field,
        value,
        max: COUNT_MAX,
    })
}

/// A column that is never negative.
pub(super) fn unsigned(column: &str, value: i64) -> Result<u64, StoreError> {
    u64::try_from(value).map_err(|_negative| damaged(&format!("{value} as {column}")))
}

/// A number of things in memory as a column.
pub(super) fn count(number: usize) -> i64 {
    i64::try_from(number).unwrap_or(i64::MAX)
}

pub(super) fn damaged(what: &str) -> StoreError {
    StoreError::Failed(format!("the store holds {what}"))
}
