//! What the emulated sensor is shown: a scene, or a recording.

use crate::cli::Demo;
use crate::exit::bad_input;
use crate::{compare, files, recordings};
use anyhow::Result;
use grideye_frame::{RawFrame, TICK};
use grideye_rig::{Source, replay_source, scene_source};
use grideye_scene::Scene;
use grideye_validator::report::Input;
use std::path::PathBuf;

/// Frames recorded of a scene in which nothing moves: ten seconds.
const STATIC_FRAMES: u64 = 100;
/// Longest walk that is recorded, in frames: ten minutes.
const FRAMES_MAX: u64 = 6_000;

pub(super) enum Show {
    Scene(Box<SceneShow>),
    Replay(Vec<RawFrame>),
}

pub(super) struct SceneShow {
    pub(super) scene: Scene,
    pub(super) sensor: String,
    pub(super) name: String,
    pub(super) inputs: Vec<Input>,
    files: Vec<PathBuf>,
    pub(super) warnings: Vec<String>,
    pub(super) experiment: Option<u8>,
}

impl Show {
    /// Reads the scene or the recording, before anything is started.
    pub(super) fn prepare(options: &Demo) -> Result<Self> {
        if let Some(path) = &options.replay {
            return Ok(Self::Replay(recordings::load_frames(path)?));
        }
        let loaded = files::load_scene(options.scene.as_deref())?;
        let scene = loaded.scene;
        let sensor = files::sensor_name(&scene, options.sensor.as_deref())?;
        let mut inputs = compare::hashed_all(&loaded.files)?;
        let name = match &options.scene {
            Some(path) => path.display().to_string(),
            None => "scenes/experiment-1.toml".to_owned(),
        };
        if options.scene.is_none() {
            inputs.push(compare::hashed_text(&name, files::DEFAULT_SCENE));
        }
        let experiment = scene.paper_experiment();
        Ok(Self::Scene(Box::new(SceneShow {
            scene,
            sensor,
            name,
            inputs,
            files: loaded.files,
            warnings: loaded.warnings,
            experiment,
        })))
    }

    pub(super) fn files(&self) -> &[PathBuf] {
        match self {
            Self::Scene(shown) => &shown.files,
            Self::Replay(_) => &[],
        }
    }

    pub(super) fn frames(&self) -> u64 {
        match self {
            Self::Scene(shown) if shown.scene.is_static() => STATIC_FRAMES,
            Self::Scene(shown) => {
                let ticks = shown.scene.duration().as_nanos() / TICK.as_nanos();
                u64::try_from(ticks + 1).map_or(FRAMES_MAX, |frames| frames.min(FRAMES_MAX))
            }
            Self::Replay(frames) => u64::try_from(frames.len()).unwrap_or(u64::MAX),
        }
    }

    /// What the sensor's pixels are filled from.
    pub(super) fn source(&self, seed: u64) -> Result<Source> {
        match self {
            Self::Scene(shown) => {
                let simulator = files::simulator(&shown.scene, Some(&shown.sensor))?;
                scene_source(&shown.scene, simulator, seed).map_err(bad_input)
            }
            Self::Replay(frames) => Ok(replay_source(frames)),
        }
    }
}
