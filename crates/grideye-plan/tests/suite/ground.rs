//! A sensor's field of view on the floor and up to the walls.

use glam::{DVec2, DVec3};
use grideye_plan::ground::{View, in_view_m, view};
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
fn straight_down_the_floor_in_view_is_a_square() {
    let scene =
        looked_at("position_mm = [2000, 1500, 2500]\nelevation_deg = 90\nazimuth_deg = -90");
    let (room, sensor) = (scene.room(), &scene.sensors()[0]);
    let half_m = 2.5 * libm::tan(30.0_f64.to_radians());
    let wanted = [2.0 - half_m, 1.5 - half_m, 2.0 + half_m, 1.5 + half_m];
    let wanted = wanted.map(|side| (side * 1e6).round() / 1e6);
    assert_eq!(box_of(&in_view_m(room, sensor)), wanted);
}

#[test]
fn at_a_wall_the_floor_comes_into_view_where_the_lowest_ray_meets_it() {
    let scene = looked_at("position_mm = [0, 1500, 1000]\nelevation_deg = 0\nazimuth_deg = 0");
    let (room, sensor) = (scene.room(), &scene.sensors()[0]);
    // Sideways, the view is as wide as the room from 2.6 m on.
    let nearest_m = 1.0 / libm::tan(30.0_f64.to_radians());
    let nearest_m = (nearest_m * 1e6).round() / 1e6;
    assert_eq!(box_of(&in_view_m(room, sensor)), [nearest_m, 0.0, 4.0, 3.0]);
}

#[test]
fn a_sensor_that_looks_away_from_the_room_has_nothing_in_view() {
    let scene = looked_at("position_mm = [0, 1500, 1000]\nelevation_deg = 0\nazimuth_deg = 180");
    let (room, sensor) = (scene.room(), &scene.sensors()[0]);
    assert_eq!(in_view_m(room, sensor), []);
    assert_eq!(view(room, sensor).faces_m, Vec::<Vec<DVec3>>::new());
}

/// Twice the area of a flat face, m².
fn area_m2(face: &[DVec3]) -> f64 {
    let next = face.iter().skip(1);
    let pairs = face.iter().zip(next);
    let sum: DVec3 = pairs
        .map(|(from, to)| (*from - face[0]).cross(*to - face[0]))
        .sum();
    0.5 * sum.length()
}

/// Level, at the middle of the left wall, 1 m up: the far wall is 4 m away and the view 4.62 m wide and high there, so it
/// sees all of that wall.
#[test]
fn a_view_in_space_covers_what_the_walls_leave_and_its_rays_end_there() {
    let scene = looked_at("position_mm = [0, 1500, 1000]\nelevation_deg = 0\nazimuth_deg = 0");
    let sensor = &scene.sensors()[0];
    let View { faces_m, corners_m } = view(scene.room(), sensor);
    let is_far = |face: &&Vec<DVec3>| face.iter().all(|corner| corner.x > 4.0 - 1e-9);
    let far: Vec<f64> = faces_m
        .iter()
        .filter(is_far)
        .map(|face| area_m2(face))
        .collect();
    assert!(
        far.len() == 1 && (far[0] - 3.0 * 2.5).abs() < 1e-9,
        "{far:?}"
    );
    let floor: Vec<&Vec<DVec3>> = faces_m
        .iter()
        .filter(|face| face.iter().all(|corner| corner.z == 0.0))
        .collect();
    assert_eq!(floor.len(), 1);
    let flat: Vec<DVec2> = floor[0].iter().map(|corner| corner.truncate()).collect();
    assert_eq!(box_of(&flat), box_of(&in_view_m(scene.room(), sensor)));
    // The rays along the corners of the image are at 30 degrees in either direction: two meet the floor, two the edge
    // between a side wall, 1.5 m aside, and the ceiling, 1.5 m up.
    assert_eq!(corners_m.len(), 4, "{corners_m:?}");
    let reach_m = 1.0 / libm::tan(30.0_f64.to_radians());
    for corner in &corners_m {
        let on_floor = corner.z.abs() < 1e-9 && (corner.x - reach_m).abs() < 1e-6;
        let on_side = (corner.y - 1.5).abs() > 1.5 - 1e-6 && (corner.z - 2.5).abs() < 1e-6;
        assert!(on_floor || on_side, "{corner}");
    }
}

#[test]
fn a_view_around_a_corner_ends_where_the_corner_hides_the_rest() {
    let plan = "plan_mm = [[0, 0], [4000, 0], [4000, 1000], [1000, 1000], [1000, 3000], [0, 3000]]\nheight_mm = 2500";
    let pose = "position_mm = [500, 2500, 2400]\nelevation_deg = 40\nazimuth_deg = -80";
    let scene = looked_at_in(plan, pose);
    let sensor = &scene.sensors()[0];
    let seen = view(scene.room(), sensor);
    assert!(!seen.faces_m.is_empty());
    // Nothing behind the line from the sensor past the corner at (1, 1), and nothing seen through its walls.
    let tip = sensor.pose.position_m;
    for corner in seen.faces_m.iter().flatten() {
        assert!(scene.room().contains(*corner), "{corner}");
        for step in 1..50 {
            let between = tip.lerp(*corner, f64::from(step) / 50.0);
            assert!(scene.room().contains(between), "{corner} through {between}");
        }
    }
}
