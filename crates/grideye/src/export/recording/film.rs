//! Pictures of a recording of one sensor; what is missing is left out, and the time below each picture shows it.

use super::{Out, Rows};
use crate::exit::bad_input;
use crate::export::Film;
use amg8833::word;
use anyhow::{Result, anyhow};
use grideye_frame::{COLUMNS, ROWS, RawFrame};
use grideye_recording::StreamId;
use grideye_scene::Image;
use std::io::Write;
use std::time::Duration;

/// Draws the film, calls back after each frame, and says what was drawn.
type Drawing = fn(&Film<'_>, &mut dyn Write, &dyn Fn()) -> Result<String>;

pub(super) fn write(rows: Rows<'_>, out: Out<'_, '_>, draw: Drawing) -> Result<String> {
    let (stream, frames) = one_stream(rows)?;
    let (first_ns, first) = frames.first().ok_or_else(|| {
        bad_input(anyhow!(
            "the recording holds no frame\nhint: all of its rows say that a frame is missing, or it has no rows"
        ))
    })?;
    let frame = |index: u32| {
        let frame = usize::try_from(index).ok().and_then(|at| frames.get(at));
        let (at_ns, raw) = frame.unwrap_or(&frames[0]);
        (
            Duration::from_nanos(at_ns.saturating_sub(*first_ns)),
            image(raw),
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
        ambient: word::thermistor_celsius(first.thermistor),
        frame: &frame,
    };
    draw(&film, out, &|| ())
}

fn one_stream(rows: Rows<'_>) -> Result<(StreamId, Vec<(u64, RawFrame)>)> {
    let mut only: Option<StreamId> = None;
    let mut frames = Vec::new();
    for row in rows {
        let row = row?;
        let stream = only.get_or_insert_with(|| row.stream.clone());
        if *stream != row.stream {
            return Err(bad_input(anyhow!(
                "the recording holds several streams, and a picture shows one\nhint: choose one with --sensor, for example --sensor {}/{}",
                stream.device,
                stream.sensor
            )));
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

/// Frames a second by the interval that is most usual; 10 where there is none.
fn sampling_hz(frames: &[(u64, RawFrame)]) -> f64 {
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

fn image(frame: &RawFrame) -> Image {
    let celsius = |pixel| f64::from(word::pixel_celsius(pixel).get());
    Image {
        columns: COLUMNS,
        rows: ROWS,
        celsius: frame.pixels.iter().copied().map(celsius).collect(),
    }
}
