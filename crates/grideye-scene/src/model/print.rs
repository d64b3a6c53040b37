//! Warm prints on an object: a sheet just above its face that fades after a body has stood, sat or lain there.

use crate::geometry::Mesh;
use crate::heat::{Material, left};
use crate::model::body::Body;
use crate::motion::Stay;
use crate::radiometry::Surface;

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Print {
    pub(crate) sheet: Mesh,
    /// The object's index in the scene, and how much warmer than its mean the face is there.
    pub(crate) object: usize,
    pub(crate) offset_c: f64,
    pub(crate) contact_c: f64,
    pub(crate) contact: Stay,
    pub(crate) material: Material,
}

const FADED_C: f64 = 1e-3;

impl Print {
    pub(crate) fn surface(&self, scene: &[Body], ambient_c: f64, time_s: f64) -> Option<Surface> {
        let object = scene.get(self.object)?;
        if time_s < self.contact.from_s {
            return None;
        }
        let face_c = object.celsius(ambient_c, time_s) + self.offset_c;
        let after_s = time_s - self.contact.until_s;
        let contact_s = self.contact.until_s - self.contact.from_s;
        let share = if after_s > 0.0 {
            left(contact_s, after_s, self.material.fading_s())
        } else {
            1.0
        };
        let start_c = object.celsius(ambient_c, self.contact.from_s) + self.offset_c;
        let warmer_c = share * (self.contact_c - start_c);
        (warmer_c.abs() > FADED_C).then_some(Surface {
            celsius: face_c + warmer_c,
            emissivity: object.surface.emissivity,
        })
    }
}
