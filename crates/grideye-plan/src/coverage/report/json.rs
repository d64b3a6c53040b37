//! All that was found, for programs.

use super::csv::{blind, kind};
use super::found::{Report, share};
use crate::coverage::floor::Kind;
use crate::coverage::map::Map;
use crate::coverage::pick::Rule;
use serde_json::{Value, json};

impl Report<'_> {
    /// All that was found, for programs.
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
            "poses_tried": self.poses.len() - self.kept,
            "pairs": self.looks.len() * floor.cells.iter().filter(|cell| cell.kind != Kind::Outside).count(),
            "objective_is_submodular": self.pick.as_ref().map(|pick| pick.is_submodular),
            "sensors": sensors(self),
            "totals": totals(&self.map),
            "floor": {"columns": floor.columns, "rows": floor.rows, "cell_mm": [floor.cell_m.x * 1000.0, floor.cell_m.y * 1000.0]},
            "cells": cells(self),
        });
        format!("{all:#}\n")
    }
}

/// The shown poses, and what is reached with each of them and all before it.
fn sensors(found: &Report<'_>) -> Vec<Value> {
    let steps = found.pick.iter().flat_map(|pick| &pick.steps);
    let of_pick: Vec<_> = (0..found.kept)
        .map(|_| None)
        .chain(steps.map(Some))
        .collect();
    let shown = found.shown.iter().zip(&found.steps).zip(of_pick);
    shown
        .enumerate()
        .map(|(index, ((pose, map), step))| {
            let candidate = &found.poses[*pose];
            json!({
                "name": found.shown_name(index),
                "position_mm": candidate.position_mm.to_array(),
                "elevation_deg": candidate.elevation_deg,
                "azimuth_deg": candidate.azimuth_deg,
                "objective": step.map(|step| step.objective),
                "objective_max": step.and_then(|step| step.objective_max),
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
