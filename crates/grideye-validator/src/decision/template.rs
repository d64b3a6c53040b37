//! Likelihood ratios of recordings, as products with templates.
//!
//! `W(a, b) = Σ (a - ā)(b - b̄) / s² + n ā b̄ / (s² + n τ²)`, summed over pixels and frames: each frame less its mean over
//! the pixels, `ā` the mean over the `n` frames, `s` the noise, `τ` the unknown constant error of each pixel. It is the
//! product of two pictures in units of what noise and pattern hide.

use crate::decision::film::Image;
use crate::numbers::count;
use grideye_frame::PIXELS;

/// What hides a picture.
pub(crate) struct Hiding {
    noise_c2: f64,
    pattern_c2: [f64; PIXELS],
}

/// A picture, ready for products with recordings.
pub(crate) struct Template {
    weights: Vec<Image>,
    /// `W` of the picture with itself.
    pub(crate) square: f64,
}

impl Hiding {
    pub(crate) fn new(noise_c: f64, pattern_c: &Image) -> Self {
        Self {
            noise_c2: noise_c * noise_c,
            pattern_c2: pattern_c.map(|sd_c| f64::from(sd_c).powi(2)),
        }
    }

    /// The share of a pixel's mean over `frames` that is its own error, if the picture explains nothing.
    pub(crate) fn own_share(&self, frames: usize) -> [f64; PIXELS] {
        let frames = count(frames);
        self.pattern_c2
            .map(|pattern_c2| frames * pattern_c2 / (self.noise_c2 + frames * pattern_c2))
    }

    pub(crate) fn template(&self, picture: &[Image]) -> Template {
        let mut weights = centered(picture);
        let (mean, frames) = (mean(&weights), count(picture.len()));
        let still: [f64; PIXELS] =
            std::array::from_fn(|pixel| mean[pixel] / (self.noise_c2 + frames * self.pattern_c2[pixel]));
        let mut square = 0.0;
        for weight in &mut weights {
            for (pixel, weight) in weight.iter_mut().enumerate() {
                let moving = f64::from(*weight) - mean[pixel];
                square += moving * moving / self.noise_c2 + mean[pixel] * still[pixel];
                *weight = (moving / self.noise_c2 + still[pixel]) as f32;
            }
        }
        Template { weights, square }
    }

    /// `W` of a recording with itself.
    pub(crate) fn square(&self, recording: &[Image]) -> f64 {
        self.template(recording).square
    }
}

impl Template {
    /// `W` of a recording with the picture.
    pub(crate) fn product(&self, recording: &[Image]) -> f64 {
        let frames = self.weights.iter().zip(recording);
        frames
            .map(|(weights, frame)| {
                let pixels = weights.iter().zip(frame);
                f64::from(pixels.map(|(weight, celsius)| weight * celsius).sum::<f32>())
            })
            .sum()
    }
}

/// Each frame less its mean over the pixels.
pub(crate) fn centered(frames: &[Image]) -> Vec<Image> {
    let center = |frame: &Image| {
        let mean = frame.iter().sum::<f32>() / PIXELS as f32;
        frame.map(|celsius| celsius - mean)
    };
    frames.iter().map(center).collect()
}

fn mean(frames: &[Image]) -> [f64; PIXELS] {
    let number = count(frames.len().max(1));
    std::array::from_fn(|pixel| frames.iter().map(|frame| f64::from(frame[pixel])).sum::<f64>() / number)
}
