//! From JSON to the types: shape and limits. What must hold between fields is checked afterwards, in `check`.

use super::error::{repeated, too_many};
use crate::record::{CLOCK_STATES, ClockState, Record, Stamp};
use crate::wire::error::WireError;
use crate::wire::types::{Account, Acknowledgement, Batch, Gap, Limits, SensorBatch};
use crate::wire::values::{COUNT, NANOSECONDS, Named, Text, WORD, fill};
use core::cell::Cell;
use core::fmt;
use core::marker::PhantomData;
use grideye_frame::{NoData, PIXELS, PixelWord, RawFrame, Reading, ThermistorWord};
use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Unexpected, Visitor};
use serde_json::value::RawValue;
use std::collections::BTreeMap;

type Counts = BTreeMap<String, u64>;

pub(super) fn batch(json: &[u8], limits: &Limits) -> Result<Batch, WireError> {
    parse(json, |words| BatchSeed {
        limits,
        frames_left: Cell::new(limits.frames),
        words,
    })
}

pub(super) fn acknowledgement(json: &[u8], limits: &Limits) -> Result<Acknowledgement, WireError> {
    parse(json, |_words| AcknowledgementSeed { limits })
}

/// How the words of pixels are read, which are most of a body.
#[derive(Debug, Clone, Copy)]
enum Words {
    /// As text of the array, in a third of the time; a fault in it is not named.
    Quickly,
    OneByOne,
}

/// Parses once, quickly; only what that refuses is gone through again, one by one and with the place kept track of.
fn parse<'de, S: DeserializeSeed<'de>>(
    json: &'de [u8],
    seed: impl Fn(Words) -> S,
) -> Result<S::Value, WireError> {
    let mut quick = serde_json::Deserializer::from_slice(json);
    let parsed = seed(Words::Quickly).deserialize(&mut quick);
    if let Ok(value) = parsed.and_then(|value| quick.end().map(|()| value)) {
        return Ok(value);
    }
    let mut track = serde_path_to_error::Track::new();
    let mut slow = serde_json::Deserializer::from_slice(json);
    let tracked = serde_path_to_error::Deserializer::new(&mut slow, &mut track);
    let parsed = seed(Words::OneByOne).deserialize(tracked);
    let parsed = parsed.and_then(|value| slow.end().map(|()| value));
    parsed.map_err(|error| WireError::from_parser(&track.path(), &error))
}

struct BatchSeed<'l> {
    limits: &'l Limits,
    /// Frames that the body may still hold, counted over its sensors.
    frames_left: Cell<usize>,
    words: Words,
}

impl<'de> DeserializeSeed<'de> for BatchSeed<'_> {
    type Value = Batch;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Batch, D::Error> {
        deserializer.deserialize_map(self)
    }
}

#[derive(Deserialize)]
#[serde(field_identifier, rename_all = "snake_case")]
enum BatchField {
    Device,
    Boot,
    TSentBootNs,
    Sensors,
}

impl<'de> Visitor<'de> for BatchSeed<'_> {
    type Value = Batch;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("an object with device, boot and sensors")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Batch, A::Error> {
        let (mut device, mut boot, mut sent, mut sensors) = (None, None, None, None);
        while let Some(field) = map.next_key()? {
            match field {
                BatchField::Device => fill(&mut device, "device", &mut map, Text)?,
                BatchField::Boot => fill(&mut boot, "boot", &mut map, Text)?,
                BatchField::TSentBootNs => fill(&mut sent, "t_sent_boot_ns", &mut map, COUNT)?,
                BatchField::Sensors => fill(&mut sensors, "sensors", &mut map, SensorsSeed(&self))?,
            }
        }
        Ok(Batch {
            device: device.ok_or_else(|| A::Error::missing_field("device"))?,
            boot: boot.ok_or_else(|| A::Error::missing_field("boot"))?,
            t_sent_boot_ns: sent,
            sensors: sensors.ok_or_else(|| A::Error::missing_field("sensors"))?,
        })
    }
}

struct SensorsSeed<'b>(&'b BatchSeed<'b>);

impl<'de> DeserializeSeed<'de> for SensorsSeed<'_> {
    type Value = Vec<SensorBatch>;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de> Visitor<'de> for SensorsSeed<'_> {
    type Value = Vec<SensorBatch>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("an array of sensors")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
        let mut sensors = Vec::new();
        while let Some(sensor) = seq.next_element_seed(SensorSeed(self.0))? {
            if sensors.len() == self.0.limits.sensors {
                return Err(too_many(self.0.limits.sensors, "sensors"));
            }
            sensors.push(sensor);
        }
        Ok(sensors)
    }
}

struct SensorSeed<'b>(&'b BatchSeed<'b>);

impl<'de> DeserializeSeed<'de> for SensorSeed<'_> {
    type Value = SensorBatch;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<SensorBatch, D::Error> {
        deserializer.deserialize_map(self)
    }
}

#[derive(Deserialize)]
#[serde(field_identifier, rename_all = "snake_case")]
enum SensorField {
    Sensor,
    Account,
    Frames,
}

impl<'de> Visitor<'de> for SensorSeed<'_> {
    type Value = SensorBatch;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("an object with sensor and frames")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<SensorBatch, A::Error> {
        let (mut sensor, mut account, mut frames) = (None, None, None);
        while let Some(field) = map.next_key()? {
            match field {
                SensorField::Sensor => fill(&mut sensor, "sensor", &mut map, Text)?,
                SensorField::Account => {
                    fill(
                        &mut account,
                        "account",
                        &mut map,
                        AccountSeed(self.0.limits),
                    )?;
                }
                SensorField::Frames => fill(&mut frames, "frames", &mut map, FramesSeed(self.0))?,
            }
        }
        Ok(SensorBatch {
            sensor: sensor.ok_or_else(|| A::Error::missing_field("sensor"))?,
            account,
            frames: frames.ok_or_else(|| A::Error::missing_field("frames"))?,
        })
    }
}

struct AccountSeed<'l>(&'l Limits);

impl<'de> DeserializeSeed<'de> for AccountSeed<'_> {
    type Value = Account;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Account, D::Error> {
        deserializer.deserialize_map(self)
    }
}

#[derive(Deserialize)]
#[serde(field_identifier, rename_all = "snake_case")]
enum AccountField {
    Read,
    Missing,
    Dropped,
    Spooled,
    Errors,
    Ended,
}

impl<'de> Visitor<'de> for AccountSeed<'_> {
    type Value = Account;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("an object with read, missing, dropped, spooled and errors")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Account, A::Error> {
        let (mut read, mut missing, mut spooled) = (None, None, None);
        let (mut dropped, mut errors, mut ended) = (None, None, None);
        let reasons = || CountsSeed {
            limit: self.0.reasons,
            of: "reasons",
        };
        while let Some(field) = map.next_key()? {
            match field {
                AccountField::Read => fill(&mut read, "read", &mut map, COUNT)?,
                AccountField::Missing => fill(&mut missing, "missing", &mut map, COUNT)?,
                AccountField::Dropped => fill(&mut dropped, "dropped", &mut map, reasons())?,
                AccountField::Spooled => fill(&mut spooled, "spooled", &mut map, COUNT)?,
                AccountField::Errors => fill(&mut errors, "errors", &mut map, reasons())?,
                AccountField::Ended => {
                    fill(&mut ended, "ended", &mut map, PhantomData::<bool>)?;
                }
            }
        }
        Ok(Account {
            read: read.ok_or_else(|| A::Error::missing_field("read"))?,
            missing: missing.ok_or_else(|| A::Error::missing_field("missing"))?,
            dropped: dropped.ok_or_else(|| A::Error::missing_field("dropped"))?,
            spooled: spooled.ok_or_else(|| A::Error::missing_field("spooled"))?,
            errors: errors.ok_or_else(|| A::Error::missing_field("errors"))?,
            ended: ended.unwrap_or(false),
        })
    }
}

struct FramesSeed<'b>(&'b BatchSeed<'b>);

impl<'de> DeserializeSeed<'de> for FramesSeed<'_> {
    type Value = Vec<Record>;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de> Visitor<'de> for FramesSeed<'_> {
    type Value = Vec<Record>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("an array of frames")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
        let left = &self.0.frames_left;
        let mut frames = Vec::new();
        while let Some(frame) = seq.next_element_seed(FrameSeed(self.0.words))? {
            left.set(
                left.get()
                    .checked_sub(1)
                    .ok_or_else(|| too_many::<A::Error>(self.0.limits.frames, "frames in all"))?,
            );
            frames.push(frame);
        }
        Ok(frames)
    }
}

/// A frame is an object only: serde's own derive would take an array of the fields' values as well.
struct FrameSeed(Words);

impl<'de> DeserializeSeed<'de> for FrameSeed {
    type Value = Record;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Record, D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for FrameSeed {
    type Value = Record;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .write_str("an object with seq, t_boot_ns, t_utc_ns, clock and a frame or `missing`")
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Record, A::Error> {
        let map = MapAccessDeserializer::new(map);
        match self.0 {
            Words::Quickly => FrameFields::<QuickPixels>::deserialize(map)?.record(),
            Words::OneByOne => FrameFields::<Pixels>::deserialize(map)?.record(),
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, bound = "P: Deserialize<'de>")]
struct FrameFields<P> {
    #[serde(deserialize_with = "count")]
    seq: u64,
    #[serde(deserialize_with = "count")]
    t_boot_ns: u64,
    #[serde(deserialize_with = "nanoseconds")]
    t_utc_ns: i64,
    #[serde(deserialize_with = "clock")]
    clock: ClockState,
    #[serde(default, deserialize_with = "missing")]
    missing: Option<NoData>,
    #[serde(default, deserialize_with = "word")]
    thermistor_raw: Option<u16>,
    #[serde(default = "Option::default", deserialize_with = "some")]
    pixels_raw: Option<P>,
}

impl<P: Into<[PixelWord; PIXELS]>> FrameFields<P> {
    fn record<E: Error>(self) -> Result<Record, E> {
        let reading = match (self.missing, self.thermistor_raw, self.pixels_raw) {
            (None, Some(thermistor), Some(pixels)) => Reading::Frame(RawFrame {
                thermistor: ThermistorWord(thermistor),
                pixels: pixels.into(),
            }),
            (Some(reason), None, None) => Reading::NoData(reason),
            (None, None, _) => return Err(E::missing_field("thermistor_raw")),
            (None, _, None) => return Err(E::missing_field("pixels_raw")),
            (Some(_), _, _) => {
                let both = Unexpected::Other("`missing` and words");
                return Err(E::invalid_value(both, &"words, or `missing` with a reason"));
            }
        };
        Ok(Record {
            seq: self.seq,
            stamp: Stamp {
                t_boot_ns: self.t_boot_ns,
                t_utc_ns: self.t_utc_ns,
                clock: self.clock,
            },
            reading,
        })
    }
}

fn count<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u64, D::Error> {
    COUNT.deserialize(deserializer)
}

fn nanoseconds<'de, D: Deserializer<'de>>(deserializer: D) -> Result<i64, D::Error> {
    NANOSECONDS.deserialize(deserializer)
}

fn clock<'de, D: Deserializer<'de>>(deserializer: D) -> Result<ClockState, D::Error> {
    Named {
        expected: CLOCK_STATES,
        kind: PhantomData,
    }
    .deserialize(deserializer)
}

fn missing<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<NoData>, D::Error> {
    Named {
        expected: "the name of a reason why there is no frame",
        kind: PhantomData,
    }
    .deserialize(deserializer)
    .map(Some)
}

fn word<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<u16>, D::Error> {
    WORD.deserialize(deserializer).map(Some)
}

fn some<'de, D: Deserializer<'de>, P: Deserialize<'de>>(
    deserializer: D,
) -> Result<Option<P>, D::Error> {
    P::deserialize(deserializer).map(Some)
}

struct Pixels([PixelWord; PIXELS]);

impl From<Pixels> for [PixelWord; PIXELS] {
    fn from(pixels: Pixels) -> Self {
        pixels.0
    }
}

impl<'de> Deserialize<'de> for Pixels {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(PixelsVisitor).map(Self)
    }
}

struct PixelsVisitor;

impl<'de> Visitor<'de> for PixelsVisitor {
    type Value = [PixelWord; PIXELS];

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "an array of exactly {PIXELS} integers")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
        let mut words = [PixelWord(0); PIXELS];
        for (index, slot) in words.iter_mut().enumerate() {
            *slot = match seq.next_element_seed(WORD)? {
                Some(word) => PixelWord(word),
                None => return Err(A::Error::invalid_length(index, &self)),
            };
        }
        match seq.next_element_seed(WORD)? {
            None => Ok(words),
            Some(_) => Err(A::Error::invalid_value(Unexpected::Other("a 65th"), &self)),
        }
    }
}

/// The same from the text of the array. It takes less than `Pixels` does, and nothing else.
struct QuickPixels([PixelWord; PIXELS]);

impl From<QuickPixels> for [PixelWord; PIXELS] {
    fn from(pixels: QuickPixels) -> Self {
        pixels.0
    }
}

impl<'de> Deserialize<'de> for QuickPixels {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let array = <&RawValue>::deserialize(deserializer)?.get().as_bytes();
        let words = quick_words(array).ok_or_else(|| D::Error::custom("not quickly read"))?;
        Ok(Self(words))
    }
}

/// 64 decimal numbers between brackets, with commas and perhaps blanks; that it is JSON has been checked.
fn quick_words(array: &[u8]) -> Option<[PixelWord; PIXELS]> {
    /// Every larger number has more digits than a word.
    const BEYOND: u32 = 99_999;
    let mut words = [PixelWord(0); PIXELS];
    let mut slots = words.iter_mut();
    let mut word = 0;
    for byte in array.strip_prefix(b"[")? {
        match byte {
            b'0'..=b'9' => word = (word * 10 + u32::from(byte - b'0')).min(BEYOND),
            b',' | b']' => {
                *slots.next()? = PixelWord(u16::try_from(word).ok()?);
                word = 0;
            }
            b' ' | b'\n' | b'\r' | b'\t' => {}
            _ => return None,
        }
    }
    slots.next().is_none().then_some(words)
}

struct AcknowledgementSeed<'l> {
    limits: &'l Limits,
}

impl<'de> DeserializeSeed<'de> for AcknowledgementSeed<'_> {
    type Value = Acknowledgement;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        deserializer.deserialize_map(self)
    }
}

#[derive(Deserialize)]
#[serde(field_identifier, rename_all = "snake_case")]
enum AcknowledgementField {
    DurableThrough,
    Gaps,
}

impl<'de> Visitor<'de> for AcknowledgementSeed<'_> {
    type Value = Acknowledgement;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("an object with durable_through and gaps")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Acknowledgement, A::Error> {
        let (mut durable, mut gaps) = (None, None);
        let by_sensor = || CountsSeed {
            limit: self.limits.sensors,
            of: "sensors",
        };
        while let Some(field) = map.next_key()? {
            match field {
                AcknowledgementField::DurableThrough => {
                    fill(&mut durable, "durable_through", &mut map, by_sensor())?;
                }
                AcknowledgementField::Gaps => {
                    fill(&mut gaps, "gaps", &mut map, GapsSeed(self.limits.gaps))?;
                }
            }
        }
        Ok(Acknowledgement {
            durable_through: durable.ok_or_else(|| A::Error::missing_field("durable_through"))?,
            gaps: gaps.ok_or_else(|| A::Error::missing_field("gaps"))?,
        })
    }
}

struct GapsSeed(usize);

impl<'de> DeserializeSeed<'de> for GapsSeed {
    type Value = Vec<Gap>;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de> Visitor<'de> for GapsSeed {
    type Value = Vec<Gap>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("an array of gaps")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
        let mut gaps = Vec::new();
        while let Some(gap) = seq.next_element_seed(GapSeed)? {
            if gaps.len() == self.0 {
                return Err(too_many(self.0, "gaps"));
            }
            gaps.push(gap);
        }
        Ok(gaps)
    }
}

struct GapSeed;

impl<'de> DeserializeSeed<'de> for GapSeed {
    type Value = Gap;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Gap, D::Error> {
        deserializer.deserialize_map(self)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct GapFields {
    sensor: String,
    #[serde(deserialize_with = "count")]
    from: u64,
    #[serde(deserialize_with = "count")]
    to: u64,
}

impl<'de> Visitor<'de> for GapSeed {
    type Value = Gap;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("an object with sensor, from and to")
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Gap, A::Error> {
        let fields: GapFields = Deserialize::deserialize(MapAccessDeserializer::new(map))?;
        Ok(Gap {
            sensor: fields.sensor,
            from: fields.from,
            to: fields.to,
        })
    }
}

/// A map of names to counts: no name twice, and only so many.
struct CountsSeed {
    limit: usize,
    of: &'static str,
}

impl<'de> DeserializeSeed<'de> for CountsSeed {
    type Value = Counts;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Counts, D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for CountsSeed {
    type Value = Counts;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("an object of names and counts")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Counts, A::Error> {
        let mut counts = Counts::new();
        while let Some(key) = map.next_key::<String>()? {
            let count = map.next_value_seed(COUNT)?;
            if counts.contains_key(&key) {
                return Err(repeated(&key));
            }
            if counts.len() == self.limit {
                return Err(too_many(self.limit, self.of));
            }
            counts.insert(key, count);
        }
        Ok(counts)
    }
}
