//! A canvas of dots: rectangles and text, in RGB or palette colors.

use crate::font;

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

#[cfg(test)]
mod tests {
    use super::*;

    fn dark(canvas: &Canvas<bool>) -> usize {
        canvas.dots().iter().filter(|dot| **dot).count()
    }

    #[test]
    fn shapes_beyond_the_canvas_are_cut_off() {
        let mut canvas = Canvas::new(20, 20, false);
        canvas.fill((18, 19), (10, 10), true);
        canvas.fill((29, 29), (1, 1), true);
        assert_eq!(dark(&canvas), 2);
        canvas.fill((0, 0), (90, 90), true);
        assert_eq!(dark(&canvas), 400);
        canvas.text((15, 15), "beyond", 3, false);
        assert!(dark(&canvas) < 400);
    }
}
