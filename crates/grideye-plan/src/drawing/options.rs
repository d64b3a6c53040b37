//! What to draw beside the scene.

use grideye_scene::Sensor;
use std::time::Duration;

/// What to draw beside the scene.
#[derive(Debug, Clone, Copy)]
pub struct Drawing<'a> {
    /// The head line.
    pub title: &'a str,
    /// The sensor whose frames the circles stand for; `None` takes the scene's first.
    pub sampled_by: Option<&'a Sensor>,
    /// When agents and temperatures are drawn.
    pub time: Duration,
}

impl<'a> Drawing<'a> {
    /// The start of the scene, sampled by its first sensor.
    #[must_use]
    pub const fn new(title: &'a str) -> Self {
        Self {
            title,
            sampled_by: None,
            time: Duration::ZERO,
        }
    }
}
