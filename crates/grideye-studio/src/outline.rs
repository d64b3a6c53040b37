//! Where everything in a scene is at a moment, for the page to draw and drag; in meters.

use crate::rounding::{flat, hundredths, point};
use grideye_plan::drawing::{self, mosaic_of};
use grideye_scene::{Agent, Body, Scene, polygon};
use serde_json::{Map, Value, json};
use std::time::Duration;

/// Maximum faces drawn individually; further bodies become boxes.
const FACES_MAX: usize = 4_000;
/// Maximum numbers of a list shown with its key.
const LIST_MAX: usize = 4;
const WAYPOINTS_MAX: usize = 200;

/// The kinds of tables, as spelled in the file.
const KINDS: [&str; 4] = ["object", "mosaic", "agent", "sensor"];

/// The room, and everything with a table in the text, in order.
pub(crate) fn outline(text: &str, scene: &Scene, at: Duration) -> Value {
    let document: toml::Table = text.parse().unwrap_or_default();
    let document = serde_json::to_value(document).unwrap_or_default();
    let moment = Moment { scene, at };
    let mut items = Vec::new();
    for kind in KINDS {
        let tables = document[kind].as_array();
        for (index, table) in tables.into_iter().flatten().enumerate() {
            items.push(moment.item(kind, index, table));
        }
    }
    json!({
        "seconds": scene.duration().as_secs_f64(),
        "keys": plain(&document),
        "room": { "keys": plain(&document["room"]), "outline_m": flat(scene.room().outline_m()) },
        "items": items,
        "drawing": drawing::json(scene, at, FACES_MAX),
    })
}

/// The same of a scene without its text: what stands in it, without the keys.
pub(crate) fn room_at(scene: &Scene, at: Duration) -> Value {
    let moment = Moment { scene, at };
    let agents = scene.agents().iter().map(|agent| ("agent", &agent.name));
    let sensors = scene
        .sensors()
        .iter()
        .map(|sensor| ("sensor", &sensor.name));
    let named = agents.chain(sensors).enumerate();
    let items =
        named.map(|(index, (kind, name))| moment.item(kind, index, &json!({ "name": name })));
    json!({
        "at_s": at.as_secs_f64(),
        "room": { "keys": {}, "outline_m": flat(scene.room().outline_m()) },
        "items": items.collect::<Vec<Value>>(),
        "drawing": drawing::json(scene, at, FACES_MAX),
    })
}

struct Moment<'a> {
    scene: &'a Scene,
    at: Duration,
}

impl Moment<'_> {
    fn item(&self, kind: &str, index: usize, table: &Value) -> Value {
        let name = table["name"].as_str().unwrap_or_default();
        let mut item = json!({ "kind": kind, "index": index, "name": name, "keys": plain(table) });
        let scene = self.scene;
        match kind {
            "sensor" => {
                let sensor = scene.sensors().iter().find(|sensor| sensor.name == name);
                sensor
                    .into_iter()
                    .for_each(|sensor| item["at_m"] = json!(point(sensor.pose.position_m)));
            }
            "agent" => {
                let agent = scene.agents().iter().find(|agent| agent.name == name);
                agent
                    .into_iter()
                    .for_each(|agent| self.standing(agent, table, &mut item));
            }
            _ => {
                let is_cell =
                    |object: &&Body| kind == "mosaic" && mosaic_of(&object.name) == Some(name);
                let objects = scene.objects().iter();
                let own: Vec<&Body> = objects
                    .filter(|object| object.name == name || is_cell(object))
                    .collect();
                item["bodies"] = json!(outline_of(&own).as_slice());
                item["top_m"] = json!(top_m(&own));
            }
        }
        item
    }

    fn standing(&self, agent: &Agent, table: &Value, item: &mut Value) {
        let at_m = agent.position_m(self.at);
        let bodies = agent.bodies_at(self.at);
        item["at_m"] = json!(point(at_m));
        item["top_m"] = json!(top_m(&bodies.iter().collect::<Vec<_>>()));
        let bodies: Vec<Value> = bodies.iter().flat_map(|body| outline_of(&[body])).collect();
        item["bodies"] = json!(bodies);
        if let Some((person, facing)) = agent.person.as_ref().zip(agent.facing(self.at)) {
            let front = facing.x_axis;
            item["faces_deg"] = json!(hundredths(front.y.atan2(front.x).to_degrees()));
            // What a word stands for.
            item["person"] = json!({ "build": person.girth, "clothing": person.clothing.clo });
        }
        if let Some(way) = &agent.trajectory {
            let points = way.waypoints_m();
            let points_m = points.iter().take(WAYPOINTS_MAX).map(|at| point(*at));
            item["way"] = json!({
                "file": table["trajectory"],
                "points_m": points_m.collect::<Vec<[f64; 3]>>(),
            });
        }
    }
}

/// The outline of bodies that are one thing; none without bodies.
fn outline_of(bodies: &[&Body]) -> Option<Value> {
    let corners = bodies.iter().flat_map(|body| body.mesh.vertices_m());
    let outline = polygon::hull(corners.map(|corner| corner.truncate()).collect());
    (!outline.is_empty()).then(|| json!({ "outline_m": flat(outline) }))
}

/// The top middle of the box around bodies.
fn top_m(bodies: &[&Body]) -> Option<[f64; 3]> {
    let bounds = bodies.iter().map(|body| body.mesh.bounds_m());
    let (low, high) =
        bounds.reduce(|(low, high), (one_low, one_high)| (low.min(one_low), high.max(one_high)))?;
    Some(point((0.5 * (low + high)).with_z(high.z)))
}

/// The keys of a table with a number, text, Boolean or short list; also those of its parts and person.
fn plain(table: &Value) -> Map<String, Value> {
    let entries = table.as_object().into_iter().flatten();
    let shown = entries.filter_map(|(key, value)| match value {
        Value::Array(list) if key == "part" => Some((
            key.clone(),
            list.iter().map(|part| Value::Object(plain(part))).collect(),
        )),
        Value::Array(list) => {
            let is_short =
                list.len() <= LIST_MAX && !list.iter().any(|one| one.is_array() || one.is_object());
            is_short.then(|| (key.clone(), value.clone()))
        }
        Value::Object(_) if key == "person" => Some((key.clone(), Value::Object(plain(value)))),
        Value::Object(_) => None,
        _ => Some((key.clone(), value.clone())),
    });
    shown.collect()
}
