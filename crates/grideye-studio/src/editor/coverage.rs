//! Where a draft's sensors see a person, on a coarse grid for the plan.

use super::fault::Fault;
use grideye_plan::coverage::{
    CoverageError, Figure, Floor, Grain, InSight, Kind, Map, Spot, Survey, Wish,
};
use grideye_scene::Scene;
use serde_json::{Value, json};
use std::sync::atomic::{AtomicBool, Ordering};

/// Minimum side of a floor cell, in meters.
const CELL_M_MIN: f64 = 0.2;
/// Maximum cells of the floor times sensors: beyond it, cells get larger.
const PAIRS_MAX: f64 = 6_000.0;
/// Maximum sensors considered.
const SENSORS_MAX: usize = 32;

/// The map of a scene; `None` once the request is abandoned.
///
/// # Errors
/// Why the room cannot be surveyed.
pub(super) fn map(scene: &Scene, is_given_up: &AtomicBool) -> Result<Option<Value>, Fault> {
    let sensors = scene.sensors();
    let sensors = sensors.get(..SENSORS_MAX).unwrap_or(sensors);
    let grain = Grain {
        cell_m: cell_m(scene, sensors.len()),
        ..Grain::default()
    };
    let figure = Figure::standing();
    let survey = Survey::new(scene, &figure, &grain).map_err(|error| fault(&error))?;
    let mut looks = Vec::new();
    for sensor in sensors {
        if is_given_up.load(Ordering::Relaxed) {
            return Ok(None);
        }
        looks.push(survey.look(sensor).map_err(|error| fault(&error))?);
    }
    let wish = Wish::default();
    let map = Map::new(survey.floor(), &looks.iter().collect::<Vec<_>>(), &wish);
    let cells: String = map.spots.iter().map(|spot| letter(spot, &wish)).collect();
    let totals = &map.totals;
    Ok(Some(json!({
        "columns": survey.floor().columns,
        "rows": survey.floor().rows,
        "low_m": low_m(survey.floor()),
        "cell_m": survey.floor().cell_m.to_array(),
        "cells": cells,
        "places": totals.places,
        "detected": totals.detected,
        "hidden": totals.hidden,
        "out_of_view": totals.out_of_view,
        "figure": figure.name(),
        "sigma_min": wish.sigma_min,
    })))
}

fn cell_m(scene: &Scene, sensors: usize) -> f64 {
    let (low, high) = scene.room().bounds_m();
    let area = (high.x - low.x) * (high.y - low.y);
    let sensors: f64 = sensors.max(1).to_string().parse().unwrap_or(1.0);
    (area * sensors / PAIRS_MAX).sqrt().max(CELL_M_MIN)
}

/// The letter of a cell: `d`etected, `w`eak, `h`idden, `o`ut of view, `t`oo tight for a person, `f`urniture, or `x` for
/// outside.
fn letter(spot: &Spot, wish: &Wish) -> char {
    match (spot.kind, spot.ground) {
        (Kind::Outside, _) => 'x',
        (Kind::Furniture, _) => 'f',
        (Kind::Tight, _) => 't',
        (Kind::Place, _) if spot.is_detected(wish) => 'd',
        (Kind::Place, Some(InSight::Hidden)) => 'h',
        (Kind::Place, Some(InSight::OutOfView)) => 'o',
        (Kind::Place, _) => 'w',
    }
}

/// The left front corner of the first cell.
fn low_m(floor: &Floor) -> [f64; 2] {
    let first = floor.cells.first().map(|cell| cell.ground_m);
    first.map_or([0.0; 2], |at| {
        [at.x - floor.cell_m.x / 2.0, at.y - floor.cell_m.y / 2.0]
    })
}

fn fault(error: &CoverageError) -> Fault {
    Fault::said(&error.to_string(), None)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::editor::GivenUp;
    use std::sync::Arc;

    #[test]
    fn an_abandoned_map_stops() {
        let text = "[room]\nsize_mm = [2000, 2000, 2700]\nambient_c = 20\n[[sensor]]\nname = \"s\"\npreset = \"grid-eye\"\nposition_mm = [1000, 1000, 2700]\nelevation_deg = 90\nazimuth_deg = 0\n";
        let none = |_: &str| Err(std::io::ErrorKind::NotFound.into());
        let scene = Scene::parse(text, "scene", &none).unwrap().scene;
        let waiting = GivenUp::default();
        let is_given_up = Arc::clone(&waiting.0);
        assert!(map(&scene, &is_given_up).unwrap().is_some());
        drop(waiting);
        assert!(map(&scene, &is_given_up).unwrap().is_none());
    }
}
