//! From the command line to the sensors: reads the scene, the recording and the profile, and says what is shown.

use super::machine::{Part, Wiring};
use super::plan::{self, Planned, Wish};
use super::show::{self, AtEnd, Pictures, Replay, Show, Specimen, Timeline, World};
use super::trace::TraceFile;
use crate::cli::{Emulate, Method};
use crate::exit::bad_input;
use crate::{files, recordings, sensor};
use amg8833::word;
use amg8833_emulator::script::Script;
use amg8833_emulator::{Drift, Options};
use anyhow::{Result, anyhow};
use grideye_frame::{Celsius, Frame};
use grideye_recording::Record;
use grideye_scene::Scene;
use grideye_scene::profile::Profile;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// The profiles that are built in: name and file.
const PROFILES: [(&str, &str); 3] = [
    (
        "ideal",
        include_str!("../../../../scenes/profiles/ideal.toml"),
    ),
    (
        "datasheet",
        include_str!("../../../../scenes/profiles/datasheet.toml"),
    ),
    (
        "linaige",
        include_str!("../../../../scenes/profiles/linaige.toml"),
    ),
];

/// The sensors as they are to be built in, and what they show, for people.
pub(super) struct Prepared {
    pub(super) parts: Vec<Part>,
    pub(super) shown: String,
}

/// What the buses are like: their speed, their faults, and who is told of what passes on them.
pub(super) fn wiring(options: &Emulate, prepared: &Prepared) -> Result<Wiring> {
    let script = options
        .faults
        .as_deref()
        .map(script)
        .transpose()?
        .map(|script| {
            // The default seed leaves the script its own.
            let seed = script.seed().wrapping_add(options.seed).wrapping_sub(1);
            script.with_seed(seed)
        });
    if let Some(script) = &script {
        check_targets(script, &prepared.parts)?;
    }
    let trace = options
        .trace
        .as_deref()
        .map(|path| TraceFile::create(path, prepared.buses()))
        .transpose()?;
    Ok(Wiring {
        scl_hz: options.scl,
        script,
        trace,
    })
}

fn script(path: &Path) -> Result<Script> {
    let hint =
        "name a file that you may read; crates/amg8833-emulator/scripts/README.md describes it";
    let text = files::text(path, "the script of faults", hint)?;
    Script::from_toml(&text, &path.display().to_string()).map_err(bad_input)
}

/// A fault of a sensor or bus that is not there would never strike, and nobody would be told.
fn check_targets(script: &Script, parts: &[Part]) -> Result<()> {
    for (number, rule) in (1..).zip(script.rules()) {
        let is_met = |part: &Part| {
            let place = &part.planned.place;
            rule.bus.is_none_or(|bus| bus == place.bus)
                && rule.address.is_none_or(|address| address == place.address)
        };
        if !parts.iter().any(is_met) {
            let places = parts.iter().map(|part| part.planned.place.to_string());
            return Err(bad_input(anyhow!(
                "fault {number} of the script names a bus or an address without a sensor\nhint: there are sensors at {}",
                places.collect::<Vec<_>>().join(", ")
            )));
        }
    }
    Ok(())
}

impl Prepared {
    /// How many buses there are.
    pub(super) fn buses(&self) -> usize {
        let numbers: BTreeSet<u32> = self
            .parts
            .iter()
            .map(|part| part.planned.place.bus)
            .collect();
        numbers.len()
    }
}

/// Reads what the options name, and checks them against each other, before anything is started.
pub(super) fn prepare(options: &Emulate, world: &Arc<World>) -> Result<Prepared> {
    let shown = Shown::read(options)?;
    let profile = options.profile.as_deref().map(profile).transpose()?;
    shown.check(options, profile.is_some())?;
    let wish = Wish {
        sensors: &options.sensors,
        address: options.address,
        bus: options.device,
    };
    let names = shown.names();
    let planned = plan::sensors(&wish, names.as_deref())?;
    let profile = profile.map(Arc::new);
    let parts = (0..)
        .zip(planned)
        .map(|(index, planned)| part(options, &shown, profile.as_ref(), world, index, planned))
        .collect::<Result<_>>()?;
    Ok(Prepared {
        parts,
        shown: shown.name(),
    })
}

fn part(
    options: &Emulate,
    shown: &Shown,
    profile: Option<&Arc<Profile>>,
    world: &Arc<World>,
    index: u64,
    planned: Planned,
) -> Result<Part> {
    let noise_seed = profile.is_none().then_some(options.seed);
    let (length, pictures) = shown.pictures(&planned.name, noise_seed)?;
    let specimen = profile.map(|profile| Specimen {
        profile: Arc::clone(profile),
        // Two sensors are two specimens.
        seed: options.seed.wrapping_add(index),
        ticks: 0,
    });
    Ok(Part {
        planned,
        show: Show {
            world: Arc::clone(world),
            timeline: Timeline::new(length, options.at_end),
            pictures,
            specimen,
        },
        options: chip(options, profile.map(Arc::as_ref)),
    })
}

/// How the chip behaves: its clock is the command line's, else the profile's.
fn chip(options: &Emulate, profile: Option<&Profile>) -> Options {
    let of_the_profile = profile.map_or(0, Profile::clock_error_ppm);
    let drift_ppm = profile.map_or(0, Profile::clock_drift_ppm_per_hour);
    Options {
        clock_error_ppm: options.clock_error.unwrap_or(of_the_profile),
        clock_drift: Drift::PpmPerHour(drift_ppm),
        ..Options::default()
    }
}

/// The frames of each sensor of a recording, by its name.
type Sensors = BTreeMap<String, Vec<(Duration, Frame)>>;

/// What all sensors are shown.
enum Shown {
    Scene {
        path: PathBuf,
        scene: Box<Scene>,
        method: Method,
    },
    Recording {
        path: PathBuf,
        replay: Replay,
        sensors: Sensors,
    },
    Constant(f32),
}

impl Shown {
    fn read(options: &Emulate) -> Result<Self> {
        if let Some(path) = &options.recording {
            return Ok(Self::Recording {
                path: path.clone(),
                replay: options.replay.unwrap_or(Replay::Times),
                sensors: recorded(path)?,
            });
        }
        if let Some(celsius) = options.constant {
            return Ok(Self::Constant(celsius));
        }
        let path = options.scene.clone().unwrap_or_default();
        let scene = Box::new(files::load_scene(Some(&path))?.scene);
        Ok(Self::Scene {
            path,
            scene,
            method: options.method,
        })
    }

    /// What the options ask of this show that it has not.
    fn check(&self, options: &Emulate, has_profile: bool) -> Result<()> {
        match self {
            Self::Scene { .. } | Self::Constant(_) if options.replay.is_some() => {
                Err(bad_input(anyhow!(
                    "--replay says when the frames of a recording come, and there is none\nhint: leave out --replay, or name a --recording"
                )))
            }
            Self::Recording { .. } if has_profile => Err(bad_input(anyhow!(
                "a recording has the noise of the sensor that recorded it, and --profile would add another's\nhint: leave out --profile; --clock-error sets the sensor's clock"
            ))),
            Self::Scene { path, scene, .. }
                if scene.is_static() && options.at_end != AtEnd::Hold =>
            {
                Err(bad_input(anyhow!(
                    "nothing moves in {}, so it has no end\nhint: leave out --at-end",
                    path.display()
                )))
            }
            _ => Ok(()),
        }
    }

    /// The sensors that there are to choose from; `None` where any name will do.
    fn names(&self) -> Option<Vec<String>> {
        match self {
            Self::Scene { scene, .. } => {
                let names = scene.sensors().iter().map(|sensor| sensor.name.clone());
                Some(names.collect())
            }
            Self::Recording { sensors, .. } if sensors.len() > 1 => {
                Some(sensors.keys().cloned().collect())
            }
            Self::Recording { .. } | Self::Constant(_) => None,
        }
    }

    fn name(&self) -> String {
        match self {
            Self::Scene { path, .. } | Self::Recording { path, .. } => path.display().to_string(),
            Self::Constant(celsius) => format!("{celsius} °C"),
        }
    }

    /// What one sensor is shown, and for how long.
    fn pictures(&self, name: &str, noise_seed: Option<u64>) -> Result<(Duration, Pictures)> {
        match self {
            Self::Scene { scene, method, .. } => {
                let simulator = method.simulator(scene, name).map_err(bad_input)?;
                sensor::check_resolution(&simulator)?;
                let pictures = Pictures::Scene {
                    simulator: Box::new(simulator),
                    thermistor: match noise_seed {
                        Some(_) => sensor::self_heated(scene.ambient()),
                        // A profile knows how warm its chip becomes.
                        None => scene.ambient(),
                    },
                    noise_seed,
                };
                Ok((scene.duration(), pictures))
            }
            Self::Recording {
                replay, sensors, ..
            } => {
                // The one sensor of a recording answers to any name.
                let frames = sensors
                    .get(name)
                    .or_else(|| sensors.values().next())
                    .map_or(&[][..], Vec::as_slice);
                let pictures = match replay {
                    Replay::Times => Pictures::Times(frames.to_vec()),
                    Replay::Frames => Pictures::Frames {
                        frames: frames.iter().map(|(_, frame)| *frame).collect(),
                        shown: 0,
                    },
                };
                // All of them end, and begin anew, together.
                let length = sensors.values().map(|frames| show::length(frames)).max();
                Ok((length.unwrap_or_default(), pictures))
            }
            Self::Constant(celsius) => {
                let room = Celsius::new(*celsius);
                let mut frame = Frame::uniform(room);
                if noise_seed.is_some() {
                    frame.thermistor = sensor::self_heated(room);
                }
                Ok((Duration::ZERO, Pictures::Constant(Box::new(frame))))
            }
        }
    }
}

/// The frames of a recording's sensors with their times since the first of all; those that are missing are left out.
fn recorded(path: &Path) -> Result<Sensors> {
    let streams = recordings::load_streams(path)?;
    let mut sensors = Sensors::new();
    let runs: BTreeSet<(&str, &str)> = streams
        .keys()
        .map(|stream| (stream.device.as_str(), stream.boot.as_str()))
        .collect();
    if runs.len() > 1 {
        return Err(bad_input(anyhow!(
            "{} holds {} streams of {} runs of an agent, whose times have no common beginning\nhint: keep the rows of one device and boot",
            path.display(),
            streams.len(),
            runs.len()
        )));
    }
    let boot_ns = |record: &Record| record.reading.frame().map(|_| record.stamp.t_boot_ns);
    let Some(first_ns) = streams.values().flatten().filter_map(boot_ns).min() else {
        return Err(bad_input(anyhow!(
            "{} holds no frame\nhint: name a recording in which the sensor was read",
            path.display()
        )));
    };
    for (stream, records) in streams {
        let frames = records.iter().filter_map(|record| {
            let since_ns = record.stamp.t_boot_ns.saturating_sub(first_ns);
            let frame = word::frame(record.reading.frame()?);
            Some((Duration::from_nanos(since_ns), frame))
        });
        let frames: Vec<_> = frames.collect();
        if !frames.is_empty() {
            sensors.insert(stream.sensor, frames);
        }
    }
    Ok(sensors)
}

/// A built-in profile by its name, else the one in this file.
fn profile(named: &Path) -> Result<Profile> {
    if let Some((name, text)) = PROFILES.iter().find(|(name, _)| named == Path::new(name)) {
        return Profile::parse(text, name).map_err(bad_input);
    }
    let names = PROFILES.map(|(name, _)| name).join(", ");
    let hint = format!("name a file, or one of the built-in profiles: {names}");
    let text = files::text(named, "the profile", &hint)?;
    Profile::parse(&text, &named.display().to_string()).map_err(bad_input)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_in_profiles_are_profiles() {
        for (name, _) in PROFILES {
            profile(Path::new(name)).unwrap();
        }
    }
}
