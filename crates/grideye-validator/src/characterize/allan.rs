//! Allan deviations of single pixels and of the common mode.

use crate::characterize::histogram::{DIFFERENCE_BIN_C, Histogram};
use crate::frames::types::Pixels;
use crate::numbers::{RunningVariance, long_count};
use grideye_frame::PIXELS;
use serde::Serialize;

/// Averages of 1, 2, 4 and so on up to 512 frames.
const OCTAVES: usize = 10;
const PAIRS_MIN: u64 = 8;

/// How much averages over consecutive stretches of one length differ.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AllanPoint {
    /// Length of the averages, seconds.
    pub tau_s: f64,
    /// Allan deviation of single pixels, °C, from the quartiles over all pixels and averages.
    pub pixel_c: f64,
    /// Allan deviation of the common mode, °C.
    pub common_c: f64,
}

#[derive(Debug)]
pub(crate) struct Allan(Vec<Octave>);

#[derive(Debug)]
struct Octave {
    pixels: Histogram,
    common: RunningVariance,
    /// The first of two averages that make one of the next octave, and the average before this one.
    half: Option<Average>,
    before: Option<Average>,
}

#[derive(Debug, Clone, Copy)]
struct Average {
    pixels: Pixels,
    common: f64,
}

impl Default for Allan {
    fn default() -> Self {
        let octave = |number: i32| Octave {
            // Longer averages differ less.
            pixels: Histogram::new(DIFFERENCE_BIN_C / 2.0_f64.powi(number).sqrt()),
            common: RunningVariance::default(),
            half: None,
            before: None,
        };
        Self((0..).take(OCTAVES).map(octave).collect())
    }
}

impl Allan {
    pub(crate) fn push(&mut self, frame: &Pixels, common: f64) {
        let mut average = Average {
            pixels: *frame,
            common,
        };
        for octave in &mut self.0 {
            octave.take(&average);
            let Some(half) = octave.half.take() else {
                octave.half = Some(average);
                return;
            };
            average = half.mean(&average);
        }
    }

    pub(crate) fn break_off(&mut self) {
        for octave in &mut self.0 {
            octave.half = None;
            octave.before = None;
        }
    }

    #[cfg(test)]
    pub(crate) fn pairs(&self, octave: usize) -> u64 {
        self.0[octave].common.count
    }

    pub(crate) fn finish(self, period_s: f64) -> Vec<AllanPoint> {
        let root_two = 2.0_f64.sqrt();
        let mut frames = 1.0;
        let mut points = Vec::new();
        for octave in self.0 {
            let pairs = octave.common.count;
            if pairs < PAIRS_MIN {
                break;
            }
            // Around zero, not the mean: a steady drift counts too.
            let common = octave.common;
            let square = common.variance() * long_count(pairs - 1) / long_count(pairs)
                + common.mean * common.mean;
            points.push(AllanPoint {
                tau_s: frames * period_s,
                pixel_c: octave.pixels.quartile_sigma().unwrap_or(0.0) / root_two,
                common_c: square.sqrt() / root_two,
            });
            frames *= 2.0;
        }
        points
    }
}

impl Octave {
    fn take(&mut self, average: &Average) {
        if let Some(before) = self.before.replace(*average) {
            for (now, then) in average.pixels.iter().zip(before.pixels) {
                self.pixels.push(now - then);
            }
            self.common.push(average.common - before.common);
        }
    }
}

impl Average {
    fn mean(&self, other: &Self) -> Self {
        Self {
            pixels: std::array::from_fn::<f64, PIXELS, _>(|pixel| {
                0.5 * (self.pixels[pixel] + other.pixels[pixel])
            }),
            common: 0.5 * (self.common + other.common),
        }
    }
}

const _: () = assert!(
    OCTAVES < 16,
    "an octave's bins would be narrower than a float's steps of a temperature"
);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numbers::normal_draws;

    #[test]
    fn white_noise_falls_with_the_root_and_a_ramp_rises() {
        let mut noise = normal_draws(5);
        let mut allan = Allan::default();
        for place in 0..4096_u32 {
            let frame: Pixels = std::array::from_fn(|_| 20.0 + 0.3 * noise());
            // A ramp of 0.001 per frame has an Allan deviation of 0.001 m / sqrt(2).
            allan.push(&frame, 0.001 * f64::from(place));
        }
        let points = allan.finish(0.1);
        assert_eq!(points.len(), 9);
        for (number, point) in (0..).zip(points) {
            let frames = 2.0_f64.powi(number);
            assert!((point.tau_s - 0.1 * frames).abs() < 1e-9);
            let white = 0.3 / frames.sqrt();
            assert!((point.pixel_c / white - 1.0).abs() < 0.1, "{point:?}");
            let ramp = 0.001 * frames / 2.0_f64.sqrt();
            assert!((point.common_c / ramp - 1.0).abs() < 1e-6, "{point:?}");
        }
    }

    /// Steps of a quarter degree, and a person of three degrees on eight pixels who comes and goes, there half of the
    /// time.
    #[test]
    fn a_person_coming_and_going_hardly_widens_the_quartiles() {
        let mut noise = normal_draws(6);
        let mut allan = Allan::default();
        for place in 0..8192_u32 {
            let warm = if place / 24 % 2 == 0 { 3.0 } else { 0.0 };
            let frame: Pixels = std::array::from_fn(|pixel| {
                let person = if pixel < 8 { warm } else { 0.0 };
                ((20.0 + person + 0.3 * noise()) * 4.0).round() / 4.0
            });
            allan.push(&frame, 0.0);
        }
        // Rounding adds a twelfth of the step's square to the variance, white like the rest.
        let sigma = (0.3_f64.powi(2) + 0.0625 / 12.0).sqrt();
        for (number, point) in (0..).zip(allan.finish(0.1)).take(6) {
            let ratio = point.pixel_c / (sigma / 2.0_f64.powi(number).sqrt());
            assert!((0.97..1.25).contains(&ratio), "{ratio} {point:?}");
        }
    }
}
