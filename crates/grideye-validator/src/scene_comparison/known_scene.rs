//! A scene that is compared again and again.

use crate::compare::Comparison;
use crate::decision::Rendered;
use crate::error::ValidatorError;
use crate::scene_comparison::compare_scene::compared;
use crate::scene_comparison::types::Options;
use grideye_recording::Record;
use grideye_scene::Scene;

/// A scene at one of its sensors. It keeps what a comparison rendered of it, so that the next is faster.
pub struct KnownScene {
    scene: Scene,
    sensor: String,
    rendered: Rendered,
}

impl KnownScene {
    /// A sensor that the scene lacks is an error of each comparison.
    #[must_use]
    pub fn new(scene: Scene, sensor: &str) -> Self {
        Self {
            scene,
            sensor: sensor.to_owned(),
            rendered: Rendered::default(),
        }
    }

    /// The same result as [`crate::compare_scene`].
    ///
    /// # Errors
    /// The same.
    pub fn compare(
        &mut self,
        records: &[Record],
        options: &Options,
    ) -> Result<Comparison, ValidatorError> {
        let of = (&self.scene, self.sensor.as_str());
        compared(records, of, options, &mut self.rendered)
    }
}
