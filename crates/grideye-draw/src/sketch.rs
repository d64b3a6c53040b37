//! A drawing of simple shapes, as SVG or PNG.

use crate::encode;
use crate::palette::Rgb;
use crate::{raster, vector};
use glam::DVec2;
use std::io::{self, Write};

pub use crate::shape::{Anchor, Shape};

/// A drawing on a white page with its origin at the top left; later shapes cover earlier ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Sketch {
    /// Width of the page.
    pub width: f64,
    /// Height of the page.
    pub height: f64,
    /// Shapes in painting order.
    pub shapes: Vec<Shape>,
}

/// Color of text and other prominent shapes.
pub const DARK: Rgb = [34, 34, 34];
/// Color of reading aids.
pub const GRAY: Rgb = [110, 110, 110];
/// Color of the page.
pub const WHITE: Rgb = [255, 255, 255];

/// Corners of the polygon drawn for a disc.
const DISC_CORNERS: u8 = 20;
/// Length of a dash, and of the gap between two.
const DASH: f64 = 7.0;
const BETWEEN: f64 = 5.0;
/// Limit on the dashes of one line.
const DASHES_MAX: usize = 500;

impl Sketch {
    /// An empty page.
    #[must_use]
    pub const fn new(width: f64, height: f64) -> Self {
        Self {
            width,
            height,
            shapes: Vec::new(),
        }
    }

    /// The drawing as a self-contained SVG.
    #[must_use]
    pub fn svg(&self) -> String {
        vector::svg((self.width, self.height), &self.shapes)
    }

    /// Writes the drawing as a PNG, with two dots per unit.
    ///
    /// # Errors
    /// If writing fails.
    pub fn png(&self, out: impl Write) -> io::Result<()> {
        encode::rgb(
            &raster::canvas((self.width, self.height), &self.shapes),
            out,
        )
    }

    /// Dark text.
    pub fn text(&mut self, at: DVec2, anchor: Anchor, size: f64, text: &str) {
        self.write((at, anchor, size), text, false);
    }

    /// Dark text with a white border, readable on any background.
    pub fn halo(&mut self, at: DVec2, anchor: Anchor, size: f64, text: &str) {
        self.write((at, anchor, size), text, true);
    }

    fn write(&mut self, (at, anchor, size): (DVec2, Anchor, f64), text: &str, halo: bool) {
        self.shapes.push(Shape::Text {
            at,
            anchor,
            size,
            text: text.to_owned(),
            color: DARK,
            halo,
        });
    }

    /// A filled rectangle between two corners.
    pub fn rectangle(&mut self, (low, high): (DVec2, DVec2), fill: Rgb) {
        let points = vec![
            low,
            DVec2::new(high.x, low.y),
            high,
            DVec2::new(low.x, high.y),
        ];
        self.shapes.push(Shape::Polygon { points, fill });
    }

    /// A filled disc.
    pub fn disc(&mut self, middle: DVec2, radius: f64, fill: Rgb) {
        let turn = std::f64::consts::TAU / f64::from(DISC_CORNERS);
        let corner = |index: u8| {
            let (sin, cos) = libm::sincos(turn * f64::from(index));
            middle + radius * DVec2::new(cos, sin)
        };
        let points = (0..DISC_CORNERS).map(corner).collect();
        self.shapes.push(Shape::Polygon { points, fill });
    }

    /// Straight lines from point to point.
    pub fn line(&mut self, points: Vec<DVec2>, width: f64, color: Rgb) {
        self.shapes.push(Shape::Line {
            points,
            width,
            color,
        });
    }

    /// Straight lines from point to point and back to the first.
    pub fn closed(&mut self, mut points: Vec<DVec2>, width: f64, color: Rgb) {
        points.extend(points.first().copied());
        self.line(points, width, color);
    }

    /// A closed dashed line, dark on white, visible on any background.
    pub fn dashed(&mut self, corners: &[DVec2]) {
        let next = corners.iter().cycle().skip(1);
        for (from, to) in corners.iter().zip(next) {
            let length = from.distance(*to);
            let along = (*to - *from).normalize_or_zero();
            let mut way = 0.0;
            for _ in 0..DASHES_MAX {
                if way >= length {
                    break;
                }
                let end = (way + DASH).min(length);
                let dash = vec![*from + way * along, *from + end * along];
                self.line(dash.clone(), 3.2, WHITE);
                self.line(dash, 1.4, DARK);
                way += DASH + BETWEEN;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sketch() -> Sketch {
        let mut sketch = Sketch::new(20.0, 10.0);
        sketch.rectangle((DVec2::ZERO, DVec2::new(4.0, 2.5)), GRAY);
        sketch.line(vec![DVec2::ZERO, DVec2::new(3.0, 4.0)], 1.5, DARK);
        sketch.halo(DVec2::new(10.0, 9.0), Anchor::End, 11.0, "a<b");
        sketch
    }

    #[test]
    fn shapes_are_elements_in_their_order() {
        assert_eq!(
            sketch().svg(),
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"20\" height=\"10\" viewBox=\"0 0 20 10\" font-family=\"sans-serif\">\n\
             <rect width=\"20\" height=\"10\" fill=\"#ffffff\"/>\n\
             <path d=\"M0.00 0.00L4.00 0.00L4.00 2.50L0.00 2.50Z\" fill=\"#6e6e6e\" stroke=\"#6e6e6e\" stroke-width=\"0.3\"/>\n\
             <path d=\"M0.00 0.00L3.00 4.00\" fill=\"none\" stroke=\"#222222\" stroke-width=\"1.5\"/>\n\
             <text x=\"10.0\" y=\"9.0\" text-anchor=\"end\" font-size=\"11\" fill=\"#222222\" stroke=\"#ffffff\" stroke-width=\"3\" \
             stroke-linejoin=\"round\" paint-order=\"stroke\">a&lt;b</text>\n</svg>\n"
        );
    }

    #[test]
    fn a_png_has_two_dots_for_each_unit() {
        let mut png = Vec::new();
        sketch().png(&mut png).unwrap();
        let reader = png::Decoder::new(io::Cursor::new(png)).read_info().unwrap();
        assert_eq!(reader.info().size(), (40, 20));
    }
}
