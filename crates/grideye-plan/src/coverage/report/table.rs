//! Writes the results for the terminal and for a scene file.

use super::found::{Report, place, share};
use crate::coverage::floor::Kind;
use crate::coverage::map::Spot;
use crate::coverage::wish::Rule;
use grideye_draw::text::counted;

const COLUMNS_MAX: usize = 120;

impl Report<'_> {
    /// The results for the terminal.
    #[must_use]
    pub fn text(&self) -> String {
        [head(self), poses(self), summary(self), plan(self)].concat()
    }

    /// The picked poses as tables of a scene file.
    #[must_use]
    pub fn tables(&self) -> String {
        let mut text = format!(
            "# {} for {}: a person is detected at {} of all places, from {} sigma on.\n",
            counted(self.poses.len() - self.kept, "pose"),
            self.scene_name,
            percent(self.map.totals.detected, self.map.totals.places),
            self.wish.sigma_min
        );
        for (index, pose) in self.poses.iter().enumerate().skip(self.kept) {
            text.push('\n');
            text.push_str(&pose.toml(&self.shown_name(index)));
        }
        text
    }
}

fn head(found: &Report<'_>) -> String {
    let floor = found.survey.floor();
    let totals = &found.map.totals;
    let [width, depth, height] = (found.scene.room().size_m * 1000.0).round().to_array();
    let mut head = format!(
        "{}: {width} x {depth} x {height} mm, {} °C; cells of {:.0} x {:.0} mm: {} with ground, {} with room for {}\n",
        found.scene_name,
        found.scene.room().ambient_c,
        floor.cell_m.x * 1000.0,
        floor.cell_m.y * 1000.0,
        totals.ground,
        totals.places,
        found.figure.name()
    );
    if let Some(choice) = found.choice {
        head.push_str(&format!("{} poses tried\n", choice.tried));
    }
    head
}

fn poses(found: &Report<'_>) -> String {
    let detects = format!("person > {} σ", found.wish.sigma_min);
    let mut text = format!(
        "\n  {:<12}{:<10}{:>20}{:>11}{:>9}{:>15}{:>12}{:>14}\n",
        "sensor",
        "where",
        "position, mm",
        "elevation",
        "azimuth",
        detects,
        "floor seen",
        "worst place",
    );
    for (index, (candidate, map)) in found.poses.iter().zip(&found.steps).enumerate() {
        let [x, y, z] = candidate.position_mm.to_array();
        let name = found.shown_name(index);
        let position = format!("{x}, {y}, {z}");
        text.push_str(&format!(
            "{} {name:<12}{:<10}{position:>20}{:>10}°{:>8}°{:>15}{:>12}{:>12} σ\n",
            if index == 0 { ' ' } else { '+' },
            place(candidate),
            candidate.elevation_deg,
            candidate.azimuth_deg,
            percent(map.totals.detected, map.totals.places),
            percent(map.totals.seen, map.totals.ground),
            format!("{:.1}", map.totals.contrast_min),
        ));
    }
    text
}

fn summary(found: &Report<'_>) -> String {
    let totals = &found.map.totals;
    let mut text = String::from("\n");
    if found.choice.is_some() {
        let steps = found.steps.iter();
        let by_count = steps.enumerate().skip(found.kept.saturating_sub(1));
        let parts: Vec<String> = by_count
            .map(|(index, map)| {
                let share = percent(map.totals.detected, map.totals.places);
                if index + 1 == found.kept {
                    format!("k=0: {share}")
                } else {
                    format!("k={}: {share}", index + 1 - found.kept)
                }
            })
            .collect();
        text.push_str(&format!(
            "{} of the places above {} σ\n",
            parts.join("; "),
            found.wish.sigma_min
        ));
    }
    text.push_str(&format!(
        "floor: {} seen, {} hidden behind furniture or a wall, {} outside every field of view\n",
        percent(totals.seen, totals.ground),
        percent(totals.hidden, totals.ground),
        percent(totals.out_of_view, totals.ground),
    ));
    text.push_str(&format!(
        "contrast of {}: median {:.1} σ, least {:.1} σ{}\n",
        found.figure.name(),
        totals.contrast_median,
        totals.contrast_min,
        worst(found)
    ));
    text.push_str(&note(found));
    text
}

pub(super) fn summary_of_picture(found: &Report<'_>) -> String {
    let totals = &found.map.totals;
    format!(
        "{}: detected at {} of the places from {} \u{3c3} on; floor: {} seen, {} hidden, {} out of view",
        found.figure.name(),
        percent(totals.detected, totals.places),
        found.wish.sigma_min,
        percent(totals.seen, totals.ground),
        percent(totals.hidden, totals.ground),
        percent(totals.out_of_view, totals.ground),
    )
}

fn worst(found: &Report<'_>) -> String {
    let rule = found.wish.rule;
    let places = found.survey.floor().cells.iter().zip(&found.map.spots);
    let worst = places
        .filter(|(_, spot)| spot.kind == Kind::Place)
        .min_by(|(_, one), (_, other)| one.contrast(rule).total_cmp(&other.contrast(rule)));
    worst.map_or_else(String::new, |(cell, _)| {
        let [x, y, _] = (cell.ground_m * 1000.0).round().to_array();
        format!(" at {x}, {y} mm")
    })
}

fn note(found: &Report<'_>) -> String {
    if found.choice.is_none() {
        return String::new();
    }
    let what = match (found.wish.rule, found.wish.sensors_min) {
        (Rule::Alone, 1) => "the places at which one sensor alone detects the person".to_owned(),
        (Rule::Alone, wanted) => {
            format!("the sensors that detect the person, up to {wanted} counted at each place")
        }
        (Rule::Together, _) => {
            "the places at which all sensors together detect the person".to_owned()
        }
    };
    format!(
        "chosen to maximize {what}: the best candidates, moved and turned until nothing near them is better; a pose elsewhere may be\n"
    )
}

fn plan(found: &Report<'_>) -> String {
    let floor = found.survey.floor();
    if floor.columns > COLUMNS_MAX {
        return String::new();
    }
    let mut text = String::from(
        "\ncontrast in σ at each place, 9 for 9 and more; # furniture, - too tight for the person; the back is at the top\n",
    );
    let rows: Vec<&[Spot]> = found.map.spots.chunks(floor.columns).collect();
    for row in rows.iter().rev() {
        let cells: String = row.iter().map(|spot| character(found, spot)).collect();
        text.push_str(&format!("  {}\n", cells.trim_end()));
    }
    text
}

fn character(found: &Report<'_>, spot: &Spot) -> char {
    match spot.kind {
        Kind::Outside => ' ',
        Kind::Furniture => '#',
        Kind::Tight => '-',
        Kind::Place => {
            let whole = spot.contrast(found.wish.rule).floor().clamp(0.0, 9.0);
            format!("{whole:.0}").chars().next().unwrap_or('?')
        }
    }
}

fn percent(part: usize, whole: usize) -> String {
    format!("{:.1} %", 100.0 * share(part, whole))
}
