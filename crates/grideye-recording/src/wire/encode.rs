//! From the types to JSON.

use crate::record::Record;
use crate::wire::error::WireError;
use crate::wire::types::{Account, Batch, Gap, SensorBatch};
use grideye_frame::{PixelWord, Reading};
use serde::{Serialize, Serializer};

pub(super) fn batch(batch: &Batch) -> Result<Vec<u8>, WireError> {
    let mut body = Body {
        device: &batch.device,
        boot: &batch.boot,
        t_sent_boot_ns: batch.t_sent_boot_ns,
        sensors: Vec::with_capacity(batch.sensors.len()),
    };
    body.sensors.extend(batch.sensors.iter().map(Sensor::from));
    json(&body)
}

pub(super) fn acknowledgement<'a>(
    durable_through: impl Iterator<Item = (&'a str, u64)> + Clone,
    gaps: impl Iterator<Item = &'a Gap> + Clone,
) -> Result<Vec<u8>, WireError> {
    let gaps = gaps.map(|gap| AnswerGap {
        sensor: &gap.sensor,
        from: gap.from,
        to: gap.to,
    });
    json(&Answer {
        durable_through: Map(durable_through),
        gaps: Sequence(gaps),
    })
}

fn json(body: &impl Serialize) -> Result<Vec<u8>, WireError> {
    serde_json::to_vec(body).map_err(|error| WireError::NotJson {
        path: "body".to_owned(),
        line: error.line(),
        column: error.column(),
        found: error.to_string(),
    })
}

type Counts = std::collections::BTreeMap<String, u64>;

#[derive(Serialize)]
struct Body<'a> {
    device: &'a str,
    boot: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    t_sent_boot_ns: Option<u64>,
    sensors: Vec<Sensor<'a>>,
}

#[derive(Serialize)]
struct Sensor<'a> {
    sensor: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    account: Option<SensorAccount<'a>>,
    #[serde(serialize_with = "frames")]
    frames: &'a [Record],
}

#[derive(Serialize)]
struct SensorAccount<'a> {
    read: u64,
    missing: u64,
    dropped: &'a Counts,
    spooled: u64,
    errors: &'a Counts,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    ended: bool,
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

#[derive(Serialize)]
struct Answer<D: Serialize, G: Serialize> {
    durable_through: D,
    gaps: G,
}

/// What an iterator gives, as an object.
struct Map<I>(I);

impl<'a, I: Iterator<Item = (&'a str, u64)> + Clone> Serialize for Map<I> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.clone())
    }
}

/// What an iterator gives, as an array.
struct Sequence<I>(I);

impl<I: Iterator<Item: Serialize> + Clone> Serialize for Sequence<I> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.clone())
    }
}

#[derive(Serialize)]
struct AnswerGap<'a> {
    sensor: &'a str,
    from: u64,
    to: u64,
}

impl<'a> From<&'a SensorBatch> for Sensor<'a> {
    fn from(batch: &'a SensorBatch) -> Self {
        Self {
            sensor: &batch.sensor,
            account: batch.account.as_ref().map(SensorAccount::from),
            frames: &batch.frames,
        }
    }
}

impl<'a> From<&'a Account> for SensorAccount<'a> {
    fn from(account: &'a Account) -> Self {
        Self {
            read: account.read,
            missing: account.missing,
            dropped: &account.dropped,
            spooled: account.spooled,
            errors: &account.errors,
            ended: account.ended,
        }
    }
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
            thermistor_raw: frame.map(|frame| frame.thermistor.0),
            pixels_raw: frame.map(|frame| frame.pixels.as_slice()),
        }
    }
}

fn frames<S: Serializer>(records: &&[Record], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(records.iter().map(Frame::from))
}

fn words<S: Serializer>(words: &Option<&[PixelWord]>, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(words.unwrap_or_default().iter().map(|word| word.0))
}
