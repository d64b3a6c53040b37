//! Frames colored by temperature, beside their color scale.

use crate::canvas::{CHARACTER, Canvas};
use crate::encode;
use crate::number::{float, round_step, whole};
use crate::palette::{INFERNO, color};
use std::io::{self, Write};

/// Maps degrees to colors, the same for every frame in an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// The lowest temperature shown, °C.
    pub low_c: f64,
    /// The highest temperature shown, °C.
    pub high_c: f64,
}

/// An image of frames. Its dots index the colors of [`palette`].
#[derive(Debug, Clone)]
pub struct Thermogram {
    canvas: Canvas<u8>,
    scale: Scale,
}

/// Of 256 colors, the first 254 are temperatures from cold to warm.
const WARMEST: u8 = 253;
const PAPER: u8 = 254;
const INK: u8 = 255;

/// Red, green and blue of the 256 colors.
#[must_use]
pub fn palette() -> Vec<u8> {
    let warm = (0..=WARMEST).map(|index| color(&INFERNO, f64::from(index) / f64::from(WARMEST)));
    warm.chain([[255; 3], [32; 3]]).flatten().collect()
}

impl Scale {
    /// From the lowest to the highest temperature, widened to round numbers; `None` if there is none or one is
    /// infinite.
    #[must_use]
    pub fn of(celsius: impl IntoIterator<Item = f64>) -> Option<Self> {
        let (low_c, high_c) = celsius.into_iter().fold(
            (f64::INFINITY, f64::NEG_INFINITY),
            |(low_c, high_c), celsius| (low_c.min(celsius), high_c.max(celsius)),
        );
        if !(low_c.is_finite() && high_c.is_finite()) {
            return None;
        }
        let step = round_step(((high_c - low_c).max(0.5) / 8.0).max(STEP_MIN_C));
        let low_step = (low_c / step).floor() * step;
        Some(Self {
            low_c: low_step,
            high_c: ((high_c / step).ceil() * step).max(low_step + step),
        })
    }

    /// The round temperatures labeled on the scale.
    fn ticks_c(self) -> Vec<f64> {
        let step = round_step(((self.high_c - self.low_c) / 5.0).max(STEP_MIN_C));
        let first = (self.low_c / step - 1e-9).ceil() * step;
        let ticks = (0..=TICKS_MAX).map(|tick| first + f64::from(tick) * step);
        ticks
            .take_while(|tick| *tick <= self.high_c + 1e-9)
            .collect()
    }

    /// The place on the scale, 0 to 1.
    fn place(self, celsius: f64) -> f64 {
        ((celsius - self.low_c) / (self.high_c - self.low_c)).clamp(0.0, 1.0)
    }
}

impl Thermogram {
    /// An empty image of this many dots.
    #[must_use]
    pub fn new(width: usize, height: usize, scale: Scale) -> Self {
        Self {
            canvas: Canvas::new(width, height, PAPER),
            scale,
        }
    }

    /// The canvas.
    #[must_use]
    pub const fn canvas(&self) -> &Canvas<u8> {
        &self.canvas
    }

    /// Consumes the image and returns its canvas.
    #[must_use]
    pub fn into_canvas(self) -> Canvas<u8> {
        self.canvas
    }

    /// Draws a frame, row by row from its top left; each pixel is a square of `cell` dots.
    pub fn frame(
        &mut self,
        (left, top): (usize, usize),
        celsius: &[f64],
        columns: usize,
        cell: usize,
    ) {
        for (index, celsius) in celsius.iter().enumerate() {
            let (row, column) = (index / columns, index % columns);
            let color = warmth(self.scale.place(*celsius));
            let at = (left + column * cell, top + row * cell);
            self.canvas.fill(at, (cell, cell), color);
        }
    }

    /// Text starting at its top left, at twice the font's size.
    pub fn text(&mut self, at: (usize, usize), text: &str) {
        self.canvas.text(at, text, 2, INK);
    }

    /// The color scale, warm at the top, with numbers at the right.
    pub fn color_scale(&mut self, (left, top): (usize, usize), height: usize) {
        for y in 0..height {
            let place = 1.0 - (float(y) + 0.5) / float(height);
            self.canvas
                .fill((left, top + y), (SCALE_WIDTH, 1), warmth(place));
        }
        let is_fine = self.scale.high_c - self.scale.low_c < 5.0;
        let decimals = usize::from(is_fine);
        for tick in self.scale.ticks_c() {
            let down = whole((1.0 - self.scale.place(tick)) * float(height - 1));
            self.canvas
                .fill((left + SCALE_WIDTH, top + down), (4, 1), INK);
            let text_top = (top + down).saturating_sub(TEXT_HEIGHT / 2);
            let number = format!("{tick:.decimals$}");
            self.text((left + SCALE_WIDTH + 8, text_top), &number);
        }
        let below = (top + height + 10).min(self.canvas.height());
        self.text((left, below), "°C");
    }

    /// Writes a PNG with `about` as its text chunks.
    ///
    /// # Errors
    /// If writing fails.
    pub fn png(&self, about: &[(&str, String)], out: impl Write) -> io::Result<()> {
        encode::indexed(&self.canvas, palette(), about, out)
    }
}

/// Width of the scale with its numbers, in dots.
pub const SCALE_WITH_NUMBERS: usize = SCALE_WIDTH + 8 + 5 * 2 * CHARACTER.0;
/// Gap between two parts of an image, in dots.
pub const GAP: usize = 12;
/// Height of a line of text, in dots.
pub const TEXT_HEIGHT: usize = 2 * CHARACTER.1;
const SCALE_WIDTH: usize = 16;
const TICKS_MAX: u8 = 20;
/// The scale's numbers have at most one decimal.
const STEP_MIN_C: f64 = 0.1;

/// The palette index at a place from 0 to 1.
fn warmth(place: f64) -> u8 {
    u8::try_from(whole(place * f64::from(WARMEST)))
        .unwrap_or(WARMEST)
        .min(WARMEST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_ends_have_the_end_colors_of_inferno() {
        let palette = palette();
        assert_eq!(palette.len(), 768);
        assert_eq!(&palette[..3], &INFERNO[0]);
        let warmest = 3 * usize::from(warmth(1.0));
        assert_eq!(&palette[warmest..warmest + 3], &INFERNO[15]);
        assert_eq!(warmth(0.0), 0);
    }

    #[test]
    fn a_frame_is_drawn_with_its_first_pixel_at_the_top_left() {
        let scale = Scale {
            low_c: 20.0,
            high_c: 30.0,
        };
        let mut picture = Thermogram::new(8, 5, scale);
        picture.frame((1, 1), &[30.0, 20.0], 2, 3);
        let row = |y: usize| &picture.canvas().dots()[8 * y..8 * y + 8];
        assert_eq!(row(0), [PAPER; 8]);
        for y in 1..4 {
            assert_eq!(row(y), [PAPER, 253, 253, 253, 0, 0, 0, PAPER]);
        }
        assert_eq!(row(4), [PAPER; 8]);
    }

    #[test]
    fn the_scale_has_round_ends_and_holds_every_frame() {
        let scale = |low_c, high_c| Scale { low_c, high_c };
        let of = |low: f64, high: f64| Scale::of([low, high]).unwrap();
        assert_eq!(of(20.1, 27.9), scale(20.0, 28.0));
        assert_eq!(of(20.1, 27.9).ticks_c(), [20.0, 22.0, 24.0, 26.0, 28.0]);
        let blank = of(21.0, 21.0);
        assert!(blank.high_c > blank.low_c && blank.low_c <= 21.0 && blank.high_c >= 21.0);
        assert_eq!(blank.ticks_c().len(), 2, "one decimal tells them apart");
        assert_eq!(of(-3.2, 80.0), scale(-20.0, 80.0));
        assert_eq!(Scale::of([]), None);
    }
}
