//! What the simulator promises, checked from outside: against an independent ray caster, against the reference's
//! numbers, and against everything that a scene file can get wrong.

#![expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that panics has failed, and its counts are small"
)]

mod area;
mod collision;
mod coverage;
mod drawing;
mod fit;
mod fusion;
mod invariants;
mod motion;
mod paper_scenes;
mod peer;
mod physical;
mod physical_invariants;
mod physical_people;
mod range;
mod refusals;
mod rooms;
mod shapes;
mod shipped;
mod symmetry;
mod variation;
mod warmth;

use grideye_scene::{Loaded, Scene, SceneError, Simulator};
use std::io;
use std::time::Duration;

/// A scene of strings; there are no files unless a test brings them.
pub(crate) fn parse(text: &str) -> Result<Loaded, SceneError> {
    Scene::parse(text, "room.toml", &no_files)
}

pub(crate) fn scene(text: &str) -> Scene {
    parse(text)
        .unwrap_or_else(|error| panic!("{error}\nin\n{text}"))
        .scene
}

pub(crate) fn simulator(text: &str) -> Simulator {
    let scene = scene(text);
    let name = scene.sensors()[0].name.clone();
    Simulator::new(&scene, &name).unwrap()
}

/// The noise-free picture of the first sensor at time 0, row by row.
pub(crate) fn picture(text: &str) -> Vec<f64> {
    simulator(text).image(Duration::ZERO).celsius
}

pub(crate) fn no_files(_: &str) -> io::Result<String> {
    Err(io::Error::from(io::ErrorKind::NotFound))
}

pub(crate) const ROOM: &str = "[room]\nsize_mm = [4000, 6000, 2700]\nambient_c = 20.1\n";

/// A Grid-EYE under the ceiling in the middle of [`ROOM`], front at the top of its picture.
pub(crate) const CEILING: &str = "[[sensor]]\nname = \"ceiling\"\npreset = \"grid-eye\"\n\
    position_mm = [2000, 3000, 2700]\nelevation_deg = 90\nazimuth_deg = -90\n";

pub(crate) fn object(
    name: &str,
    position_mm: [f64; 3],
    size_mm: [f64; 3],
    yaw_deg: f64,
    celsius: f64,
) -> String {
    format!(
        "[[object]]\nname = \"{name}\"\nposition_mm = {position_mm:?}\nsize_mm = {size_mm:?}\nyaw_deg = {yaw_deg:?}\ntemperature_c = {celsius:?}\n"
    )
}
