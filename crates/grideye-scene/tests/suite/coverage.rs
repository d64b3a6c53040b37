//! Where sensors see what: against closed forms, a march along rays, the simulator's own frames, and all pairs.

use crate::{ROOM, object, scene};
use glam::{DVec2, DVec3};
use grideye_scene::coverage::{
    Blind, Candidate, CoverageError, Figure, Grain, InSight, Kind, Look, Map, Mount, Mounts,
    Posture, Rule, Survey, Wish, candidates, limits, pick, preset,
};
use grideye_scene::perceived::Surface;
use grideye_scene::physical::Optics;
use grideye_scene::{Scene, Sensor, Simulator};
use std::time::Duration;

const PAPER: Surface = Surface {
    celsius: 28.0,
    emissivity: 0.8,
};

fn sensor(name: &str, position_mm: [f64; 3], elevation_deg: f64, azimuth_deg: f64) -> String {
    format!(
        "[[sensor]]\nname = \"{name}\"\npreset = \"grid-eye\"\nposition_mm = {position_mm:?}\nelevation_deg = {elevation_deg:?}\nazimuth_deg = {azimuth_deg:?}\n"
    )
}

fn cells_of(cell_mm: f64) -> Grain {
    Grain {
        cell_m: cell_mm / 1000.0,
        ..Grain::default()
    }
}

fn survey(scene: &Scene, cell_mm: f64) -> Survey {
    Survey::new(scene, &Figure::standing(), &cells_of(cell_mm)).unwrap()
}

fn looks(survey: &Survey, scene: &Scene) -> Vec<Look> {
    survey.look_all(scene.sensors(), 1, &|| ()).unwrap()
}

#[test]
fn the_footprint_of_60_degrees_from_2_7_metres_is_3_118_metres() {
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
    // 1.559 m to either side are the middles of 62 cells of 25 mm.
    assert_eq!(seen, 124 * 124);
}

#[test]
fn the_shadow_of_a_box_is_as_long_as_similar_triangles_say() {
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
                assert_eq!((cell.kind, spot.blind), (Kind::Furniture, None));
                continue;
            }
            x if x > 0.9 && x < 1.4294 => InSight::Hidden,
            x if x.abs() < 1.5588 => InSight::Seen,
            _ => InSight::OutOfView,
        };
        assert_eq!(found.ground, expected, "{x}");
        if expected == InSight::Hidden {
            hidden += 1;
            assert_eq!(spot.blind, Some(Blind::Hidden));
        }
    }
    // Two rows of cells, 0.53 m of 25 mm each.
    assert_eq!(hidden, 2 * 21);
}

/// A generator of its own: x' = 6364136223846793005 x + 1442695040888963407 (Knuth), its upper half.
struct Dice(u64);

impl Dice {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (self.0 >> 33) as f64 / (1_u64 << 31) as f64
    }
}

/// An upright box: middle of the underside, size, turn.
type Upright = (DVec3, DVec3, f64);

/// Whether a point is in a box that is larger by `more` on all sides.
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
                let [base, size] = [base, size].map(|metres| (*metres * 1000.0).to_array());
                object(&format!("{index}"), base, size, *yaw, 20.1)
            });
        let place_mm = (self.place * 1000.0).to_array();
        let sensor = sensor("S", place_mm, self.elevation_deg, self.azimuth_deg);
        scene(&format!("{ROOM}{}{sensor}", things.collect::<String>()))
    }

    /// Whether a point is in any box that is larger by `more`.
    fn holds(&self, point: DVec3, more: f64) -> bool {
        self.boxes.iter().any(|one| is_in(point, one, more))
    }

    /// The same of any point on the way from the sensor.
    fn hides(&self, point: DVec3, more: f64) -> bool {
        let way = (1..2000).map(|step| self.place.lerp(point, f64::from(step) / 2000.0));
        way.into_iter().any(|at| self.holds(at, more))
    }

    /// By how much the slope to a point exceeds that of 30 degrees on either axis; `None` behind the sensor.
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

    /// What is to be found; `None` if two millimetres decide.
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
fn sight_is_what_a_march_along_the_ray_says() {
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

#[test]
fn the_contrast_is_that_of_the_frames_of_a_scene_with_the_person_in_it() {
    let room = format!(
        "{ROOM}{}{}",
        object(
            "shelf",
            [2900.0, 3100.0, 0.0],
            [300.0, 900.0, 1200.0],
            20.0,
            26.0
        ),
        sensor("S", [1500.0, 2500.0, 2600.0], 60.0, 30.0)
    );
    let empty = scene(&room);
    let survey = survey(&empty, 500.0);
    let look = &looks(&survey, &empty)[0];
    let frame = |scene: &Scene| {
        Simulator::without_grid(scene, "S")
            .unwrap()
            .image(Duration::ZERO)
            .celsius
    };
    let nobody = frame(&empty);
    let mut strong = 0;
    for (cell, found) in survey.floor().cells.iter().zip(&look.cells) {
        if cell.kind != Kind::Place {
            assert_eq!((found.contrast, found.peak), (0.0, 0.0));
            continue;
        }
        // Cells of half a metre leave room for the shoulders everywhere: both turns fit, but beside the shelf.
        let near_shelf = cell.ground_m.truncate().distance(DVec2::new(2.9, 3.1)) < 0.9;
        if near_shelf {
            continue;
        }
        let of_turn = |yaw_deg: f64| {
            let [x, y, _] = (cell.ground_m * 1000.0).to_array();
            let person = format!(
                "[[agent]]\nname = \"p\"\nsize_mm = [200, 500, 1750]\nyaw_deg = {yaw_deg:?}\ntemperature_c = 28\nposition_mm = [{x:?}, {y:?}, 0]\n"
            );
            let with = frame(&scene(&format!("{room}{person}")));
            let changes: Vec<f64> = with
                .iter()
                .zip(&nobody)
                .map(|(with, nobody)| with - nobody)
                .collect();
            let squares: f64 = changes.iter().map(|change| change * change).sum();
            let peak = changes
                .iter()
                .fold(0.0_f64, |peak, change| peak.max(change.abs()));
            (squares.sqrt() / 0.2, peak / 0.2)
        };
        let (one, other) = (of_turn(0.0), of_turn(90.0));
        assert!(
            (found.contrast - one.0.min(other.0)).abs() < 1e-9,
            "{}",
            cell.ground_m
        );
        assert!((found.peak - one.1.min(other.1)).abs() < 1e-9);
        strong += usize::from(found.contrast > 3.0);
    }
    assert!(strong > 10, "{strong}");
}

#[test]
fn round_the_corner_of_an_l_nothing_is_seen_and_behind_its_walls_nobody_stands() {
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
        // The line from the sensor by the inner corner, (2, 2), goes on with a slope of -1 / 2.5.
        let beyond = at.y - (2.0 + (2.0 - at.x) / 2.5);
        if at.x < 2.0 && beyond > 0.01 {
            assert_ne!(found.ground, InSight::Seen, "{at}");
            // All of the body is behind the corner, from its shoulders to its other side.
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
    assert_eq!(corners.count(), 5 * 2);
    assert!(
        poses
            .iter()
            .all(|pose| scene.room().contains(pose.sensor.pose.position_m))
    );
}

#[test]
fn frames_that_are_averaged_raise_the_contrast_by_their_root() {
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

#[test]
fn a_square_room_with_the_sensor_in_its_middle_looks_the_same_from_all_sides() {
    let text = format!(
        "[room]\nsize_mm = [4000, 4000, 2700]\nambient_c = 20\n{}{}",
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
    let survey = survey(&scene, 200.0);
    let look = &looks(&survey, &scene)[0];
    let map = Map::new(survey.floor(), &[look], &Wish::default());
    let n = survey.floor().columns;
    assert_eq!((n, survey.floor().rows), (20, 20));
    let spot = |x: usize, y: usize| map.spots[y * n + x];
    let alike = |one: (usize, usize), other: (usize, usize)| {
        let (one, other) = (spot(one.0, one.1), spot(other.0, other.1));
        assert_eq!(
            (one.kind, one.blind, one.seen_by),
            (other.kind, other.blind, other.seen_by)
        );
        // The simulator's rule for integrals is exact up to degree 5, and begins at one corner.
        let near = |one: f64, other: f64| (one - other).abs() < 1e-3 * (1.0 + one);
        assert!(
            near(one.best, other.best) && near(one.peak, other.peak),
            "{one:?} {other:?}"
        );
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

/// A room in which poses see different parts, and few candidates.
fn small() -> (Scene, Vec<Candidate>, Survey, Vec<Look>) {
    let text = format!(
        "{ROOM}{}{}",
        object(
            "cupboard",
            [2000.0, 2400.0, 0.0],
            [1600.0, 500.0, 2100.0],
            15.0,
            20.1
        ),
        object(
            "bed",
            [900.0, 4800.0, 0.0],
            [900.0, 2000.0, 500.0],
            0.0,
            20.1
        )
    );
    let scene = scene(&text);
    let survey = survey(&scene, 400.0);
    let mounts = Mounts {
        spacing_m: 1.3,
        ceiling_headings: 4,
        wall_headings_deg: vec![0.0],
        ..Mounts::default()
    };
    let poses = candidates(&survey, &mounts, &preset("grid-eye").unwrap()).unwrap();
    let sensors: Vec<Sensor> = poses.iter().map(|pose| pose.sensor.clone()).collect();
    let looks = survey.look_all(&sensors, 1, &|| ()).unwrap();
    (scene, poses, survey, looks)
}

/// The objective by its words: sensors that detect, up to the wanted number, as a part of it, on the mean.
fn objective(survey: &Survey, looks: &[&Look], wish: &Wish) -> f64 {
    let places = survey
        .floor()
        .cells
        .iter()
        .enumerate()
        .filter(|(_, cell)| cell.kind == Kind::Place);
    let parts: Vec<f64> = places
        .map(|(index, _)| {
            let detect = looks
                .iter()
                .filter(|look| look.cells[index].contrast >= wish.sigma_min);
            detect.count().min(wish.sensors_min) as f64 / wish.sensors_min as f64
        })
        .collect();
    parts.iter().sum::<f64>() / parts.len() as f64
}

#[test]
fn the_greedy_choice_is_held_to_all_pairs() {
    let (_, _, survey, looks) = small();
    for (sensors_min, sigma_min) in [(1, 3.0), (1, 8.0), (2, 3.0)] {
        let wish = Wish {
            sensors_min,
            sigma_min,
            ..Wish::default()
        };
        let found = pick(survey.floor(), &looks, &[], 4, &wish).unwrap();
        assert!(found.is_submodular);
        let value = |looks: &[&Look]| objective(&survey, looks, &wish);
        let best_one = looks.iter().map(|look| value(&[look])).fold(0.0, f64::max);
        let mut best_two = 0.0_f64;
        for (index, one) in looks.iter().enumerate() {
            for other in &looks[index + 1..] {
                best_two = best_two.max(value(&[one, other]));
            }
        }
        let [one, two, ..] = found.steps.as_slice() else {
            panic!("{found:?}");
        };
        assert_eq!(one.objective, best_one);
        assert!((one.objective_max.unwrap() - best_one).abs() < 1e-12);
        let share = 1.0 - (-1.0_f64).exp();
        assert!(two.objective >= share * best_two && two.objective <= best_two + 1e-12);
        assert!(
            two.objective_max.unwrap() >= best_two - 1e-12,
            "{two:?} {best_two}"
        );
        // What is reported is what the chosen poses do, and no step falls.
        let mut chosen = Vec::new();
        let mut before = 0.0;
        for step in &found.steps {
            chosen.push(&looks[step.chosen]);
            assert!((step.objective - value(&chosen)).abs() < 1e-12 && step.objective >= before);
            assert!(step.objective_max.unwrap() >= step.objective - 1e-12);
            before = step.objective;
        }
    }
}

#[test]
fn more_sensors_never_see_less_and_those_that_are_there_count() {
    let (_, _, survey, looks) = small();
    let wish = Wish::default();
    let found = pick(survey.floor(), &looks, &[], 5, &wish).unwrap();
    let mut before: Option<Map> = None;
    for count in 1..=found.steps.len() {
        let chosen: Vec<&Look> = found.steps[..count]
            .iter()
            .map(|step| &looks[step.chosen])
            .collect();
        let map = Map::new(survey.floor(), &chosen, &wish);
        assert!(
            (found.steps[count - 1].objective
                - map.totals.detected as f64 / map.totals.places as f64)
                .abs()
                < 1e-12
        );
        if let Some(before) = before {
            for (now, then) in map.spots.iter().zip(&before.spots) {
                assert!(
                    now.seen_by >= then.seen_by
                        && now.together >= then.together
                        && now.best >= then.best
                );
            }
            assert!(
                map.totals.hidden + map.totals.out_of_view
                    <= before.totals.hidden + before.totals.out_of_view
            );
        }
        before = Some(map);
    }
    // Kept poses are not picked again, and the rest begins where they end.
    let kept = [found.steps[0].chosen];
    let rest = pick(survey.floor(), &looks, &kept, 4, &wish).unwrap();
    let chosen = |steps: &[grideye_scene::coverage::Step]| {
        steps.iter().map(|step| step.chosen).collect::<Vec<_>>()
    };
    assert_eq!(chosen(&rest.steps), chosen(&found.steps[1..]));
}

#[test]
fn two_weak_sensors_detect_together_what_neither_does_alone() {
    let text = format!(
        "{ROOM}{}{}",
        sensor("A", [1900.0, 3000.0, 2700.0], 90.0, -90.0),
        sensor("B", [2100.0, 3000.0, 2700.0], 90.0, -90.0)
    );
    let scene = scene(&text);
    let survey = survey(&scene, 200.0);
    let looks = looks(&survey, &scene);
    let both = [&looks[0], &looks[1]];
    let strict = Wish {
        sigma_min: 6.0,
        ..Wish::default()
    };
    let alone = Map::new(survey.floor(), &both, &strict);
    let wish = Wish {
        rule: Rule::Together,
        ..strict
    };
    let together = Map::new(survey.floor(), &both, &wish);
    assert!(together.totals.detected > alone.totals.detected);
    for (index, spot) in alone.spots.iter().enumerate() {
        let [one, other] = both.map(|look| look.cells[index].contrast);
        assert!((spot.together - one.hypot(other)).abs() < 1e-9);
        assert_eq!(spot.best, one.max(other));
    }
    let found = pick(survey.floor(), &looks, &[], 2, &wish).unwrap();
    assert!(!found.is_submodular && found.steps.iter().all(|step| step.objective_max.is_none()));
    let last = found.steps.last().unwrap().objective;
    assert!((last - together.totals.detected as f64 / together.totals.places as f64).abs() < 1e-12);
}

#[test]
fn any_number_of_threads_finds_the_same_bits() {
    let (scene, poses, survey, one) = small();
    let sensors: Vec<Sensor> = poses.iter().map(|pose| pose.sensor.clone()).collect();
    let bits = |looks: &[Look]| -> Vec<(u64, u64)> {
        let cells = looks.iter().flat_map(|look| &look.cells);
        cells
            .map(|seen| (seen.contrast.to_bits(), seen.peak.to_bits()))
            .collect()
    };
    for threads in [2, 3, 16] {
        let counted = std::sync::atomic::AtomicUsize::new(0);
        let count = || {
            counted.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        };
        let many = survey.look_all(&sensors, threads, &count).unwrap();
        assert_eq!(bits(&many), bits(&one));
        assert_eq!(many, one);
        assert_eq!(counted.into_inner(), sensors.len());
    }
    drop(scene);
}

#[test]
fn who_lies_lies_in_bed_and_under_the_table_and_who_stands_does_neither() {
    let text = format!(
        "{ROOM}{}{}{}",
        object(
            "bed",
            [2000.0, 4500.0, 0.0],
            [2000.0, 1000.0, 550.0],
            0.0,
            20.1
        ),
        object(
            "table top",
            [2000.0, 1500.0, 850.0],
            [2400.0, 1400.0, 30.0],
            0.0,
            20.1
        ),
        object(
            "lamp",
            [2000.0, 3000.0, 2200.0],
            [400.0, 400.0, 100.0],
            0.0,
            20.1
        )
    );
    let scene = scene(&text);
    let at = |posture: Posture, place: (f64, f64)| {
        let figure = Figure::new(posture, DVec3::new(0.2, 0.5, 1.75), PAPER);
        let survey = Survey::new(&scene, &figure, &cells_of(100.0)).unwrap();
        let cells = survey.floor().cells.iter();
        let nearest = cells.min_by(|one, other| {
            let away = |at: DVec3| at.truncate().distance(place.into());
            away(one.ground_m).total_cmp(&away(other.ground_m))
        });
        let cell = nearest.unwrap();
        (cell.kind, (cell.ground_m.z * 1000.0).round())
    };
    let (bed, table, lamp) = ((2.05, 4.55), (2.05, 1.55), (2.05, 3.05));
    assert_eq!(at(Posture::Lying, bed), (Kind::Place, 550.0));
    assert_eq!(at(Posture::Sitting, bed), (Kind::Place, 550.0));
    assert_eq!(at(Posture::Standing, bed).0, Kind::Furniture);
    assert_eq!(at(Posture::Lying, table), (Kind::Place, 0.0));
    assert_eq!(at(Posture::Standing, table).0, Kind::Furniture);
    assert_eq!(at(Posture::Standing, lamp), (Kind::Place, 0.0));
    // 0.1 m from the wall nobody lies across, and 0.05 m from it nobody stands at all.
    assert_eq!(at(Posture::Lying, (0.15, 3.05)).0, Kind::Tight);
    assert_eq!(at(Posture::Standing, (0.05, 3.05)).0, Kind::Tight);
    assert_eq!(at(Posture::Standing, (0.15, 3.05)).0, Kind::Place);
    // The gap between the bed and a wall 0.1 m from it is no place either.
    assert_eq!(at(Posture::Standing, (0.95, 4.55)).0, Kind::Tight);
}

#[test]
fn an_agent_of_the_scene_may_be_who_is_looked_for() {
    let person = "[[agent]]\nname = \"p\"\nsize_mm = [200, 500, 1750]\ntemperature_c = 28\nposition_mm = [1000, 1000, 0]\n";
    let text = format!(
        "{ROOM}{person}{}",
        sensor("S", [2000.0, 3000.0, 2700.0], 90.0, -90.0)
    );
    let scene = scene(&text);
    let figure = Figure::of_agent(&scene.agents()[0]);
    let by_agent = Survey::new(&scene, &figure, &cells_of(500.0)).unwrap();
    let (one, other) = (
        looks(&by_agent, &scene),
        looks(&survey(&scene, 500.0), &scene),
    );
    for (one, other) in one[0].cells.iter().zip(&other[0].cells) {
        assert!((one.contrast - other.contrast).abs() < 1e-9);
    }
}

#[test]
fn who_is_in_the_scene_already_changes_no_look() {
    // In the middle of the view, and where the person is to be tried as well.
    let person = "[[agent]]\nname = \"p\"\nsize_mm = [200, 500, 1750]\ntemperature_c = 28\nposition_mm = [2250, 3250, 0]\n";
    let sensor = sensor("S", [2000.0, 3000.0, 2700.0], 90.0, -90.0);
    let [empty, inhabited] = ["", person].map(|agent| scene(&format!("{ROOM}{agent}{sensor}")));
    let kinds = |survey: &Survey| -> Vec<Kind> {
        let cells = survey.floor().cells.iter();
        cells.map(|cell| cell.kind).collect()
    };
    let [one, other] = [&empty, &inhabited].map(|scene| survey(scene, 500.0));
    assert_eq!(kinds(&one), kinds(&other));
    let found = looks(&one, &empty);
    assert_eq!(found, looks(&other, &inhabited));
    assert!(found[0].cells.iter().any(|cell| cell.contrast > 3.0));
}

#[test]
fn what_is_behind_the_sensor_hides_nothing_before_it() {
    // A panel of 2 m along a diagonal, and a sensor before it: the lines go away from the panel, and the boxes around
    // them and around the panel overlap. Those lines, made longer backwards, go through it.
    let text = format!(
        "{ROOM}{}{}",
        object(
            "panel",
            [2000.0, 2000.0, 0.0],
            [2000.0, 100.0, 2000.0],
            -45.0,
            20.1
        ),
        sensor("S", [2200.0, 2200.0, 1000.0], 60.0, 45.0)
    );
    let scene = scene(&text);
    let survey = survey(&scene, 50.0);
    let look = &looks(&survey, &scene)[0];
    let mut seen = 0;
    for (cell, found) in survey.floor().cells.iter().zip(&look.cells) {
        assert_ne!(found.ground, InSight::Hidden, "{}", cell.ground_m);
        let is_in_box = cell.ground_m.truncate().max_element() < 2.7;
        seen += usize::from(is_in_box && found.ground == InSight::Seen);
    }
    assert!(seen > 10, "{seen}");
}

#[test]
fn in_a_wardrobe_taller_than_the_person_is_no_ground() {
    let (base, size) = ([3000.0, 3000.0, 0.0], [1000.0, 1600.0, 2100.0]);
    let scene = scene(&format!(
        "{ROOM}{}",
        object("wardrobe", base, size, 0.0, 20.1)
    ));
    for posture in [Posture::Standing, Posture::Sitting, Posture::Lying] {
        let figure = Figure::new(posture, DVec3::new(0.2, 0.5, 1.75), PAPER);
        let survey = Survey::new(&scene, &figure, &cells_of(100.0)).unwrap();
        for cell in &survey.floor().cells {
            let away = (cell.ground_m.truncate() - DVec2::new(3.0, 3.0)).abs();
            let is_in_it = away.x < 0.5 && away.y < 0.8;
            assert_eq!(cell.kind == Kind::Furniture, is_in_it, "{}", cell.ground_m);
        }
    }
}

#[test]
fn a_picked_pose_is_the_same_sensor_in_a_scene_file() {
    let (_, mut poses, ..) = small();
    let mut special = poses[0].clone();
    assert_eq!(special.sensor.optics, Optics::Amg88);
    let keys = "detectable_range_c = [0, 80]\noptics = \"pinhole\"\npixel_width_deg = [8, 9]\nblur_deg = [7.5, 2.5]\nstep_c = 0.25\n";
    let text = format!("{ROOM}{}{keys}", special.toml("S"));
    let text = text.replace("optics = \"datasheet\"\n", "");
    special.sensor = scene(&text).sensors()[0].clone();
    poses.push(special);
    let mut mounts = Vec::new();
    for pose in &poses {
        let text = format!("{ROOM}{}", pose.toml("a-name.of:its_own"));
        let again = &scene(&text).sensors()[0].clone();
        assert_eq!(again.name, "a-name.of:its_own");
        let mut expected = pose.sensor.clone();
        expected.name.clone_from(&again.name);
        let (one, other) = (again.field_of_view_rad, expected.field_of_view_rad);
        assert!((one - other).abs().max_element() < 1e-12);
        // Degrees go through a decimal number: their last bit may differ.
        expected.field_of_view_rad = one;
        assert_eq!(*again, expected);
        mounts.extend(pose.mount);
    }
    for mount in [Mount::Ceiling, Mount::Wall, Mount::Corner] {
        assert!(mounts.contains(&mount));
    }
}

#[test]
fn candidates_are_where_and_as_they_are_said_to_be() {
    let scene = scene(&format!(
        "{ROOM}{}",
        object(
            "cupboard",
            [300.0, 3000.0, 0.0],
            [600.0, 1000.0, 2400.0],
            0.0,
            20.1
        )
    ));
    let survey = survey(&scene, 500.0);
    let mounts = Mounts {
        spacing_m: 1.0,
        ..Mounts::default()
    };
    let poses = candidates(&survey, &mounts, &preset("grid-eye").unwrap()).unwrap();
    let count = |mount: Mount| {
        poses
            .iter()
            .filter(|pose| pose.mount == Some(mount))
            .count()
    };
    // 4 x 6 places, once straight down and in 8 directions at 30°; 4 corners at 2 angles.
    assert_eq!(count(Mount::Ceiling), 24 * 9);
    assert_eq!(count(Mount::Corner), 4 * 2);
    // 20 places along the walls, 6 directions each; those at y = 2.5 and 3.5 m on the left are the cupboard's corner
    // and its end: on its border the room begins.
    let left: Vec<f64> = poses
        .iter()
        .filter(|pose| pose.mount == Some(Mount::Wall) && pose.position_mm.x < 100.0)
        .map(|pose| pose.position_mm.y)
        .collect();
    assert!(
        left.iter().all(|y| *y <= 2500.0 || *y >= 3500.0),
        "{left:?}"
    );
    for pose in &poses {
        let forward = pose.sensor.pose.world_from_sensor().x_axis;
        let middle = DVec3::new(2.0, 3.0, 0.0) - pose.sensor.pose.position_m;
        assert!(scene.room().contains(pose.sensor.pose.position_m));
        match pose.mount {
            Some(Mount::Ceiling) => assert!(forward.z < -0.86),
            Some(Mount::Corner) => {
                // Along the bisector, by 45 degrees in a room of right angles.
                assert!((forward.x.abs() - forward.y.abs()).abs() < 1e-9);
                assert!(forward.truncate().dot(middle.truncate()) > 0.0);
            }
            _ => {
                let [x, y, _] = pose.position_mm.to_array();
                let inward = match (x, y) {
                    (20.0, _) => DVec2::X,
                    (3980.0, _) => -DVec2::X,
                    (_, 20.0) => DVec2::Y,
                    _ => -DVec2::Y,
                };
                assert!(
                    forward.truncate().normalize().dot(inward) > 0.86,
                    "{pose:?}"
                );
            }
        }
    }
}

/// A refusal names what is wrong and what to do.
fn assert_said(error: &CoverageError, words: &str) {
    let found = error.to_string();
    assert!(found.contains(words) && found.contains("hint: "), "{found}");
}

#[test]
fn a_floor_that_makes_no_sense_is_refused_by_name() {
    let empty = scene(ROOM);
    let figure = Figure::standing();
    let turns = |turns: usize| Grain {
        turns,
        ..Grain::default()
    };
    let no_frames = Grain {
        frames: 0,
        ..Grain::default()
    };
    for (grain, words) in [
        (cells_of(f64::NAN), "the length of a cell"),
        (cells_of(0.0), "1 mm or more"),
        (cells_of(10.0), "240000 cells of the floor"),
        (turns(0), "1 to 36"),
        (turns(limits::TURNS_MAX + 1), "1 to 36"),
        (no_frames, "the number of frames"),
    ] {
        assert_said(&Survey::new(&empty, &figure, &grain).unwrap_err(), words);
    }
    let giant = Figure::new(Posture::Standing, DVec3::new(0.2, 0.5, 3.0), PAPER);
    let error = Survey::new(&empty, &giant, &Grain::default()).unwrap_err();
    assert!(matches!(error, CoverageError::NoPlace { .. }), "{error}");
}

#[test]
fn more_poses_than_there_may_be_are_refused() {
    let survey = survey(&scene(ROOM), 100.0);
    let like = preset("grid-eye").unwrap();
    let none = survey.look_all(&[], 1, &|| ());
    assert!(matches!(none, Err(CoverageError::NoCandidates)));
    let many = |count: usize| {
        let error = survey.look_all(&vec![like.clone(); count], 1, &|| ());
        error.unwrap_err().to_string()
    };
    // 2,400 cells.
    let found = many(limits::PAIRS_MAX / 2_400 + 1);
    assert!(
        found.contains("2084 poses times 2400 cells are 5001600 pairs"),
        "{found}"
    );
    let found = many(limits::CANDIDATES_MAX + 1);
    assert!(found.contains("20001 candidate poses"), "{found}");
    for threads in [0, limits::THREADS_MAX + 1] {
        let found = survey.look_all(std::slice::from_ref(&like), threads, &|| ());
        assert_said(&found.unwrap_err(), "1 to 256");
    }
    let mut quiet = like;
    quiet.noise_sigma = 0.0;
    assert_said(&survey.look(&quiet).unwrap_err(), "no noise");
    assert!(preset("grid-ear").is_err());
}

#[test]
fn mounts_that_make_no_sense_are_refused_by_name() {
    let survey = survey(&scene(ROOM), 500.0);
    let like = preset("grid-eye").unwrap();
    let changed = |change: &dyn Fn(&mut Mounts)| {
        let mut mounts = Mounts::default();
        change(&mut mounts);
        mounts
    };
    for (mounts, words) in [
        (
            changed(&|mounts| mounts.mounts.clear()),
            "no candidate pose",
        ),
        (
            changed(&|mounts| mounts.spacing_m = 0.01),
            "expected at most 20000",
        ),
        (
            changed(&|mounts| mounts.spacing_m = -1.0),
            "the spacing of the poses",
        ),
        (
            changed(&|mounts| mounts.ceiling_tilts_deg = vec![91.0]),
            "a tilt is 91°",
        ),
        (
            changed(&|mounts| mounts.wall_downs_deg = vec![-1.0]),
            "an angle below the level",
        ),
        (
            changed(&|mounts| mounts.wall_headings_deg = vec![f64::NAN]),
            "a heading on a wall",
        ),
        (
            changed(&|mounts| mounts.wall_heights_m = vec![0.0]),
            "a height on a wall",
        ),
        (
            changed(&|mounts| mounts.ceiling_headings = 0),
            "the number of headings",
        ),
        (
            changed(&|mounts| {
                (mounts.mounts, mounts.wall_heights_m) = (vec![Mount::Wall], vec![2.9]);
            }),
            "no candidate pose",
        ),
    ] {
        assert_said(&candidates(&survey, &mounts, &like).unwrap_err(), words);
    }
}

#[test]
fn wishes_that_make_no_sense_are_refused_by_name() {
    let survey = survey(&scene(ROOM), 500.0);
    let looks = vec![survey.look(&preset("grid-eye").unwrap()).unwrap()];
    let wish = |sigma_min: f64, sensors_min: usize, rule: Rule| Wish {
        sigma_min,
        sensors_min,
        rule,
    };
    for (count, wish, words) in [
        (0, Wish::default(), "1 to 100"),
        (limits::PICKED_MAX + 1, Wish::default(), "1 to 100"),
        (1, wish(3.0, 0, Rule::Alone), "at each place"),
        (1, wish(0.0, 1, Rule::Alone), "above 0"),
        (1, wish(f64::NAN, 1, Rule::Alone), "above 0"),
        (1, wish(3.0, 2, Rule::Together), "detect together"),
    ] {
        let error = pick(survey.floor(), &looks, &[], count, &wish).unwrap_err();
        assert_said(&error, words);
    }
}
