//! From the command line to the sensors: reads the scene, the recording, the profile and the script of faults.

use crate::cli::Emulate;
use crate::exit::bad_input;
use crate::{files, recordings};
use amg8833_emulator::script::Script;
use anyhow::{Result, anyhow};
use grideye_inputs::profile_or_built_in;
use grideye_rig::{AtEnd, Build, Part, Replay, Shown, World, planned, recorded};
use std::path::PathBuf;
use std::sync::Arc;

pub(super) struct Prepared {
    pub(super) parts: Vec<Part>,
    pub(super) shown: String,
}

pub(super) fn faults(options: &Emulate) -> Result<Option<Script>> {
    let read = |path: &PathBuf| grideye_inputs::faults(path, options.seed);
    let script = options.faults.as_ref().map(read).transpose();
    script.map_err(bad_input)
}

pub(super) fn prepare(options: &Emulate, world: &Arc<World>) -> Result<Prepared> {
    let shown = shown(options)?;
    let profile = options.profile.as_deref().map(profile_or_built_in);
    let profile = profile.transpose().map_err(bad_input)?;
    check(options, &shown, profile.is_some())?;
    let alone = (options.device, options.address);
    let planned = planned(&options.sensors, alone, shown.names().as_deref());
    let build = Build {
        seed: options.seed,
        profile,
        clock_error_ppm: options.clock_error,
        at_end: options.at_end,
    };
    Ok(Prepared {
        parts: grideye_rig::parts(&shown, world, planned.map_err(asked)?, &build)
            .map_err(bad_input)?,
        shown: named(options),
    })
}

fn asked(error: String) -> anyhow::Error {
    bad_input(anyhow!(error))
}

fn shown(options: &Emulate) -> Result<Shown> {
    if let Some(path) = &options.recording {
        let streams = recordings::load_streams(path)?;
        recordings::say_doubt(path, streams.values().flatten());
        recordings::say_what_stands_for_the_thermistor(streams.values().flatten());
        let sensors =
            recorded(streams).map_err(|error| bad_input(anyhow!("{} {error}", path.display())))?;
        return Ok(Shown::Recording {
            replay: options.replay.unwrap_or(Replay::Times),
            sensors,
        });
    }
    if let Some(celsius) = options.constant {
        return Ok(Shown::Constant(celsius));
    }
    let path = options.scene.clone().unwrap_or_default();
    let scene = files::load_scene(&path)?.scene;
    Ok(Shown::Scene(Box::new(scene)))
}

fn named(options: &Emulate) -> String {
    let path = options.recording.as_ref().or(options.scene.as_ref());
    match (path, options.constant) {
        (None, Some(celsius)) => format!("{celsius} °C"),
        (path, _) => path.map_or_else(String::new, |path| path.display().to_string()),
    }
}

fn check(options: &Emulate, shown: &Shown, has_profile: bool) -> Result<()> {
    match shown {
        Shown::Scene(_) | Shown::Constant(_) if options.replay.is_some() => {
            Err(bad_input(anyhow!(
                "--replay says when the frames of a recording come, and there is none\nhint: leave out --replay, or name a --recording"
            )))
        }
        Shown::Recording { .. } if has_profile => Err(bad_input(anyhow!(
            "a recording has the noise of the sensor that recorded it, and --profile would add another's\nhint: leave out --profile; --clock-error sets the sensor's clock"
        ))),
        Shown::Scene(scene) if scene.is_static() && options.at_end != AtEnd::Hold => {
            let named = named(options);
            Err(bad_input(anyhow!(
                "nothing moves in {named}, so it has no end\nhint: leave out --at-end"
            )))
        }
        _ => Ok(()),
    }
}
