//! Converts the room's contents to flat pieces to paint.

use super::camera::{Camera, Plane};
use super::limits;
use super::options::Drawing;
use super::painter::{Paint, Piece, clipped};
use glam::{DVec2, DVec3};
use grideye_scene::{Agent, Cuboid, Mesh, Room, Scene, Sensor, count};
use std::collections::HashMap;
use std::f64::consts::TAU;

pub(super) fn bounds_m(scene: &Scene) -> (DVec3, DVec3) {
    scene.room().bounds_m()
}

/// The room's floor, walls and ceiling, each as an outline facing into the room.
pub(super) struct Walls {
    /// Sides with the whole room in front of them: seen from within, none hides another.
    pub(super) around: Vec<Vec<DVec3>>,
    /// Walls that jut into the room, cut into convex faces.
    pub(super) jutting: Vec<Vec<DVec3>>,
    /// All sides, cut into convex faces.
    convex: Vec<Vec<DVec3>>,
}

impl Walls {
    pub(super) fn new(room: &Room) -> Self {
        let jutting = room.jutting_m();
        let mut around = room.sides_m();
        around.retain(|side| !jutting.contains(side));
        Self {
            around,
            jutting,
            convex: room.convex_sides_m(),
        }
    }
}

pub(super) fn of_scene(
    (scene, walls): (&Scene, &Walls),
    drawing: &Drawing<'_>,
    camera: &Camera,
    is_perspective: bool,
) -> Vec<Piece> {
    let mut pieces = jutting_walls(walls, camera);
    let mut faces_left = limits::FACES_MAX;
    for body in scene.objects() {
        let color = body.color.unwrap_or(OBJECT);
        add_body(&mut pieces, &body.mesh, color, camera, &mut faces_left);
    }
    for agent in scene.agents() {
        // One direction for a whole person: planes of its segments that are parallel do not cut one another.
        let ahead = camera.towards_eye_from(agent.position_m(drawing.time));
        for part in agent.bodies_at(drawing.time) {
            let color = part.color.unwrap_or(AGENT);
            match agent.person {
                Some(_) => add_segment(&mut pieces, &part.mesh, color, (camera, ahead)),
                None => add_body(&mut pieces, &part.mesh, color, camera, &mut faces_left),
            }
        }
        add_trajectory(
            &mut pieces,
            agent,
            drawing.sampled_by.or(scene.sensors().first()),
        );
    }
    let root = count::float(scene.sensors().len().max(1)).sqrt();
    let opacity = PYRAMID_OPACITY / (root * root.sqrt());
    for sensor in scene.sensors() {
        // From above, the sides would tint everything below them; their edges, the two diagonals, suffice.
        let of_sides = if is_perspective { opacity } else { 0.0 };
        add_view(&mut pieces, sensor, walls, (of_sides, opacity));
    }
    pieces
}

/// Draw a circle on the agent's path at every how many frames.
pub(super) fn circle_step(agent: &Agent, sensor: &Sensor) -> usize {
    frames_on_trajectory(agent, sensor)
        .div_ceil(limits::CIRCLES_MAX)
        .max(1)
}

pub(super) fn captured_points_m(agent: &Agent, sensor: &Sensor) -> Vec<DVec3> {
    let step = circle_step(agent, sensor);
    (0..frames_on_trajectory(agent, sensor))
        .step_by(step)
        .map(|index| agent.position_m(sensor.frame_time(u32::try_from(index).unwrap_or(u32::MAX))))
        .collect()
}

fn view_corners_m(sensor: &Sensor, forward_m: f64) -> [DVec3; 4] {
    let slopes = sensor.view_slopes();
    let world_from_sensor = sensor.pose.world_from_sensor();
    [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].map(|(to_left, to_top)| {
        let direction = DVec3::new(1.0, to_left * slopes.x, to_top * slopes.y);
        sensor.pose.position_m + world_from_sensor * (forward_m * direction)
    })
}

fn frames_on_trajectory(agent: &Agent, sensor: &Sensor) -> usize {
    let last = (agent.duration().as_secs_f64() * sensor.sampling_hz + 1e-6).floor();
    count::floor(last).saturating_add(1).min(FRAMES_MAX)
}

fn add_body(
    pieces: &mut Vec<Piece>,
    mesh: &Mesh,
    color: [u8; 3],
    camera: &Camera,
    faces_left: &mut usize,
) {
    let faces = mesh.faces().count();
    if faces > limits::FACES_OF_BODY_MAX || faces > *faces_left {
        add_solid(pieces, &box_around(mesh), color, camera);
        return;
    }
    *faces_left -= faces;
    add_solid(pieces, mesh, color, camera);
}

/// A person's segment as its silhouette: an outline through its middle, across the direction ahead to the eye.
fn add_segment(
    pieces: &mut Vec<Piece>,
    mesh: &Mesh,
    color: [u8; 3],
    (camera, ahead): (&Camera, DVec3),
) {
    let (low, high) = mesh.bounds_m();
    let middle_m = 0.5 * (low + high);
    let right = ahead.any_orthonormal_vector();
    let up = ahead.cross(right);
    let corners: Vec<DVec2> = mesh
        .vertices_m()
        .iter()
        .map(|corner_m| {
            let ray = camera.towards_eye_from(*corner_m);
            let from_middle_m = *corner_m - middle_m;
            let on_plane = from_middle_m - from_middle_m.dot(ahead) / ray.dot(ahead) * ray;
            DVec2::new(on_plane.dot(right), on_plane.dot(up))
        })
        .collect();
    let mut outline: Vec<DVec2> = (0..SILHOUETTE)
        .filter_map(|side| {
            let angle = TAU * count::float(side) / count::float(SILHOUETTE);
            let outward = DVec2::new(libm::cos(angle), libm::sin(angle));
            let reach = |corner: &DVec2| corner.dot(outward);
            let far = |one: &DVec2, other: &DVec2| reach(one).total_cmp(&reach(other));
            corners.iter().copied().max_by(far)
        })
        .collect();
    outline.dedup();
    let outline = outline.iter().map(|at| middle_m + at.x * right + at.y * up);
    let fill = shaded(color, ahead);
    let edge = color.map(|part| part / 2);
    pieces.push(Piece::face(outline.collect(), fill, 1.0, edge));
}

fn box_around(mesh: &Mesh) -> Mesh {
    let (low, high) = mesh.bounds_m();
    let size_m = (high - low).max(DVec3::splat(1e-6));
    let base_m = low + 0.5 * size_m.with_z(0.0);
    Mesh::of_cuboid(&Cuboid::new(base_m, size_m, 0.0))
}

/// The faces visible from outside, with the edges that a draftsman would draw.
fn add_solid(pieces: &mut Vec<Piece>, mesh: &Mesh, color: [u8; 3], camera: &Camera) {
    let outlines: Vec<&[usize]> = mesh.faces().collect();
    let points_m = |outline: &[usize]| -> Vec<DVec3> {
        let corners = outline.iter();
        corners.map(|corner| mesh.vertices_m()[*corner]).collect()
    };
    let planes = outlines.iter();
    let planes = planes.map(|outline| Plane::of_face(&points_m(outline)));
    let planes: Vec<Option<Plane>> = planes.collect();
    let mut beside: HashMap<(usize, usize), Vec<usize>> = HashMap::new();
    for (face, outline) in outlines.iter().enumerate() {
        for edge in edges(outline) {
            beside.entry(edge).or_default().push(face);
        }
    }
    let is_open = !mesh.is_closed();
    let seen = |face: usize| planes[face].is_some_and(|plane| camera.side_of(&plane) > 0.0);
    for (face, outline) in outlines.iter().enumerate() {
        let Some(plane) = planes[face].filter(|_| is_open || seen(face)) else {
            continue;
        };
        let shown = if seen(face) { plane } else { plane.opposite() };
        let is_drawn = |edge: (usize, usize)| {
            beside.get(&edge).is_none_or(|faces| match faces[..] {
                [one, other] => seen(one) != seen(other) || is_crease(planes[one], planes[other]),
                _ => true,
            })
        };
        pieces.push(Piece {
            points_m: points_m(outline),
            edges: edges(outline).map(is_drawn).collect(),
            paint: Paint::Face {
                fill: shaded(color, shown.normal),
                opacity: 1.0,
                edge: color.map(|part| part / 2),
            },
        });
    }
}

fn edges(outline: &[usize]) -> impl Iterator<Item = (usize, usize)> {
    let following = outline.iter().cycle().skip(1);
    outline
        .iter()
        .zip(following)
        .map(|(from, to)| (*from.min(to), *from.max(to)))
}

fn is_crease(one: Option<Plane>, other: Option<Plane>) -> bool {
    one.zip(other)
        .is_none_or(|(one, other)| one.normal.dot(other.normal) < CREASE_COS)
}

fn shaded(color: [u8; 3], normal: DVec3) -> [u8; 3] {
    let light = DVec3::new(-0.37, -0.56, 0.74);
    let brightness = 0.72 + 0.28 * normal.dot(light).max(0.0);
    color.map(|part| {
        let lit = count::floor((f64::from(part) * brightness).round());
        u8::try_from(lit).unwrap_or(u8::MAX)
    })
}

fn add_trajectory(pieces: &mut Vec<Piece>, agent: &Agent, sensor: Option<&Sensor>) {
    let Some(trajectory) = &agent.trajectory else {
        return;
    };
    let color = agent.parts.iter().find_map(|part| part.color);
    let color = color.unwrap_or(AGENT);
    let legs = trajectory.waypoints_m().windows(2);
    pieces.extend(legs.map(|leg| Piece::without_edges(leg.to_vec(), Paint::Line { color })));
    let Some(sensor) = sensor else { return };
    let points_m = captured_points_m(agent, sensor);
    let radius = if points_m.len() > CROWDED { 1.8 } else { 3.0 };
    let circle = |point| Piece::without_edges(vec![point], Paint::Circle { color, radius });
    pieces.extend(points_m.into_iter().map(circle));
}

/// The walls that jut in and face the camera; things behind them show through.
fn jutting_walls(walls: &Walls, camera: &Camera) -> Vec<Piece> {
    let is_seen = |side: &&Vec<DVec3>| {
        Plane::of_face(side).is_some_and(|plane| camera.side_of(&plane) > 1e-9)
    };
    let piece = |side: &Vec<DVec3>| Piece::face(side.clone(), WALL, WALL_OPACITY, WALL_EDGE);
    walls.jutting.iter().filter(is_seen).map(piece).collect()
}

fn add_view(
    pieces: &mut Vec<Piece>,
    sensor: &Sensor,
    walls: &Walls,
    (of_sides, of_walls): (f64, f64),
) {
    let tip_m = sensor.pose.position_m;
    let reach_m = walls.convex.iter().flatten();
    let reach_m = reach_m.map(|corner| corner.distance(tip_m));
    let corners_m = view_corners_m(sensor, 2.0 * reach_m.fold(0.0, f64::max));
    let sides: Vec<Vec<DVec3>> = (0..4)
        .map(|index| vec![tip_m, corners_m[index], corners_m[(index + 1) % 4]])
        .collect();
    let jutting = walls.jutting.iter().take(SHADOWS_MAX);
    let shadows: Vec<_> = jutting.filter_map(|wall| shadow(tip_m, wall)).collect();
    let around = walls.around.iter();
    let outer: Vec<_> = around.filter_map(|wall| Plane::of_face(wall)).collect();
    let sides_seen = sides.iter();
    let sides_seen = sides_seen.filter_map(|side| within(side, &outer, of_sides));
    pieces.extend(sides_seen.flat_map(|side| lit(side, &shadows)));
    let ahead_m = tip_m + sensor.pose.world_from_sensor().x_axis;
    let inward = sides.iter().filter_map(|side| facing(side, ahead_m));
    let inward: Vec<Plane> = inward.collect();
    if inward.len() < sides.len() {
        return;
    }
    let shows = |wall: &&Vec<DVec3>| {
        Plane::of_face(wall).is_some_and(|plane| plane.height_m(tip_m) > -ON_WALL_M)
    };
    for wall in walls.convex.iter().filter(shows) {
        let Some(seen) = within(wall, &inward, of_walls) else {
            continue;
        };
        // The view's own outline ends at the wall too; edges where a floor was cut are not drawn.
        let is_whole = walls.around.contains(wall) || walls.jutting.contains(wall);
        let seen = Piece {
            edges: vec![is_whole; seen.points_m.len()],
            ..seen
        };
        pieces.extend(lit(seen, &shadows));
    }
}

/// The planes around what a wall hides from a point, positive inside; `None` if the wall faces away from the point.
fn shadow(tip_m: DVec3, wall: &[DVec3]) -> Option<Vec<Plane>> {
    let plane = Plane::of_face(wall)?;
    if plane.height_m(tip_m) <= ON_WALL_M {
        return None;
    }
    let middle_m = wall.iter().sum::<DVec3>() / count::float(wall.len());
    let sides = wall.iter().zip(wall.iter().cycle().skip(1));
    let sides = sides.filter_map(|(from, to)| facing(&[tip_m, *from, *to], middle_m));
    let mut planes: Vec<Plane> = sides.collect();
    // The wall does not hide itself.
    planes.push(Plane::new(-plane.normal, -plane.offset_m + ON_WALL_M));
    Some(planes)
}

fn lit(piece: Piece, shadows: &[Vec<Plane>]) -> Vec<Piece> {
    shadows.iter().fold(vec![piece], |lit, shadow| {
        let parts = lit.into_iter().flat_map(|piece| outside(piece, shadow));
        parts.collect()
    })
}

fn outside(piece: Piece, shadow: &[Plane]) -> Vec<Piece> {
    let is_hidden = shadow
        .iter()
        .try_fold(piece.clone(), |rest, plane| clipped(&rest, plane))
        .is_some_and(|hidden| Plane::of_face(&hidden.points_m).is_some());
    if !is_hidden {
        return vec![piece];
    }
    let mut parts = Vec::new();
    let mut rest = Some(piece);
    for plane in shadow {
        let Some(whole) = rest else { break };
        let part = clipped(&whole, &plane.opposite());
        parts.extend(part.filter(|part| Plane::of_face(&part.points_m).is_some()));
        rest = clipped(&whole, plane);
    }
    parts
}

/// The part of a face on the positive side of all planes, in the yellow of views.
fn within(outline: &[DVec3], planes: &[Plane], opacity: f64) -> Option<Piece> {
    let whole = Piece::face(outline.to_vec(), SEEN, opacity, SEEN_EDGE);
    let piece = planes
        .iter()
        .try_fold(whole, |piece, plane| clipped(&piece, plane))?;
    Plane::of_face(&piece.points_m).map(|_| piece)
}

/// The plane of a face, oriented so that `point_m` is on its positive side.
fn facing(outline: &[DVec3], point_m: DVec3) -> Option<Plane> {
    let plane = Plane::of_face(outline)?;
    let is_behind = plane.height_m(point_m) < 0.0;
    Some(if is_behind { plane.opposite() } else { plane })
}

/// PeerJ CS 11:e3124, "Object placement": blue by default.
pub(super) const OBJECT: [u8; 3] = [0x5b, 0x8d, 0xd9];
/// The same paper, "Agent configuration": red by default.
pub(super) const AGENT: [u8; 3] = [0xd6, 0x3b, 0x33];
pub(super) const SEEN: [u8; 3] = [0xff, 0xd5, 0x2e];
pub(super) const SEEN_EDGE: [u8; 3] = [0xb8, 0x86, 0x00];

const WALL: [u8; 3] = [0xe6; 3];
const WALL_EDGE: [u8; 3] = [0x99; 3];
const WALL_OPACITY: f64 = 0.6;
/// Limit on the walls that cut shadows out of a sensor's view; further walls cast none.
const SHADOWS_MAX: usize = 100;
const ON_WALL_M: f64 = 1e-6;
const PYRAMID_OPACITY: f64 = 0.22;
/// Faces that meet at less than 30 degrees are one round surface.
const CREASE_COS: f64 = 0.866;
/// Corners of a segment's silhouette.
const SILHOUETTE: usize = 16;
const CROWDED: usize = 60;
const FRAMES_MAX: usize = 1_000_000;
