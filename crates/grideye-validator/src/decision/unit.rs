//! What a unit adds to what it sees, as far as a recording tells without its scene.

use crate::decision::view::{Image, add};
use crate::decision::world::normal;
use crate::numbers::{count, mean, median, percentile, single};
use grideye_frame::PIXELS;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// What a unit adds to each picture.
#[derive(Debug, Clone)]
pub(crate) struct Unit {
    /// Noise of each pixel from picture to picture, rounding included, °C.
    pub(crate) noise_c: Image,
    /// Correlation of a pixel's noise with that of the picture before.
    pub(crate) correlation: f32,
    /// Standard deviation of each pixel's unknown constant error, unit and room, °C.
    pub(crate) pattern_c: Image,
    /// What else is open of the room: each law in words, and what one standard deviation adds.
    pub(crate) open: Vec<(String, Image)>,
}

/// Share of a pixel's steps from frame to frame that count for its noise: the largest may be a person's.
const KEPT_SHARE: f64 = 0.8;
/// What the mean square of that share is of a normal law's variance: `1 - 2 z φ(z) / 0.8` with `z = 1.2816`.
const KEPT_SQUARE: f64 = 0.437_7;
/// Fewest frames that show whether noise is correlated.
const CORRELATED_FRAMES_MIN: usize = 60;

impl Unit {
    /// From steps between frames: no scene is asked, because a wrong one would leave more noise and excuse itself.
    pub(crate) fn of(frames: &[Image], pattern_c: Image, step_c: f64) -> Self {
        let steps = |lag: usize| -> [f64; PIXELS] {
            std::array::from_fn(|pixel| variance(frames, pixel, lag))
        };
        let least = step_c * step_c / 12.0;
        let own = steps(1);
        let kept = correlation(frames, &own, &steps(10.min(frames.len() / 2).max(1)));
        let all = (median(&own).unwrap_or(least) / (1.0 - kept)).max(least);
        let noise_c = own.map(|variance| {
            // Few frames tell little of a single pixel.
            let trusted = count(frames.len()) / (count(frames.len()) + 30.0);
            let own = (variance / (1.0 - kept)).clamp(0.5 * all, 4.0 * all);
            single((trusted * own + (1.0 - trusted) * all).sqrt())
        });
        Self {
            noise_c,
            correlation: single(kept),
            pattern_c: pattern_c.map(|sd_c| sd_c.hypot(single(rounding_c(all - least, step_c)))),
            open: Vec::new(),
        }
    }

    /// The unit of means over `frames` frames.
    pub(crate) fn averaged(mut self, frames: usize) -> Self {
        let number = count(frames.max(1));
        let kept = f64::from(self.correlation);
        let mut sum = number;
        for apart in 1..frames {
            sum += 2.0 * (number - count(apart)) * kept.powf(count(apart));
        }
        let share = single((sum / (number * number)).sqrt());
        self.noise_c = self.noise_c.map(|noise_c| share * noise_c);
        self.correlation = self.correlation.powf(single(number));
        self
    }

    /// Draws what a unit adds to `number` pictures.
    pub(crate) fn errors(&self, number: usize, random: &mut ChaCha8Rng) -> Vec<Image> {
        let mut pattern: Image = self
            .pattern_c
            .map(|sd_c| single(normal(random, f64::from(sd_c))));
        for (_, shows) in &self.open {
            add(&mut pattern, shows, single(normal(random, 1.0)));
        }
        let fresh = (1.0 - self.correlation * self.correlation).sqrt();
        let mut white = |_| -> Image {
            std::array::from_fn(|pixel| {
                let draw: f32 = StandardNormal.sample(random);
                self.noise_c[pixel] * draw
            })
        };
        let mut noise = white(0);
        let picture = |index: usize| {
            let new = white(index);
            for (noise, new) in noise.iter_mut().zip(&new) {
                *noise = self.correlation * *noise + fresh * new;
            }
            let mut all = pattern;
            add(&mut all, &noise, 1.0);
            all
        };
        (0..number).map(picture).collect()
    }

    /// Variance of each pixel's unknown constant error, °C².
    pub(crate) fn constant_c2(&self) -> [f64; PIXELS] {
        std::array::from_fn(|pixel| {
            let open = self.open.iter().map(|(_, shows)| shows[pixel]);
            let sds = open.chain([self.pattern_c[pixel]]);
            sds.map(|sd_c| f64::from(sd_c).powi(2)).sum()
        })
    }
}

/// Standard deviation of the error that rounding leaves in the mean of many frames: noise of a step's size leaves none
/// (Widrow and Kollár, Quantization Noise, 2008: the factor is the characteristic function of the noise).
fn rounding_c(noise_c2: f64, step_c: f64) -> f64 {
    let least = step_c / 12.0_f64.sqrt();
    let turns = 2.0 * std::f64::consts::PI / step_c.max(1e-9);
    least * (-0.5 * turns * turns * noise_c2.max(0.0)).exp()
}

/// Half the mean square of a pixel's steps over `lag` frames, without the largest.
fn variance(frames: &[Image], pixel: usize, lag: usize) -> f64 {
    let pairs = frames.iter().zip(frames.iter().skip(lag));
    let mut squares: Vec<f64> = pairs
        .map(|(now, then)| f64::from(then[pixel] - now[pixel]).powi(2))
        .collect();
    squares.sort_by(f64::total_cmp);
    let whole = KEPT_SHARE * count(squares.len());
    let mut left = whole;
    let mut sum = 0.0;
    for square in squares {
        let share = left.clamp(0.0, 1.0);
        sum += share * square;
        left -= share;
    }
    sum / whole.max(1e-9) / KEPT_SQUARE / 2.0
}

/// Correlation of the noise of neighboring frames, by how much pixels change further in ten frames: nothing in most units.
/// The quietest quarter of the pixels tells, because a person passes the others.
fn correlation(frames: &[Image], one: &[f64; PIXELS], ten: &[f64; PIXELS]) -> f64 {
    const CLEAR: f64 = 1.6;
    if frames.len() < CORRELATED_FRAMES_MIN {
        return 0.0;
    }
    let mut sorted = ten.to_vec();
    sorted.sort_by(f64::total_cmp);
    let limit = percentile(&sorted, 25).unwrap_or(0.0);
    let quiet: Vec<usize> = (0..PIXELS).filter(|&pixel| ten[pixel] <= limit).collect();
    let of = |all: &[f64; PIXELS]| {
        let values: Vec<f64> = quiet.iter().map(|&pixel| all[pixel]).collect();
        mean(&values).unwrap_or(0.0)
    };
    let ratio = of(ten) / of(one).max(1e-9);
    if ratio < CLEAR {
        return 0.0;
    }
    // ratio = (1 - ρ^10) / (1 - ρ)
    let (mut low, mut high) = (0.0_f64, 0.98);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        let reached = (1.0 - middle.powi(10)) / (1.0 - middle);
        (low, high) = if reached < ratio {
            (middle, high)
        } else {
            (low, middle)
        };
    }
    0.5 * (low + high)
}
