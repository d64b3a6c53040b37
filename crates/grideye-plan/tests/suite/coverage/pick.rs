//! The picked poses, compared with all pairs.

use super::{looks, sensor, survey};
use crate::{ROOM, object, scene};
use grideye_plan::coverage::{
    Candidate, Kind, Look, Map, Mounts, Rule, Survey, Wish, candidates, pick, preset,
};
use grideye_scene::{Scene, Sensor};

/// A room in which poses see different parts, and few candidates.
pub(super) fn small() -> (Scene, Vec<Candidate>, Survey, Vec<Look>) {
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

/// The objective by its definition: detecting sensors, up to the wanted number, as a share of it, averaged.
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
fn the_greedy_choice_is_compared_with_all_pairs() {
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
        // The reported figures are those of the chosen poses, and no step decreases.
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
fn more_sensors_never_see_less_and_kept_ones_count() {
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
    // Kept poses are not picked again, and picking continues from them.
    let kept = [found.steps[0].chosen];
    let rest = pick(survey.floor(), &looks, &kept, 4, &wish).unwrap();
    let chosen = |steps: &[grideye_plan::coverage::Step]| {
        steps.iter().map(|step| step.chosen).collect::<Vec<_>>()
    };
    assert_eq!(chosen(&rest.steps), chosen(&found.steps[1..]));
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
    let found = pick(survey.floor(), &looks, &[], 2, &wish).unwrap();
    assert!(!found.is_submodular && found.steps.iter().all(|step| step.objective_max.is_none()));
    let last = found.steps.last().unwrap().objective;
    assert!((last - together.totals.detected as f64 / together.totals.places as f64).abs() < 1e-12);
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
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
