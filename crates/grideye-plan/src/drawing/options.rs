//! Options of a drawing.

use grideye_draw::Rgb;
use grideye_scene::Sensor;
use std::time::Duration;

/// Options of a drawing.
#[derive(Debug, Clone, Copy)]
pub struct Drawing<'a> {
    /// The title.
    pub title: &'a str,
    /// The sensor whose frames the circles mark; by default the scene's first.
    pub sampled_by: Option<&'a Sensor>,
    /// The time at which agents and temperatures are drawn.
    pub time: Duration,
    /// A sensor, by its number in the scene, and the color of each pixel's footprint.
    pub frame: Option<(usize, &'a [Rgb])>,
}

impl<'a> Drawing<'a> {
    /// The start of the scene, sampled by its first sensor.
    #[must_use]
    pub const fn new(title: &'a str) -> Self {
        Self {
            title,
            sampled_by: None,
            time: Duration::ZERO,
            frame: None,
        }
    }
}
