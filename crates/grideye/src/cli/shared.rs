//! What the options of several commands share.

use grideye_scene::{Scene, SceneError, Simulator};

/// The seed of a comparison's simulation, where nobody chose another.
pub(crate) const SEED: u64 = 2;

/// How a simulated frame is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Method {
    /// Rays through a grid of points, resampled to the sensor's pixels.
    Grid,
    /// The integral over each pixel's response, without a grid.
    Area,
}

impl Method {
    /// A simulator for the sensor of that name that makes its frames so.
    pub(crate) fn simulator(self, scene: &Scene, sensor: &str) -> Result<Simulator, SceneError> {
        match self {
            Self::Grid => Simulator::new(scene, sensor),
            Self::Area => Simulator::without_grid(scene, sensor),
        }
    }
}

/// A number above 0.
pub(super) fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("expected a number above 0".to_owned()),
    }
}
