//! Arrays for numpy, one entry per row (N); a missing frame is NaN, and `missing` has the reason.
//!
//! | array | type | shape | holds |
//! |---|---|---|---|
//! | `frames` | float32 | (N, rows, columns) | °C, pixel 1 first, as the sensor numbers them; simulated ones not rounded to its steps |
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
//! | `time_s` | float64 | (N) | of simulated frames: seconds since the scene's start |
//! | `metadata` | str | () | of simulated frames: JSON with scene, sensor, seed, sampling_hz, program |

use super::rows::{Out, Row, Rows, check_length};
use crate::error::ExportError;
use crate::npy::Archive;
use grideye_recording::StreamId;
use std::time::Duration;

/// The columns of all rows, as bytes and texts.
#[derive(Default)]
struct Columns {
    count: usize,
    frames: Vec<u8>,
    thermistor_c: Vec<u8>,
    seq: Vec<u8>,
    t_boot_ns: Vec<u8>,
    time_s: Vec<u8>,
    t_utc_ns: Vec<u8>,
    stream: Vec<u8>,
    streams: Vec<StreamId>,
    clock: Vec<&'static str>,
    missing: Vec<&'static str>,
    labels: Vec<String>,
}

pub(super) fn write(mut rows: Rows<'_>, out: &mut dyn Out) -> Result<String, ExportError> {
    let (size, labels, about) = (rows.size, rows.labels, rows.about.take());
    let mut held = Columns::default();
    for row in rows {
        held.add(row?, size, labels.len())?;
    }
    let count = held.count;
    let each = [count];
    let mut archive = Archive::new(out);
    archive.array("frames", "<f4", &[count, size.1, size.0], &held.frames)?;
    for (name, dtype, bytes) in [
        ("thermistor_c", "<f4", &held.thermistor_c),
        ("seq", "<u8", &held.seq),
        ("t_boot_ns", "<u8", &held.t_boot_ns),
        ("t_utc_ns", "<i8", &held.t_utc_ns),
        ("stream", "<u4", &held.stream),
    ] {
        archive.array(name, dtype, &each, bytes)?;
    }
    archive.texts("clock", &each, &held.clock)?;
    archive.texts("missing", &each, &held.missing)?;
    let streams = held.streams.iter();
    let streams = streams.map(|one| format!("{}/{}/{}", one.device, one.sensor, one.boot));
    let streams: Vec<String> = streams.collect();
    archive.texts("streams", &[streams.len()], &streams)?;
    if !labels.is_empty() {
        archive.texts("labels", &[count, labels.len()], &held.labels)?;
        archive.texts("label_names", &[labels.len()], labels)?;
    }
    if let Some(about) = about {
        archive.array("time_s", "<f8", &each, &held.time_s)?;
        archive.texts("metadata", &[], &[about])?;
    }
    archive.finish()?;
    Ok(format!("{count} rows"))
}

impl Columns {
    fn add(&mut self, row: Row, size: (usize, usize), labels: usize) -> Result<(), ExportError> {
        self.count += 1;
        check_length(self.count, size)?;
        self.missing.push(row.missing().unwrap_or_default());
        let pixels_c = row.pixels_c;
        let pixels_c = pixels_c.unwrap_or_else(|_missing| vec![f32::NAN; size.0 * size.1]);
        let bytes = pixels_c.into_iter().flat_map(f32::to_le_bytes);
        self.frames.extend(bytes);
        let thermistor_c = row.thermistor_c.unwrap_or(f32::NAN);
        self.thermistor_c.extend(thermistor_c.to_le_bytes());
        self.seq.extend(row.seq.to_le_bytes());
        self.t_boot_ns.extend(row.stamp.t_boot_ns.to_le_bytes());
        let time = Duration::from_nanos(row.stamp.t_boot_ns);
        self.time_s.extend(time.as_secs_f64().to_le_bytes());
        self.t_utc_ns.extend(row.stamp.t_utc_ns.to_le_bytes());
        self.clock.push(row.stamp.clock.name());
        let known = self
            .streams
            .iter()
            .rposition(|stream| *stream == row.stream);
        let stream = known.unwrap_or_else(|| {
            self.streams.push(row.stream);
            self.streams.len() - 1
        });
        self.stream.extend(u32::try_from(stream)?.to_le_bytes());
        self.labels.extend(row.labels);
        self.labels.resize(self.count * labels, String::new());
        Ok(())
    }
}
