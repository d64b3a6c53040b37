//! MCAP (mcap.dev), for Foxglove and similar programs: two topics per device and sensor.
//!
//! | topic | schema | holds |
//! |---|---|---|
//! | `/DEVICE/SENSOR/image` | `foxglove.RawImage`, JSON | pixels of 32 bits (`32FC1`), °C |
//! | `/DEVICE/SENSOR/state` | `grideye.State`, JSON | thermistor, number, clock, and why a frame is missing |
//!
//! A message's time is the device's wall clock, or the time since the device started if that clock was never set.

use super::rows::{Out, Row, Rows};
use crate::error::ExportError;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use grideye_recording::Stamp;
use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::{Seek, Write};

const PIXEL_BYTES: usize = 4;

/// Writes messages as they come, and opens channels on first use.
struct Messages<W: Write + Seek> {
    file: Writer<W>,
    image: u16,
    state: u16,
    /// The image and state channels, by device and sensor.
    channels: BTreeMap<(String, String), (u16, u16)>,
    written: u32,
}

pub(super) fn write(rows: Rows<'_>, out: &mut dyn Out) -> Result<String, ExportError> {
    let mut messages = Messages::new(out)?;
    let mut count: u64 = 0;
    let (labels, columns) = (rows.labels, rows.size.0);
    for row in rows {
        messages.row(&row?, labels, columns)?;
        count += 1;
    }
    messages.file.finish()?;
    Ok(format!("{count} rows"))
}

impl<W: Write + Seek> Messages<W> {
    fn new(out: W) -> Result<Self, ExportError> {
        let options = WriteOptions::new()
            .compression(None)
            .library(concat!("grideye ", env!("CARGO_PKG_VERSION")));
        let mut file = options.create(out)?;
        let mut schema = |name, schema: Value| {
            file.add_schema(name, "jsonschema", schema.to_string().as_bytes())
        };
        let image = schema("foxglove.RawImage", image_schema())?;
        let state = schema("grideye.State", state_schema())?;
        Ok(Self {
            file,
            image,
            state,
            channels: BTreeMap::new(),
            written: 0,
        })
    }

    fn row(&mut self, row: &Row, labels: &[String], columns: usize) -> Result<(), ExportError> {
        let (image, state) = self.channels_of(row)?;
        let at_ns = time_ns(&row.stamp);
        if let Ok(pixels_c) = &row.pixels_c {
            self.message(
                image,
                at_ns,
                &image_message(row, (pixels_c.as_slice(), columns), at_ns),
            )?;
        }
        self.message(state, at_ns, &state_message(row, labels))
    }

    fn channels_of(&mut self, row: &Row) -> Result<(u16, u16), ExportError> {
        let key = (row.stream.device.clone(), row.stream.sensor.clone());
        if let Some(known) = self.channels.get(&key) {
            return Ok(*known);
        }
        let place = format!("/{}/{}", key.0, key.1);
        let mut open = |schema, what| {
            let topic = format!("{place}/{what}");
            self.file
                .add_channel(schema, &topic, "json", &BTreeMap::new())
        };
        let channels = (open(self.image, "image")?, open(self.state, "state")?);
        self.channels.insert(key, channels);
        Ok(channels)
    }

    fn message(&mut self, channel_id: u16, at_ns: u64, message: &Value) -> Result<(), ExportError> {
        let header = MessageHeader {
            channel_id,
            sequence: self.written,
            log_time: at_ns,
            publish_time: at_ns,
        };
        self.written = self.written.wrapping_add(1);
        let bytes = message.to_string();
        Ok(self
            .file
            .write_to_known_channel(&header, bytes.as_bytes())?)
    }
}

/// The wall time, or the time since the device started if its wall clock was never set.
fn time_ns(stamp: &Stamp) -> u64 {
    let wall_ns = u64::try_from(stamp.t_utc_ns).unwrap_or(0);
    if wall_ns == 0 {
        stamp.t_boot_ns
    } else {
        wall_ns
    }
}

fn image_message(row: &Row, (pixels_c, columns): (&[f32], usize), at_ns: u64) -> Value {
    let bytes: Vec<u8> = pixels_c
        .iter()
        .flat_map(|pixel| pixel.to_le_bytes())
        .collect();
    json!({
        "timestamp": { "sec": at_ns / 1_000_000_000, "nsec": at_ns % 1_000_000_000 },
        "frame_id": format!("{}/{}", row.stream.device, row.stream.sensor),
        "width": columns,
        "height": pixels_c.len() / columns.max(1),
        "encoding": "32FC1",
        "step": columns * PIXEL_BYTES,
        "data": STANDARD.encode(bytes),
    })
}

fn state_message(row: &Row, labels: &[String]) -> Value {
    let mut message = json!({
        "boot": row.stream.boot,
        "seq": row.seq,
        "t_boot_ns": row.stamp.t_boot_ns,
        "clock": row.stamp.clock.name(),
        "thermistor_celsius": row.thermistor_c,
        "missing": row.missing(),
    });
    if !labels.is_empty() {
        let named = labels.iter().zip(&row.labels);
        message["labels"] = named
            .map(|(name, label)| (name.clone(), label.clone()))
            .collect();
    }
    message
}

/// The fields of `foxglove.RawImage`, from docs.foxglove.dev/docs/visualization/message-schemas/raw-image.
fn image_schema() -> Value {
    let time = json!({
        "type": "object",
        "title": "time",
        "properties": { "sec": { "type": "integer", "minimum": 0 }, "nsec": { "type": "integer", "minimum": 0, "maximum": 999_999_999 } },
    });
    json!({
        "title": "foxglove.RawImage",
        "type": "object",
        "properties": {
            "timestamp": time,
            "frame_id": { "type": "string" },
            "width": { "type": "integer", "minimum": 0 },
            "height": { "type": "integer", "minimum": 0 },
            "encoding": { "type": "string" },
            "step": { "type": "integer", "minimum": 0 },
            "data": { "type": "string", "contentEncoding": "base64" },
        },
    })
}

fn state_schema() -> Value {
    json!({
        "title": "grideye.State",
        "type": "object",
        "properties": {
            "boot": { "type": "string" },
            "seq": { "type": "integer", "minimum": 0 },
            "t_boot_ns": { "type": "integer", "minimum": 0 },
            "clock": { "enum": ["unsynced", "synced", "stepped"] },
            "thermistor_celsius": { "type": ["number", "null"] },
            "missing": { "type": ["string", "null"] },
            "labels": { "type": "object", "additionalProperties": { "type": "string" } },
        },
    })
}
