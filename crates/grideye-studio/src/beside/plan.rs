//! A scene from above, as outlines for the page to draw.

use crate::rounding::{flat, millimeters, point};
use grideye_plan::{drawing, ground};
use grideye_scene::{Agent, Scene, Sensor};
use serde_json::{Value, json};

/// Room, objects, sensors with their view of the floor, and the agents' bodies and paths; in meters, x to the right and y to the
/// back.
pub(super) fn plan(scene: &Scene) -> Value {
    let objects = scene.objects().iter();
    let objects = objects
        .map(|object| json!({ "name": object.name, "outline_m": flat(ground::outline_m(object)) }));
    let sensors = scene.sensors().iter();
    let agents = scene.agents().iter();
    json!({
        "colors": drawing::colors(),
        "room_m": flat(scene.room().outline_m()),
        "ambient_c": scene.room().ambient_c,
        "objects": objects.collect::<Vec<Value>>(),
        "sensors": sensors.map(|sensor| seeing(scene, sensor)).collect::<Vec<Value>>(),
        "agents": agents.map(walking).collect::<Vec<Value>>(),
    })
}

fn seeing(scene: &Scene, sensor: &Sensor) -> Value {
    json!({
        "name": sensor.name,
        "at_m": point(sensor.pose.position_m),
        "in_view_m": flat(ground::in_view_m(scene.room(), sensor)),
    })
}

fn walking(agent: &Agent) -> Value {
    let way = agent.trajectory.as_ref();
    let way_m = way.map(|way| flat(way.waypoints_m().iter().map(|at| at.truncate())));
    json!({
        "name": agent.name,
        "starts_m": [millimeters(agent.start_m.x), millimeters(agent.start_m.y)],
        "way_m": way_m.unwrap_or_default(),
        "is_person": agent.person.is_some(),
        "body_m": ground::body_m(agent).into_iter().map(flat).collect::<Vec<_>>(),
    })
}
