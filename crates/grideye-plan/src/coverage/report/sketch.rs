//! The map as a drawing.

use super::found::Report;
use super::table::summary_of_picture;
use crate::coverage::picture::MapDrawing;
use grideye_draw::sketch::Sketch;
use grideye_scene::Sensor;

impl Report<'_> {
    /// The map as a drawing that a person reads.
    #[must_use]
    pub fn sketch(&self) -> Sketch {
        let sensors: Vec<(String, &Sensor)> = self
            .shown
            .iter()
            .enumerate()
            .map(|(index, pose)| {
                (
                    self.shown_name(index).unwrap_or_default(),
                    &self.poses[*pose].sensor,
                )
            })
            .collect();
        MapDrawing {
            title: &format!("{}: coverage", self.scene_name),
            summary: &summary_of_picture(self),
            scene: self.scene,
            floor: self.survey.floor(),
            map: &self.map,
            wish: &self.wish,
            sensors: &sensors,
        }
        .sketch()
    }
}
