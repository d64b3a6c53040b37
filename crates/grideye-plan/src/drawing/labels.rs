//! Places names next to the things they name, where there is room.

use super::bodies::mosaic_of;
use super::camera::Camera;
use super::limits;
use super::options::Drawing;
use glam::{DVec2, DVec3};
use grideye_scene::{Body, Scene};
use std::collections::HashSet;

#[derive(Debug, Default)]
pub(crate) struct Labels {
    pub(crate) placed: Vec<Label>,
    pub(crate) left_out: usize,
}

#[derive(Debug)]
pub(crate) struct Label {
    pub(crate) at: DVec2,
    pub(crate) text: String,
}

impl Labels {
    /// Agents first, then sensors, then objects: earlier names get the room.
    pub(crate) fn of(scene: &Scene, drawing: &Drawing<'_>, camera: &Camera) -> Self {
        let mut labels = Self::default();
        let time_s = drawing.time.as_secs_f64();
        let titled = |name: &str, body: &Body| {
            with_temperature(name, body.celsius(scene.room().ambient_c, time_s))
        };
        for agent in scene.agents() {
            let name = match agent.parts.as_slice() {
                [only] => titled(&agent.name, only),
                _ => agent.name.clone(),
            };
            let parts = agent.bodies_at(drawing.time).into_iter();
            if let Some(top_m) = top_m(parts.map(|part| part.mesh.bounds_m())) {
                labels.place(camera.project(top_m), name);
            }
        }
        for sensor in scene.sensors() {
            labels.place(camera.project(sensor.pose.position_m), sensor.name.clone());
        }
        let mut mosaics = HashSet::new();
        for object in scene.objects() {
            let text = match mosaic_of(&object.name) {
                Some(mosaic) if mosaics.insert(mosaic) => mosaic.to_owned(),
                Some(_) => continue,
                None => titled(&object.name, object),
            };
            if let Some(top_m) = top_m(std::iter::once(object.mesh.bounds_m())) {
                labels.place(camera.project(top_m), text);
            }
        }
        labels
    }

    /// Places a name above its thing, or below it if another name is in the way.
    pub(crate) fn place(&mut self, thing: DVec2, text: String) {
        let places = [-8.0, 16.0, -22.0].map(|down| thing + DVec2::new(0.0, down));
        let free = places
            .into_iter()
            .find(|at| self.placed.iter().all(|other| !overlap(*at, &text, other)));
        match free {
            Some(at) if self.placed.len() < limits::LABELS_MAX => {
                self.placed.push(Label { at, text });
            }
            _ => self.left_out += 1,
        }
    }
}

fn with_temperature(name: &str, celsius: f64) -> String {
    format!("{name}, {} °C", (celsius * 10.0).round() / 10.0)
}

/// The top center of the box around all bodies.
fn top_m(bounds: impl Iterator<Item = (DVec3, DVec3)>) -> Option<DVec3> {
    bounds
        .reduce(|(low, high), (body_low, body_high)| (low.min(body_low), high.max(body_high)))
        .map(|(low, high)| (0.5 * (low + high)).with_z(high.z))
}

fn overlap(at: DVec2, text: &str, other: &Label) -> bool {
    let apart = (at - other.at).abs();
    apart.x < 0.5 * (width(text) + width(&other.text)) + 4.0 && apart.y < LINE_HEIGHT
}

/// Approximate width of the text on the sheet.
pub(crate) fn width(text: &str) -> f64 {
    text.chars().map(|_| CHARACTER_WIDTH).sum()
}

const CHARACTER_WIDTH: f64 = 6.3;
const LINE_HEIGHT: f64 = 13.0;
