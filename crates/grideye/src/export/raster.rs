//! A drawing of simple shapes in dots, as a PNG.

use super::font;
use anyhow::Result;
use grideye_plan::coverage::{Anchor, Shape, Sketch};
use std::io::Write;

/// Dots for each unit of the drawing: as many as make its text readable.
const DOTS: f64 = 2.0;
/// The height of text for which the font's dots are two dots each.
const SIZE_OF_TWO: f64 = 12.0;

/// Writes the drawing.
pub(crate) fn write(sketch: &Sketch, out: &mut dyn Write) -> Result<()> {
    let mut canvas = Canvas::new(sketch.width, sketch.height);
    for shape in &sketch.shapes {
        canvas.shape(shape);
    }
    let (width, height) = (u32::try_from(canvas.width)?, u32::try_from(canvas.height)?);
    let mut encoder = png::Encoder::new(out, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&canvas.dots.concat())?;
    writer.finish()?;
    Ok(())
}

struct Canvas {
    width: usize,
    height: usize,
    /// Red, green and blue, row by row.
    dots: Vec<[u8; 3]>,
}

/// A place in dots.
type At = (f64, f64);

impl Canvas {
    fn new(width: f64, height: f64) -> Self {
        let (width, height) = (whole(DOTS * width), whole(DOTS * height));
        Self {
            width,
            height,
            dots: vec![[255; 3]; width * height],
        }
    }

    fn shape(&mut self, shape: &Shape) {
        match shape {
            Shape::Polygon { points, fill } => {
                let corners: Vec<At> = points.iter().map(|at| (DOTS * at.x, DOTS * at.y)).collect();
                self.polygon(&corners, *fill);
            }
            Shape::Line {
                points,
                width,
                color,
            } => {
                let places: Vec<At> = points.iter().map(|at| (DOTS * at.x, DOTS * at.y)).collect();
                for pair in places.windows(2) {
                    self.line((pair[0], pair[1]), (DOTS * width).max(1.0), *color);
                }
            }
            Shape::Text {
                at,
                anchor,
                size,
                text,
                color,
                halo,
            } => {
                let dot = if *size > 1.3 * SIZE_OF_TWO { 3 } else { 2 };
                let wide = width_of(text, dot);
                let left = match anchor {
                    Anchor::Start => DOTS * at.x,
                    Anchor::Middle => DOTS * at.x - 0.5 * wide,
                    Anchor::End => DOTS * at.x - wide,
                };
                let top = DOTS * at.y - float(font::SIZE.1 * dot);
                if *halo {
                    for (x, y) in [(-2.0, 0.0), (2.0, 0.0), (0.0, -2.0), (0.0, 2.0)] {
                        self.text((left + x, top + y), text, dot, [255; 3]);
                    }
                }
                self.text((left, top), text, dot, *color);
            }
        }
    }

    /// Fills what is within by the even-odd rule: a dot whose middle is.
    fn polygon(&mut self, corners: &[At], fill: [u8; 3]) {
        let low = corners.iter().map(|at| at.1).fold(f64::INFINITY, f64::min);
        let high = corners
            .iter()
            .map(|at| at.1)
            .fold(f64::NEG_INFINITY, f64::max);
        for row in whole(low.floor())..whole(high.ceil()).min(self.height) {
            let middle = float(row) + 0.5;
            let mut crossings: Vec<f64> = sides(corners)
                .filter(|(from, to)| (from.1 > middle) != (to.1 > middle))
                .map(|(from, to)| from.0 + (to.0 - from.0) * (middle - from.1) / (to.1 - from.1))
                .collect();
            crossings.sort_by(f64::total_cmp);
            for pair in crossings.chunks_exact(2) {
                self.row(row, (whole(pair[0]), whole(pair[1])), fill);
            }
        }
    }

    fn line(&mut self, (from, to): (At, At), width: f64, color: [u8; 3]) {
        let (x, y) = (to.0 - from.0, to.1 - from.1);
        let length = x.hypot(y);
        if length <= 0.0 {
            return;
        }
        let (across_x, across_y) = (-0.5 * width * y / length, 0.5 * width * x / length);
        // Half as wide beyond both ends, so that lines which meet have a corner.
        let (more_x, more_y) = (across_y, -across_x);
        let (from, to) = (
            (from.0 - more_x, from.1 - more_y),
            (to.0 + more_x, to.1 + more_y),
        );
        let corners = [
            (from.0 + across_x, from.1 + across_y),
            (to.0 + across_x, to.1 + across_y),
            (to.0 - across_x, to.1 - across_y),
            (from.0 - across_x, from.1 - across_y),
        ];
        self.polygon(&corners, color);
    }

    fn text(&mut self, (left, top): At, text: &str, dot: usize, color: [u8; 3]) {
        for (index, character) in text.chars().enumerate() {
            for (y, row) in font::rows(character).into_iter().enumerate() {
                for x in (0..font::SIZE.0).filter(|x| (row >> (font::SIZE.0 - 1 - x)) & 1 == 1) {
                    let column = whole(left) + dot * (index * (font::SIZE.0 + 1) + x);
                    for down in 0..dot {
                        self.row(whole(top) + dot * y + down, (column, column + dot), color);
                    }
                }
            }
        }
    }

    /// Fills a part of a row; what lies beyond the picture is cut off.
    fn row(&mut self, row: usize, (from, to): (usize, usize), color: [u8; 3]) {
        let (from, to) = (from.min(self.width), to.min(self.width));
        if row < self.height && from < to {
            self.dots[row * self.width + from..row * self.width + to].fill(color);
        }
    }
}

fn sides(corners: &[At]) -> impl Iterator<Item = (At, At)> {
    let next = corners.iter().cycle().skip(1);
    corners.iter().copied().zip(next.copied())
}

fn width_of(text: &str, dot: usize) -> f64 {
    float(dot * (font::SIZE.0 + 1) * text.chars().count())
}

#[expect(
    clippy::as_conversions,
    clippy::cast_precision_loss,
    reason = "a picture has far fewer dots than 2^53"
)]
const fn float(dots: usize) -> f64 {
    dots as f64
}

#[expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "rounded and not negative; beyond the picture is cut off"
)]
fn whole(dots: f64) -> usize {
    dots.round().max(0.0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dark(canvas: &Canvas) -> usize {
        canvas.dots.iter().filter(|dot| **dot == [0; 3]).count()
    }

    #[test]
    fn a_triangle_fills_half_of_its_square_and_a_line_is_as_long_and_wide_as_it_is() {
        let mut canvas = Canvas::new(100.0, 100.0);
        canvas.polygon(&[(0.0, 0.0), (200.0, 0.0), (0.0, 200.0)], [0; 3]);
        let found = dark(&canvas);
        assert!(found.abs_diff(20_000) < 300, "{found}");
        let mut canvas = Canvas::new(100.0, 100.0);
        canvas.line(((20.0, 50.0), (120.0, 50.0)), 4.0, [0; 3]);
        // 100 long and 2 more at either end, 4 wide.
        assert_eq!(dark(&canvas), 104 * 4);
    }

    #[test]
    fn what_lies_beyond_the_picture_is_cut_off() {
        let mut canvas = Canvas::new(10.0, 10.0);
        canvas.polygon(
            &[(-50.0, -50.0), (90.0, -50.0), (90.0, 90.0), (-50.0, 90.0)],
            [0; 3],
        );
        assert_eq!(dark(&canvas), 400);
        canvas.text((15.0, 15.0), "beyond", 3, [255; 3]);
    }

    #[test]
    fn every_character_that_names_are_made_of_can_be_read() {
        let all = ('a'..='z').chain('A'..='Z').chain('0'..='9');
        let mut seen = std::collections::BTreeMap::new();
        for character in all.chain(".,:;+-=()%/<>_'°σ".chars()) {
            let rows = font::rows(character);
            assert_ne!(rows, [0; 7], "{character}");
            assert_eq!(seen.insert(rows, character), None, "{character}");
        }
    }
}
