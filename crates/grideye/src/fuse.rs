//! `grideye fuse`: the sensors of a scene as one of more pixels, and how near each way of it comes to the truth.

use crate::cli::Fuse;
use crate::exit::{Outcome, bad_input};
use crate::output::{out, outln};
use crate::{export, files};
use anyhow::Result;
use grideye_plan::fusion::{Comparison, SensorArray};
use grideye_scene::{Image, Scene, Sensor};

/// Fuses the frames at the scene's start, prints the table, and writes what was asked for.
pub(crate) fn run(options: &Fuse) -> Result<Outcome> {
    let loaded = files::load_scene(Some(&options.scene))?;
    files::keep_apart(
        [&options.scene].into_iter().chain(&loaded.trajectories),
        options.out.iter().chain(&options.json),
    )?;
    let scene = loaded.scene;
    let sensors = sensors(&scene, options)?;
    let array = SensorArray::new(&sensors).map_err(bad_input)?;
    let found = Comparison::new(&scene, &sensors, array, options.frames, options.seed)
        .map_err(bad_input)?;
    match &options.json {
        Some(path) if path.as_os_str() == "-" => out!("{}", found.json())?,
        Some(path) => {
            files::write_text(path, &found.json())?;
            out!("{}", found.text())?;
        }
        None => out!("{}", found.text())?,
    }
    if let Some(out) = &options.out {
        let (names, pictures): (Vec<&str>, Vec<&Image>) = found.images().unzip();
        export::write_tiles(&pictures, out)?;
        outln!(
            "pictures of {}, from the left: {}",
            out.display(),
            names.join(", ")
        )?;
    }
    Ok(Outcome::Done)
}

/// Those that were named, or all.
fn sensors<'a>(scene: &'a Scene, options: &Fuse) -> Result<Vec<&'a Sensor>> {
    if options.sensors.is_empty() {
        return Ok(scene.sensors().iter().collect());
    }
    options
        .sensors
        .iter()
        .map(|name| scene.sensor(name).map_err(bad_input))
        .collect()
}
