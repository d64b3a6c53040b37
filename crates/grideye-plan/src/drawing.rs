//! The scene as one self-contained SVG (PeerJ CS 11:e3124, Figures 3, 11, 12, 14, 24), and what it is drawn from.
//!
//! A scene's bodies are faces and ellipsoids in meters, ordered for any eye: [`svg`] draws them, and so can whoever gets
//! [`json()`]. On paper, objects are blue and agents red
//! unless they have a color; yellow is what sensors have in view, dotted lines paths, circles frames. Perspective at the left, top
//! view at the right.

mod bodies;
pub(crate) mod camera;
mod footprints;
pub(crate) mod labels;
pub mod limits;
mod options;
pub(crate) mod sheet;
mod tree;
mod way;

use crate::ground;
use bodies::{Bodies, point, points};
pub use bodies::{colors, mosaic_of};
use camera::{Camera, Panel};
use glam::{DVec2, DVec3};
use grideye_draw::palette::{AGENT, OBJECT, VIEW, hex};
use grideye_scene::{Agent, Scene, Sensor, count};
use labels::Labels;
pub use options::Drawing;
use serde_json::{Value, json};
use sheet::Sheet;
use std::time::Duration;

/// The scene in perspective and from above, as a self-contained SVG of 1280 x 720.
#[must_use]
pub fn svg(scene: &Scene, drawing: &Drawing<'_>) -> String {
    let way = trajectory_text(scene, drawing);
    let summary = summary(scene, way.as_deref());
    let mut sheet = Sheet::new((WIDTH, HEIGHT), drawing.title, &summary, "");
    let bounds_m = scene.room().bounds_m();
    let bodies = bodies(scene, drawing);
    let perspective = Camera::perspective(bounds_m, &PERSPECTIVE);
    sheet.panel("Perspective", &PERSPECTIVE);
    draw(&mut sheet, &perspective, scene, &bodies, drawing);
    sheet.axes(&perspective, bounds_m);
    sheet.labels(&Labels::of(scene, drawing, &perspective));
    let above = Camera::from_above(bounds_m, &FROM_ABOVE);
    sheet.panel("From above", &FROM_ABOVE);
    draw(&mut sheet, &above, scene, &bodies, drawing);
    sheet.ruler(&above, bounds_m);
    sheet.labels(&Labels::of(scene, drawing, &above));
    legend(&mut sheet, way.is_some());
    sheet.finish()
}

/// The scene in perspective without words, as a self-contained square SVG.
#[must_use]
pub fn perspective(scene: &Scene, drawing: &Drawing<'_>) -> String {
    let mut sheet = Sheet::bare(SQUARE.size.into(), "");
    let camera = Camera::perspective(scene.room().bounds_m(), &SQUARE);
    draw(&mut sheet, &camera, scene, &bodies(scene, drawing), drawing);
    sheet.finish()
}

fn bodies(scene: &Scene, drawing: &Drawing<'_>) -> Bodies {
    let shown = drawing.frame.map(|(number, _)| number);
    let sensors = scene.sensors().iter().enumerate();
    let bodies = Bodies::of(scene, drawing.time, limits::FACES_MAX);
    footprints::of(bodies, sensors.filter(|(number, _)| Some(*number) == shown))
}

/// What is drawn of a scene at a time, for a program that draws it itself, in meters; bodies beyond so many faces, in file
/// order, are boxes.
///
/// `shapes` are what faces and ellipsoids belong to, by index: kind, name, color, temperature. `nodes` are a binary tree, the
/// root first: seen from before a node's `plane` (a unit normal and the offset along it), what is on the first of its
/// `sides` is drawn first, then its `faces`, then the other side. `rounds` are ellipsoids, each where its center is.
/// `footprints` of faces, ellipsoids and `sides` of the room are a sensor's number, a pixel's, and the corners of what it sees.
/// `sensors` have the parts of walls and floor in view, and the rays to the corners. `colors` are those of each kind.
#[must_use]
pub fn json(scene: &Scene, time: Duration, faces_max: usize) -> Value {
    let room = scene.room();
    let (low_m, high_m) = room.bounds_m();
    let outlines = |faces_m: &[Vec<DVec3>]| -> Vec<Vec<[f64; 3]>> {
        faces_m.iter().map(|face| points(face)).collect()
    };
    let sensors = scene.sensors().iter().map(|sensor| {
        let view = ground::view(room, sensor);
        json!({
            "name": sensor.name,
            "at_m": point(sensor.pose.position_m),
            "view_m": outlines(&view.faces_m),
            "rays_m": points(&view.corners_m),
        })
    });
    let sensors_all = scene.sensors().iter().enumerate();
    let mut all = footprints::of(Bodies::of(scene, time, faces_max), sensors_all).json();
    all["sensors"] = sensors.collect();
    all["room"] = json!({
        "low_m": point(low_m),
        "high_m": point(high_m),
        "sides_m": outlines(&room.sides_m()),
    });
    all
}

fn draw(sheet: &mut Sheet, camera: &Camera, scene: &Scene, bodies: &Bodies, drawing: &Drawing<'_>) {
    let room = scene.room();
    let around = bodies.sides.iter().map(|side| side.corners_m.clone());
    let around: Vec<Vec<DVec3>> = around.collect();
    let colors = drawing.frame.map_or(&[][..], |(_, colors)| colors);
    let view = |sensor| (sensor, ground::view(room, sensor));
    let views: Vec<(&Sensor, ground::View)> = scene.sensors().iter().map(view).collect();
    let root = count::float(views.len().max(1)).sqrt();
    let opacity = VIEW_OPACITY / (root * root.sqrt());
    sheet.walls(camera, "wall", &around);
    for (_, view) in &views {
        sheet.view(camera, view, opacity);
    }
    for side in &bodies.sides {
        sheet.footprints(camera, &side.footprints, colors);
    }
    sheet.bodies(camera, bodies, colors);
    sheet.walls(camera, "wire", &around);
    sheet.walls(camera, "wire", &room.jutting_m());
    for agent in scene.agents() {
        ways(
            sheet,
            camera,
            agent,
            drawing.sampled_by.or(scene.sensors().first()),
        );
    }
    for (sensor, view) in &views {
        sheet.sensor(camera, sensor, &view.corners_m);
    }
}

fn ways(sheet: &mut Sheet, camera: &Camera, agent: &Agent, sensor: Option<&Sensor>) {
    let Some(trajectory) = &agent.trajectory else {
        return;
    };
    let color = agent.parts.iter().find_map(|part| part.color);
    let frames = sensor.map(|sensor| way::captured_points_m(agent, sensor));
    let frames_m: Vec<DVec3> = frames.unwrap_or_default();
    let way_m = trajectory.waypoints_m();
    sheet.way(camera, way_m, &frames_m, color.unwrap_or(AGENT));
}

fn legend(sheet: &mut Sheet, somebody_walks: bool) {
    let mut at = DVec2::new(24.0, LEGEND_Y);
    for (color, text) in [
        (OBJECT, "object"),
        (AGENT, "agent"),
        (VIEW, "sensor and its field of view"),
    ] {
        at = sheet.key(at, &hex(color), text);
    }
    if somebody_walks {
        let line = format!("M{} {}h34", at.x, at.y - 4.0);
        let way = sheet.svg.element("path").with("class", "way");
        way.with("d", line).with("stroke", hex(AGENT)).end();
        let text = "path, and a circle where a frame is taken";
        sheet.text("", at + DVec2::new(42.0, 0.0), text);
    }
}

fn summary(scene: &Scene, way: Option<&str>) -> String {
    let (low, high) = scene.room().bounds_m();
    let [width, depth, height] = ((high - low) * 1000.0).round().to_array();
    let mut line = format!(
        "{width} x {depth} x {height} mm, {} °C; {}, {}, {}",
        scene.room().ambient_c,
        counted(scene.objects().len(), "object"),
        counted(scene.agents().len(), "agent"),
        counted(scene.sensors().len(), "sensor"),
    );
    if let Some(way) = way {
        line.push_str("; ");
        line.push_str(way);
    }
    line
}

fn counted(count: usize, what: &str) -> String {
    match count {
        0 => format!("no {what}s"),
        _ => grideye_draw::text::counted(count, what),
    }
}

fn trajectory_text(scene: &Scene, drawing: &Drawing<'_>) -> Option<String> {
    let sensor = drawing.sampled_by.or(scene.sensors().first())?;
    let every = scene
        .agents()
        .iter()
        .filter(|agent| agent.trajectory.is_some())
        .map(|agent| way::circle_step(agent, sensor))
        .max()?;
    let which = match every {
        1 => "a circle at every frame".to_owned(),
        2 => "a circle at every second frame".to_owned(),
        step => format!("a circle at every {step}th frame"),
    };
    Some(format!(
        "{which} of {} at {} Hz",
        sensor.name, sensor.sampling_hz
    ))
}

const VIEW_OPACITY: f64 = 0.4;
const WIDTH: f64 = 1280.0;
const HEIGHT: f64 = 720.0;
const LEGEND_Y: f64 = 696.0;
const PERSPECTIVE: Panel = Panel::new(24.0, 84.0, 760.0, 584.0);
const SQUARE: Panel = Panel::new(0.0, 0.0, 600.0, 600.0);
const FROM_ABOVE: Panel = Panel::new(808.0, 84.0, 448.0, 584.0);
