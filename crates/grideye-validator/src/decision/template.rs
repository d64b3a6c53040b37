//! Likelihood ratios of recordings, as products with templates.
//!
//! `W(a, b) = Σ (a - ā)(b - b̄) / s² + n ā b̄ / (s² + n τ²)`, summed over pixels and pictures: each picture less its mean
//! over the pixels, `ā` the mean over the `n` pictures, `s` the noise, `τ` the unknown constant error of each pixel. It is
//! the product of two films in units of what noise and pattern hide.

use crate::decision::unit::Unit;
use crate::decision::view::{Image, PIXEL_COUNT};
use crate::numbers::{count, single};
use grideye_frame::PIXELS;
use std::ops::Range;

/// What a unit adds to every frame, and so hides.
pub(crate) struct NoiseModel {
    noise_c2: [f64; PIXELS],
    pattern_c2: [f64; PIXELS],
}

/// A film, ready for products with others.
pub(crate) struct Template {
    weights: Vec<Image>,
    /// `W` of the film with itself.
    pub(crate) square: f64,
}

impl NoiseModel {
    pub(crate) fn new(unit: &Unit) -> Self {
        Self {
            noise_c2: unit.noise_c.map(|sd_c| f64::from(sd_c).powi(2)),
            pattern_c2: unit.constant_c2(),
        }
    }

    /// The share of a pixel's mean over `pictures` that is its own error, if the film explains nothing.
    pub(crate) fn own_share(&self, pictures: usize) -> [f64; PIXELS] {
        let number = count(pictures);
        std::array::from_fn(|pixel| {
            let pattern = number * self.pattern_c2[pixel];
            pattern / (self.noise_c2[pixel] + pattern)
        })
    }

    pub(crate) fn template(&self, film: &[Image]) -> Template {
        let mut weights = centered(film);
        let (mean, number) = (mean(&weights), count(film.len()));
        let still: [f64; PIXELS] = std::array::from_fn(|pixel| {
            mean[pixel] / (self.noise_c2[pixel] + number * self.pattern_c2[pixel])
        });
        let mut square = 0.0;
        for weight in &mut weights {
            for (pixel, weight) in weight.iter_mut().enumerate() {
                let moving = (f64::from(*weight) - mean[pixel]) / self.noise_c2[pixel];
                let product = moving + still[pixel];
                square += f64::from(*weight) * product;
                *weight = single(product);
            }
        }
        // Recordings keep their common level, which the weights must not see.
        Template {
            weights: centered(&weights),
            square,
        }
    }

    /// `W` of a film with itself.
    pub(crate) fn square(&self, film: &[Image]) -> f64 {
        self.squares(film).iter().sum()
    }

    /// The same of what changes, and of the mean picture.
    pub(crate) fn squares(&self, film: &[Image]) -> [f64; 2] {
        let films = centered(film);
        let (mean, number) = (mean(&films), count(film.len()));
        let mut squares = [0.0; 2];
        for pixel in 0..PIXELS {
            let changes = films
                .iter()
                .map(|image| f64::from(image[pixel]) - mean[pixel]);
            let moving: f64 = changes.map(|celsius| celsius * celsius).sum();
            let noise_c2 = self.noise_c2[pixel];
            let still = number * mean[pixel] * mean[pixel];
            squares[0] += moving / noise_c2;
            squares[1] += still / (noise_c2 + number * self.pattern_c2[pixel]);
        }
        squares
    }

    /// Sum of squares of the steps from picture to picture, in units of the noise: what the noise is in this film.
    pub(crate) fn steps(&self, film: &[Image]) -> f64 {
        let weights = self.noise_c2.map(|noise| single(1.0 / noise));
        let mut sum = 0.0;
        for (now, then) in film.iter().zip(film.iter().skip(1)) {
            let mut squares = 0.0_f32;
            for pixel in 0..PIXELS {
                let step = then[pixel] - now[pixel];
                squares += weights[pixel] * step * step;
            }
            sum += f64::from(squares);
        }
        sum
    }
}

impl Template {
    /// `W` of another film with this one.
    pub(crate) fn product(&self, film: &[Image]) -> f64 {
        self.product_during(0..self.weights.len().min(film.len()), film)
    }

    /// `W` of a film that shows nothing at other times.
    pub(crate) fn product_during(&self, during: Range<usize>, film: &[Image]) -> f64 {
        const LANES: usize = 16;
        /// Pictures whose products are summed as `f32`.
        const TOGETHER: usize = 16;
        let weights = self.weights[during.clone()].chunks(TOGETHER);
        let mut sum = 0.0;
        for (weights, images) in weights.zip(film[during].chunks(TOGETHER)) {
            // Indexed, so that the compiler makes vectors of the lanes.
            let mut lanes = [0.0_f32; LANES];
            for (weights, image) in weights.iter().zip(images) {
                for row in 0..PIXELS / LANES {
                    for lane in 0..LANES {
                        lanes[lane] += weights[LANES * row + lane] * image[LANES * row + lane];
                    }
                }
            }
            sum += f64::from(lanes.iter().sum::<f32>());
        }
        sum
    }
}

/// Each picture less its mean over the pixels.
pub(crate) fn centered(film: &[Image]) -> Vec<Image> {
    let center = |image: &Image| {
        let mean = image.iter().sum::<f32>() / PIXEL_COUNT;
        image.map(|celsius| celsius - mean)
    };
    film.iter().map(center).collect()
}

pub(crate) fn mean(film: &[Image]) -> [f64; PIXELS] {
    let mut sums = [0.0; PIXELS];
    for image in film {
        for (sum, celsius) in sums.iter_mut().zip(image) {
            *sum += f64::from(*celsius);
        }
    }
    sums.map(|sum| sum / count(film.len().max(1)))
}
