//! Outlines of a scene from straight above, and what sensors have in view of a room, for drawing.

use crate::plane::Plane;
use glam::{DVec2, DVec3};
use grideye_scene::polygon::{clipped, hull};
use grideye_scene::{Body, Room, Sensor};

/// How far beside a corner rays pass it, so that one meets its wall and the other the wall behind it.
const ASIDE_RAD: f64 = 1e-9;
/// What is nearer than this is one point, or in one plane, meters.
const ON_WALL_M: f64 = 1e-6;

/// The outline of a body in place, meters: its convex hull, counter-clockwise.
#[must_use]
pub fn outline_m(body: &Body) -> Vec<DVec2> {
    let corners = body.mesh.vertices_m().iter();
    hull(corners.map(|corner| corner.truncate()).collect())
}

/// What a sensor has in view of its room, meters.
#[derive(Debug, Clone, Default)]
pub struct View {
    /// The parts of walls, floor and ceiling.
    pub faces_m: Vec<Vec<DVec3>>,
    /// Where the rays along the corners of its image meet the room.
    pub corners_m: Vec<DVec3>,
}

/// What a sensor has in view of its room; furniture hides nothing.
#[must_use]
pub fn view(room: &Room, sensor: &Sensor) -> View {
    let tip_m = sensor.pose.position_m;
    let mut view = View::default();
    for side in sides_before_walls(room, sensor) {
        let face = within_view(&side, sensor);
        // A wall that the sensor is on, and a line of sight beside a corner, are seen from their edge.
        let apart_m = Plane::of_face(&face).map_or(0.0, |plane| plane.height_m(tip_m));
        if apart_m < ON_WALL_M {
            continue;
        }
        for corner in &face {
            let in_sensor = sensor.pose.point_in_sensor(*corner);
            let borders = borders(sensor.view_slopes()).into_iter();
            let touched = borders.filter(|border| border.dot(in_sensor).abs() < ON_WALL_M);
            let is_new = |other: &DVec3| other.distance(*corner) > ON_WALL_M;
            if touched.count() > 1 && view.corners_m.iter().all(is_new) {
                view.corners_m.push(*corner);
            }
        }
        view.faces_m.push(face);
    }
    view
}

/// The part of the floor in a sensor's field of view, as far as the first wall, meters; empty if it sees no floor.
#[must_use]
pub fn in_view_m(room: &Room, sensor: &Sensor) -> Vec<DVec2> {
    let level_m = room.bounds_m().0.z;
    let floor = before_walls(room, sensor).into_iter();
    let floor: Vec<DVec3> = floor.map(|corner| corner.extend(level_m)).collect();
    let seen = within_view(&floor, sensor);
    seen.iter().map(|corner| corner.truncate()).collect()
}

/// The floor, the ceiling and the walls of a room up to those that a sensor meets first.
fn sides_before_walls(room: &Room, sensor: &Sensor) -> Vec<Vec<DVec3>> {
    if room.jutting_m().is_empty() {
        return room.sides_m();
    }
    let (low_m, high_m) = room.bounds_m();
    let outline = before_walls(room, sensor);
    let level = |height_m: f64| outline.iter().map(move |at| at.extend(height_m));
    let edges = outline.iter().zip(outline.iter().cycle().skip(1));
    let wall = |(from, to): (&DVec2, &DVec2)| {
        let (top, bottom) = (high_m.z, low_m.z);
        vec![
            from.extend(top),
            to.extend(top),
            to.extend(bottom),
            from.extend(bottom),
        ]
    };
    let floor = level(low_m.z).collect();
    let ceiling = level(high_m.z).rev().collect();
    [floor, ceiling]
        .into_iter()
        .chain(edges.map(wall))
        .collect()
}

/// The outline of a room up to the walls that a sensor meets first: all of it, unless a corner juts into the room.
fn before_walls(room: &Room, sensor: &Sensor) -> Vec<DVec2> {
    let (outline, from) = (room.outline_m(), sensor.pose.position_m.truncate());
    let next = outline.iter().copied().cycle().skip(1);
    let walls: Vec<(DVec2, DVec2)> = outline.iter().copied().zip(next).collect();
    let mut corners = walls.iter().zip(walls.iter().cycle().skip(1));
    if corners.all(|((start, end), (_, next))| (end - start).perp_dot(next - end) >= 0.0) {
        return outline;
    }
    let angles = outline.iter().flat_map(|corner| {
        let angle = libm::atan2(corner.y - from.y, corner.x - from.x);
        [angle - ASIDE_RAD, angle + ASIDE_RAD]
    });
    let mut angles: Vec<f64> = angles.collect();
    angles.sort_by(f64::total_cmp);
    let ends = angles.iter().filter_map(|angle| {
        let ray = DVec2::new(libm::cos(*angle), libm::sin(*angle));
        let meets = |(start, end): &(DVec2, DVec2)| {
            let (wall, towards) = (end - start, start - from);
            // Positive where the ray leaves the room: a sensor on a wall does not meet that wall.
            let slope = ray.perp_dot(wall);
            let reach = towards.perp_dot(wall) / slope;
            let share = towards.perp_dot(ray) / slope;
            let is_met = slope > 0.0 && (0.0..=1.0).contains(&share) && reach > -ASIDE_RAD;
            is_met.then_some(reach)
        };
        let reach = walls.iter().filter_map(meets).min_by(f64::total_cmp)?;
        Some(from + ray * reach)
    });
    let mut outline: Vec<DVec2> = ends.collect();
    outline.extend(outline.first().copied());
    outline.dedup_by(|next, before| next.distance(*before) < ON_WALL_M);
    outline.pop();
    let around = |index: usize| outline[index % outline.len()];
    let turns = (0..outline.len()).filter(|index| {
        let [before, at, next] = [outline.len() - 1, 0, 1].map(|step| around(index + step));
        (at - before).perp_dot(next - at).abs() > ON_WALL_M
    });
    turns.map(around).collect()
}

/// The part of a surface in a sensor's field of view.
fn within_view(surface: &[DVec3], sensor: &Sensor) -> Vec<DVec3> {
    let borders = borders(sensor.view_slopes());
    borders.iter().fold(surface.to_vec(), |rest, border| {
        clipped(&rest, |corner| {
            border.dot(sensor.pose.point_in_sensor(corner))
        })
    })
}

/// The vectors that have no negative product with a point in view, in the sensor's own directions.
fn borders(slopes: DVec2) -> [DVec3; 4] {
    [
        DVec3::new(slopes.x, 1.0, 0.0),
        DVec3::new(slopes.x, -1.0, 0.0),
        DVec3::new(slopes.y, 0.0, 1.0),
        DVec3::new(slopes.y, 0.0, -1.0),
    ]
}
