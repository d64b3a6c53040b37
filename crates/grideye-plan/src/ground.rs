//! Outlines of a scene from straight above, for drawing floor plans.

use glam::{DVec2, DVec3};
use grideye_scene::polygon::{clipped, hull};
use grideye_scene::{Body, Room, Sensor};

/// How far beside a corner rays pass it, so that one meets its wall and the other the wall behind it.
const ASIDE_RAD: f64 = 1e-9;

/// The outline of a body in place, meters: its convex hull, counter-clockwise.
#[must_use]
pub fn outline_m(body: &Body) -> Vec<DVec2> {
    let corners = body.mesh.vertices_m().iter();
    hull(corners.map(|corner| corner.truncate()).collect())
}

/// The part of the floor in a sensor's field of view, as far as the first wall, meters; empty if it sees no floor.
#[must_use]
pub fn in_view_m(room: &Room, sensor: &Sensor) -> Vec<DVec2> {
    let floor = before_walls(room, sensor).into_iter();
    let floor: Vec<DVec3> = floor.map(|corner| corner.extend(0.0)).collect();
    let seen = within_view(&floor, sensor);
    seen.iter().map(|corner| corner.truncate()).collect()
}

/// A sensor's field of view from the sensor to the first wall, at all heights of the room, meters.
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
    edges.fold(before_walls(room, sensor), |rest, (from, to)| {
        clipped(&rest, |at| (to - from).perp_dot(at - from))
    })
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
            let (reach, share) = (
                towards.perp_dot(wall) / slope,
                towards.perp_dot(ray) / slope,
            );
            let is_met = slope > 0.0 && (0.0..=1.0).contains(&share) && reach > -ASIDE_RAD;
            is_met.then_some(reach)
        };
        let reach = walls.iter().filter_map(meets).min_by(f64::total_cmp)?;
        Some(from + ray * reach)
    });
    ends.collect()
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
        looked_at_in("size_mm = [4000, 3000, 2500]", pose)
    }

    fn looked_at_in(room: &str, pose: &str) -> Scene {
        let text = format!(
            "[room]\n{room}\nambient_c = 20\n[[sensor]]\nname = \"s\"\npreset = \"grid-eye\"\nfov_deg = 60\n{pose}\n"
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
        let scene =
            looked_at("position_mm = [2000, 1500, 2500]\nelevation_deg = 90\nazimuth_deg = -90");
        let (room, sensor) = (scene.room(), &scene.sensors()[0]);
        let half_m = 2.5 * libm::tan(30.0_f64.to_radians());
        let wanted = [2.0 - half_m, 1.5 - half_m, 2.0 + half_m, 1.5 + half_m];
        let wanted = wanted.map(|side| (side * 1e6).round() / 1e6);
        assert_eq!(box_of(&in_view_m(room, sensor)), wanted);
        assert_eq!(box_of(&reach_m(room, sensor)), wanted);
    }

    #[test]
    fn at_a_wall_the_view_is_a_wedge_from_the_sensor_to_the_walls() {
        let scene = looked_at("position_mm = [0, 1500, 1000]\nelevation_deg = 0\nazimuth_deg = 0");
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
    fn a_corner_that_juts_into_the_room_hides_what_is_behind_it() {
        let plan = "plan_mm = [[0, 0], [4000, 0], [4000, 1000], [1000, 1000], [1000, 3000], [0, 3000]]\nheight_mm = 2500";
        let pose = "position_mm = [0, 3000, 2500]\nelevation_deg = 45\nazimuth_deg = -90";
        let scene = looked_at_in(plan, pose);
        let reach = reach_m(scene.room(), &scene.sensors()[0]);
        // The line of sight over the corner at (1, 1) falls by 2 m per meter and meets the front wall at x = 1.5 m.
        assert_eq!(box_of(&reach), [0.0, 0.0, 1.5, 3.0]);
        let is_near = |at: &DVec2| at.distance(DVec2::new(1.5, 0.0)) < 1e-6;
        assert!(reach.iter().any(is_near), "{reach:?}");
    }

    #[test]
    fn a_sensor_that_looks_away_from_the_room_reaches_nothing() {
        let scene =
            looked_at("position_mm = [0, 1500, 1000]\nelevation_deg = 0\nazimuth_deg = 180");
        assert_eq!(reach_m(scene.room(), &scene.sensors()[0]), []);
    }
}
