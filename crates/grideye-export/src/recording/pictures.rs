//! Images of a recording of one sensor; missing frames are skipped, which the times below the images show.

use super::rows::{Out, Rows};
use crate::error::ExportError;
use crate::film::{Film, FilmFormat};
use amg8833::word;
use grideye_frame::{COLUMNS, Celsius, ROWS, RecordedFrame};
use grideye_recording::StreamId;
use std::time::Duration;

pub(super) fn write(
    rows: Rows<'_>,
    mut out: &mut dyn Out,
    draw: FilmFormat,
) -> Result<String, ExportError> {
    let (stream, frames) = one_stream(rows)?;
    let (first_ns, _) = frames.first().ok_or(ExportError::NoFrame)?;
    let frame = |index: u32| {
        let frame = usize::try_from(index).ok().and_then(|at| frames.get(at));
        let (at_ns, raw) = frame.unwrap_or(&frames[0]);
        (
            Duration::from_nanos(at_ns.saturating_sub(*first_ns)),
            celsius(raw),
        )
    };
    let film = Film {
        scene: format!("{} {}", stream.device, stream.boot),
        sensor: &stream.sensor,
        seed: 0,
        columns: COLUMNS,
        rows: ROWS,
        frames: u32::try_from(frames.len())?,
        sampling_hz: sampling_hz(&frames),
        starts_utc_ns: None,
        // Not drawn.
        ambient: Celsius::default(),
        frame: &frame,
    };
    draw(&film, &mut out, &|| ())
}

fn one_stream(rows: Rows<'_>) -> Result<(StreamId, Vec<(u64, RecordedFrame)>), ExportError> {
    let mut only: Option<StreamId> = None;
    let mut frames = Vec::new();
    for row in rows {
        let row = row?;
        let stream = only.get_or_insert_with(|| row.stream.clone());
        if *stream != row.stream {
            return Err(ExportError::SeveralStreams {
                device: stream.device.clone(),
                sensor: stream.sensor.clone(),
            });
        }
        let frame = row.record.reading.frame();
        frames.extend(frame.map(|frame| (row.record.stamp.t_boot_ns, *frame)));
    }
    let nobody = || StreamId {
        device: String::new(),
        sensor: String::new(),
        boot: String::new(),
    };
    Ok((only.unwrap_or_else(nobody), frames))
}

/// Frames per second from the median interval; 10 without any.
fn sampling_hz(frames: &[(u64, RecordedFrame)]) -> f64 {
    let mut intervals: Vec<u64> = frames
        .windows(2)
        .map(|pair| pair[1].0.saturating_sub(pair[0].0))
        .filter(|interval| *interval > 0)
        .collect();
    intervals.sort_unstable();
    intervals.get(intervals.len() / 2).map_or(10.0, |median| {
        1.0 / Duration::from_nanos(*median).as_secs_f64()
    })
}

fn celsius(frame: &RecordedFrame) -> Vec<f64> {
    let celsius = |pixel| f64::from(word::pixel_celsius(pixel).get());
    frame.pixels.iter().copied().map(celsius).collect()
}
