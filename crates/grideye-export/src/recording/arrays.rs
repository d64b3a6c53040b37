//! A recording as arrays for numpy, one entry per row (N); a missing frame is NaN, and `missing` has the reason.
//!
//! | array | type | shape | holds |
//! |---|---|---|---|
//! | `frames` | float32 | (N, 8, 8) | °C, pixel 1 first, as the sensor numbers them |
//! | `thermistor_c` | float32 | (N) | °C; NaN if not known |
//! | `seq` | uint64 | (N) | the sensor frame's number |
//! | `t_boot_ns` | uint64 | (N) | the device's clock since it started |
//! | `t_utc_ns` | int64 | (N) | the device's wall clock |
//! | `stream` | uint32 | (N) | the row's stream: an index into `streams` |
//! | `clock` | str | (N) | `unsynced`, `synced` or `stepped` |
//! | `missing` | str | (N) | empty if there is a frame |
//! | `labels` | str | (N, L) | what else the recording says; absent without labels |
//! | `label_names` | str | (L) | the names of these columns |
//! | `streams` | str | (S) | device, sensor and boot, separated by slashes |

use super::rows::{Out, Rows};
use crate::error::ExportError;
use crate::npz::Archive;
use amg8833::word;
use grideye_frame::{PIXELS, Reading};
use grideye_recording::{Record, StreamId};

/// Maximum rows: keeps the archive below the 4 GB limit without the 64-bit extension.
const ROWS_MAX: usize = 8_000_000;

/// The rows, each with the index of its stream.
#[derive(Default)]
struct Held {
    streams: Vec<StreamId>,
    rows: Vec<(u32, Record)>,
    labels: Vec<String>,
}

pub(super) fn write(rows: Rows<'_>, out: &mut dyn Out) -> Result<String, ExportError> {
    let label_names = rows.labels.to_vec();
    let held = Held::of(rows)?;
    let mut archive = Archive::new(out);
    let count = held.rows.len();
    let records = || held.rows.iter().map(|(_, record)| record);
    let each = [count];
    archive.array("frames.npy", "<f4", &[count, 8, 8], records().map(pixels))?;
    let thermistors = records().map(|record| thermistor(record).to_le_bytes());
    archive.array("thermistor_c.npy", "<f4", &each, thermistors)?;
    let seqs = records().map(|record| record.seq.to_le_bytes());
    archive.array("seq.npy", "<u8", &each, seqs)?;
    let boots_ns = records().map(|record| record.stamp.t_boot_ns.to_le_bytes());
    archive.array("t_boot_ns.npy", "<u8", &each, boots_ns)?;
    let walls_ns = records().map(|record| record.stamp.t_utc_ns.to_le_bytes());
    archive.array("t_utc_ns.npy", "<i8", &each, walls_ns)?;
    let streams = held.rows.iter().map(|(stream, _)| stream.to_le_bytes());
    archive.array("stream.npy", "<u4", &each, streams)?;
    let clocks: Vec<&str> = records().map(|record| record.stamp.clock.name()).collect();
    archive.texts("clock.npy", &each, &clocks)?;
    let reasons: Vec<&str> = records().map(reason).collect();
    archive.texts("missing.npy", &each, &reasons)?;
    let streams = held.streams.iter();
    let names: Vec<String> = streams
        .map(|stream| format!("{}/{}/{}", stream.device, stream.sensor, stream.boot))
        .collect();
    archive.texts("streams.npy", &[names.len()], &names)?;
    if !label_names.is_empty() {
        let sides = [count, label_names.len()];
        archive.texts("labels.npy", &sides, &held.labels)?;
        archive.texts("label_names.npy", &sides[1..], &label_names)?;
    }
    archive.finish()?;
    Ok(format!("{count} rows"))
}

impl Held {
    fn of(rows: Rows<'_>) -> Result<Self, ExportError> {
        let mut held = Self::default();
        let width = rows.labels.len();
        for row in rows {
            let row = row?;
            let mut known = held.streams.iter();
            let known = known.rposition(|stream| *stream == row.stream);
            let stream = known.unwrap_or_else(|| {
                held.streams.push(row.stream);
                held.streams.len() - 1
            });
            if held.rows.len() == ROWS_MAX {
                return Err(ExportError::LongRecording { rows_max: ROWS_MAX });
            }
            held.rows.push((u32::try_from(stream)?, row.record));
            let mut labels = row.labels;
            labels.resize(width, String::new());
            held.labels.extend(labels);
        }
        Ok(held)
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
    let thermistor = record.reading.frame().and_then(|frame| frame.thermistor);
    thermistor.map_or(f32::NAN, |word| word::thermistor_celsius(word).get())
}

fn reason(record: &Record) -> &'static str {
    match &record.reading {
        Reading::Frame(_) => "",
        Reading::NoData(reason) => reason.name(),
    }
}
