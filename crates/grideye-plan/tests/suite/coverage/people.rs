//! Where people lie, sit and stand, and what is in the way.

use super::{cells_of, looks, person, sensor, survey};
use crate::{ROOM, object, scene};
use glam::{DVec2, DVec3};
use grideye_plan::coverage::{Figure, InSight, Kind, Survey};
use grideye_scene::Posture;

#[test]
fn a_lying_person_fits_in_bed_and_under_the_table_but_a_standing_one_does_not() {
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
        let survey = Survey::new(&scene, &person(posture), &cells_of(100.0)).unwrap();
        let cells = survey.floor().cells.iter();
        let nearest = cells.min_by(|one, other| {
            let away = |at: DVec3| at.truncate().distance(place.into());
            away(one.ground_m).total_cmp(&away(other.ground_m))
        });
        let cell = nearest.unwrap();
        (cell.kind, (cell.ground_m.z * 1000.0).round())
    };
    let (bed, table, lamp) = ((2.05, 4.55), (2.05, 1.55), (2.05, 3.05));
    assert_eq!(at(Posture::Lie, bed), (Kind::Place, 550.0));
    assert_eq!(at(Posture::Sit, bed), (Kind::Place, 550.0));
    assert_eq!(at(Posture::Stand, bed).0, Kind::Furniture);
    assert_eq!(at(Posture::Lie, table), (Kind::Place, 0.0));
    assert_eq!(at(Posture::Stand, table).0, Kind::Furniture);
    assert_eq!(at(Posture::Stand, lamp), (Kind::Place, 0.0));
    // Nobody lies crosswise 0.1 m from the wall, and nobody stands 0.05 m from it.
    assert_eq!(at(Posture::Lie, (0.15, 3.05)).0, Kind::Tight);
    assert_eq!(at(Posture::Stand, (0.05, 3.05)).0, Kind::Tight);
    assert_eq!(at(Posture::Stand, (0.15, 3.05)).0, Kind::Place);
    // The gap between the bed and a wall 0.1 m from it is no place either.
    assert_eq!(at(Posture::Stand, (0.95, 4.55)).0, Kind::Tight);
}

#[test]
fn an_agent_of_the_scene_may_be_the_person_to_look_for() {
    let person = "[[agent]]\nname = \"p\"\nperson = { height_mm = 1700 }\nyaw_deg = 70\nposition_mm = [1000, 1000, 0]\n";
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
fn agents_in_the_scene_do_not_change_looks() {
    // In the middle of the view, where the person is tried as well.
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
fn objects_behind_the_sensor_hide_nothing_in_front() {
    // A panel of 2 m along a diagonal, and a sensor in front of it. The lines of sight lead away from the panel, but
    // their bounding boxes overlap the panel's, and extended backwards they would cross it.
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
fn there_is_no_ground_in_a_wardrobe_taller_than_the_person() {
    let (base, size) = ([3000.0, 3000.0, 0.0], [1000.0, 1600.0, 2100.0]);
    let scene = scene(&format!(
        "{ROOM}{}",
        object("wardrobe", base, size, 0.0, 20.1)
    ));
    for posture in [Posture::Stand, Posture::Sit, Posture::Lie] {
        let survey = Survey::new(&scene, &person(posture), &cells_of(100.0)).unwrap();
        for cell in &survey.floor().cells {
            let away = (cell.ground_m.truncate() - DVec2::new(3.0, 3.0)).abs();
            let is_in_it = away.x < 0.5 && away.y < 0.8;
            assert_eq!(cell.kind == Kind::Furniture, is_in_it, "{}", cell.ground_m);
        }
    }
}
