//! Encodes the types as JSON.

use crate::record::Record;
use crate::wire::error::WireError;
use grideye_frame::{PixelWord, Reading};
use serde::{Serialize, Serializer};

pub(super) fn acknowledgement<'a>(
    durable_through: impl Iterator<Item = (&'a str, u64)> + Clone,
    gaps: impl Iterator<Item: Serialize> + Clone,
) -> Result<Vec<u8>, WireError> {
    json(&Answer {
        durable_through: Map(durable_through),
        gaps: Sequence(gaps),
    })
}

pub(super) fn json(body: &impl Serialize) -> Result<Vec<u8>, WireError> {
    serde_json::to_vec(body).map_err(|error| WireError::NotJson {
        path: "body".to_owned(),
        line: error.line(),
        column: error.column(),
        found: error.to_string(),
    })
}

#[derive(Serialize)]
struct Answer<D: Serialize, G: Serialize> {
    durable_through: D,
    gaps: G,
}

struct Map<I>(I);

impl<'a, I: Iterator<Item = (&'a str, u64)> + Clone> Serialize for Map<I> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.clone())
    }
}

struct Sequence<I>(I);

impl<I: Iterator<Item: Serialize> + Clone> Serialize for Sequence<I> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.clone())
    }
}

#[derive(Serialize)]
struct Frame<'a> {
    seq: u64,
    t_boot_ns: u64,
    t_utc_ns: i64,
    clock: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    missing: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    thermistor_raw: Option<u16>,
    #[serde(skip_serializing_if = "Option::is_none", serialize_with = "words")]
    pixels_raw: Option<&'a [PixelWord]>,
}

impl<'a> From<&'a Record> for Frame<'a> {
    fn from(record: &'a Record) -> Self {
        let frame = record.reading.frame();
        Self {
            seq: record.seq,
            t_boot_ns: record.stamp.t_boot_ns,
            t_utc_ns: record.stamp.t_utc_ns,
            clock: record.stamp.clock.name(),
            missing: match record.reading {
                Reading::Frame(_) => None,
                Reading::NoData(reason) => Some(reason.name()),
            },
            thermistor_raw: frame.and_then(|frame| frame.thermistor).map(|word| word.0),
            pixels_raw: frame.map(|frame| frame.pixels.as_slice()),
        }
    }
}

pub(super) fn frames<S: Serializer>(records: &[Record], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(records.iter().map(Frame::from))
}

fn words<S: Serializer>(words: &Option<&[PixelWord]>, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(words.unwrap_or_default().iter().map(|word| word.0))
}
