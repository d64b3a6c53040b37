//! Where an agent is on its way at a sensor's frames.

use super::limits;
use glam::DVec3;
use grideye_scene::{Agent, Sensor, count};

const FRAMES_MAX: usize = 1_000_000;

/// A circle is drawn on the agent's path at every how many frames.
pub(super) fn circle_step(agent: &Agent, sensor: &Sensor) -> usize {
    let frames = frames_on_trajectory(agent, sensor);
    frames.div_ceil(limits::CIRCLES_MAX).max(1)
}

pub(super) fn captured_points_m(agent: &Agent, sensor: &Sensor) -> Vec<DVec3> {
    let frames = 0..frames_on_trajectory(agent, sensor);
    frames
        .step_by(circle_step(agent, sensor))
        .map(|index| agent.position_m(sensor.frame_time(u32::try_from(index).unwrap_or(u32::MAX))))
        .collect()
}

fn frames_on_trajectory(agent: &Agent, sensor: &Sensor) -> usize {
    let last = (agent.duration().as_secs_f64() * sensor.sampling_hz + 1e-6).floor();
    count::floor(last).saturating_add(1).min(FRAMES_MAX)
}
