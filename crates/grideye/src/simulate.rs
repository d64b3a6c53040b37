//! `grideye simulate`: what a sensor of a scene measures, and what the room looks like.

use crate::cli::{self, Simulate};
use crate::exit::{Outcome, bad_input};
use crate::export;
use crate::output::outln;
use crate::{files, progress};
use anyhow::{Result, anyhow};
use grideye_export::film::Film;
use grideye_plan::drawing::{self, Drawing};
use grideye_scene::{Image, Model, Scene, Sensor, Simulator};
use std::path::Path;
use std::time::Duration;

/// Frames of a scene in which nothing moves: as many as the paper's static protocol takes.
const STATIC_FRAMES: u32 = 10;

/// Writes the simulated frames and the view of the room; asked for neither, it prints the first frame.
pub(crate) fn run(options: &Simulate) -> Result<Outcome> {
    let loaded = files::load_scene_as(options.model.map(model), Some(&options.scene))?;
    files::keep_apart(
        [&options.scene].into_iter().chain(&loaded.trajectories),
        options.out.iter().chain(&options.view),
    )?;
    let scene = loaded.scene;
    if let Some(view) = &options.view {
        check_extension(view, "svg")?;
        draw(options, &scene, view)?;
        if options.out.is_none() {
            return Ok(Outcome::Done);
        }
    }
    let name = files::sensor_name(&scene, options.sensor.as_deref())?;
    let simulator = options.method.simulator(&scene, &name).map_err(bad_input)?;
    let sensor = simulator.sensor();
    match &options.out {
        Some(out) => write(options, &scene, &simulator, sensor, out)?,
        None => print(&simulator.noisy(Duration::ZERO, options.seed))?,
    }
    Ok(Outcome::Done)
}

const fn model(model: cli::Model) -> Model {
    match model {
        cli::Model::Paper => Model::Paper,
        cli::Model::Physical => Model::Physical,
    }
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

fn write(
    options: &Simulate,
    scene: &Scene,
    simulator: &Simulator,
    sensor: &Sensor,
    out: &Path,
) -> Result<()> {
    let frames = options.frames.unwrap_or_else(|| match scene.is_static() {
        true => STATIC_FRAMES,
        false => u32::try_from(scene.frame_count(sensor)).unwrap_or(u32::MAX),
    });
    let film = Film {
        scene: name_of(&options.scene),
        sensor: &sensor.name,
        seed: options.seed,
        columns: sensor.columns,
        rows: sensor.rows,
        frames,
        sampling_hz: sensor.sampling_hz,
        ambient: scene.ambient(),
        frame: &|index| {
            let time = sensor.frame_time(index);
            (time, simulator.noisy(time, options.seed).celsius)
        },
    };
    export::write_film(&film, out)
}

/// The room as the paper shows it.
fn draw(options: &Simulate, scene: &Scene, view: &Path) -> Result<()> {
    let sampled_by = match &options.sensor {
        Some(name) => Some(scene.sensor(name).map_err(bad_input)?),
        None => None,
    };
    let title = name_of(&options.scene);
    let svg = drawing::svg(
        scene,
        &Drawing {
            sampled_by,
            ..Drawing::new(&title)
        },
    );
    files::write_text(view, &svg)?;
    progress::say(&format!("wrote the view of the room to {}", view.display()));
    Ok(())
}

fn name_of(scene: &Path) -> String {
    scene
        .file_stem()
        .map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

fn check_extension(path: &Path, wanted: &str) -> Result<()> {
    if path
        .extension()
        .is_some_and(|extension| extension == wanted)
    {
        return Ok(());
    }
    Err(bad_input(anyhow!(
        "cannot tell what to write from the name {}\nhint: end it with .{wanted}",
        path.display()
    )))
}
