//! Where everything in a scene is at a moment, for the page to draw and drag; in meters.

use crate::rounding::{flat, hundredths, point};
use grideye_plan::ground;
use grideye_scene::{Agent, Body, Scene, Sensor};
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
pub(super) fn outline(text: &str, scene: &Scene, at: Duration) -> Value {
    let document: toml::Table = text.parse().unwrap_or_default();
    let document = serde_json::to_value(document).unwrap_or_default();
    let mut drawing = Drawing {
        scene,
        at,
        faces: 0,
    };
    let mut items = Vec::new();
    for kind in KINDS {
        let tables = document[kind].as_array();
        for (index, table) in tables.into_iter().flatten().enumerate() {
            items.push(drawing.item(kind, index, table));
        }
    }
    json!({
        "seconds": scene.duration().as_secs_f64(),
        "keys": plain(&document),
        "room": room(scene, &document["room"]),
        "items": items,
    })
}

fn room(scene: &Scene, table: &Value) -> Value {
    let room = scene.room();
    let (low, high) = room.bounds_m();
    let sides = room.sides_m().into_iter().take(FACES_MAX);
    let sides = sides.map(|side| side.into_iter().map(point).collect());
    json!({
        "keys": plain(table),
        "outline_m": flat(room.outline_m()),
        "low_m": point(low),
        "high_m": point(high),
        "sides_m": sides.collect::<Vec<Vec<[f64; 3]>>>(),
    })
}

struct Drawing<'a> {
    scene: &'a Scene,
    at: Duration,
    faces: usize,
}

impl Drawing<'_> {
    fn item(&mut self, kind: &str, index: usize, table: &Value) -> Value {
        let name = table["name"].as_str().unwrap_or_default();
        let mut item = json!({ "kind": kind, "index": index, "name": name, "keys": plain(table) });
        let scene = self.scene;
        match kind {
            "sensor" => {
                let sensor = scene.sensors().iter().find(|sensor| sensor.name == name);
                sensor
                    .into_iter()
                    .for_each(|sensor| seeing(scene, sensor, &mut item));
            }
            "agent" => {
                let agent = scene.agents().iter().find(|agent| agent.name == name);
                agent
                    .into_iter()
                    .for_each(|agent| self.standing(agent, table, &mut item));
            }
            "mosaic" => item["bodies"] = json!(cells(scene.objects(), name).as_slice()),
            _ => {
                let object = scene.objects().iter().find(|object| object.name == name);
                let bodies = object.map(|object| self.body(object));
                item["bodies"] = json!(bodies.as_slice());
            }
        }
        item
    }

    fn standing(&mut self, agent: &Agent, table: &Value, item: &mut Value) {
        let at_m = agent.position_m(self.at);
        let bodies = agent.bodies_at(self.at);
        item["at_m"] = json!(point(at_m));
        item["bodies"] = match agent.rounded_m(self.at) {
            Some(rounded) => {
                let segments = bodies.iter().zip(rounded);
                let segments = segments.map(|(body, (center_m, axes_m))| {
                    segment(body, center_m.into(), axes_m.to_cols_array_2d())
                });
                segments.collect()
            }
            None => bodies.iter().map(|body| self.body(body)).collect(),
        };
        if let Some((person, facing)) = agent.person.as_ref().zip(agent.facing(self.at)) {
            let front = facing.x_axis;
            item["faces_deg"] = json!(hundredths(front.y.atan2(front.x).to_degrees()));
            // What a word stands for.
            item["person"] = json!({ "build": person.girth, "clothing": person.clothing.clo });
        }
        if let Some(trajectory) = &agent.trajectory {
            let points = trajectory.waypoints_m();
            let points_m = points.iter().take(WAYPOINTS_MAX).map(|at| point(*at));
            item["way"] = json!({
                "file": table["trajectory"],
                "points_m": points_m.collect::<Vec<[f64; 3]>>(),
                "is_whole": points.len() <= WAYPOINTS_MAX,
            });
        }
    }

    /// Corners, faces and outline of a body.
    fn body(&mut self, body: &Body) -> Value {
        let faces: Vec<&[usize]> = body.mesh.faces().collect();
        self.faces += faces.len();
        let (vertices, faces) = if self.faces <= FACES_MAX {
            let vertices = body.mesh.vertices_m().iter();
            (vertices.copied().map(Into::into).collect(), json!(faces))
        } else {
            let (low, high) = body.mesh.bounds_m();
            (corners(low.to_array(), high.to_array()), json!(BOX_FACES))
        };
        json!({
            "celsius": hundredths(body.surface.celsius),
            "outline_m": flat(ground::outline_m(body)),
            "vertices_m": vertices.into_iter().map(point).collect::<Vec<[f64; 3]>>(),
            "faces": faces,
        })
    }
}

/// A segment of a person: an ellipsoid with these semi-axes.
fn segment(body: &Body, center_m: [f64; 3], axes_m: [[f64; 3]; 3]) -> Value {
    json!({
        "celsius": hundredths(body.surface.celsius),
        "outline_m": flat(ground::outline_m(body)),
        "center_m": point(center_m),
        "axes_m": axes_m.map(point),
    })
}

fn seeing(scene: &Scene, sensor: &Sensor, item: &mut Value) {
    let (pose, axes) = (&sensor.pose, sensor.pose.world_from_sensor());
    let axes = [axes.x_axis, axes.y_axis, axes.z_axis];
    let axes = axes.map(|axis| axis.to_array().map(|part| (part * 1e6).round() / 1e6));
    let angles = [pose.elevation_rad, pose.azimuth_rad, pose.roll_rad];
    item["at_m"] = json!(point(pose.position_m));
    item["axes"] = json!(axes);
    item["field_rad"] = json!(sensor.field_of_view_rad.to_array());
    item["in_view_m"] = json!(flat(ground::in_view_m(scene.room(), sensor)));
    item["reach_m"] = json!(flat(ground::reach_m(scene.room(), sensor)));
    item["turned_deg"] = json!(angles.map(|angle| hundredths(angle.to_degrees())));
}

const BOX_FACES: [[usize; 4]; 6] = [
    [0, 2, 3, 1],
    [4, 5, 7, 6],
    [0, 1, 5, 4],
    [2, 6, 7, 3],
    [0, 4, 6, 2],
    [1, 3, 7, 5],
];

/// The corners of a box, in the order that its faces index.
fn corners(low: [f64; 3], high: [f64; 3]) -> Vec<[f64; 3]> {
    let ends = [low, high];
    (0..8)
        .map(|corner: usize| {
            [
                ends[corner & 1][0],
                ends[corner >> 1 & 1][1],
                ends[corner >> 2][2],
            ]
        })
        .collect()
}

/// A mosaic as one box around its cells, which are objects named by row and column.
fn cells(objects: &[Body], mosaic: &str) -> Option<Value> {
    let is_cell = |object: &&Body| {
        let place = object.name.strip_prefix(mosaic);
        let place = place.and_then(|place| place.strip_prefix(' ')?.split_once(' '));
        place.is_some_and(|(row, column)| [row, column].iter().all(|at| at.parse::<u32>().is_ok()))
    };
    let cells = || objects.iter().filter(is_cell);
    let bounds = cells().map(|cell| cell.mesh.bounds_m());
    let (low, high) = bounds.reduce(|(low, high), (one, other)| (low.min(one), high.max(other)))?;
    let vertices = corners(low.to_array(), high.to_array());
    let outline = [
        [low.x, low.y],
        [high.x, low.y],
        [high.x, high.y],
        [low.x, high.y],
    ];
    Some(json!({
        "celsius": hundredths(cells().next()?.surface.celsius),
        "outline_m": flat(outline),
        "vertices_m": vertices.into_iter().map(point).collect::<Vec<[f64; 3]>>(),
        "faces": BOX_FACES,
    }))
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
