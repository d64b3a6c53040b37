//! The poses that a search finds, beside all pairs of candidates and beside random poses.

use super::sight::Dice;
use super::{looks, sensor, survey};
use crate::{ROOM, object, scene};
use glam::DVec3;
use grideye_plan::coverage::{
    Candidate, Choice, CoverageError, Kind, Look, Map, Mount, Mounts, Rule, Survey, Wish,
    candidates, preset, search,
};
use grideye_scene::{Pose, Scene, Sensor};
use std::sync::Mutex;

/// Few candidates.
pub(super) fn few() -> Mounts {
    Mounts {
        spacing_m: 1.3,
        ceiling_headings: 4,
        wall_headings_deg: vec![0.0],
        ..Mounts::default()
    }
}

/// A room in which poses see different parts, and few candidates.
pub(super) fn small() -> (Scene, Vec<Candidate>, Survey) {
    let cupboard = object(
        "cupboard",
        [2000.0, 2400.0, 0.0],
        [1600.0, 500.0, 2100.0],
        15.0,
        20.1,
    );
    let bed = object(
        "bed",
        [900.0, 4800.0, 0.0],
        [900.0, 2000.0, 500.0],
        0.0,
        20.1,
    );
    let scene = scene(&format!("{ROOM}{cupboard}{bed}"));
    let survey = survey(&scene, 400.0);
    let poses = candidates(&survey, &few(), &preset("grid-eye").unwrap()).unwrap();
    (scene, poses, survey)
}

fn found(
    survey: &Survey,
    (poses, mounts): (&[Candidate], &Mounts),
    kept: &[Look],
    wanted: (usize, &Wish),
) -> Choice {
    search(survey, (poses, mounts), kept, wanted, 2, &|_, _| ()).unwrap()
}

fn sensors_of(poses: &[Candidate]) -> Vec<Sensor> {
    poses.iter().map(|pose| pose.sensor.clone()).collect()
}

/// The objective by its definition: detecting sensors, up to the wanted number, as a share of it, averaged.
fn objective(survey: &Survey, looks: &[&Look], wish: &Wish) -> f64 {
    let cells = survey.floor().cells.iter().enumerate();
    let places = cells.filter(|(_, cell)| cell.kind == Kind::Place);
    let parts: Vec<f64> = places
        .map(|(index, _)| {
            let squares = |look: &&Look| look.cells[index].contrast.powi(2);
            if wish.rule == Rule::Together {
                let together = looks.iter().map(squares).sum::<f64>().sqrt();
                return f64::from(u8::from(together >= wish.sigma_min));
            }
            let detect = looks
                .iter()
                .filter(|look| look.cells[index].contrast >= wish.sigma_min);
            detect.count().min(wish.sensors_min) as f64 / wish.sensors_min as f64
        })
        .collect();
    parts.iter().sum::<f64>() / parts.len() as f64
}

#[test]
fn two_poses_see_at_least_as_much_as_any_two_candidates() {
    let (_, poses, survey) = small();
    let mounts = few();
    let looks = survey.look_all(&sensors_of(&poses), 2, &|| ()).unwrap();
    for (sensors_min, sigma_min) in [(1, 3.0), (1, 8.0), (2, 3.0)] {
        let wish = Wish {
            sensors_min,
            sigma_min,
            ..Wish::default()
        };
        let value = |looks: &[&Look]| objective(&survey, looks, &wish);
        let best_one = looks.iter().map(|look| value(&[look])).fold(0.0, f64::max);
        let mut best_two = 0.0_f64;
        for (index, one) in looks.iter().enumerate() {
            for other in &looks[index + 1..] {
                best_two = best_two.max(value(&[one, other]));
            }
        }
        let one = found(&survey, (&poses, &mounts), &[], (1, &wish));
        let two = found(&survey, (&poses, &mounts), &[], (2, &wish));
        assert!(
            one.steps[0].objective >= best_one,
            "{}",
            one.steps[0].objective
        );
        assert!(
            two.steps[1].objective >= best_two,
            "{} {best_two}",
            two.steps[1].objective
        );
        // The reported figures are those of the chosen poses, and no step decreases.
        let mut chosen = Vec::new();
        let mut before = 0.0;
        for step in &two.steps {
            chosen.push(&step.look);
            assert_eq!(step.look, survey.look(&step.pose.sensor).unwrap());
            assert!((step.objective - value(&chosen)).abs() < 1e-12 && step.objective >= before);
            before = step.objective;
        }
    }
}

/// An L of two arms of 3 m, 27 m², with a table.
const L: &str = "[room]\nplan_mm = [[0, 0], [6000, 0], [6000, 3000], [3000, 3000], [3000, 6000], [0, 6000]]\nheight_mm = 2600\nambient_c = 21\n";

/// Any pose that somebody may mount: all over the ceiling and along the walls, by any angle.
fn random(dice: &mut Dice, scene: &Scene, like: &Sensor) -> Sensor {
    let (low, high) = scene.room().bounds_m();
    loop {
        let mut at = DVec3::new(
            dice.between(low.x, high.x),
            dice.between(low.y, high.y),
            high.z,
        );
        let mut elevation_deg = 90.0 - dice.between(0.0, 70.0);
        let azimuth_deg = dice.between(-180.0, 180.0);
        let side = dice.between(0.0, 8.0);
        if side < 4.0 {
            let ends = [
                (low.x + 0.02, at.y),
                (high.x - 0.02, at.y),
                (at.x, low.y + 0.02),
                (at.x, high.y - 0.02),
            ];
            let (x, y) = ends[side as usize];
            at = DVec3::new(x, y, 2.2);
            elevation_deg = dice.between(5.0, 70.0);
        }
        if scene.room().contains(at) {
            let mut sensor = like.clone();
            sensor.pose = Pose::from_degrees(at, elevation_deg, azimuth_deg, 0.0);
            return sensor;
        }
    }
}

#[test]
fn no_random_pose_sees_more_than_the_best_found() {
    let table = object(
        "table",
        [1500.0, 4200.0, 0.0],
        [900.0, 1400.0, 740.0],
        20.0,
        21.0,
    );
    let shelf = object(
        "shelf",
        [2600.0, 3000.0, 0.0],
        [400.0, 1400.0, 2000.0],
        0.0,
        21.0,
    );
    let stove = object(
        "stove",
        [300.0, 3000.0, 0.0],
        [500.0, 500.0, 900.0],
        0.0,
        45.0,
    );
    for (name, text, cell_mm) in [
        ("box", format!("{ROOM}{shelf}{stove}"), 300.0),
        ("l", format!("{L}{table}"), 300.0),
        ("physical l", format!("model = \"physical\"\n{L}{table}"), 500.0),
        (
            "u",
            "[room]\nplan_mm = [[0, 0], [7000, 0], [7000, 4000], [5000, 4000], [5000, 1800], [2000, 1800], [2000, 4000], [0, 4000]]\nheight_mm = 2400\nambient_c = 19\n".to_owned(),
            250.0,
        ),
    ] {
        let scene = scene(&text);
        let survey = survey(&scene, cell_mm);
        let (mounts, like) = (Mounts::default(), preset("grid-eye").unwrap());
        let poses = candidates(&survey, &mounts, &like).unwrap();
        let wish = Wish::default();
        let best = found(&survey, (&poses, &mounts), &[], (1, &wish)).steps[0].objective;
        let mut dice = Dice(7);
        let sensors: Vec<Sensor> = (0..200).map(|_| random(&mut dice, &scene, &like)).collect();
        let looks = survey.look_all(&sensors, 2, &|| ()).unwrap();
        let of_random = looks.iter().map(|look| objective(&survey, &[look], &wish));
        let random = of_random.fold(0.0, f64::max);
        println!("{name}: {best} beside {random}");
        assert!(best >= random, "{name}: {best} beside {random}");
    }
}

#[test]
fn two_ceiling_poses_of_an_l_see_at_least_what_two_along_its_arms_do() {
    let by_hand = [
        sensor("A", [1500.0, 1500.0, 2600.0], 45.0, 0.0),
        sensor("B", [1500.0, 1500.0, 2600.0], 45.0, 90.0),
        sensor("C", [300.0, 1500.0, 2600.0], 45.0, 0.0),
        sensor("D", [1500.0, 300.0, 2600.0], 45.0, 90.0),
    ];
    let scene = scene(&format!("{L}{}", by_hand.concat()));
    let survey = survey(&scene, 250.0);
    let looks = looks(&survey, &scene);
    let wish = Wish::default();
    let pairs = [[0, 1], [2, 3], [0, 3], [2, 1]]
        .map(|[one, other]| objective(&survey, &[&looks[one], &looks[other]], &wish));
    let by_hand = pairs.into_iter().fold(0.0, f64::max);
    let mounts = Mounts {
        mounts: vec![Mount::Ceiling],
        ..Mounts::default()
    };
    let poses = candidates(&survey, &mounts, &preset("grid-eye").unwrap()).unwrap();
    let choice = found(&survey, (&poses, &mounts), &[], (2, &wish));
    let reached = choice.steps[1].objective;
    println!("{reached} beside {by_hand}");
    assert!(reached >= by_hand, "{reached} {by_hand}");
}

#[test]
fn poses_stay_within_the_angles_and_on_their_walls() {
    let (scene, _, survey) = small();
    let mounts = Mounts {
        mounts: vec![Mount::Wall, Mount::Corner],
        wall_headings_deg: vec![-10.0, 20.0],
        wall_downs_deg: vec![30.0],
        ..few()
    };
    let poses = candidates(&survey, &mounts, &preset("grid-eye").unwrap()).unwrap();
    let choice = found(&survey, (&poses, &mounts), &[], (4, &Wish::default()));
    assert!(choice.tried > poses.len());
    for step in choice.steps {
        let [x, y, z] = step.pose.position_mm.to_array();
        let (low, high) = scene.room().bounds_m();
        let to_wall_mm = [
            x - 1000.0 * low.x,
            1000.0 * high.x - x,
            y - 1000.0 * low.y,
            1000.0 * high.y - y,
        ];
        let inward = [0.0, 180.0, 90.0, -90.0];
        assert_eq!((z, step.pose.elevation_deg), (2200.0, 30.0));
        let walls = to_wall_mm
            .iter()
            .zip(inward)
            .filter(|(away_mm, _)| (**away_mm - 20.0).abs() < 1.0);
        let inward: Vec<f64> = walls.map(|(_, inward)| inward).collect();
        let heading =
            |inward: f64| (step.pose.azimuth_deg - inward + 540.0).rem_euclid(360.0) - 180.0;
        // In a corner the bisector is 45 degrees off either wall.
        let range = if inward.len() == 1 {
            -10.0..=20.0
        } else {
            -55.0..=65.0
        };
        assert!(
            inward
                .iter()
                .any(|inward| range.contains(&heading(*inward))),
            "{:?}",
            step.pose
        );
    }
}

#[test]
fn more_sensors_never_see_less_and_kept_ones_count() {
    let (_, poses, survey) = small();
    let (wish, mounts) = (Wish::default(), few());
    let choice = found(&survey, (&poses, &mounts), &[], (5, &wish));
    let mut before: Option<Map> = None;
    for count in 1..=choice.steps.len() {
        let chosen: Vec<&Look> = choice.steps[..count]
            .iter()
            .map(|step| &step.look)
            .collect();
        let map = Map::new(survey.floor(), &chosen, &wish);
        let share = map.totals.detected as f64 / map.totals.places as f64;
        assert!((choice.steps[count - 1].objective - share).abs() < 1e-12);
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
    // Beside a kept sensor, the search finds another part of the room.
    let kept = std::slice::from_ref(&choice.steps[0].look);
    let rest = found(&survey, (&poses, &mounts), kept, (1, &wish));
    assert!(rest.steps[0].objective > choice.steps[0].objective);
    assert!(
        rest.steps[0].objective >= objective(&survey, &[&kept[0], &choice.steps[1].look], &wish)
    );
}

#[test]
fn two_weak_sensors_together_detect_what_neither_does_alone() {
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
    let share = together.totals.detected as f64 / together.totals.places as f64;
    assert!((objective(&survey, &both, &wish) - share).abs() < 1e-12);
    let poses = candidates(&survey, &few(), &preset("grid-eye").unwrap()).unwrap();
    let choice = found(&survey, (&poses, &few()), &[], (2, &wish));
    let chosen: Vec<&Look> = choice.steps.iter().map(|step| &step.look).collect();
    assert!((choice.steps[1].objective - objective(&survey, &chosen, &wish)).abs() < 1e-12);
    assert!(choice.steps[1].objective >= share);
}

#[test]
fn any_number_of_threads_gives_the_same_choice_and_says_how_far_it_is() {
    let (_, poses, survey) = small();
    let (wish, mounts) = (Wish::default(), few());
    let one = found(&survey, (&poses, &mounts), &[], (2, &wish));
    for threads in [1, 5] {
        let steps = Mutex::new(Vec::new());
        let say = |done: usize, whole: usize| steps.lock().unwrap().push((done, whole));
        let many = search(&survey, (&poses, &mounts), &[], (2, &wish), threads, &say).unwrap();
        assert_eq!(many, one);
        let mut steps = steps.into_inner().unwrap();
        let whole = steps[0].1;
        assert!(steps.iter().all(|step| step.1 == whole && step.0 <= whole));
        steps.sort_unstable();
        steps.dedup();
        assert!(steps.len() > 50, "{steps:?}");
    }
    let none = search(&survey, (&[], &mounts), &[], (2, &wish), 1, &|_, _| ());
    assert!(matches!(none, Err(CoverageError::NoCandidates)));
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let (_, poses, survey) = small();
    let sensors = sensors_of(&poses);
    let one = survey.look_all(&sensors, 1, &|| ()).unwrap();
    let bits = |looks: &[Look]| -> Vec<u64> {
        let cells = looks.iter().flat_map(|look| &look.cells);
        cells.map(|seen| seen.contrast.to_bits()).collect()
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
}
