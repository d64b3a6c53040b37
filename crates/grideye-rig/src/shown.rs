//! What all sensors of a machine are shown: a scene, a recording, or one temperature.

use crate::error::RigError;
use crate::sensor;
use crate::show::{self, Pictures, Replay};
use grideye_frame::{Celsius, Frame};
use grideye_recording::{Record, StreamId};
use grideye_scene::{Scene, Simulator};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// Each sensor's frames with their times since the first frame of all, by sensor name.
pub type Recorded = BTreeMap<String, Vec<(Duration, Frame)>>;

/// What all sensors are shown.
#[expect(missing_docs, reason = "the names say it")]
pub enum Shown {
    Scene(Box<Scene>),
    Recording {
        replay: Replay,
        sensors: Recorded,
    },
    /// One temperature everywhere, °C.
    Constant(f32),
}

impl Shown {
    /// The available sensors; `None` if any name will do.
    #[must_use]
    pub fn names(&self) -> Option<Vec<String>> {
        match self {
            Self::Scene(scene) => {
                let names = scene.sensors().iter().map(|sensor| sensor.name.clone());
                Some(names.collect())
            }
            Self::Recording { sensors, .. } if sensors.len() > 1 => {
                Some(sensors.keys().cloned().collect())
            }
            Self::Recording { .. } | Self::Constant(_) => None,
        }
    }

    /// What one sensor is shown, and for how long.
    pub(crate) fn pictures(
        &self,
        name: &str,
        noise_seed: Option<u64>,
    ) -> Result<(Duration, Pictures), RigError> {
        match self {
            Self::Scene(scene) => {
                let simulator = Simulator::new(scene, name)?;
                sensor::check_resolution(&simulator)?;
                let pictures = Pictures::Scene {
                    simulator: Box::new(simulator),
                    thermistor: match noise_seed {
                        Some(_) => sensor::self_heated(scene.ambient()),
                        // A profile includes the chip's self-heating.
                        None => scene.ambient(),
                    },
                    noise_seed,
                };
                Ok((scene.duration(), pictures))
            }
            Self::Recording { replay, sensors } => {
                // A recording's only sensor answers to any name.
                let named = sensors.get(name).or_else(|| sensors.values().next());
                let frames = named.cloned().unwrap_or_default();
                if *replay == Replay::Frames {
                    let frames = show::evenly(frames.into_iter().map(|(_, frame)| frame));
                    let shown = Some(0);
                    let length = show::length(&frames);
                    return Ok((length, Pictures::Frames { frames, shown }));
                }
                // All of them end, and restart, together.
                let length = sensors.values().map(|frames| show::length(frames)).max();
                Ok((length.unwrap_or_default(), Pictures::timed(frames)))
            }
            Self::Constant(celsius) => {
                let room = Celsius::new(*celsius);
                let mut frame = Frame::uniform(room);
                if noise_seed.is_some() {
                    frame.thermistor = sensor::self_heated(room);
                }
                let frames = vec![(Duration::ZERO, frame)];
                Ok((Duration::ZERO, Pictures::timed(frames)))
            }
        }
    }
}

/// A recording's frames by sensor, with their times since the first frame of all; missing frames are skipped.
/// # Errors
/// If it holds no frame, or streams without a common start of time.
pub fn recorded(streams: BTreeMap<StreamId, Vec<Record>>) -> Result<Recorded, RigError> {
    let boot = |stream: &StreamId| (stream.device.clone(), stream.boot.clone());
    let boots: BTreeSet<_> = streams.keys().map(boot).collect();
    if boots.len() > 1 {
        return Err(RigError::SeveralBoots(streams.len(), boots.len()));
    }
    let boot_ns = |record: &Record| record.reading.frame().map(|_| record.stamp.t_boot_ns);
    let first_ns = streams.values().flatten().filter_map(boot_ns).min();
    let first_ns = first_ns.ok_or(RigError::NoFrame)?;
    let timed = |record: &Record| {
        let since_ns = record.stamp.t_boot_ns.saturating_sub(first_ns);
        let frame = sensor::shown(record.reading.frame()?);
        Some((Duration::from_nanos(since_ns), frame))
    };
    let sensors = streams.into_iter().map(|(stream, records)| {
        let frames: Vec<_> = records.iter().filter_map(timed).collect();
        (stream.sensor, frames)
    });
    Ok(sensors.filter(|(_, frames)| !frames.is_empty()).collect())
}
