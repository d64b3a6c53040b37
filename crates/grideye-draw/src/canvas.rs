//! A canvas of dots: rectangles, polygons, lines and text, in RGB or palette colors.

use crate::font;
use crate::number::{float, whole};

/// A place in dots from the top left.
pub type At = (f64, f64);

/// Dots row by row from the top left. Anything drawn beyond the canvas is cut off.
#[derive(Debug, Clone)]
pub struct Canvas<C> {
    width: usize,
    height: usize,
    dots: Vec<C>,
}

/// Width and height of a character in dots, at one dot per font dot; the width includes a gap.
pub const CHARACTER: (usize, usize) = (font::SIZE.0 + 1, font::SIZE.1);

impl<C: Copy> Canvas<C> {
    /// A canvas of one color.
    #[must_use]
    pub fn new(width: usize, height: usize, paper: C) -> Self {
        Self {
            width,
            height,
            dots: vec![paper; width * height],
        }
    }

    /// A canvas of these dots, `width` per row.
    #[must_use]
    pub fn of(width: usize, dots: Vec<C>) -> Self {
        let height = dots.len() / width.max(1);
        Self {
            width,
            height,
            dots,
        }
    }

    /// The width in dots.
    #[must_use]
    pub const fn width(&self) -> usize {
        self.width
    }

    /// The height in dots.
    #[must_use]
    pub const fn height(&self) -> usize {
        self.height
    }

    /// All dots, row by row from the top left.
    #[must_use]
    pub fn dots(&self) -> &[C] {
        &self.dots
    }

    /// Consumes the canvas and returns its dots.
    #[must_use]
    pub fn into_dots(self) -> Vec<C> {
        self.dots
    }

    /// Fills a rectangle.
    pub fn fill(&mut self, (left, top): (usize, usize), (width, height): (usize, usize), color: C) {
        let (from, to) = (left.min(self.width), (left + width).min(self.width));
        for row in top..(top + height).min(self.height) {
            self.dots[row * self.width + from..row * self.width + to].fill(color);
        }
    }

    /// Fills a polygon by the even-odd rule: every dot with its center inside.
    pub fn polygon(&mut self, corners: &[At], color: C) {
        let rows = || corners.iter().map(|at| at.1);
        let low = rows().fold(f64::INFINITY, f64::min);
        let high = rows().fold(f64::NEG_INFINITY, f64::max);
        for row in whole(low.floor())..whole(high.ceil()).min(self.height) {
            let middle = float(row) + 0.5;
            let mut crossings: Vec<f64> = sides(corners)
                .filter(|(from, to)| (from.1 > middle) != (to.1 > middle))
                .map(|(from, to)| from.0 + (to.0 - from.0) * (middle - from.1) / (to.1 - from.1))
                .collect();
            crossings.sort_by(f64::total_cmp);
            for pair in crossings.chunks_exact(2) {
                let (from, to) = (whole(pair[0]), whole(pair[1]));
                self.fill((from, row), (to - from, 1), color);
            }
        }
    }

    /// A straight line.
    pub fn line(&mut self, (from, to): (At, At), width: f64, color: C) {
        let (x, y) = (to.0 - from.0, to.1 - from.1);
        let length = x.hypot(y);
        if length <= 0.0 {
            return;
        }
        let (across_x, across_y) = (-0.5 * width * y / length, 0.5 * width * x / length);
        // Extend both ends by half the width, so that joined lines form corners.
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

    /// Text starting at its top left; each font dot is a square of `dot` dots.
    pub fn text(&mut self, (left, top): (usize, usize), text: &str, dot: usize, color: C) {
        for (index, character) in text.chars().enumerate() {
            for (y, row) in font::rows(character).into_iter().enumerate() {
                for x in (0..font::SIZE.0).filter(|x| (row >> (font::SIZE.0 - 1 - x)) & 1 == 1) {
                    let at = (left + dot * (index * CHARACTER.0 + x), top + dot * y);
                    self.fill(at, (dot, dot), color);
                }
            }
        }
    }
}

fn sides(corners: &[At]) -> impl Iterator<Item = (At, At)> {
    let next = corners.iter().cycle().skip(1);
    corners.iter().copied().zip(next.copied())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dark(canvas: &Canvas<bool>) -> usize {
        canvas.dots().iter().filter(|dot| **dot).count()
    }

    #[test]
    fn triangles_and_lines_fill_their_area() {
        let mut canvas = Canvas::new(200, 200, false);
        canvas.polygon(&[(0.0, 0.0), (200.0, 0.0), (0.0, 200.0)], true);
        let found = dark(&canvas);
        assert!(found.abs_diff(20_000) < 300, "{found}");
        let mut canvas = Canvas::new(200, 200, false);
        canvas.line(((20.0, 50.0), (120.0, 50.0)), 4.0, true);
        // 100 long plus 2 at each end, 4 wide.
        assert_eq!(dark(&canvas), 104 * 4);
    }

    #[test]
    fn shapes_beyond_the_canvas_are_cut_off() {
        let mut canvas = Canvas::new(20, 20, false);
        canvas.fill((18, 19), (10, 10), true);
        canvas.fill((29, 29), (1, 1), true);
        assert_eq!(dark(&canvas), 2);
        canvas.polygon(
            &[(-50.0, -50.0), (90.0, -50.0), (90.0, 90.0), (-50.0, 90.0)],
            true,
        );
        assert_eq!(dark(&canvas), 400);
        canvas.text((15, 15), "beyond", 3, false);
        assert!(dark(&canvas) < 400);
    }
}
