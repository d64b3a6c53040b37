//! A body as JSON, read and written, and the frame that both share. The types state their bounds; `check` then compares
//! the fields.

use crate::record::{ClockState, Record, Stamp};
use crate::wire::error::WireError;
use crate::wire::values::{Expected, Integer, Named, Object, Pixels, some};
use grideye_frame::{NoData, Reading, RecordedFrame, ThermistorWord};
use serde::de::{Deserializer, Error, Unexpected};
use serde::{Deserialize, Serialize, Serializer};

/// Parses once; only a rejected body again, to name the place, which takes twice as long.
pub(super) fn read<'de, T: Deserialize<'de> + Expected>(json: &'de [u8]) -> Result<T, WireError> {
    let mut parser = serde_json::Deserializer::from_slice(json);
    let parsed = Object::deserialize(&mut parser);
    let parsed = parsed.and_then(|Object(value)| parser.end().map(|()| value));
    parsed.or_else(|_| named(json))
}

fn named<'de, T: Deserialize<'de> + Expected>(json: &'de [u8]) -> Result<T, WireError> {
    let mut track = serde_path_to_error::Track::new();
    let mut parser = serde_json::Deserializer::from_slice(json);
    let tracked = serde_path_to_error::Deserializer::new(&mut parser, &mut track);
    let parsed = Object::deserialize(tracked);
    let parsed = parsed.and_then(|Object(value)| parser.end().map(|()| value));
    parsed.map_err(|error| WireError::from_parser(&track.path(), &error))
}

pub(super) fn write(body: &impl Serialize) -> Result<Vec<u8>, WireError> {
    serde_json::to_vec(body)
        .map_err(|error| WireError::not_json("body".to_owned(), &error, &error.to_string()))
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Frame {
    seq: Integer<u64>,
    t_boot_ns: Integer<u64>,
    t_utc_ns: Integer<i64>,
    clock: Named<ClockState>,
    #[serde(default, deserialize_with = "some")]
    #[serde(skip_serializing_if = "Option::is_none")]
    missing: Option<Named<NoData>>,
    /// Absent or `null` if it is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    thermistor_raw: Option<Integer<u16>>,
    #[serde(default, deserialize_with = "some")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pixels_raw: Option<Pixels>,
}

impl Serialize for Record {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let (missing, frame) = match self.reading {
            Reading::Frame(frame) => (None, Some(frame)),
            Reading::NoData(reason) => (Some(Named(reason)), None),
        };
        let thermistor = frame.and_then(|frame| frame.thermistor);
        let frame = Frame {
            seq: Integer(self.seq),
            t_boot_ns: Integer(self.stamp.t_boot_ns),
            t_utc_ns: Integer(self.stamp.t_utc_ns),
            clock: Named(self.stamp.clock),
            missing,
            thermistor_raw: thermistor.map(|word| Integer(word.0)),
            pixels_raw: frame.map(|frame| Pixels(frame.pixels)),
        };
        frame.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Record {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let frame = Frame::deserialize(deserializer)?;
        let reading = match (frame.missing, frame.thermistor_raw, frame.pixels_raw) {
            (None, thermistor, Some(Pixels(pixels))) => Reading::Frame(RecordedFrame {
                thermistor: thermistor.map(|Integer(word)| ThermistorWord(word)),
                pixels,
            }),
            (Some(Named(reason)), None, None) => Reading::NoData(reason),
            (None, _, None) => return Err(D::Error::missing_field("pixels_raw")),
            (Some(_), _, _) => {
                let both = Unexpected::Other("`missing` and words");
                return Err(D::Error::invalid_value(
                    both,
                    &"words, or `missing` with a reason",
                ));
            }
        };
        Ok(Self {
            seq: frame.seq.0,
            stamp: Stamp {
                t_boot_ns: frame.t_boot_ns.0,
                t_utc_ns: frame.t_utc_ns.0,
                clock: frame.clock.0,
            },
            reading,
        })
    }
}
