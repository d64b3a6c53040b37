//! Writes the results for programs and as a drawing: JSON, a row for each cell, a sketch.

use super::found::{Report, share};
use super::table::summary_of_picture;
use crate::coverage::floor::{Cell, Kind};
use crate::coverage::map::{Blind, Map, Spot};
use crate::coverage::picture::MapDrawing;
use crate::coverage::wish::Rule;
use grideye_draw::sketch::Sketch;
use grideye_scene::Sensor;
use serde_json::{Value, json};
use std::io::{self, Write};

impl Report<'_> {
    /// All results, for programs.
    #[must_use]
    pub fn json(&self) -> String {
        let floor = self.survey.floor();
        let all = json!({
            "scene": self.scene_name,
            "person": self.figure.name(),
            "wish": {
                "sigma_min": self.wish.sigma_min,
                "sensors_min": self.wish.sensors_min,
                "rule": match self.wish.rule { Rule::Alone => "alone", Rule::Together => "together" },
            },
            "poses_tried": self.choice.map_or(0, |choice| choice.tried),
            "sensors": sensors(self),
            "totals": totals(&self.map),
            "floor": {"columns": floor.columns, "rows": floor.rows, "cell_mm": [floor.cell_m.x * 1000.0, floor.cell_m.y * 1000.0]},
            "cells": cells(self),
        });
        format!("{all:#}\n")
    }

    /// Writes the map as CSV: front row first, each row from the left; contrasts in units of the noise.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn csv(&self, out: &mut dyn Write) -> io::Result<()> {
        writeln!(
            out,
            "x_mm,y_mm,ground_mm,kind,blind,seen_by,detected_by,contrast_sigma,contrast_together_sigma,peak_sigma,best_sensor"
        )?;
        for (cell, spot) in self.survey.floor().cells.iter().zip(&self.map.spots) {
            if cell.kind != Kind::Outside {
                writeln!(out, "{}", row(self, cell, spot))?;
            }
        }
        Ok(())
    }

    /// The map as a drawing for people.
    #[must_use]
    pub fn sketch(&self) -> Sketch {
        let names = (0..).map(|index| self.shown_name(index).unwrap_or_default());
        let sensors = self.poses.iter().map(|pose| &pose.sensor);
        let sensors: Vec<(String, &Sensor)> = names.zip(sensors).collect();
        MapDrawing {
            title: &format!("{}: coverage", self.scene_name),
            summary: &summary_of_picture(self),
            scene: self.scene,
            floor: self.survey.floor(),
            map: &self.map,
            wish: &self.wish,
            sensors: &sensors,
        }
        .sketch()
    }
}

fn sensors(found: &Report<'_>) -> Vec<Value> {
    let objective = |index: usize| {
        let step = found.choice?.steps.get(index.checked_sub(found.kept)?)?;
        Some(step.objective)
    };
    let poses = found.poses.iter().zip(&found.steps).enumerate();
    poses
        .map(|(index, (pose, map))| {
            json!({
                "name": found.shown_name(index),
                "position_mm": pose.position_mm.to_array(),
                "elevation_deg": pose.elevation_deg,
                "azimuth_deg": pose.azimuth_deg,
                "objective": objective(index),
                "with_all_before": totals(map),
            })
        })
        .collect()
}

fn totals(map: &Map) -> Value {
    let totals = &map.totals;
    json!({
        "ground": totals.ground,
        "seen": totals.seen,
        "seen_share": share(totals.seen, totals.ground),
        "hidden": totals.hidden,
        "out_of_view": totals.out_of_view,
        "places": totals.places,
        "detected": totals.detected,
        "detected_share": share(totals.detected, totals.places),
        "contrast_min_sigma": totals.contrast_min,
        "contrast_median_sigma": totals.contrast_median,
    })
}

fn cells(found: &Report<'_>) -> Vec<Value> {
    let floor = found.survey.floor();
    let inside = floor.cells.iter().zip(&found.map.spots);
    inside
        .filter(|(cell, _)| cell.kind != Kind::Outside)
        .map(|(cell, spot)| {
            let contrast = |value: f64| (spot.kind == Kind::Place).then_some(value);
            json!({
                "ground_mm": (cell.ground_m * 1000.0).to_array(),
                "kind": kind(spot.kind),
                "blind": spot.blind.map(|_| blind(spot.blind)),
                "seen_by": spot.seen_by,
                "detected_by": spot.detected_by,
                "contrast_sigma": contrast(spot.best),
                "contrast_together_sigma": contrast(spot.together),
                "peak_sigma": contrast(spot.peak),
                "best_sensor": spot.best_look.and_then(|look| found.shown_name(look)),
            })
        })
        .collect()
}

fn row(found: &Report<'_>, cell: &Cell, spot: &Spot) -> String {
    let [x, y, z] = (cell.ground_m * 1000.0).to_array();
    // A cell that is not a place has no contrast: an empty field, not a zero.
    let contrast = |value: f64| match spot.kind {
        Kind::Place => format!("{value:.3}"),
        _ => String::new(),
    };
    let best = spot.best_look.and_then(|look| found.shown_name(look));
    format!(
        "{x:.1},{y:.1},{z:.1},{},{},{},{},{},{},{},{}",
        kind(spot.kind),
        blind(spot.blind),
        spot.seen_by,
        spot.detected_by,
        contrast(spot.best),
        contrast(spot.together),
        contrast(spot.peak),
        quoted(&best.unwrap_or_default()),
    )
}

const fn kind(kind: Kind) -> &'static str {
    match kind {
        Kind::Outside => "outside",
        Kind::Furniture => "furniture",
        Kind::Tight => "tight",
        Kind::Place => "place",
    }
}

const fn blind(blind: Option<Blind>) -> &'static str {
    match blind {
        None => "",
        Some(Blind::Hidden) => "hidden",
        Some(Blind::OutOfView) => "out of view",
    }
}

fn quoted(name: &str) -> String {
    if name.contains(['"', ',', '\n', '\r']) {
        return format!("\"{}\"", name.replace('"', "\"\""));
    }
    name.to_owned()
}
