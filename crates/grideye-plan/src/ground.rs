//! A scene from straight above, as outlines, for whoever draws a plan of it.

use glam::{DVec2, DVec3};
use grideye_scene::polygon::{clipped, hull};
use grideye_scene::{Body, Room, Sensor};

/// The outline of a body where it stands, meters: its convex hull, counter-clockwise.
#[must_use]
pub fn outline_m(body: &Body) -> Vec<DVec2> {
    let corners = body.mesh.vertices_m().iter();
    hull(corners.map(|corner| corner.truncate()).collect())
}

/// The part of the floor in a sensor's field of view, as far as the walls, meters; empty if it sees no floor.
#[must_use]
pub fn in_view_m(room: &Room, sensor: &Sensor) -> Vec<DVec2> {
    let outline_m = room.outline_m();
    let floor: Vec<DVec3> = outline_m.iter().map(|corner| corner.extend(0.0)).collect();
    let seen = within_view(&floor, sensor);
    seen.iter().map(|corner| corner.truncate()).collect()
}

/// A sensor's field of view from the sensor to the walls, at all heights of the room, meters.
#[must_use]
pub fn reach_m(room: &Room, sensor: &Sensor) -> Vec<DVec2> {
    let sides = room.sides_m();
    let ends = sides.iter().flat_map(|side| within_view(side, sensor));
    let apex = std::iter::once(sensor.pose.position_m);
    let wedge = hull(apex.chain(ends).map(DVec3::truncate).collect());
    if wedge.len() < 3 {
        return Vec::new();
    }
    let edges = wedge.iter().zip(wedge.iter().cycle().skip(1));
    // The hull bridges the notch of a room that is not convex, and the room's outline takes the bridge away.
    edges.fold(room.outline_m(), |rest, (from, to)| {
        clipped(&rest, |at| (to - from).perp_dot(at - from))
    })
}

/// The part of a surface in a sensor's field of view.
fn within_view(surface: &[DVec3], sensor: &Sensor) -> Vec<DVec3> {
    let slopes = sensor.view_slopes();
    let borders = [
        DVec3::new(slopes.x, 1.0, 0.0),
        DVec3::new(slopes.x, -1.0, 0.0),
        DVec3::new(slopes.y, 0.0, 1.0),
        DVec3::new(slopes.y, 0.0, -1.0),
    ];
    borders.iter().fold(surface.to_vec(), |rest, border| {
        clipped(&rest, |corner| {
            border.dot(sensor.pose.point_in_sensor(corner))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use grideye_scene::Scene;
    use grideye_scene::polygon::bounds;
    use std::io;

    /// A room of 4 by 3 by 2.5 m with one sensor of 60 by 60 degrees.
    fn looked_at(pose: &str) -> Scene {
        let text = format!(
            "[room]\nsize_mm = [4000, 3000, 2500]\nambient_c = 20\n[[sensor]]\nname = \"s\"\npreset = \"grid-eye\"\nfov_deg = 60\n{pose}\n"
        );
        let no_files = |_: &str| Err::<String, _>(io::ErrorKind::NotFound.into());
        Scene::parse(&text, "test", &no_files).unwrap().scene
    }

    fn box_of(outline: &[DVec2]) -> [f64; 4] {
        let (low, high) = bounds(outline.iter().copied());
        [low.x, low.y, high.x, high.y].map(|side| (side * 1e6).round() / 1e6)
    }

    #[test]
    fn straight_down_the_view_reaches_as_far_as_its_footprint() {
        let scene = looked_at("position_mm = [2000, 1500, 2500]\nelevation_deg = 90");
        let (room, sensor) = (scene.room(), &scene.sensors()[0]);
        let half_m = 2.5 * libm::tan(30.0_f64.to_radians());
        let wanted = [2.0 - half_m, 1.5 - half_m, 2.0 + half_m, 1.5 + half_m];
        let wanted = wanted.map(|side| (side * 1e6).round() / 1e6);
        assert_eq!(box_of(&in_view_m(room, sensor)), wanted);
        assert_eq!(box_of(&reach_m(room, sensor)), wanted);
    }

    #[test]
    fn at_a_wall_the_view_is_a_wedge_from_the_sensor_to_the_walls() {
        let scene = looked_at("position_mm = [0, 1500, 1000]\nelevation_deg = 0");
        let (room, sensor) = (scene.room(), &scene.sensors()[0]);
        // The floor comes into view where the lowest ray meets it; sideways, the wedge is as wide as the room from 2.6 m on.
        let nearest_m = 1.0 / libm::tan(30.0_f64.to_radians());
        let nearest_m = (nearest_m * 1e6).round() / 1e6;
        assert_eq!(box_of(&in_view_m(room, sensor)), [nearest_m, 0.0, 4.0, 3.0]);
        let reach = reach_m(room, sensor);
        assert_eq!(box_of(&reach), [0.0, 0.0, 4.0, 3.0]);
        let is_in = |at: DVec2| {
            let next = reach.iter().cycle().skip(1);
            reach
                .iter()
                .zip(next)
                .all(|(from, to)| (to - from).perp_dot(at - from) >= -1e-9)
        };
        assert!(is_in(DVec2::new(1.0, 1.5 + 0.57)) && !is_in(DVec2::new(1.0, 1.5 + 0.59)));
    }

    #[test]
    fn a_sensor_that_looks_away_from_the_room_reaches_nothing() {
        let scene =
            looked_at("position_mm = [0, 1500, 1000]\nelevation_deg = 0\nazimuth_deg = 180");
        assert_eq!(reach_m(scene.room(), &scene.sensors()[0]), []);
    }
}
