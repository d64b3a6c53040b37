//! `grideye simulate`: what a sensor of a scene measures.

use crate::cli::Simulate;
use crate::exit::{Outcome, bad_input};
use crate::{files, progress};
use amg8833::word;
use anyhow::{Context as _, Result, anyhow};
use grideye_frame::{Celsius, PIXELS, PixelWord, RawFrame, Reading};
use grideye_recording::csv::Writer;
use grideye_recording::{ClockState, Record, Row, Stamp, StreamId};
use grideye_scene::{Image, Scene, Simulator};
use std::path::Path;
use std::time::Duration;

/// Frames of a scene in which nothing moves: as many as the paper's static protocol takes.
const STATIC_FRAMES: u32 = 10;

/// Writes the simulated frames as a recording, or prints the first.
pub(crate) fn run(options: &Simulate) -> Result<Outcome> {
    let scene = files::load_scene(Some(&options.scene))?.scene;
    let name = files::sensor_name(&scene, options.sensor.as_deref())?;
    let simulator = files::simulator(&scene, Some(&name))?;
    let sensor = scene.sensor(&name)?;
    let frames = options.frames.unwrap_or_else(|| match scene.is_static() {
        true => STATIC_FRAMES,
        false => u32::try_from(scene.frame_count(sensor)).unwrap_or(u32::MAX),
    });
    let times = (0..frames).map(|index| sensor.frame_time(index));
    match &options.out {
        Some(out) => write(options, &scene, &simulator, &name, out, times)?,
        None => print(&simulator.noisy(Duration::ZERO, options.seed)),
    }
    Ok(Outcome::Done)
}

fn print(image: &Image) {
    for row in 0..image.rows {
        let cells: Vec<String> = (0..image.columns)
            .map(|column| format!("{:6.2}", image.at(row, column)))
            .collect();
        println!("{}", cells.join(" "));
    }
}

fn write(
    options: &Simulate,
    scene: &Scene,
    simulator: &Simulator,
    sensor: &str,
    out: &Path,
    times: impl ExactSizeIterator<Item = Duration>,
) -> Result<()> {
    if out.extension().is_none_or(|extension| extension != "csv") {
        return Err(bad_input(anyhow!(
            "cannot tell what to write from the name {}\nhint: end it with .csv",
            out.display()
        )));
    }
    let stream = StreamId {
        device: "simulator".to_owned(),
        sensor: sensor.to_owned(),
        boot: format!("seed-{}", options.seed),
    };
    let count = times.len();
    let bar = progress::bar(u64::try_from(count).unwrap_or(u64::MAX), "simulating");
    files::write_whole(out, |file| {
        let mut writer = Writer::new(file)?;
        for (seq, time) in (0..).zip(times) {
            let image = simulator.noisy(time, options.seed);
            let record = record(seq, time, &image, scene.ambient())?;
            writer.write(&Row {
                stream: stream.clone(),
                record,
                t_arrival_ns: None,
            })?;
            bar.inc(1);
        }
        writer.finish()?;
        Ok(())
    })?;
    bar.finish_and_clear();
    progress::say(&format!("wrote {count} frames to {}", out.display()));
    Ok(())
}

/// A simulated image as the sensor would have reported it: in its own steps. Simulated frames have no wall clock.
fn record(seq: u64, time: Duration, image: &Image, thermistor: Celsius) -> Result<Record> {
    let frame = image.to_frame(thermistor).ok_or_else(|| {
        bad_input(anyhow!(
            "the sensor has {} x {} pixels, and a recording holds 8 x 8\nhint: leave --out away to print the frame",
            image.columns,
            image.rows
        ))
    })?;
    let mut raw = RawFrame {
        thermistor: word::thermistor_word(frame.thermistor).context("the room's temperature")?,
        pixels: [PixelWord::default(); PIXELS],
    };
    for (word, celsius) in raw.pixels.iter_mut().zip(frame.pixels) {
        *word = word::pixel_word(celsius).context("a simulated pixel")?;
    }
    Ok(Record {
        seq,
        stamp: Stamp {
            t_boot_ns: u64::try_from(time.as_nanos()).unwrap_or(u64::MAX),
            t_utc_ns: 0,
            clock: ClockState::Unsynced,
        },
        reading: Reading::Frame(raw),
    })
}
