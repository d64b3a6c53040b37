//! Frames as pictures: each pixel a square of colour, with a scale of colours and its numbers beside it.

use super::{Film, font};
use anyhow::{Result, ensure};
use grideye_scene::Image;
use grideye_validator::report::palette::{INFERNO, colour};

/// A picture of palette colours, row by row from the top left.
#[derive(Clone)]
pub(super) struct Picture {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) dots: Vec<u8>,
}

/// From degrees to colours, the same for every frame of a film.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    pub(super) low_c: f64,
    pub(super) high_c: f64,
}

/// The first colours are those of temperatures, from cold to warm; the last two these.
pub(super) const PAPER: u8 = 254;
pub(super) const INK: u8 = 255;
const WARMEST: u8 = 253;

/// Red, green and blue of the 256 colours.
pub(super) fn palette() -> Vec<u8> {
    let warm = (0..=WARMEST).map(|index| colour(&INFERNO, f64::from(index) / f64::from(WARMEST)));
    warm.chain([[255; 3], [32; 3]]).flatten().collect()
}

impl Scale {
    /// From the coldest to the warmest pixel of all frames, widened to round numbers.
    pub(super) fn of(film: &Film<'_>) -> Result<Self> {
        Self::of_images((0..film.frames).map(|index| (film.frame)(index).1))
    }

    /// The same of images that are there.
    pub(super) fn of_images<I: std::borrow::Borrow<Image>>(
        images: impl Iterator<Item = I>,
    ) -> Result<Self> {
        let mut low_c = f64::INFINITY;
        let mut high_c = f64::NEG_INFINITY;
        for image in images {
            for celsius in &image.borrow().celsius {
                low_c = low_c.min(*celsius);
                high_c = high_c.max(*celsius);
            }
        }
        ensure!(
            low_c.is_finite() && high_c.is_finite(),
            "a frame that is no number"
        );
        let step = round_step((high_c - low_c).max(0.5) / 8.0);
        Ok(Self {
            low_c: (low_c / step).floor() * step,
            high_c: ((high_c / step).ceil() * step).max((low_c / step).floor() * step + step),
        })
    }

    /// The round temperatures to write beside the scale.
    pub(super) fn ticks_c(&self) -> Vec<f64> {
        let step = round_step((self.high_c - self.low_c) / 5.0);
        let first = (self.low_c / step - 1e-9).ceil() * step;
        let ticks = (0..=TICKS_MAX).map(|tick| first + f64::from(tick) * step);
        ticks
            .take_while(|tick| *tick <= self.high_c + 1e-9)
            .collect()
    }

    /// The place between coldest and warmest, 0 to 1.
    pub(super) fn place(&self, celsius: f64) -> f64 {
        ((celsius - self.low_c) / (self.high_c - self.low_c)).clamp(0.0, 1.0)
    }
}

impl Picture {
    pub(super) fn new(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            dots: vec![PAPER; width * height],
        }
    }

    /// Fills a rectangle; what lies beyond the picture is cut off.
    pub(super) fn fill(
        &mut self,
        (left, top): (usize, usize),
        (width, height): (usize, usize),
        color: u8,
    ) {
        let right = (left + width).min(self.width);
        for y in top..(top + height).min(self.height) {
            if let Some(row) = self
                .dots
                .get_mut(y * self.width + left.min(right)..y * self.width + right)
            {
                row.fill(color);
            }
        }
    }

    /// A frame with squares of `cell` dots for its pixels.
    pub(super) fn frame(
        &mut self,
        (left, top): (usize, usize),
        image: &Image,
        cell: usize,
        scale: Scale,
    ) {
        for (index, celsius) in image.celsius.iter().enumerate() {
            let (row, column) = (index / image.columns, index % image.columns);
            let color = warmth(scale.place(*celsius));
            self.fill(
                (left + column * cell, top + row * cell),
                (cell, cell),
                color,
            );
        }
    }

    /// Text from a place to the right, twice the size of its font.
    pub(super) fn text(&mut self, (left, top): (usize, usize), text: &str) {
        for (index, character) in text.chars().enumerate() {
            for (y, row) in font::rows(character).into_iter().enumerate() {
                for x in (0..font::SIZE.0).filter(|x| (row >> (font::SIZE.0 - 1 - x)) & 1 == 1) {
                    let at = (left + 2 * (index * (font::SIZE.0 + 1) + x), top + 2 * y);
                    self.fill(at, (2, 2), INK);
                }
            }
        }
    }

    /// The scale of colours, warm at the top, with its numbers at the right.
    pub(super) fn color_scale(&mut self, (left, top): (usize, usize), height: usize, scale: Scale) {
        for y in 0..height {
            let place = 1.0 - (count(y) + 0.5) / count(height);
            self.fill((left, top + y), (SCALE_WIDTH, 1), warmth(place));
        }
        let decimals = if scale.high_c - scale.low_c < 5.0 {
            1
        } else {
            0
        };
        for tick in scale.ticks_c() {
            let down = nearest((1.0 - scale.place(tick)) * count(height - 1));
            self.fill((left + SCALE_WIDTH, top + down), (4, 1), INK);
            let text_top = (top + down).saturating_sub(TEXT_HEIGHT / 2);
            self.text(
                (left + SCALE_WIDTH + 8, text_top),
                &format!("{tick:.decimals$}"),
            );
        }
        self.text((left, (top + height + 10).min(self.height)), "°C");
    }
}

/// Dots that the scale and its numbers take.
pub(super) const SCALE_WITH_NUMBERS: usize = SCALE_WIDTH + 8 + 5 * CHARACTER_WIDTH;
/// Dots between two things.
pub(super) const GAP: usize = 12;
/// Dots that a line of text takes down the page.
pub(super) const TEXT_HEIGHT: usize = 2 * font::SIZE.1;
const CHARACTER_WIDTH: usize = 2 * (font::SIZE.0 + 1);
const SCALE_WIDTH: usize = 16;
const TICKS_MAX: u8 = 20;

/// The colour at a place of 0 to 1.
fn warmth(place: f64) -> u8 {
    u8::try_from(nearest(place * f64::from(WARMEST)))
        .unwrap_or(WARMEST)
        .min(WARMEST)
}

/// The next of 0.1, 0.2, 0.5, 1, 2, 5, 10 … of at least `length`.
fn round_step(length: f64) -> f64 {
    let mut decade = 0.1;
    while decade < 1e5 {
        for factor in [1.0, 2.0, 5.0] {
            if factor * decade >= length - 1e-9 {
                return factor * decade;
            }
        }
        decade *= 10.0;
    }
    decade
}

#[expect(
    clippy::as_conversions,
    clippy::cast_precision_loss,
    reason = "a picture has far fewer dots than 2^53"
)]
pub(super) const fn count(dots: usize) -> f64 {
    dots as f64
}

#[expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "rounded and not negative; beyond the picture is cut off"
)]
pub(super) fn nearest(dots: f64) -> usize {
    dots.round().max(0.0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coldest_and_warmest_have_the_ends_of_inferno() {
        let palette = palette();
        assert_eq!(palette.len(), 768);
        assert_eq!(&palette[..3], &INFERNO[0]);
        let warmest = 3 * usize::from(warmth(1.0));
        assert_eq!(&palette[warmest..warmest + 3], &INFERNO[15]);
        assert_eq!(warmth(0.0), 0);
    }

    #[test]
    fn a_frame_is_drawn_with_its_first_pixel_at_the_top_left() {
        let image = Image {
            columns: 2,
            rows: 1,
            celsius: vec![30.0, 20.0],
        };
        let scale = Scale {
            low_c: 20.0,
            high_c: 30.0,
        };
        let mut picture = Picture::new(8, 5);
        picture.frame((1, 1), &image, 3, scale);
        let row = |y: usize| &picture.dots[8 * y..8 * y + 8];
        assert_eq!(row(0), [PAPER; 8]);
        for y in 1..4 {
            assert_eq!(row(y), [PAPER, 253, 253, 253, 0, 0, 0, PAPER]);
        }
        assert_eq!(row(4), [PAPER; 8]);
    }

    #[test]
    fn the_scale_has_round_ends_and_holds_every_frame() {
        let film = |low: f64, high: f64| {
            let frame = move |_| {
                let image = Image {
                    columns: 2,
                    rows: 1,
                    celsius: vec![low, high],
                };
                (std::time::Duration::ZERO, image)
            };
            let film = Film {
                scene: String::new(),
                sensor: "",
                seed: 1,
                columns: 2,
                rows: 1,
                frames: 1,
                sampling_hz: 1.0,
                ambient: grideye_frame::Celsius::new(20.0),
                frame: &frame,
            };
            Scale::of(&film).unwrap()
        };
        assert_eq!(
            film(20.1, 27.9),
            Scale {
                low_c: 20.0,
                high_c: 28.0
            }
        );
        assert_eq!(film(20.1, 27.9).ticks_c(), [20.0, 22.0, 24.0, 26.0, 28.0]);
        let blank = film(21.0, 21.0);
        assert!(blank.high_c > blank.low_c && blank.low_c <= 21.0 && blank.high_c >= 21.0);
        assert_eq!(
            film(-3.2, 80.0),
            Scale {
                low_c: -20.0,
                high_c: 80.0
            }
        );
    }

    #[test]
    fn what_reaches_beyond_the_picture_is_cut_off() {
        let mut picture = Picture::new(4, 4);
        picture.fill((3, 3), (10, 10), INK);
        picture.fill((9, 9), (1, 1), INK);
        assert_eq!(picture.dots.iter().filter(|dot| **dot == INK).count(), 1);
    }
}
