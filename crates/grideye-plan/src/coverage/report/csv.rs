//! The map as a table: a row for each cell in the room.

use super::found::Report;
use crate::coverage::floor::{Cell, Kind};
use crate::coverage::map::{Blind, Spot};
use std::io::{self, Write};

impl Report<'_> {
    /// Writes the map as a table: front row first, each from the left; contrasts in units of the noise.
    ///
    /// # Errors
    /// Of `out`.
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
}

fn row(found: &Report<'_>, cell: &Cell, spot: &Spot) -> String {
    let [x, y, z] = (cell.ground_m * 1000.0).to_array();
    // What is no place has no contrast: an empty field, not a zero.
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

pub(super) const fn kind(kind: Kind) -> &'static str {
    match kind {
        Kind::Outside => "outside",
        Kind::Furniture => "furniture",
        Kind::Tight => "tight",
        Kind::Place => "place",
    }
}

pub(super) const fn blind(blind: Option<Blind>) -> &'static str {
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
