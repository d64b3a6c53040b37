//! `grideye simulate`: what a sensor of a scene measures, and what the room looks like.

use crate::cli::Simulate;
use crate::exit::{Outcome, bad_input};
use crate::export;
use crate::output::outln;
use crate::{files, progress};
use anyhow::Result;
use grideye_export::recording::{Row, Rows};
use grideye_frame::{COLUMNS, ROWS};
use grideye_plan::drawing::{self, Drawing};
use grideye_recording::{ClockState, Stamp, StreamId};
use grideye_scene::count::single;
use grideye_scene::{Image, Scene, Simulator};
use serde_json::json;
use std::path::Path;
use std::time::Duration;

/// Frames of a scene in which nothing moves: as many as the paper's static protocol takes.
const STATIC_FRAMES: u32 = 10;

pub(crate) fn run(options: &Simulate) -> Result<Outcome> {
    let loaded = files::load_scene_as(options.model, &options.scene)?;
    files::keep_apart(&loaded.files, options.out.iter().chain(&options.view))?;
    files::say_unseen(&loaded, options.sensor.as_deref());
    let scene = loaded.scene;
    if let Some(view) = &options.view {
        if files::end(view) != Some("svg") {
            return Err(files::unknown_end(view, ".svg"));
        }
        draw(options, &scene, view)?;
        if options.out.is_none() {
            return Ok(Outcome::Done);
        }
    }
    let name = files::sensor_name(&scene, options.sensor.as_deref())?;
    let simulator = Simulator::new(&scene, &name).map_err(bad_input)?;
    match &options.out {
        Some(out) => write(options, &scene, &simulator, out)?,
        None => print(&simulator.noisy(Duration::ZERO, options.seed))?,
    }
    Ok(Outcome::Done)
}

fn print(image: &Image) -> Result<()> {
    for row in 0..image.rows {
        let cells: Vec<String> = (0..image.columns)
            .map(|column| format!("{:6.2}", image.at(row, column)))
            .collect();
        outln!("{}", cells.join(" "))?;
    }
    Ok(())
}

fn write(options: &Simulate, scene: &Scene, simulator: &Simulator, out: &Path) -> Result<()> {
    let sensor = simulator.sensor();
    let frames = options.frames.unwrap_or_else(|| match scene.is_static() {
        true => STATIC_FRAMES,
        false => u32::try_from(scene.frame_count(sensor)).unwrap_or(u32::MAX),
    });
    let size = (sensor.columns, sensor.rows);
    if files::end(out) == Some("csv") && size != (COLUMNS, ROWS) {
        progress::say(&format!(
            "a recording holds 8 x 8 pixels, and {} has {} x {}: writing a table of degrees instead",
            sensor.name, sensor.columns, sensor.rows
        ));
    }
    let bar = progress::bar(u64::from(frames), "simulating");
    let about = json!({
        "scene": files::stem(&options.scene),
        "sensor": sensor.name,
        "seed": options.seed,
        "sampling_hz": sensor.sampling_hz,
        "program": concat!("grideye ", env!("CARGO_PKG_VERSION")),
    });
    let mut rows = (0..frames).map(|index| {
        bar.inc(1);
        Ok(row(options.seed, scene, simulator, index))
    });
    let rows = Rows {
        size,
        about: Some(about.to_string()),
        labels: &[],
        rows: &mut rows,
    };
    export::write(rows, out, None)?;
    bar.finish_and_clear();
    Ok(())
}

/// A simulated frame. It has a wall clock only if the scene has a start in UTC.
fn row(seed: u64, scene: &Scene, simulator: &Simulator, index: u32) -> Row {
    let sensor = simulator.sensor();
    let time = sensor.frame_time(index);
    let since_ns = i64::try_from(time.as_nanos()).unwrap_or(i64::MAX);
    let (t_utc_ns, clock) = match scene.starts_utc() {
        Some(starts) => (starts.ns.saturating_add(since_ns), ClockState::Synced),
        None => (0, ClockState::Unsynced),
    };
    let celsius = simulator.noisy(time, seed).celsius;
    Row {
        stream: StreamId {
            device: "simulator".to_owned(),
            sensor: sensor.name.clone(),
            boot: format!("seed-{seed}"),
        },
        seq: u64::from(index),
        stamp: Stamp {
            t_boot_ns: since_ns.unsigned_abs(),
            t_utc_ns,
            clock,
        },
        t_arrival_ns: None,
        labels: Vec::new(),
        thermistor_c: Some(scene.ambient().get()),
        pixels_c: Ok(celsius.into_iter().map(single).collect()),
    }
}

fn draw(options: &Simulate, scene: &Scene, view: &Path) -> Result<()> {
    let named = options.sensor.as_deref().map(|name| scene.sensor(name));
    let title = files::stem(&options.scene);
    let how = Drawing {
        sampled_by: named.transpose().map_err(bad_input)?,
        ..Drawing::new(&title)
    };
    files::write_text(view, &drawing::svg(scene, &how))?;
    progress::say(&format!("wrote the view of the room to {}", view.display()));
    Ok(())
}
