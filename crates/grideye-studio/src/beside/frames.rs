//! What a scene's sensor sees, in pieces of five seconds, with the agents' positions.

use crate::catalogue::{Catalogue, LoadedScene, SceneEntry};
use crate::rounding::{flat, hundredths};
use anyhow::Result;
use grideye_frame::TICK;
use grideye_scene::Agent;
use serde_json::{Value, json};
use std::time::Duration;

pub(super) const PIECE_FRAMES: u64 = 50;

/// The piece that contains a second of the scene; beyond its ends, the first or last.
pub(super) fn piece_at(seconds: f64, loaded: &LoadedScene) -> u64 {
    let asked = Duration::try_from_secs_f64(seconds).unwrap_or(Duration::ZERO);
    let within = asked.min(loaded.scene.duration());
    steps(within.saturating_add(TICK / 2)) / PIECE_FRAMES
}

/// One piece of the scene: frames without noise in °C, rounded to a hundredth; the last frame is the scene's end.
///
/// # Errors
/// If the scene has no such sensor.
pub(super) fn piece(
    catalogue: &Catalogue,
    scene: &SceneEntry,
    loaded: &LoadedScene,
    sensor: &str,
    piece: u64,
) -> Result<Value> {
    let film = catalogue.film(scene, loaded, sensor)?;
    let duration = loaded.scene.duration();
    let last = steps(duration.saturating_add(TICK - Duration::from_nanos(1)));
    let first = piece * PIECE_FRAMES;
    let times: Vec<Duration> = (first..first + PIECE_FRAMES)
        .take_while(|index| *index <= last)
        .filter_map(|index| TICK.checked_mul(u32::try_from(index).ok()?))
        .map(|time| time.min(duration))
        .collect();
    let frames = times.iter().map(|time| film.image(*time).celsius);
    let rounded = |celsius: Vec<f64>| celsius.into_iter().map(hundredths).collect();
    let frames: Vec<Vec<f64>> = frames.map(rounded).collect();
    let agents = loaded.scene.agents().iter();
    let agents: Vec<Value> = agents.map(|agent| places(agent, &times)).collect();
    Ok(json!({
        "scene": scene.name,
        "sensor": sensor,
        "edition": scene.edition,
        "seconds": duration.as_secs_f64(),
        "step_s": TICK.as_secs_f64(),
        "first": first,
        "frames": frames,
        "agents": agents,
    }))
}

fn places(agent: &Agent, times: &[Duration]) -> Value {
    let places = times.iter().map(|time| agent.position_m(*time).truncate());
    let fronts_deg = times.iter().map(|time| agent.front_rad(*time).to_degrees());
    let fronts_deg: Vec<f64> = fronts_deg.map(f64::round).collect();
    json!({ "name": agent.name, "at_m": flat(places), "front_deg": fronts_deg })
}

fn steps(time: Duration) -> u64 {
    u64::try_from(time.as_nanos() / TICK.as_nanos()).unwrap_or(u64::MAX)
}
