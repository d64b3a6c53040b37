//! What each pose sees: against closed forms, a march along rays, and the simulator's own frames.

use super::{cells_of, looks, sensor, survey};
use crate::{ROOM, object, scene};
use glam::{DVec2, DVec3};
use grideye_plan::coverage::{
    Figure, Grain, InSight, Kind, Map, Mount, Mounts, Survey, Wish, candidates, preset,
};
use grideye_scene::{Scene, Simulator};
use std::time::Duration;

#[test]
fn the_footprint_of_60_degrees_from_2_7_meters_is_3_118_meters() {
    let scene = scene(&format!(
        "{ROOM}{}",
        sensor("S", [2000.0, 3000.0, 2700.0], 90.0, -90.0)
    ));
    let survey = survey(&scene, 25.0);
    let look = &looks(&survey, &scene)[0];
    let half_m = 0.5 * 3.118;
    let mut seen = 0;
    for (cell, found) in survey.floor().cells.iter().zip(&look.cells) {
        let away = (cell.ground_m.truncate() - DVec2::new(2.0, 3.0))
            .abs()
            .max_element();
        if (away - half_m).abs() < 2e-3 {
            continue;
        }
        let expected = if away < half_m {
            InSight::Seen
        } else {
            InSight::OutOfView
        };
        assert_eq!(found.ground, expected, "{}", cell.ground_m);
        seen += usize::from(found.ground == InSight::Seen);
    }
    // 1.559 m to either side are the centers of 62 cells of 25 mm.
    assert_eq!(seen, 124 * 124);
}

#[test]
fn the_shadow_of_a_box_follows_similar_triangles() {
    // 1 m high, its far side 0.9 m from below the sensor: the shadow ends at 0.9 · 2.7 / 1.7 = 1.4294 m.
    let text = format!(
        "{ROOM}{}{}",
        object(
            "box",
            [2600.0, 3000.0, 0.0],
            [600.0, 800.0, 1000.0],
            0.0,
            20.1
        ),
        sensor("S", [2000.0, 3000.0, 2700.0], 90.0, -90.0)
    );
    let scene = scene(&text);
    let survey = survey(&scene, 25.0);
    let look = &looks(&survey, &scene)[0];
    let map = Map::new(survey.floor(), &[look], &Wish::default());
    let row = survey.floor().cells.iter().zip(&look.cells).zip(&map.spots);
    let mut hidden = 0;
    for ((cell, found), spot) in row.filter(|((cell, _), _)| (cell.ground_m.y - 3.0).abs() < 0.02) {
        let x = cell.ground_m.x - 2.0;
        let expected = match x {
            x if (0.3..0.9).contains(&x) => {
                assert_eq!((cell.kind, spot.ground), (Kind::Furniture, None));
                continue;
            }
            x if x > 0.9 && x < 1.4294 => InSight::Hidden,
            x if x.abs() < 1.5588 => InSight::Seen,
            _ => InSight::OutOfView,
        };
        assert_eq!(found.ground, expected, "{x}");
        if expected == InSight::Hidden {
            hidden += 1;
            assert_eq!(spot.ground, Some(InSight::Hidden));
        }
    }
    // Two rows of cells, 0.53 m of 25 mm each.
    assert_eq!(hidden, 2 * 21);
}

/// An independent generator: x' = 6364136223846793005 x + 1442695040888963407 (Knuth), its upper half.
pub(super) struct Dice(pub(super) u64);

impl Dice {
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (self.0 >> 33) as f64 / (1_u64 << 31) as f64
    }
}

/// An upright box: center of the base, size, rotation.
type Upright = (DVec3, DVec3, f64);

/// Whether a point is in a box enlarged by `more` on all sides.
fn is_in(point: DVec3, (base, size, yaw_deg): &Upright, more: f64) -> bool {
    let (sin, cos) = yaw_deg.to_radians().sin_cos();
    let from = point - *base;
    let own = DVec2::new(cos * from.x + sin * from.y, cos * from.y - sin * from.x).abs();
    own.x < 0.5 * size.x + more
        && own.y < 0.5 * size.y + more
        && from.z > -more
        && from.z < size.z + more
}

/// Five boxes on the floor, and a sensor's place and direction.
struct Thrown {
    boxes: Vec<Upright>,
    place: DVec3,
    elevation_deg: f64,
    azimuth_deg: f64,
}

impl Thrown {
    fn new(dice: &mut Dice) -> Self {
        let mut vector = |low: [f64; 3], high: [f64; 3]| {
            DVec3::from(std::array::from_fn(|axis| {
                dice.between(low[axis], high[axis])
            }))
        };
        let boxes = (0..5).map(|_| {
            let size = vector([0.3; 3], [1.0, 1.0, 1.6]);
            let base = vector([0.8, 0.8, 0.0], [3.2, 5.2, 0.0]);
            (base, size, vector([0.0; 3], [90.0; 3]).x)
        });
        let boxes = boxes.collect();
        let place = vector([0.2, 0.2, 1.9], [3.8, 5.8, 2.7]);
        let angles = vector([20.0, -180.0, 0.0], [90.0, 180.0, 0.0]);
        Self {
            boxes,
            place,
            elevation_deg: angles.x,
            azimuth_deg: angles.y,
        }
    }

    fn scene(&self) -> Scene {
        let things = self
            .boxes
            .iter()
            .enumerate()
            .map(|(index, (base, size, yaw))| {
                let [base, size] = [base, size].map(|meters| (*meters * 1000.0).to_array());
                object(&format!("{index}"), base, size, *yaw, 20.1)
            });
        let place_mm = (self.place * 1000.0).to_array();
        let sensor = sensor("S", place_mm, self.elevation_deg, self.azimuth_deg);
        scene(&format!("{ROOM}{}{sensor}", things.collect::<String>()))
    }

    /// Whether a point is in any box enlarged by `more`.
    fn holds(&self, point: DVec3, more: f64) -> bool {
        self.boxes.iter().any(|one| is_in(point, one, more))
    }

    /// Whether any point on the line from the sensor is in an enlarged box.
    fn hides(&self, point: DVec3, more: f64) -> bool {
        let way = (1..2000).map(|step| self.place.lerp(point, f64::from(step) / 2000.0));
        way.into_iter().any(|at| self.holds(at, more))
    }

    /// How much the slope to a point exceeds that of 30 degrees on either axis; `None` behind the sensor.
    fn beside(&self, point: DVec3) -> Option<f64> {
        let (sin, cos) = self.elevation_deg.to_radians().sin_cos();
        let (across, along) = self.azimuth_deg.to_radians().sin_cos();
        let forward = DVec3::new(cos * along, cos * across, -sin);
        let right = forward.cross(DVec3::Z).normalize();
        let up = right.cross(forward);
        let ray = point - self.place;
        let slopes = DVec2::new(ray.dot(right), ray.dot(up)).abs() / ray.dot(forward);
        (ray.dot(forward) > 0.0).then(|| slopes.max_element() - 30.0_f64.to_radians().tan())
    }

    /// The expected result; `None` if two millimeters decide.
    fn expected(&self, point: DVec3) -> Option<InSight> {
        match self.beside(point) {
            Some(beside) if beside.abs() < 1e-3 => None,
            Some(beside) if beside < 0.0 => match [-2e-3, 2e-3].map(|more| self.hides(point, more))
            {
                [true, _] => Some(InSight::Hidden),
                [_, false] => Some(InSight::Seen),
                _ => None,
            },
            _ => Some(InSight::OutOfView),
        }
    }
}

#[test]
fn sight_agrees_with_a_march_along_the_ray() {
    let mut dice = Dice(1);
    let mut compared = [0; 3];
    for _ in 0..25 {
        let thrown = Thrown::new(&mut dice);
        let scene = thrown.scene();
        let survey = survey(&scene, 300.0);
        let look = &looks(&survey, &scene)[0];
        for (cell, found) in survey.floor().cells.iter().zip(&look.cells) {
            let point = cell.ground_m.with_z(0.001);
            let under = [-0.01, 0.01].map(|more| thrown.holds(point.with_z(0.1), more));
            if under[0] != under[1] {
                continue;
            }
            assert_eq!(cell.kind == Kind::Furniture, under[0]);
            if under[0] {
                continue;
            }
            if let Some(expected) = thrown.expected(point) {
                assert_eq!(found.ground, expected, "{point} from {}", thrown.place);
                compared[expected as usize] += 1;
            }
        }
    }
    assert!(compared.iter().all(|count| *count > 100), "{compared:?}");
}

/// Beside frames of a scene with the same body: exactly, but for the cuboids that a person is in the paper's model.
#[test]
fn contrast_equals_that_of_frames_with_the_person() {
    const CUBOID: &str = "size_mm = [200, 500, 1750]\ntemperature_c = 28";
    for (model, keys, is_exact) in [
        ("paper", CUBOID, true),
        (
            "physical",
            "person = { clothing = \"coat\", posture = \"sit\" }",
            true,
        ),
        ("physical", "person = {}", true),
        ("paper", "person = {}", false),
        ("paper", "person = { posture = \"sit\" }", false),
        ("paper", "person = { posture = \"lie\" }", false),
    ] {
        compare_with_frames(model, keys, is_exact);
    }
}

/// The contrast by its definition.
fn contrast(somebody: &[f64], nobody: &[f64], sigma_c: f64) -> f64 {
    let changes = somebody.iter().zip(nobody);
    let squares = changes.map(|(with, without)| (with - without).powi(2));
    squares.sum::<f64>().sqrt() / sigma_c
}

fn compare_with_frames(model: &str, keys: &str, is_exact: bool) {
    let room = format!(
        "model = \"{model}\"\n{ROOM}{}{}",
        object(
            "shelf",
            [2900.0, 3100.0, 0.0],
            [300.0, 900.0, 1200.0],
            20.0,
            26.0
        ),
        sensor("S", [1500.0, 2500.0, 2600.0], 60.0, 30.0)
    );
    let with = |at_m: DVec3, yaw_deg: f64| {
        let [x, y, _] = (at_m * 1000.0).to_array();
        scene(&format!(
            "{room}[[agent]]\nname = \"p\"\n{keys}\nyaw_deg = {yaw_deg:?}\nposition_mm = [{x:?}, {y:?}, 0]\n"
        ))
    };
    let empty = scene(&room);
    let figure = Figure::of_agent(&with(DVec3::new(1.0, 1.0, 0.0), 0.0).agents()[0]);
    let survey = Survey::new(&empty, &figure, &cells_of(500.0)).unwrap();
    let look = &looks(&survey, &empty)[0];
    let frame = |scene: &Scene| {
        let simulator = Simulator::new(scene, "S").unwrap();
        simulator.image(Duration::ZERO).celsius
    };
    let nobody = frame(&empty);
    let sigma_c = empty.sensors()[0].noise_sigma;
    let (mut strong, mut unlike, mut sums) = (0, 0, (0.0, 0.0));
    for (cell, found) in survey.floor().cells.iter().zip(&look.cells) {
        if cell.kind != Kind::Place {
            assert_eq!(found.contrast, 0.0);
            continue;
        }
        // Elsewhere, both turns fit.
        let away_m = (cell.ground_m.truncate() - DVec2::new(2.0, 3.0)).abs();
        let near_shelf = cell.ground_m.truncate().distance(DVec2::new(2.9, 3.1)) < 1.5;
        if near_shelf || away_m.x > 0.9 || away_m.y > 1.9 {
            continue;
        }
        let of_turn =
            |yaw_deg: f64| contrast(&frame(&with(cell.ground_m, yaw_deg)), &nobody, sigma_c);
        let expected = of_turn(0.0).min(of_turn(90.0));
        strong += usize::from(expected > 3.0);
        unlike += usize::from((found.contrast > 3.0) != (expected > 3.0));
        sums = (sums.0 + found.contrast, sums.1 + expected);
        assert!(
            !is_exact || (found.contrast - expected).abs() < 1e-9,
            "{model}, {keys}, {}: {found:?} {expected:?}",
            cell.ground_m
        );
    }
    let about = format!("{model}, {keys}: {sums:?}, {unlike} of {strong}");
    println!("{about}");
    assert!(strong >= 2 && unlike <= 1, "{about}");
    assert!((sums.0 / sums.1 - 1.0).abs() < 0.2, "{about}");
}

#[test]
fn nothing_is_seen_around_the_corner_of_an_l_and_nobody_stands_behind_its_walls() {
    let text = format!(
        "[room]\nplan_mm = [[0, 0], [5000, 0], [5000, 2000], [2000, 2000], [2000, 5000], [0, 5000]]\nheight_mm = 2500\nambient_c = 20\n{}",
        sensor("S", [4500.0, 1000.0, 2200.0], 20.0, 160.0)
    );
    let scene = scene(&text);
    let survey = survey(&scene, 125.0);
    let look = &looks(&survey, &scene)[0];
    let mut counts = [0; 3];
    for (cell, found) in survey.floor().cells.iter().zip(&look.cells) {
        let at = cell.ground_m.truncate();
        assert_eq!(cell.kind == Kind::Outside, at.x > 2.0 && at.y > 2.0, "{at}");
        if cell.kind == Kind::Outside {
            assert_eq!((found.contrast, found.ground), (0.0, InSight::OutOfView));
            continue;
        }
        counts[found.ground as usize] += 1;
        // The line from the sensor past the inner corner, (2, 2), continues with a slope of -1 / 2.5.
        let beyond = at.y - (2.0 + (2.0 - at.x) / 2.5);
        if at.x < 2.0 && beyond > 0.01 {
            assert_ne!(found.ground, InSight::Seen, "{at}");
            // The whole body is behind the corner, from its shoulders to its other side.
            if beyond > 0.6 {
                assert!(found.contrast < 1e-9, "{at}: {}", found.contrast);
            }
        } else if at.x < 2.0 {
            assert_ne!(found.ground, InSight::Hidden, "{at}");
        }
    }
    assert!(counts.iter().all(|count| *count > 20), "{counts:?}");
    let mounts = Mounts::default();
    let poses = candidates(&survey, &mounts, &preset("grid-eye").unwrap()).unwrap();
    // Five corners look into the room, the sixth out of it.
    let corners = poses
        .iter()
        .filter(|pose| pose.mount == Some(Mount::Corner));
    assert_eq!(corners.count(), 5 * 3);
    assert!(
        poses
            .iter()
            .all(|pose| scene.room().contains(pose.sensor.pose.position_m))
    );
}

#[test]
fn averaging_raises_the_contrast_by_the_root_of_the_frames() {
    let scene = scene(&format!(
        "{ROOM}{}",
        sensor("S", [2000.0, 3000.0, 2700.0], 90.0, -90.0)
    ));
    let one = looks(&survey(&scene, 500.0), &scene);
    let grain = Grain {
        frames: 25,
        ..cells_of(500.0)
    };
    let survey = Survey::new(&scene, &Figure::standing(), &grain).unwrap();
    let many = looks(&survey, &scene);
    for (one, many) in one[0].cells.iter().zip(&many[0].cells) {
        assert!((5.0 * one.contrast - many.contrast).abs() < 1e-9 * many.contrast.max(1.0));
    }
}

const CUBOID: &str = "[[agent]]\nname = \"c\"\nsize_mm = [200, 500, 1750]\ntemperature_c = 28\nposition_mm = [1000, 1000, 0]\n";

#[test]
fn a_centered_sensor_sees_a_square_room_symmetrically() {
    let text = format!(
        "[room]\nsize_mm = [4000, 4000, 2700]\nambient_c = 20\n{CUBOID}{}{}",
        object(
            "table",
            [2000.0, 2000.0, 0.0],
            [700.0, 700.0, 700.0],
            0.0,
            20.0
        ),
        sensor("S", [2000.0, 2000.0, 2700.0], 90.0, 90.0)
    );
    let scene = scene(&text);
    // Unlike a person, it looks the same from its front and its back.
    let figure = Figure::of_agent(&scene.agents()[0]);
    let survey = Survey::new(&scene, &figure, &cells_of(200.0)).unwrap();
    let look = &looks(&survey, &scene)[0];
    let map = Map::new(survey.floor(), &[look], &Wish::default());
    let n = survey.floor().columns;
    assert_eq!((n, survey.floor().rows), (20, 20));
    let spot = |x: usize, y: usize| map.spots[y * n + x];
    let alike = |one: (usize, usize), other: (usize, usize)| {
        let (one, other) = (spot(one.0, one.1), spot(other.0, other.1));
        assert_eq!(
            (one.kind, one.ground, one.seen_by),
            (other.kind, other.ground, other.seen_by)
        );
        // The simulator's rule for integrals is exact up to degree 5, and starts at one corner.
        let near = |one: f64, other: f64| (one - other).abs() < 1e-3 * (1.0 + one);
        assert!(near(one.best, other.best), "{one:?} {other:?}");
    };
    for y in 0..n {
        for x in 0..n {
            alike((x, y), (n - 1 - x, y));
            alike((x, y), (x, n - 1 - y));
            alike((x, y), (y, x));
        }
    }
    assert!(map.totals.hidden == 0 && map.totals.seen > 0 && map.totals.out_of_view > 0);
}
