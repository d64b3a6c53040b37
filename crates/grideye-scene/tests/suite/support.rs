//! Parses scenes from strings for tests.

use grideye_scene::{Loaded, Scene, SceneError};
use std::io;

/// A scene from a string; there are no files unless a test supplies them.
pub(crate) fn parse(text: &str) -> Result<Loaded, SceneError> {
    Scene::parse(text, "room.toml", &no_files)
}

pub(crate) fn scene(text: &str) -> Scene {
    parse(text)
        .unwrap_or_else(|error| panic!("{error}\nin\n{text}"))
        .scene
}

pub(crate) fn no_files(_: &str) -> io::Result<String> {
    Err(io::Error::from(io::ErrorKind::NotFound))
}

pub(crate) const ROOM: &str = "[room]\nsize_mm = [4000, 6000, 2700]\nambient_c = 20.1\n";

/// A Grid-EYE under the ceiling in the center of [`ROOM`], front at the top of its image.
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
