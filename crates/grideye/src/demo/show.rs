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

/// What is shown.
pub(super) enum Show {
    /// A scene, and afterwards its comparison.
    Scene(Box<SceneShow>),
    /// A recording, and afterwards the count.
    Replay(Replay),
}

/// A scene and one of its sensors.
pub(super) struct SceneShow {
    pub(super) scene: Scene,
    pub(super) sensor: String,
    pub(super) name: String,
    pub(super) inputs: Vec<Input>,
    /// The files that the scene names.
    files: Vec<PathBuf>,
    pub(super) warnings: Vec<String>,
    pub(super) experiment: Option<u8>,
}

/// A recording's frames.
pub(super) struct Replay {
    pub(super) frames: Vec<RawFrame>,
}

impl Show {
    /// Reads the scene or the recording, before anything is started.
    pub(super) fn prepare(options: &Demo) -> Result<Self> {
        if let Some(path) = &options.replay {
            return Ok(Self::Replay(Replay {
                frames: recordings::load_frames(path)?,
            }));
        }
        let loaded = files::load_scene(options.scene.as_deref())?;
        let scene = loaded.scene;
        let sensor = files::sensor_name(&scene, options.sensor.as_deref())?;
        let (name, mut inputs) = match &options.scene {
            Some(path) => (path.display().to_string(), vec![compare::hashed(path)?]),
            None => {
                let name = "scenes/experiment-1.toml";
                let input = compare::hashed_text(name, files::DEFAULT_SCENE);
                (name.to_owned(), vec![input])
            }
        };
        inputs.extend(compare::hashed_all(&loaded.trajectories)?);
        let experiment = scene.paper_experiment();
        Ok(Self::Scene(Box::new(SceneShow {
            scene,
            sensor,
            name,
            inputs,
            files: loaded.trajectories,
            warnings: loaded.warnings,
            experiment,
        })))
    }

    /// The files that the scene names.
    pub(super) fn files(&self) -> &[PathBuf] {
        match self {
            Self::Scene(shown) => &shown.files,
            Self::Replay(_) => &[],
        }
    }

    /// How many frames are recorded.
    pub(super) fn frames(&self) -> u64 {
        match self {
            Self::Scene(shown) if shown.scene.is_static() => STATIC_FRAMES,
            Self::Scene(shown) => {
                let ticks = shown.scene.duration().as_nanos() / TICK.as_nanos();
                u64::try_from(ticks + 1).map_or(FRAMES_MAX, |frames| frames.min(FRAMES_MAX))
            }
            Self::Replay(replay) => u64::try_from(replay.frames.len()).unwrap_or(u64::MAX),
        }
    }

    /// What the sensor's pixels are filled from.
    pub(super) fn source(&self, seed: u64) -> Result<Source> {
        match self {
            Self::Scene(shown) => {
                let simulator = files::simulator(&shown.scene, Some(&shown.sensor))?;
                scene_source(&shown.scene, simulator, seed).map_err(bad_input)
            }
            Self::Replay(replay) => Ok(replay_source(&replay.frames)),
        }
    }
}
