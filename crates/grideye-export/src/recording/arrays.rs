//! Arrays for numpy, one entry for each of the recording's N rows; a missing frame is NaN, and why stands in `missing`.
//!
//! | array | type | shape | holds |
//! |---|---|---|---|
//! | `frames` | float32 | (N, 8, 8) | °C, pixel 1 first, as the sensor numbers them |
//! | `thermistor_c` | float32 | (N) | °C |
//! | `seq` | uint64 | (N) | the sensor frame's number |
//! | `t_boot_ns` | uint64 | (N) | the device's clock since it started |
//! | `t_utc_ns` | int64 | (N) | the device's wall clock |
//! | `stream` | uint32 | (N) | whose frame: an index into `streams` |
//! | `clock` | str | (N) | `unsynced`, `synced` or `stepped` |
//! | `missing` | str | (N) | empty where there is a frame |
//! | `streams` | str | (S) | device, sensor and boot with a slash between |

use super::rows::{Out, Rows};
use crate::error::ExportError;
use crate::npz::{Archive, header};
use amg8833::word;
use grideye_frame::{PIXELS, Reading};
use grideye_recording::{Record, StreamId};
use std::io::Write;

/// Rows whose arrays stay below the 4 GB of an archive without the 64-bit extension.
const ROWS_MAX: usize = 8_000_000;

/// The rows, without the names that they share.
#[derive(Default)]
struct Held {
    streams: Vec<StreamId>,
    rows: Vec<(u32, Record)>,
}

pub(super) fn write(rows: Rows<'_>, out: &mut dyn Out) -> Result<String, ExportError> {
    let held = Held::of(rows)?;
    let mut archive = Archive::new(out);
    let count = held.rows.len();
    let each = format!("({count},)");
    archive.begin("frames.npy", &header("<f4", &format!("({count}, 8, 8)")))?;
    for (_, record) in &held.rows {
        archive.add(&pixels(record))?;
    }
    archive.end()?;
    held.array(
        &mut archive,
        "thermistor_c.npy",
        "<f4",
        &each,
        |_, record| thermistor(record).to_le_bytes(),
    )?;
    held.array(&mut archive, "seq.npy", "<u8", &each, |_, record| {
        record.seq.to_le_bytes()
    })?;
    held.array(&mut archive, "t_boot_ns.npy", "<u8", &each, |_, record| {
        record.stamp.t_boot_ns.to_le_bytes()
    })?;
    held.array(&mut archive, "t_utc_ns.npy", "<i8", &each, |_, record| {
        record.stamp.t_utc_ns.to_le_bytes()
    })?;
    held.array(&mut archive, "stream.npy", "<u4", &each, |stream, _| {
        stream.to_le_bytes()
    })?;
    let clocks = held
        .rows
        .iter()
        .map(|(_, record)| record.stamp.clock.name());
    texts(&mut archive, "clock.npy", &clocks.collect::<Vec<_>>())?;
    let reasons = held.rows.iter().map(|(_, record)| reason(record));
    texts(&mut archive, "missing.npy", &reasons.collect::<Vec<_>>())?;
    let streams = held.streams.iter();
    let names: Vec<String> = streams
        .map(|stream| format!("{}/{}/{}", stream.device, stream.sensor, stream.boot))
        .collect();
    texts(&mut archive, "streams.npy", &names)?;
    archive.finish()?;
    Ok(format!("{count} rows"))
}

impl Held {
    fn of(rows: Rows<'_>) -> Result<Self, ExportError> {
        let mut held = Self::default();
        for row in rows {
            let row = row?;
            let known = held
                .streams
                .iter()
                .rposition(|stream| *stream == row.stream);
            let stream = known.unwrap_or_else(|| {
                held.streams.push(row.stream);
                held.streams.len() - 1
            });
            if held.rows.len() == ROWS_MAX {
                return Err(ExportError::LongRecording { rows_max: ROWS_MAX });
            }
            held.rows.push((u32::try_from(stream)?, row.record));
        }
        Ok(held)
    }

    fn array<const N: usize>(
        &self,
        archive: &mut Archive<impl Write>,
        name: &'static str,
        kind: &str,
        shape: &str,
        bytes: impl Fn(u32, &Record) -> [u8; N],
    ) -> Result<(), ExportError> {
        archive.begin(name, &header(kind, shape))?;
        for (stream, record) in &self.rows {
            archive.add(&bytes(*stream, record))?;
        }
        archive.end()
    }
}

fn pixels(record: &Record) -> [u8; PIXELS * 4] {
    let mut bytes = [0; PIXELS * 4];
    let celsius = |index: usize| match &record.reading {
        Reading::Frame(frame) => word::pixel_celsius(frame.pixels[index]).get(),
        Reading::NoData(_) => f32::NAN,
    };
    for (index, cell) in bytes.chunks_exact_mut(4).enumerate() {
        cell.copy_from_slice(&celsius(index).to_le_bytes());
    }
    bytes
}

fn thermistor(record: &Record) -> f32 {
    record.reading.frame().map_or(f32::NAN, |frame| {
        word::thermistor_celsius(frame.thermistor).get()
    })
}

fn reason(record: &Record) -> &'static str {
    match &record.reading {
        Reading::Frame(_) => "",
        Reading::NoData(reason) => reason.name(),
    }
}

/// Texts of four bytes a character, as many as the longest has.
fn texts<T: AsRef<str>>(
    archive: &mut Archive<impl Write>,
    name: &'static str,
    texts: &[T],
) -> Result<(), ExportError> {
    let lengths = texts.iter().map(|text| text.as_ref().chars().count());
    let longest = lengths.max().unwrap_or(0).max(1);
    let shape = format!("({},)", texts.len());
    archive.begin(name, &header(&format!("<U{longest}"), &shape))?;
    for text in texts {
        let characters = text.as_ref().chars().map(u32::from);
        let padded = characters.chain(std::iter::repeat(0)).take(longest);
        let bytes: Vec<u8> = padded.flat_map(u32::to_le_bytes).collect();
        archive.add(&bytes)?;
    }
    archive.end()
}
