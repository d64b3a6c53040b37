//! A scene from straight above, as outlines, for whoever draws a plan of it.

use glam::{DVec2, DVec3};
use grideye_scene::Body;
use grideye_scene::Room;
use grideye_scene::Sensor;
use grideye_scene::polygon::clipped;

/// The outline of a body where it stands, metres: its convex hull, counter-clockwise.
#[must_use]
pub fn outline_m(body: &Body) -> Vec<DVec2> {
    let corners = body.mesh.vertices_m().iter();
    hull(corners.map(|corner| corner.truncate()).collect())
}

/// The part of the floor in a sensor's field of view, as far as the walls, metres; empty where it sees none.
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

/// The convex hull of points, counter-clockwise (Andrew 1979).
fn hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|one, other| one.x.total_cmp(&other.x).then(one.y.total_cmp(&other.y)));
    let half = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for point in points {
            while let [.., before, last] = chain.as_slice() {
                if (*last - *before).perp_dot(point - *last) > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut points.iter().copied());
    hull.extend(half(&mut points.iter().rev().copied()));
    hull
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hull_of_a_square_with_a_point_in_it_is_the_square() {
        let corners = [
            (0.0, 0.0),
            (2.0, 0.0),
            (2.0, 2.0),
            (0.0, 2.0),
            (1.0, 1.0),
            (1.0, 0.0),
        ];
        let found = hull(corners.map(DVec2::from).to_vec());
        assert_eq!(
            found,
            corners[..4]
                .iter()
                .copied()
                .map(DVec2::from)
                .collect::<Vec<_>>()
        );
    }
}
