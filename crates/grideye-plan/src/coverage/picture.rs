//! Draws the map as simple shapes: darker is better, undetected or unseen cells are hatched.

use super::floor::{Floor, Kind};
use super::map::{Blind, Map, Spot};
use super::wish::Wish;
use crate::ground;
use glam::{DVec2, DVec3};
use grideye_draw::number::round_step;
use grideye_draw::sketch::{Anchor, DARK, GRAY, Shape, Sketch, WHITE};
use grideye_scene::{Scene, Sensor, count, polygon::bounds};

/// The contents of the drawing.
#[derive(Debug, Clone, Copy)]
pub struct MapDrawing<'a> {
    /// The title.
    pub title: &'a str,
    /// The line below the title.
    pub summary: &'a str,
    /// The room.
    pub scene: &'a Scene,
    /// Its floor.
    pub floor: &'a Floor,
    /// What the sensors see together.
    pub map: &'a Map,
    /// What they must achieve.
    pub wish: &'a Wish,
    /// The sensors with their names.
    pub sensors: &'a [(String, &'a Sensor)],
}

impl MapDrawing<'_> {
    /// The drawing: a person's contrast at the left, the sensors that see the ground at the right.
    #[must_use]
    pub fn sketch(&self) -> Sketch {
        let high = FloorToPage::new(self.scene, DVec2::ZERO).height() + TOP;
        let mut sketch = Sketch::new(WIDTH, high + BELOW);
        let at = DVec2::new(MARGIN, 30.0);
        sketch.text(at, Anchor::Start, 18.0, self.title);
        let below = at + DVec2::new(0.0, 22.0);
        sketch.text(below, Anchor::Start, 12.0, self.summary);
        let panels = [
            ("Contrast of a person at each place", MARGIN),
            ("Sensors that see the floor", MARGIN + PANEL + GAP),
        ];
        for (index, (title, left)) in panels.into_iter().enumerate() {
            let to_page = FloorToPage::new(self.scene, DVec2::new(left, TOP));
            sketch.text(DVec2::new(left, TOP - 14.0), Anchor::Start, 13.0, title);
            for (cell, spot) in self.floor.cells.iter().zip(&self.map.spots) {
                let box_ = to_page.cell(cell.ground_m, self.floor.cell_m);
                if index == 0 {
                    self.contrast(&mut sketch, box_, spot);
                } else {
                    self.count(&mut sketch, box_, spot);
                }
            }
            self.room(&mut sketch, &to_page);
            self.markers(&mut sketch, &to_page);
            to_page.rulers(&mut sketch);
        }
        self.legend(&mut sketch, high + LEGEND);
        sketch
    }

    fn contrast(&self, sketch: &mut Sketch, cell: Cell, spot: &Spot) {
        match spot.kind {
            Kind::Outside => {}
            Kind::Furniture => sketch.rectangle(cell, FURNITURE),
            Kind::Tight => sketch.rectangle(cell, TIGHT),
            Kind::Place => {
                let band = band(spot.contrast(self.wish.rule) / self.wish.sigma_min);
                let (fill, how) = BANDS[band];
                sketch.rectangle(cell, fill);
                hatch(sketch, cell, how);
            }
        }
    }

    fn count(&self, sketch: &mut Sketch, cell: Cell, spot: &Spot) {
        match (spot.kind, spot.blind) {
            (Kind::Outside, _) => {}
            (Kind::Furniture, _) => sketch.rectangle(cell, FURNITURE),
            (_, Some(blind)) => {
                sketch.rectangle(cell, WHITE);
                hatch(sketch, cell, hatch_of(blind));
            }
            _ => {
                let fill = COUNTS[spot.seen_by.clamp(1, COUNTS.len()) - 1];
                sketch.rectangle(cell, fill);
                let size = cell.1.y - cell.0.y;
                if size >= 9.0 && self.sensors.len() > 1 {
                    let color = if spot.seen_by > 2 { WHITE } else { DARK };
                    let middle = 0.5 * (cell.0 + cell.1) + DVec2::new(0.0, 3.5);
                    sketch.shapes.push(Shape::Text {
                        at: middle,
                        anchor: Anchor::Middle,
                        size: 9.0,
                        text: spot.seen_by.to_string(),
                        color,
                        halo: false,
                    });
                }
            }
        }
    }

    fn room(&self, sketch: &mut Sketch, to_page: &FloorToPage) {
        for object in self.scene.objects() {
            let outline = ground::outline_m(object);
            let on_page: Vec<DVec2> = outline.iter().map(|corner| to_page.page(*corner)).collect();
            let (low, high) = bounds(on_page.iter().copied());
            sketch.closed(on_page, 1.2, DARK);
            let wide = 6.4 * count::float(object.name.chars().count());
            if high.x - low.x > wide && high.y - low.y > 14.0 {
                let at = 0.5 * (low + high) + DVec2::new(0.0, 4.0);
                sketch.halo(at, Anchor::Middle, 11.0, &object.name);
            }
        }
        let outline = self.scene.room().outline_m();
        let walls = outline.iter().map(|corner| to_page.page(*corner));
        sketch.closed(walls.collect(), 3.0, DARK);
    }

    fn markers(&self, sketch: &mut Sketch, to_page: &FloorToPage) {
        for (name, sensor) in self.sensors {
            let footprint = ground::in_view_m(self.scene.room(), sensor).into_iter();
            let on_page: Vec<DVec2> = footprint.map(|corner| to_page.page(corner)).collect();
            sketch.dashed(&on_page);
            let at = to_page.page(sensor.pose.position_m.truncate());
            let forward = sensor.pose.world_from_sensor().x_axis;
            let ahead = DVec2::new(forward.x, -forward.y);
            if ahead.length() > 0.05 {
                let tip = at + 26.0 * ahead;
                sketch.line(vec![at, tip], 5.0, WHITE);
                sketch.line(vec![at, tip], 2.4, DARK);
            }
            sketch.disc(at, 7.5, WHITE);
            sketch.disc(at, 6.0, DARK);
            sketch.disc(at, 2.5, WHITE);
            sketch.halo(at + DVec2::new(0.0, -11.0), Anchor::Middle, 11.0, name);
        }
    }

    fn legend(&self, sketch: &mut Sketch, top: f64) {
        let least = self.wish.sigma_min;
        let mut at = DVec2::new(MARGIN, top);
        let ends = BAND_ENDS.map(|end| (end * least * 10.0).round() / 10.0);
        let names = [
            format!("below {} \u{3c3}", ends[0]),
            format!("to {} \u{3c3}: not detected", ends[1]),
            format!("to {} \u{3c3}", ends[2]),
            format!("to {} \u{3c3}", ends[3]),
            format!("to {} \u{3c3}", ends[4]),
            "more".to_owned(),
        ];
        for (band, name) in BANDS.into_iter().zip(&names) {
            at = swatch(sketch, at, band, name);
        }
        at = DVec2::new(MARGIN, top + 24.0);
        at = swatch(sketch, at, (FURNITURE, Hatch::None), "furniture");
        swatch(sketch, at, (TIGHT, Hatch::None), "too tight for the person");
        at = DVec2::new(MARGIN + PANEL + GAP, top);
        for (seen_by, name) in ["1 sensor", "2", "3", "4 or more"].into_iter().enumerate() {
            at = swatch(sketch, at, (COUNTS[seen_by], Hatch::None), name);
        }
        at = DVec2::new(MARGIN + PANEL + GAP, top + 24.0);
        for (blind, name) in [
            (Blind::Hidden, "blind: behind furniture or a wall"),
            (Blind::OutOfView, "blind: outside every field of view"),
        ] {
            at = swatch(sketch, at, (WHITE, hatch_of(blind)), name);
        }
        at = DVec2::new(MARGIN, top + 48.0);
        sketch.disc(at + DVec2::new(7.0, -4.0), 6.0, DARK);
        sketch.disc(at + DVec2::new(7.0, -4.0), 2.5, WHITE);
        let text =
            "sensor and its direction; dashed: its field of view on the floor; lengths in meters";
        sketch.text(at + DVec2::new(20.0, 0.0), Anchor::Start, 12.0, text);
    }
}

type Cell = (DVec2, DVec2);

struct FloorToPage {
    low: DVec2,
    high: DVec2,
    top_left: DVec2,
    scale: f64,
}

impl FloorToPage {
    fn new(scene: &Scene, top_left: DVec2) -> Self {
        let (low, high) = bounds(scene.room().outline_m().into_iter());
        let scale = (DVec2::new(PANEL - RULER, PANEL_HEIGHT) / (high - low)).min_element();
        Self {
            low,
            high,
            top_left: top_left + DVec2::new(RULER, 0.0),
            scale,
        }
    }

    fn height(&self) -> f64 {
        self.scale * (self.high.y - self.low.y)
    }

    /// Right is right, back is up.
    fn page(&self, at_m: DVec2) -> DVec2 {
        let from = DVec2::new(at_m.x - self.low.x, self.high.y - at_m.y);
        self.top_left + self.scale * from
    }

    fn cell(&self, ground_m: DVec3, cell_m: DVec2) -> Cell {
        let half = 0.5 * self.scale * cell_m;
        let middle = self.page(ground_m.truncate());
        (middle - half, middle + half)
    }

    fn rulers(&self, sketch: &mut Sketch) {
        let size = self.high - self.low;
        let step = round_step(size.max_element() / 8.0);
        for (along, length) in [(DVec2::X, size.x), (DVec2::Y, size.y)] {
            let outwards = if along.x > 0.0 { DVec2::Y } else { -DVec2::X };
            for tick in 0..=count::floor(length / step + 1e-9) {
                let way = step * count::float(tick);
                let from = self.page(self.low + way * along) + 2.0 * outwards;
                sketch.line(vec![from, from + 5.0 * outwards], 1.0, GRAY);
                let text = format!("{}", (way * 1000.0).round() / 1000.0);
                let (anchor, offset) = if along.x > 0.0 {
                    (Anchor::Middle, DVec2::new(0.0, 18.0))
                } else {
                    (Anchor::End, DVec2::new(-8.0, 4.0))
                };
                sketch.text(from + offset, anchor, 11.0, &text);
            }
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Hatch {
    None,
    Lines,
    Crossed,
    Dots,
}

const fn hatch_of(blind: Blind) -> Hatch {
    match blind {
        Blind::Hidden => Hatch::Crossed,
        Blind::OutOfView => Hatch::Dots,
    }
}

fn hatch(sketch: &mut Sketch, (low, high): Cell, hatch: Hatch) {
    let across = DVec2::new(high.x, low.y);
    let down = DVec2::new(low.x, high.y);
    if matches!(hatch, Hatch::Lines | Hatch::Crossed) {
        sketch.line(vec![down, across], 0.9, DARK);
    }
    if hatch == Hatch::Crossed {
        sketch.line(vec![low, high], 0.9, DARK);
    }
    if hatch == Hatch::Dots {
        let size = 0.11 * (high.y - low.y).min(high.x - low.x);
        sketch.disc(0.5 * (low + high), size.clamp(0.5, 1.6), DARK);
    }
}

/// A colored box with its meaning; returns the place of the next one.
fn swatch(sketch: &mut Sketch, at: DVec2, (fill, how): ([u8; 3], Hatch), name: &str) -> DVec2 {
    let cell = (at - DVec2::new(0.0, 12.0), at + DVec2::new(16.0, 4.0));
    sketch.rectangle(cell, fill);
    hatch(sketch, cell, how);
    let corners = [
        cell.0,
        DVec2::new(cell.1.x, cell.0.y),
        cell.1,
        DVec2::new(cell.0.x, cell.1.y),
    ];
    sketch.closed(corners.to_vec(), 0.8, GRAY);
    sketch.text(at + DVec2::new(22.0, 0.0), Anchor::Start, 12.0, name);
    at + DVec2::new(38.0 + 6.4 * count::float(name.chars().count()), 0.0)
}

fn band(part: f64) -> usize {
    BAND_ENDS.iter().filter(|end| part >= **end).count()
}

const WIDTH: f64 = 1240.0;
const MARGIN: f64 = 28.0;
const TOP: f64 = 92.0;
const PANEL: f64 = 576.0;
const PANEL_HEIGHT: f64 = 620.0;
const GAP: f64 = 32.0;
const RULER: f64 = 34.0;
/// From the front wall to the legend, and to the end of the page.
const LEGEND: f64 = 62.0;
const BELOW: f64 = 128.0;

const BAND_ENDS: [f64; 5] = [1.0 / 3.0, 1.0, 2.0, 4.0, 8.0];
/// Lighter is worse; undetected is also hatched.
const BANDS: [([u8; 3], Hatch); 6] = [
    ([255, 255, 255], Hatch::Crossed),
    ([250, 240, 225], Hatch::Lines),
    ([205, 224, 240], Hatch::None),
    ([140, 186, 220], Hatch::None),
    ([62, 130, 186], Hatch::None),
    ([8, 64, 120], Hatch::None),
];
const COUNTS: [[u8; 3]; 4] = [
    [225, 238, 225],
    [160, 205, 165],
    [80, 150, 95],
    [20, 85, 45],
];
const FURNITURE: [u8; 3] = [190, 190, 190];
const TIGHT: [u8; 3] = [232, 232, 232];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn better_is_darker_whatever_the_hue() {
        // Relative luminance of ITU-R BT.709.
        let luminance = |[red, green, blue]: [u8; 3]| {
            0.2126 * f64::from(red) + 0.7152 * f64::from(green) + 0.0722 * f64::from(blue)
        };
        for scale in [&BANDS.map(|(fill, _)| fill)[..], &COUNTS[..]] {
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
