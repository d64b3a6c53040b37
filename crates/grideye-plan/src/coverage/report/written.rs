//! Writes the results for programs and as a drawing: JSON, a row for each cell, a sketch.

use super::found::{Report, share};
use super::table::summary_of_picture;
use crate::coverage::floor::Kind;
use crate::coverage::map::Map;
use crate::coverage::picture::Picture;
use crate::coverage::survey::InSight;
use crate::coverage::wish::Rule;
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

    /// Writes the cells of the JSON as CSV: front row first, each row from the left. A cell that is not a place has no
    /// contrast.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn csv(&self, out: &mut dyn Write) -> io::Result<()> {
        writeln!(out, "x_mm,y_mm,ground_mm,{}", COLUMNS.join(","))?;
        for cell in cells(self) {
            let at_mm = (0..3).map(|axis| &cell["ground_mm"][axis]);
            let fields = at_mm.chain(COLUMNS.map(|column| &cell[column]));
            writeln!(out, "{}", fields.map(field).collect::<Vec<_>>().join(","))?;
        }
        Ok(())
    }

    /// The map as an SVG.
    #[must_use]
    pub fn svg(&self) -> String {
        let poses = self.poses.iter().enumerate();
        let sensors = poses.map(|(index, pose)| (self.shown_name(index), &pose.sensor));
        let sensors: Vec<(String, &Sensor)> = sensors.collect();
        Picture {
            title: &format!("{}: coverage", self.scene_name),
            summary: &summary_of_picture(self),
            scene: self.scene,
            floor: self.survey.floor(),
            map: &self.map,
            wish: &self.wish,
            sensors: &sensors,
        }
        .svg()
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

const COLUMNS: [&str; 7] = [
    "kind",
    "blind",
    "seen_by",
    "detected_by",
    "contrast_sigma",
    "contrast_together_sigma",
    "best_sensor",
];

fn cells(found: &Report<'_>) -> Vec<Value> {
    let floor = found.survey.floor();
    let inside = floor.cells.iter().zip(&found.map.spots);
    inside
        .filter(|(cell, _)| cell.kind != Kind::Outside)
        .map(|(cell, spot)| {
            let rounded = |value: f64| (value * 1000.0).round() / 1000.0;
            let contrast = |value: f64| (spot.kind == Kind::Place).then(|| rounded(value));
            json!({
                "ground_mm": (cell.ground_m * 1000.0).to_array().map(rounded),
                "kind": match spot.kind {
                    Kind::Outside => "outside",
                    Kind::Furniture => "furniture",
                    Kind::Tight => "tight",
                    Kind::Place => "place",
                },
                "blind": match spot.ground {
                    Some(InSight::Hidden) => Some("hidden"),
                    Some(InSight::OutOfView) => Some("out of view"),
                    Some(InSight::Seen) | None => None,
                },
                "seen_by": spot.seen_by,
                "detected_by": spot.detected_by,
                "contrast_sigma": contrast(spot.best),
                "contrast_together_sigma": contrast(spot.together),
                "best_sensor": spot.best_look.map(|look| found.shown_name(look)),
            })
        })
        .collect()
}

fn field(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) if text.contains(['"', ',', '\n', '\r']) => {
            format!("\"{}\"", text.replace('"', "\"\""))
        }
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}
