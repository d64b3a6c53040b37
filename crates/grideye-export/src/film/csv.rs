//! A film as CSV: a recording if the sensor has 8 x 8 pixels, otherwise a table of degrees.

use super::source::Film;
use crate::error::ExportError;
use crate::npz::single;
use amg8833::word;
use grideye_frame::{Celsius, PIXELS, PixelWord, Reading, RecordedFrame};
use grideye_recording::csv::Writer;
use grideye_recording::{ClockState, Record, Row, Stamp, StreamId};
use std::io::Write;
use std::time::Duration;

/// Writes a recording as the sensor would have made it, in its own steps.
pub(super) fn recording(
    film: &Film<'_>,
    out: &mut dyn Write,
    tick: &dyn Fn(),
) -> Result<String, ExportError> {
    let stream = StreamId {
        device: "simulator".to_owned(),
        sensor: film.sensor.to_owned(),
        boot: format!("seed-{}", film.seed),
    };
    let mut writer = Writer::new(out)?;
    for index in 0..film.frames {
        let (time, frame) = (film.frame)(index);
        writer.write(&Row {
            stream: stream.clone(),
            record: record(film, u64::from(index), time, &frame)?,
            t_arrival_ns: None,
            labels: Vec::new(),
        })?;
        tick();
    }
    writer.finish()?;
    Ok(format!("{} frames", film.frames))
}

/// Writes one row per frame: its number, its time, and each pixel in °C, row by row from the top left.
pub(super) fn table(
    film: &Film<'_>,
    out: &mut dyn Write,
    tick: &dyn Fn(),
) -> Result<String, ExportError> {
    let mut line = String::from("seq,time_s");
    for row in 0..film.rows {
        for column in 0..film.columns {
            line.push_str(&format!(",r{row}c{column}_c"));
        }
    }
    writeln!(out, "{line}")?;
    for index in 0..film.frames {
        let (time, frame) = (film.frame)(index);
        line.clear();
        line.push_str(&format!("{index},{:.6}", time.as_secs_f64()));
        for celsius in &frame {
            line.push_str(&format!(",{celsius:.3}"));
        }
        writeln!(out, "{line}")?;
        tick();
    }
    Ok(format!("a table of {} frames", film.frames))
}

/// A simulated frame as the sensor would report it. It has a wall clock only if the scene has a start in UTC.
fn record(film: &Film<'_>, seq: u64, time: Duration, frame: &[f64]) -> Result<Record, ExportError> {
    let out_of_range = |what| move |source| ExportError::OutOfRange { what, source };
    let mut raw = RecordedFrame {
        thermistor: Some(
            word::thermistor_word(film.ambient).map_err(out_of_range("the room's temperature"))?,
        ),
        pixels: [PixelWord::default(); PIXELS],
    };
    for (word, celsius) in raw.pixels.iter_mut().zip(frame) {
        *word = word::pixel_word(Celsius::new(single(*celsius)))
            .map_err(out_of_range("a simulated pixel"))?;
    }
    let since_ns = i64::try_from(time.as_nanos()).unwrap_or(i64::MAX);
    let (t_utc_ns, clock) = match film.starts_utc_ns {
        Some(starts_ns) => (starts_ns.saturating_add(since_ns), ClockState::Synced),
        None => (0, ClockState::Unsynced),
    };
    Ok(Record {
        seq,
        stamp: Stamp {
            t_boot_ns: u64::try_from(time.as_nanos()).unwrap_or(u64::MAX),
            t_utc_ns,
            clock,
        },
        reading: Reading::Frame(raw),
    })
}
