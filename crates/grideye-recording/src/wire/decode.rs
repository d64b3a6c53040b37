//! Decodes JSON into the types, checking shape and limits. `check` then compares the fields.

use super::error::{repeated, too_many};
use crate::record::{ClockState, Record, Stamp};
use crate::wire::error::WireError;
use crate::wire::lifted::Lifted;
use crate::wire::types::{Account, Acknowledgement, Batch, Gap, Limits, SensorBatch};
use crate::wire::values::{Array, COUNT, Integer, Named, Object, Seed, TEXT, fill};
use core::cell::Cell;
use core::fmt;
use core::marker::PhantomData;
use grideye_frame::{NoData, PIXELS, PixelWord, Reading, RecordedFrame, ThermistorWord};
use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Unexpected, Visitor};
use serde_json::Error as JsonError;
use std::collections::BTreeMap;

type Counts = BTreeMap<String, u64>;

pub(super) fn batch(json: &[u8], limits: &Limits) -> Result<Batch, WireError> {
    let seed = |lifted| {
        Seed(BatchObject {
            limits,
            frames_left: Cell::new(limits.frames),
            lifted,
        })
    };
    let lifted = Lifted::of(json);
    parse(&lifted.rest, seed(Some(&lifted))).or_else(|_| parse_and_name(json, seed(None)))
}

pub(super) fn acknowledgement(json: &[u8], limits: &Limits) -> Result<Acknowledgement, WireError> {
    let seed = || Seed(AcknowledgementObject(limits));
    parse(json, seed()).or_else(|_| parse_and_name(json, seed()))
}

fn parse<'de, S: DeserializeSeed<'de>>(json: &'de [u8], seed: S) -> Result<S::Value, JsonError> {
    let mut parser = serde_json::Deserializer::from_slice(json);
    let value = seed.deserialize(&mut parser)?;
    parser.end().map(|()| value)
}

/// Parses again with a record of the place, which is slower: only for rejected bodies.
fn parse_and_name<'de, S: DeserializeSeed<'de>>(
    json: &'de [u8],
    seed: S,
) -> Result<S::Value, WireError> {
    let mut track = serde_path_to_error::Track::new();
    let mut parser = serde_json::Deserializer::from_slice(json);
    let tracked = serde_path_to_error::Deserializer::new(&mut parser, &mut track);
    let parsed = seed.deserialize(tracked);
    let parsed = parsed.and_then(|value| parser.end().map(|()| value));
    parsed.map_err(|error| WireError::from_parser(&track.path(), &error))
}

struct BatchObject<'l> {
    limits: &'l Limits,
    /// Frames that the body may still contain, all sensors together.
    frames_left: Cell<usize>,
    lifted: Option<&'l Lifted>,
}

#[derive(Deserialize)]
#[serde(field_identifier, rename_all = "snake_case")]
enum BatchField {
    Device,
    Boot,
    TSentBootNs,
    Sensors,
}

impl<'de> Object<'de> for BatchObject<'_> {
    type Value = Batch;
    const EXPECTED: &'static str = "an object with device, boot and sensors";

    fn read<A: MapAccess<'de>>(self, mut map: A) -> Result<Batch, A::Error> {
        let left = Cell::new(self.limits.sensors);
        let each_sensor = || Array {
            of: "sensors",
            limit: self.limits.sensors,
            limit_of: "sensors",
            left: &left,
            each: Seed(SensorObject(&self)),
        };
        let (mut device, mut boot, mut sent, mut sensors) = (None, None, None, None);
        while let Some(field) = map.next_key()? {
            match field {
                BatchField::Device => fill(&mut device, "device", &mut map, TEXT)?,
                BatchField::Boot => fill(&mut boot, "boot", &mut map, TEXT)?,
                BatchField::TSentBootNs => fill(&mut sent, "t_sent_boot_ns", &mut map, COUNT)?,
                BatchField::Sensors => fill(&mut sensors, "sensors", &mut map, each_sensor())?,
            }
        }
        Ok(Batch {
            device: device.ok_or_else(|| A::Error::missing_field("device"))?,
            boot: boot.ok_or_else(|| A::Error::missing_field("boot"))?,
            t_sent_boot_ns: sent.map(|Integer(sent)| sent),
            sensors: sensors.ok_or_else(|| A::Error::missing_field("sensors"))?,
        })
    }
}

#[derive(Clone, Copy)]
struct SensorObject<'b>(&'b BatchObject<'b>);

#[derive(Deserialize)]
#[serde(field_identifier, rename_all = "snake_case")]
enum SensorField {
    Sensor,
    Account,
    Frames,
}

impl<'de> Object<'de> for SensorObject<'_> {
    type Value = SensorBatch;
    const EXPECTED: &'static str = "an object with sensor and frames";

    fn read<A: MapAccess<'de>>(self, mut map: A) -> Result<SensorBatch, A::Error> {
        let account_of = || Seed(AccountObject(self.0.limits));
        let each_frame = || Array {
            of: "frames",
            limit: self.0.limits.frames,
            limit_of: "frames in all",
            left: &self.0.frames_left,
            each: Seed(FrameObject(self.0.lifted)),
        };
        let (mut sensor, mut account, mut frames) = (None, None, None);
        while let Some(field) = map.next_key()? {
            match field {
                SensorField::Sensor => fill(&mut sensor, "sensor", &mut map, TEXT)?,
                SensorField::Account => fill(&mut account, "account", &mut map, account_of())?,
                SensorField::Frames => fill(&mut frames, "frames", &mut map, each_frame())?,
            }
        }
        Ok(SensorBatch {
            sensor: sensor.ok_or_else(|| A::Error::missing_field("sensor"))?,
            account,
            frames: frames.ok_or_else(|| A::Error::missing_field("frames"))?,
        })
    }
}

struct AccountObject<'l>(&'l Limits);

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

impl<'de> Object<'de> for AccountObject<'_> {
    type Value = Account;
    const EXPECTED: &'static str = "an object with read, missing, dropped, spooled and errors";

    fn read<A: MapAccess<'de>>(self, mut map: A) -> Result<Account, A::Error> {
        let (mut read, mut missing, mut spooled) = (None, None, None);
        let (mut dropped, mut errors, mut ended) = (None, None, None);
        let reasons = || Seed(CountsObject(self.0.reasons, "reasons"));
        while let Some(field) = map.next_key()? {
            match field {
                AccountField::Read => fill(&mut read, "read", &mut map, COUNT)?,
                AccountField::Missing => fill(&mut missing, "missing", &mut map, COUNT)?,
                AccountField::Dropped => fill(&mut dropped, "dropped", &mut map, reasons())?,
                AccountField::Spooled => fill(&mut spooled, "spooled", &mut map, COUNT)?,
                AccountField::Errors => fill(&mut errors, "errors", &mut map, reasons())?,
                AccountField::Ended => fill(&mut ended, "ended", &mut map, PhantomData::<bool>)?,
            }
        }
        Ok(Account {
            read: read.ok_or_else(|| A::Error::missing_field("read"))?.0,
            missing: missing.ok_or_else(|| A::Error::missing_field("missing"))?.0,
            dropped: dropped.ok_or_else(|| A::Error::missing_field("dropped"))?,
            spooled: spooled.ok_or_else(|| A::Error::missing_field("spooled"))?.0,
            errors: errors.ok_or_else(|| A::Error::missing_field("errors"))?,
            ended: ended.unwrap_or(false),
        })
    }
}

/// Objects only: serde's derive would also accept an array of the fields' values.
#[derive(Clone, Copy)]
struct FrameObject<'l>(Option<&'l Lifted>);

impl<'de> Object<'de> for FrameObject<'_> {
    type Value = Record;
    const EXPECTED: &'static str =
        "an object with seq, t_boot_ns, t_utc_ns, clock and a frame or `missing`";

    fn read<A: MapAccess<'de>>(self, map: A) -> Result<Record, A::Error> {
        let map = MapAccessDeserializer::new(map);
        let Some(lifted) = self.0 else {
            return FrameFields::<Pixels>::deserialize(map)?.record(|Pixels(pixels)| Some(pixels));
        };
        FrameFields::<Integer<u16>>::deserialize(map)?.record(|_taken| lifted.next())
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, bound = "P: Deserialize<'de>")]
struct FrameFields<P> {
    seq: Integer<u64>,
    t_boot_ns: Integer<u64>,
    t_utc_ns: Integer<i64>,
    clock: Named<ClockState>,
    #[serde(default, deserialize_with = "some")]
    missing: Option<Named<NoData>>,
    /// Absent or `null` if it is not known.
    #[serde(default)]
    thermistor_raw: Option<Integer<u16>>,
    #[serde(default = "Option::default", deserialize_with = "some")]
    pixels_raw: Option<P>,
}

impl<P> FrameFields<P> {
    fn record<E: Error>(
        self,
        pixels: impl FnOnce(P) -> Option<[PixelWord; PIXELS]>,
    ) -> Result<Record, E> {
        let taken = self.pixels_raw.map(pixels);
        let pixels = taken.map(|pixels| pixels.ok_or_else(|| E::missing_field("pixels_raw")));
        let reading = match (self.missing, self.thermistor_raw, pixels.transpose()?) {
            (None, thermistor, Some(pixels)) => Reading::Frame(RecordedFrame {
                thermistor: thermistor.map(|Integer(word)| ThermistorWord(word)),
                pixels,
            }),
            (Some(Named(reason)), None, None) => Reading::NoData(reason),
            (None, _, None) => return Err(E::missing_field("pixels_raw")),
            (Some(_), _, _) => {
                let both = Unexpected::Other("`missing` and words");
                return Err(E::invalid_value(both, &"words, or `missing` with a reason"));
            }
        };
        Ok(Record {
            seq: self.seq.0,
            stamp: Stamp {
                t_boot_ns: self.t_boot_ns.0,
                t_utc_ns: self.t_utc_ns.0,
                clock: self.clock.0,
            },
            reading,
        })
    }
}

/// Rejects `null`, which a plain `Option` would accept.
fn some<'de, D: Deserializer<'de>, P: Deserialize<'de>>(
    deserializer: D,
) -> Result<Option<P>, D::Error> {
    P::deserialize(deserializer).map(Some)
}

struct Pixels([PixelWord; PIXELS]);

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
            *slot = match seq.next_element::<Integer<u16>>()? {
                Some(Integer(word)) => PixelWord(word),
                None => return Err(A::Error::invalid_length(index, &self)),
            };
        }
        match seq.next_element::<Integer<u16>>()? {
            None => Ok(words),
            Some(_) => Err(A::Error::invalid_value(Unexpected::Other("a 65th"), &self)),
        }
    }
}

struct AcknowledgementObject<'l>(&'l Limits);

#[derive(Deserialize)]
#[serde(field_identifier, rename_all = "snake_case")]
enum AcknowledgementField {
    DurableThrough,
    Gaps,
}

impl<'de> Object<'de> for AcknowledgementObject<'_> {
    type Value = Acknowledgement;
    const EXPECTED: &'static str = "an object with durable_through and gaps";

    fn read<A: MapAccess<'de>>(self, mut map: A) -> Result<Acknowledgement, A::Error> {
        let (mut durable, mut gaps) = (None, None);
        let by_sensor = || Seed(CountsObject(self.0.sensors, "sensors"));
        let left = Cell::new(self.0.gaps);
        let each_gap = || Array {
            of: "gaps",
            limit: self.0.gaps,
            limit_of: "gaps",
            left: &left,
            each: Seed(GapObject),
        };
        while let Some(field) = map.next_key()? {
            match field {
                AcknowledgementField::DurableThrough => {
                    fill(&mut durable, "durable_through", &mut map, by_sensor())?;
                }
                AcknowledgementField::Gaps => fill(&mut gaps, "gaps", &mut map, each_gap())?,
            }
        }
        Ok(Acknowledgement {
            durable_through: durable.ok_or_else(|| A::Error::missing_field("durable_through"))?,
            gaps: gaps.ok_or_else(|| A::Error::missing_field("gaps"))?,
        })
    }
}

#[derive(Clone, Copy)]
struct GapObject;

impl<'de> Object<'de> for GapObject {
    type Value = Gap;
    const EXPECTED: &'static str = "an object with sensor, from and to";

    fn read<A: MapAccess<'de>>(self, map: A) -> Result<Gap, A::Error> {
        Deserialize::deserialize(MapAccessDeserializer::new(map))
    }
}

/// A map from names to counts, without repeated names, limited to this many of the named kind.
struct CountsObject(usize, &'static str);

impl<'de> Object<'de> for CountsObject {
    type Value = Counts;
    const EXPECTED: &'static str = "an object of names and counts";

    fn read<A: MapAccess<'de>>(self, mut map: A) -> Result<Counts, A::Error> {
        let mut counts = Counts::new();
        while let Some(key) = map.next_key::<String>()? {
            let Integer(count) = map.next_value()?;
            if counts.contains_key(&key) {
                return Err(repeated(&key));
            }
            if counts.len() == self.0 {
                return Err(too_many(self.0, self.1));
            }
            counts.insert(key, count);
        }
        Ok(counts)
    }
}
