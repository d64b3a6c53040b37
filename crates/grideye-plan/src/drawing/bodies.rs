//! What is in a room, as flat faces and ellipsoids in meters for any eye. The SVG and the page draw the same.

use super::tree::{Face, Footprint, Round, Tree};
use crate::plane::Plane;
use glam::DVec3;
use grideye_draw::Rgb;
use grideye_draw::palette::{AGENT, JUTTING_WALL, OBJECT, VIEW, VIEW_EDGE, hex};
use grideye_scene::{Agent, Body, Cuboid, Mesh, Scene};
use serde_json::{Value, json};
use std::collections::HashMap;
use std::time::Duration;

/// A scene's bodies and the walls that jut into its room, at one time.
#[derive(Debug)]
pub(super) struct Bodies {
    pub(super) shapes: Vec<Shape>,
    pub(super) tree: Tree,
    pub(super) rounds: Vec<Round>,
    /// The sides of the room that do not jut into it.
    pub(super) sides: Vec<Side>,
}

/// A wall, the floor or the ceiling.
#[derive(Debug)]
pub(super) struct Side {
    pub(super) corners_m: Vec<DVec3>,
    pub(super) footprints: Vec<Footprint>,
}

/// What faces and ellipsoids belong to.
#[derive(Debug)]
pub(super) struct Shape {
    pub(super) kind: Kind,
    /// The name of the object, mosaic or agent.
    name: String,
    pub(super) color: Rgb,
    celsius: f64,
    /// Only the outsides of its faces are seen.
    pub(super) is_closed: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// A wall that juts into the room.
    Wall,
    Object,
    Agent,
}

impl Kind {
    const fn name(self) -> &'static str {
        match self {
            Self::Wall => "wall",
            Self::Object => "object",
            Self::Agent => "agent",
        }
    }
}

impl Bodies {
    /// The scene at a time. Bodies beyond so many faces, in file order, are boxes.
    pub(super) fn of(scene: &Scene, time: Duration, faces_max: usize) -> Self {
        let mut made = Builder {
            ambient_c: scene.room().ambient_c,
            time,
            faces_left: faces_max,
            shapes: Vec::new(),
            faces: Vec::new(),
            rounds: Vec::new(),
        };
        let shape = made.shape(Kind::Wall, "", JUTTING_WALL, made.ambient_c, true);
        let walls = scene.room().jutting_m().into_iter().map(|corners_m| Face {
            shape,
            edges: vec![true; corners_m.len()],
            corners_m,
            footprints: Vec::new(),
        });
        made.faces.extend(walls);
        for object in scene.objects() {
            let name = mosaic_of(&object.name).unwrap_or(&object.name);
            made.body(Kind::Object, name, object);
        }
        for agent in scene.agents() {
            made.agent(agent);
        }
        let jutting = scene.room().jutting_m();
        let mut sides = scene.room().sides_m();
        sides.retain(|side| !jutting.contains(side));
        let side = |corners_m| Side {
            corners_m,
            footprints: Vec::new(),
        };
        Self {
            shapes: made.shapes,
            tree: Tree::new(made.faces),
            rounds: made.rounds,
            sides: sides.into_iter().map(side).collect(),
        }
    }

    /// As [`super::json`] says.
    pub(super) fn json(&self) -> Value {
        let shapes = self.shapes.iter().map(|shape| {
            json!({
                "kind": shape.kind.name(),
                "name": shape.name,
                "color": hex(shape.color),
                "celsius": (shape.celsius * 100.0).round() / 100.0,
                "is_closed": shape.is_closed,
            })
        });
        let face = |face: &Face| {
            json!({
                "shape": face.shape,
                "corners_m": points(&face.corners_m),
                "edges": face.edges,
                "footprints": footprints(&face.footprints),
            })
        };
        let nodes = self.tree.nodes.iter().map(|node| {
            let plane = node.plane.normal.extend(node.plane.offset_m);
            json!({
                "plane": (plane * 1e6).round().to_array().map(|part| part / 1e6),
                "sides": node.sides,
                "faces": node.faces.iter().map(face).collect::<Vec<_>>(),
            })
        });
        let rounds = self.rounds.iter().map(|round| {
            let axes = [
                round.axes_m.x_axis,
                round.axes_m.y_axis,
                round.axes_m.z_axis,
            ];
            json!({
                "shape": round.shape,
                "center_m": point(round.center_m),
                "axes_m": axes.map(point),
                "footprints": footprints(&round.footprints),
            })
        });
        let sides = self.sides.iter().map(|side| {
            json!({
                "corners_m": points(&side.corners_m),
                "footprints": footprints(&side.footprints),
            })
        });
        json!({
            "colors": colors(),
            "shapes": shapes.collect::<Vec<_>>(),
            "nodes": nodes.collect::<Vec<_>>(),
            "rounds": rounds.collect::<Vec<_>>(),
            "sides": sides.collect::<Vec<_>>(),
        })
    }
}

fn footprints(all: &[Footprint]) -> Vec<Value> {
    let footprint = |one: &Footprint| json!([one.sensor, one.pixel, points(&one.corners_m)]);
    all.iter().map(footprint).collect()
}

/// The colors of what has none of its own, by kind.
#[must_use]
pub fn colors() -> Value {
    json!({ "object": hex(OBJECT), "agent": hex(AGENT), "view": hex(VIEW), "view-edge": hex(VIEW_EDGE) })
}

struct Builder {
    ambient_c: f64,
    time: Duration,
    faces_left: usize,
    shapes: Vec<Shape>,
    faces: Vec<Face>,
    rounds: Vec<Round>,
}

impl Builder {
    fn shape(&mut self, kind: Kind, name: &str, color: Rgb, celsius: f64, closed: bool) -> usize {
        self.shapes.push(Shape {
            kind,
            name: name.to_owned(),
            color,
            celsius,
            is_closed: closed,
        });
        self.shapes.len() - 1
    }

    fn shape_of(&mut self, kind: Kind, name: &str, body: &Body, is_closed: bool) -> usize {
        let by_kind = if kind == Kind::Agent { AGENT } else { OBJECT };
        let celsius = body.celsius(self.ambient_c, self.time.as_secs_f64());
        let color = body.color.unwrap_or(by_kind);
        self.shape(kind, name, color, celsius, is_closed)
    }

    fn agent(&mut self, agent: &Agent) {
        let bodies = agent.bodies_at(self.time);
        let Some(rounded_m) = agent.rounded_m(self.time) else {
            for body in &bodies {
                self.body(Kind::Agent, &agent.name, body);
            }
            return;
        };
        for (body, (center_m, axes_m)) in bodies.iter().zip(rounded_m) {
            let shape = self.shape_of(Kind::Agent, &agent.name, body, true);
            self.rounds.push(Round {
                shape,
                center_m,
                axes_m,
                footprints: Vec::new(),
            });
        }
    }

    fn body(&mut self, kind: Kind, name: &str, body: &Body) {
        let faces = body.mesh.faces().count();
        if faces > self.faces_left {
            let box_ = box_around(&body.mesh);
            let shape = self.shape_of(kind, name, body, true);
            self.faces.extend(faces_of(&box_, shape));
            return;
        }
        self.faces_left -= faces;
        let shape = self.shape_of(kind, name, body, body.mesh.is_closed());
        self.faces.extend(faces_of(&body.mesh, shape));
    }
}

/// The faces, with the edges that a draftsman would draw: not those within a round surface.
fn faces_of(mesh: &Mesh, shape: usize) -> Vec<Face> {
    let outlines: Vec<&[usize]> = mesh.faces().collect();
    let corners_m = |outline: &[usize]| -> Vec<DVec3> {
        let corners = outline.iter();
        corners.map(|corner| mesh.vertices_m()[*corner]).collect()
    };
    let normal = |outline: &&[usize]| {
        let plane = Plane::of_face(&corners_m(outline));
        plane.map_or(DVec3::ZERO, |plane| plane.normal)
    };
    let normals: Vec<DVec3> = outlines.iter().map(normal).collect();
    let mut beside: HashMap<(usize, usize), Vec<DVec3>> = HashMap::new();
    for (outline, normal) in outlines.iter().zip(&normals) {
        for edge in edges(outline) {
            beside.entry(edge).or_default().push(*normal);
        }
    }
    let is_crease = |edge: (usize, usize)| match beside[&edge][..] {
        [one, other] => one.dot(other) < CREASE_COS,
        _ => true,
    };
    let faces = outlines.iter().map(|outline| Face {
        shape,
        corners_m: corners_m(outline),
        edges: edges(outline).map(is_crease).collect(),
        footprints: Vec::new(),
    });
    faces.collect()
}

fn edges(outline: &[usize]) -> impl Iterator<Item = (usize, usize)> {
    let next = outline.iter().cycle().skip(1);
    let pairs = outline.iter().zip(next);
    pairs.map(|(from, to)| (*from.min(to), *from.max(to)))
}

fn box_around(mesh: &Mesh) -> Mesh {
    let (low, high) = mesh.bounds_m();
    let size_m = (high - low).max(DVec3::splat(1e-6));
    let base_m = low + 0.5 * size_m.with_z(0.0);
    Mesh::of_cuboid(&Cuboid::new(base_m, size_m, 0.0))
}

/// The name of the mosaic that a cell belongs to: the cell's name without the two numbers at its end.
#[must_use]
pub fn mosaic_of(name: &str) -> Option<&str> {
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let (front, column) = name.rsplit_once(' ')?;
    let (mosaic, row) = front.rsplit_once(' ')?;
    (is_number(row) && is_number(column)).then_some(mosaic)
}

/// A point to the millimeter.
pub(super) fn point(point_m: DVec3) -> [f64; 3] {
    (point_m * 1000.0).round().to_array().map(|mm| mm / 1000.0)
}

pub(super) fn points(points_m: &[DVec3]) -> Vec<[f64; 3]> {
    points_m.iter().copied().map(point).collect()
}

/// Faces that meet at less than 30 degrees are one round surface.
const CREASE_COS: f64 = 0.866;
