//! Outlines of a scene from straight above, for drawing floor plans.

use glam::{DVec2, DVec3};
use grideye_scene::polygon::{clipped, hull};
use grideye_scene::{Body, Room, Sensor};

/// The outline of a body in place, meters: its convex hull, counter-clockwise.
#[must_use]
pub fn outline_m(body: &Body) -> Vec<DVec2> {
    let corners = body.mesh.vertices_m().iter();
    hull(corners.map(|corner| corner.truncate()).collect())
}

/// The part of the floor in a sensor's field of view, up to the walls, meters; empty if it sees none.
#[must_use]
pub fn in_view_m(room: &Room, sensor: &Sensor) -> Vec<DVec2> {
    let outline_m = room.outline_m();
    let floor: Vec<DVec3> = outline_m.iter().map(|corner| corner.extend(0.0)).collect();
    let slopes = sensor.view_slopes();
    let borders = [
        DVec3::new(slopes.x, 1.0, 0.0),
        DVec3::new(slopes.x, -1.0, 0.0),
        DVec3::new(slopes.y, 0.0, 1.0),
        DVec3::new(slopes.y, 0.0, -1.0),
    ];
    let seen = borders.iter().fold(floor, |rest, border| {
        clipped(&rest, |corner| {
            border.dot(sensor.pose.point_in_sensor(corner))
        })
    });
    seen.iter().map(|corner| corner.truncate()).collect()
}
