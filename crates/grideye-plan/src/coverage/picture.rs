//! Draws the map on the room from above: darker is better, undetected or unseen cells are hatched.

use super::floor::{Floor, Kind};
use super::map::{Map, Spot};
use super::survey::InSight;
use super::wish::Wish;
use crate::drawing::camera::{Camera, Panel};
use crate::drawing::labels::Labels;
use crate::drawing::sheet::{Sheet, path};
use crate::ground;
use glam::{DVec2, DVec3};
use grideye_draw::Rgb;
use grideye_draw::palette::{INK, hex};
use grideye_scene::{Scene, Sensor};
use std::collections::BTreeMap;

/// The contents of the picture.
pub(super) struct Picture<'a> {
    pub(super) title: &'a str,
    pub(super) summary: &'a str,
    pub(super) scene: &'a Scene,
    pub(super) floor: &'a Floor,
    pub(super) map: &'a Map,
    pub(super) wish: &'a Wish,
    pub(super) sensors: &'a [(String, &'a Sensor)],
}

impl Picture<'_> {
    /// A person's contrast at the left, the sensors that see the ground at the right, as a self-contained SVG.
    pub(super) fn svg(&self) -> String {
        let mut sheet = Sheet::new((WIDTH, HEIGHT), self.title, self.summary, &style());
        sheet.svg.element("defs").open();
        for (name, paper, mark) in [
            ("crossed", BANDS[0], "M0 0L9 9M9 0L0 9"),
            ("lines", BANDS[1], "M0 9L9 0"),
            ("dots", BANDS[0], "M4 4h1v1h-1z"),
        ] {
            let pattern = sheet.svg.element("pattern").with("id", name);
            let pattern = pattern.with("width", 9).with("height", 9);
            pattern.with("patternUnits", "userSpaceOnUse").open();
            let paper = sheet.svg.element("rect").with("fill", hex(paper));
            paper.with("width", 9).with("height", 9).end();
            sheet.svg.mark("hatch", mark);
            sheet.svg.close("pattern");
        }
        sheet.svg.close("defs");
        let contrast = |spot: &Spot| band(spot.contrast(self.wish.rule) / self.wish.sigma_min);
        self.panel(
            &mut sheet,
            "Contrast of a person at each place",
            &LEFT,
            |spot| match spot.kind {
                Kind::Outside => None,
                Kind::Furniture => Some("furniture"),
                Kind::Tight => Some("tight"),
                Kind::Place => Some(BAND_CLASSES[contrast(spot)]),
            },
        );
        self.panel(
            &mut sheet,
            "Sensors that see the floor",
            &RIGHT,
            |spot| match (spot.kind, spot.ground) {
                (Kind::Outside, _) => None,
                (Kind::Furniture, _) => Some("furniture"),
                (_, Some(InSight::Hidden)) => Some("crossed"),
                (_, Some(InSight::OutOfView)) => Some("dots"),
                _ => Some(COUNT_CLASSES[spot.seen_by.clamp(1, COUNTS.len()) - 1]),
            },
        );
        self.legend(&mut sheet);
        sheet.finish()
    }

    fn panel(
        &self,
        sheet: &mut Sheet,
        title: &str,
        panel: &Panel,
        class: impl Fn(&Spot) -> Option<&'static str>,
    ) {
        let (room, bounds_m) = (self.scene.room(), self.scene.room().bounds_m());
        let camera = Camera::from_above(bounds_m, panel);
        sheet.panel(title, panel);
        let mut cells: BTreeMap<&str, String> = BTreeMap::new();
        for (cell, spot) in self.floor.cells.iter().zip(&self.map.spots) {
            let corner = |(x, y): (f64, f64)| {
                let aside_m = 0.5 * DVec2::new(x, y) * self.floor.cell_m;
                cell.ground_m + aside_m.extend(0.0)
            };
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(corner);
            if let Some(class) = class(spot) {
                let outlines = cells.entry(class).or_default();
                outlines.push_str(&path(&camera, &corners, true));
            }
        }
        for (class, outlines) in cells {
            sheet.mark(&format!("cell {class}"), &outlines);
        }
        let flat = |outline: Vec<DVec2>| {
            let points_m: Vec<DVec3> = outline.iter().map(|at| at.extend(0.0)).collect();
            path(&camera, &points_m, true)
        };
        let mut labels = Labels::default();
        for object in self.scene.objects() {
            sheet.mark("outline", &flat(ground::outline_m(object)));
        }
        sheet.mark("outline room", &flat(room.outline_m()));
        for (name, sensor) in self.sensors {
            sheet.mark("in-view", &flat(ground::in_view_m(room, sensor)));
            sheet.sensor(&camera, sensor, &[]);
            labels.place(camera.project(sensor.pose.position_m), name.clone());
        }
        for object in self.scene.objects() {
            let (low, high) = object.mesh.bounds_m();
            labels.place(camera.project(0.5 * (low + high)), object.name.clone());
        }
        sheet.ruler(&camera, bounds_m);
        sheet.labels(&labels);
    }

    fn legend(&self, sheet: &mut Sheet) {
        let ends = BAND_ENDS.map(|end| (end * self.wish.sigma_min * 10.0).round() / 10.0);
        let [first, second] = [LEGEND_Y, LEGEND_Y + 24.0];
        let mut at = DVec2::new(LEFT.corner.x, first);
        for band in 0..BANDS.len() {
            let name = match band {
                0 => format!("below {} σ", ends[0]),
                1 => format!("to {} σ: not detected", ends[1]),
                5 => "more".to_owned(),
                _ => format!("to {} σ", ends[band]),
            };
            at = sheet.key(at, &fill_of_band(band), &name);
        }
        at = sheet.key(DVec2::new(LEFT.corner.x, second), FURNITURE, "furniture");
        at = sheet.key(at, TIGHT, "too tight for the person");
        sheet.text("faint", at, "square: sensor; dashed: its view of the floor");
        at = DVec2::new(RIGHT.corner.x, first);
        for (fill, name) in COUNTS.into_iter().zip(["1 sensor", "2", "3", "4 or more"]) {
            at = sheet.key(at, &hex(fill), name);
        }
        at = DVec2::new(RIGHT.corner.x, second);
        at = sheet.key(at, "url(#crossed)", "blind: behind furniture or a wall");
        sheet.key(at, "url(#dots)", "blind: outside every field of view");
    }
}

fn style() -> String {
    let bands = BAND_CLASSES.into_iter().enumerate();
    let bands = bands.map(|(band, class)| (class, fill_of_band(band)));
    let counts = COUNT_CLASSES.into_iter().zip(COUNTS.map(hex));
    let fills: String = bands
        .chain(counts)
        .map(|(class, fill)| format!(".{class}{{fill:{fill}}}"))
        .collect();
    let ink = hex(INK);
    format!(
        "{fills}.cell{{stroke:none}}.furniture{{fill:{FURNITURE}}}.tight{{fill:{TIGHT}}}.crossed{{fill:url(#crossed)}}\
         .dots{{fill:url(#dots)}}.hatch{{stroke:{ink};fill:none}}.outline,.in-view{{fill:none;stroke:{ink};stroke-width:1.2}}\
         .outline.room{{stroke-width:3}}.in-view{{stroke-dasharray:7 5}}"
    )
}

fn fill_of_band(band: usize) -> String {
    match band {
        0 => "url(#crossed)".to_owned(),
        1 => "url(#lines)".to_owned(),
        _ => hex(BANDS[band]),
    }
}

fn band(part: f64) -> usize {
    BAND_ENDS.iter().filter(|end| part >= **end).count()
}

const WIDTH: f64 = 1240.0;
const HEIGHT: f64 = 748.0;
const LEFT: Panel = Panel::new(24.0, 72.0, 588.0, 616.0);
const RIGHT: Panel = Panel::new(628.0, 72.0, 588.0, 616.0);
const LEGEND_Y: f64 = 712.0;

const BAND_ENDS: [f64; 5] = [1.0 / 3.0, 1.0, 2.0, 4.0, 8.0];
/// Lighter is worse; undetected is also hatched.
const BANDS: [Rgb; 6] = [
    [255, 255, 255],
    [250, 240, 225],
    [205, 224, 240],
    [140, 186, 220],
    [62, 130, 186],
    [8, 64, 120],
];
const BAND_CLASSES: [&str; 6] = ["b0", "b1", "b2", "b3", "b4", "b5"];
const COUNTS: [Rgb; 4] = [
    [225, 238, 225],
    [160, 205, 165],
    [80, 150, 95],
    [20, 85, 45],
];
const COUNT_CLASSES: [&str; 4] = ["c1", "c2", "c3", "c4"];
const FURNITURE: &str = "#bebebe";
const TIGHT: &str = "#e8e8e8";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn better_is_darker_whatever_the_hue() {
        // Relative luminance of ITU-R BT.709.
        let luminance = |[red, green, blue]: [u8; 3]| {
            0.2126 * f64::from(red) + 0.7152 * f64::from(green) + 0.0722 * f64::from(blue)
        };
        for scale in [&BANDS[..], &COUNTS[..]] {
            for pair in scale.windows(2) {
                assert!(luminance(pair[0]) > luminance(pair[1]) + 10.0, "{pair:?}");
            }
        }
    }

    #[test]
    fn bands_follow_the_wanted_contrast() {
        let found = [0.0, 0.34, 0.999, 1.0, 2.0, 100.0].map(band);
        assert_eq!(found, [0, 1, 1, 2, 3, 5]);
    }
}
