//! What a scene leaves open of its room where it has no law: how the sensor is mounted, and how warm objects are.

use crate::advice::change::{Change, Kind};
use crate::decision::view::{Image, image, less};
use grideye_scene::{Scene, SceneError, Simulator};
use std::time::Duration;

/// Keys of a sensor mounted by eye and measure, how far off each is (standard deviation), and the change that makes it so.
#[rustfmt::skip]
const POSE: [(&str, f64, Kind, [f64; 2]); 6] = [
    ("tilt_deg.x", 1.0, Kind::Tilt, [1.0, 0.0]),
    ("tilt_deg.y", 1.0, Kind::Tilt, [0.0, 1.0]),
    ("azimuth_deg", 1.0, Kind::Azimuth, [1.0, 0.0]),
    ("position_mm.x", 30.0, Kind::Place, [0.03, 0.0]),
    ("position_mm.y", 30.0, Kind::Place, [0.0, 0.03]),
    ("position_mm.z", 30.0, Kind::Height, [0.03, 0.0]),
];
/// The same of an object's temperature, °C: a thermometer held to a surface.
const OBJECT_C: f64 = 0.5;
/// Objects whose temperature stays open.
const OBJECTS_MOST: usize = 12;
/// Root of the sum of squares over the pixels below which nothing is seen of it, °C: half a step of the sensor.
const SEEN_C: f32 = 0.12;

/// The numbers that the empty room shows at a time, each with its law in words and how the room looks with it one standard
/// deviation higher, °C. A scene that has a law of one angle of its sensor knows the others; so with places.
pub(crate) fn mounting(
    scene: &Scene,
    sensor: &str,
    time: Duration,
) -> Result<Vec<(String, Image)>, SceneError> {
    let (room, known) = (scene.without_agents(), scene.laws().numbers);
    let owner = format!("sensor.{sensor}.");
    let is_place = |key: &str| key.starts_with("position_mm");
    let pose = POSE.iter().filter(|(key, ..)| {
        let mut own = known.iter().filter_map(|one| one.key.strip_prefix(&owner));
        own.all(|other| is_place(other) != is_place(key))
    });
    let pose = pose.map(|(key, sd, kind, by)| (format!("{owner}{key}"), *sd, (*kind, 0, *by)));
    let objects = room.objects().iter().zip(0..);
    let objects = objects.filter(|(one, _)| one.surface.celsius != room.room().ambient_c);
    let objects = objects.map(|(one, of)| {
        let key = format!("object.{}.temperature_c", one.name);
        (key, OBJECT_C, (Kind::Object, of, [OBJECT_C, 0.0]))
    });
    let objects = objects.filter(|(key, ..)| known.iter().all(|one| one.key != *key));
    let mut all = Vec::new();
    for (key, sd, (kind, of, by)) in pose.chain(objects.take(OBJECTS_MOST)) {
        let shown = |sign: f64| -> Result<Image, SceneError> {
            let mut change = Change::NONE;
            (change.kind, change.of, change.by) = (kind, of, by.map(|by| sign * by));
            // Above the ceiling there is no sensor.
            let applied = change.applied(&room, sensor);
            let changed = applied.map_or_else(|| room.clone(), |applied| applied.0);
            let simulator = Simulator::new(&changed, sensor)?;
            Ok(image(&simulator.image(time).celsius))
        };
        let shows = less(&shown(1.0)?, &shown(-1.0)?).map(|celsius| 0.5 * celsius);
        if shows.iter().map(|celsius| celsius * celsius).sum::<f32>() > SEEN_C * SEEN_C {
            all.push((format!("`{key}` (sd {sd})"), shows));
        }
    }
    Ok(all)
}
