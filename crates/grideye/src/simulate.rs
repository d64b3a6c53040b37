//! `grideye simulate`: what a sensor of a scene measures, and what the room looks like.

use crate::cli::Simulate;
use crate::exit::{Outcome, bad_input};
use crate::export;
use crate::output::outln;
use crate::{files, progress};
use anyhow::Result;
use grideye_export::film::Film;
use grideye_plan::drawing::{self, Drawing};
use grideye_scene::{Image, Scene, Simulator};
use std::path::Path;
use std::time::Duration;

/// Frames of a scene in which nothing moves: as many as the paper's static protocol takes.
const STATIC_FRAMES: u32 = 10;

pub(crate) fn run(options: &Simulate) -> Result<Outcome> {
    let loaded = files::load_scene_as(options.model, Some(&options.scene))?;
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
    let simulator = options.method.simulate()(&scene, &name).map_err(bad_input)?;
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
    let film = Film {
        scene: files::stem(&options.scene),
        sensor: &sensor.name,
        seed: options.seed,
        columns: sensor.columns,
        rows: sensor.rows,
        frames,
        sampling_hz: sensor.sampling_hz,
        starts_utc_ns: scene.starts_utc().map(|utc| utc.ns),
        ambient: scene.ambient(),
        frame: &|index| {
            let time = sensor.frame_time(index);
            (time, simulator.noisy(time, options.seed).celsius)
        },
    };
    export::write_film(&film, out)
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
