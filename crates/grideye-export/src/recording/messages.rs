//! MCAP (mcap.dev) with the messages of ROS 2, for Rerun, Foxglove, PlotJuggler and ROS 2 itself: three topics per device and sensor.
//!
//! | topic | type | holds |
//! |---|---|---|
//! | `/DEVICE/SENSOR/image` | `sensor_msgs/msg/Image` | pixels of 32 bits (`32FC1`), °C |
//! | `/DEVICE/SENSOR/thermistor` | `sensor_msgs/msg/Temperature` | the sensor's own temperature, °C, if it was recorded |
//! | `/DEVICE/SENSOR/state` | `diagnostic_msgs/msg/DiagnosticArray` | of each frame, missing ones too: number, clock, boot, labels; the reason of a missing one |
//!
//! Types that every installation of ROS 2 has, so that nothing has to be built to read them. The messages' encoding is CDR,
//! little endian (OMG DDSI-RTPS 2.3, section 10). A message's time is the device's wall clock, or the time since the device started
//! if that clock was never set.

use super::rows::{Out, Row, Rows};
use crate::error::ExportError;
use grideye_recording::Stamp;
use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};
use std::collections::BTreeMap;
use std::io::{Seek, Write};

/// The levels of `diagnostic_msgs/msg/DiagnosticStatus`.
const OK: u8 = 0;
const ERROR: u8 = 2;

/// Writes messages as they come, and opens channels on first use.
struct Messages<W: Write + Seek> {
    file: Writer<W>,
    /// By device and sensor, in the order of [`TOPICS`].
    channels: BTreeMap<(String, String), [u16; 3]>,
    schemas: [u16; 3],
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
            .profile("ros2")
            .library(concat!("grideye ", env!("CARGO_PKG_VERSION")));
        let mut file = options.create(out)?;
        let mut schemas = [0; 3];
        for (id, (_, name, definition)) in schemas.iter_mut().zip(TOPICS) {
            *id = file.add_schema(name, "ros2msg", definition.as_bytes())?;
        }
        Ok(Self {
            file,
            channels: BTreeMap::new(),
            schemas,
            written: 0,
        })
    }

    fn row(&mut self, row: &Row, labels: &[String], columns: usize) -> Result<(), ExportError> {
        let [image, thermistor, state] = self.channels_of(row)?;
        let at_ns = time_ns(&row.stamp);
        if let Ok(pixels_c) = &row.pixels_c {
            self.message(
                image,
                at_ns,
                &image_message(row, (pixels_c, columns), at_ns),
            )?;
        }
        if let Some(celsius) = row.thermistor_c {
            let mut message = Cdr::stamped(row, at_ns);
            message.float64(celsius.into());
            // A variance of 0 says that it is not known.
            message.float64(0.0);
            self.message(thermistor, at_ns, &message)?;
        }
        self.message(state, at_ns, &state_message(row, labels, at_ns))
    }

    fn channels_of(&mut self, row: &Row) -> Result<[u16; 3], ExportError> {
        let key = (row.stream.device.clone(), row.stream.sensor.clone());
        if let Some(known) = self.channels.get(&key) {
            return Ok(*known);
        }
        let place = format!("/{}/{}", token(&key.0), token(&key.1));
        let mut channels = self.schemas;
        for (channel, (what, ..)) in channels.iter_mut().zip(TOPICS) {
            let topic = format!("{place}/{what}");
            *channel = self
                .file
                .add_channel(*channel, &topic, "cdr", &BTreeMap::new())?;
        }
        self.channels.insert(key, channels);
        Ok(channels)
    }

    fn message(&mut self, channel_id: u16, at_ns: u64, message: &Cdr) -> Result<(), ExportError> {
        let header = MessageHeader {
            channel_id,
            sequence: self.written,
            log_time: at_ns,
            publish_time: at_ns,
        };
        self.written = self.written.wrapping_add(1);
        Ok(self.file.write_to_known_channel(&header, &message.0)?)
    }
}

/// A name as a part of a ROS 2 topic, which has letters, digits and `_`, and begins with none of the digits
/// (design.ros2.org/articles/topic_and_service_names.html). The messages hold the name itself.
fn token(name: &str) -> String {
    let mut token: String = name
        .chars()
        .map(|letter| {
            if letter.is_ascii_alphanumeric() {
                letter
            } else {
                '_'
            }
        })
        .collect();
    if token.starts_with(|first: char| first.is_ascii_digit()) {
        token.insert(0, '_');
    }
    token
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

fn image_message(row: &Row, (pixels_c, columns): (&[f32], usize), at_ns: u64) -> Cdr {
    let mut message = Cdr::stamped(row, at_ns);
    message.length(pixels_c.len() / columns.max(1));
    message.length(columns);
    message.text("32FC1");
    message.0.push(0);
    message.length(columns * size_of::<f32>());
    message.length(size_of_val(pixels_c));
    for pixel in pixels_c {
        message.0.extend(pixel.to_le_bytes());
    }
    message
}

fn state_message(row: &Row, labels: &[String], at_ns: u64) -> Cdr {
    let (seq, t_boot_ns) = (row.seq.to_string(), row.stamp.t_boot_ns.to_string());
    let mut values = vec![
        ("boot", row.stream.boot.as_str()),
        ("seq", &seq),
        ("t_boot_ns", &t_boot_ns),
        ("clock", row.stamp.clock.name()),
    ];
    let labels = labels.iter().zip(&row.labels);
    values.extend(labels.map(|(name, label)| (name.as_str(), label.as_str())));
    let missing = row.missing();
    let mut message = Cdr::stamped(row, at_ns);
    message.length(1);
    message.0.push(if missing.is_none() { OK } else { ERROR });
    message.text(&frame_id(row));
    message.text(missing.unwrap_or(""));
    message.text(&row.stream.device);
    message.length(values.len());
    for (key, value) in values {
        message.text(key);
        message.text(value);
    }
    message
}

fn frame_id(row: &Row) -> String {
    format!("{}/{}", row.stream.device, row.stream.sensor)
}

/// One message in CDR. Its first four bytes say so, and alignment counts from behind them.
struct Cdr(Vec<u8>);

impl Cdr {
    /// Begins with a `std_msgs/msg/Header`.
    fn stamped(row: &Row, at_ns: u64) -> Self {
        let mut message = Self(vec![0, 1, 0, 0]);
        // ROS 2 counts seconds in 32 bits with a sign, until 2038.
        let seconds = i32::try_from(at_ns / 1_000_000_000).unwrap_or(i32::MAX);
        message.number(seconds.to_le_bytes());
        let nanoseconds = u32::try_from(at_ns % 1_000_000_000).unwrap_or(0);
        message.number(nanoseconds.to_le_bytes());
        message.text(&frame_id(row));
        message
    }

    fn number<const N: usize>(&mut self, bytes: [u8; N]) {
        self.0.resize((self.0.len() - 4).next_multiple_of(N) + 4, 0);
        self.0.extend(bytes);
    }

    fn length(&mut self, length: usize) {
        self.number(u32::try_from(length).unwrap_or(u32::MAX).to_le_bytes());
    }

    fn float64(&mut self, value: f64) {
        self.number(value.to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.length(text.len() + 1);
        self.0.extend(text.bytes());
        self.0.push(0);
    }
}

/// A topic's last part, its type, and that type's definition as MCAP wants it, with those it is made of
/// (mcap.dev/spec/registry, `ros2msg`).
const TOPICS: [(&str, &str, &str); 3] = [
    (
        "image",
        "sensor_msgs/msg/Image",
        include_str!("ros2/Image.msg"),
    ),
    (
        "thermistor",
        "sensor_msgs/msg/Temperature",
        include_str!("ros2/Temperature.msg"),
    ),
    (
        "state",
        "diagnostic_msgs/msg/DiagnosticArray",
        include_str!("ros2/DiagnosticArray.msg"),
    ),
];
