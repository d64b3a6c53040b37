//! A frame less its mean, from which correlations and slopes are made.

use crate::numbers::{count, finite, is_constant, mean, sum_of};

/// A frame less its own mean.
#[derive(Debug, Clone)]
pub(crate) struct Centered {
    deviations: Vec<f64>,
    squares: f64,
}

impl Centered {
    pub(crate) fn new(frame: &[f64]) -> Self {
        let mean = mean(frame).unwrap_or(0.0);
        let deviations: Vec<f64> = frame.iter().map(|value| value - mean).collect();
        // The mean of equal numbers need not be that number: what is left would be noise over noise.
        let squares = if is_constant(frame) {
            0.0
        } else {
            sum_of(&deviations, &deviations, |x, _| x * x)
        };
        Self {
            deviations,
            squares,
        }
    }

    /// The same pixels in another order.
    pub(crate) fn permuted(&self, order: &[usize]) -> Self {
        Self {
            deviations: order.iter().map(|&index| self.deviations[index]).collect(),
            squares: self.squares,
        }
    }

    pub(crate) fn correlation(&self, other: &Self) -> Option<f64> {
        correlation_of(self.product(other), self.squares, other.squares)
    }

    pub(crate) fn slope_over(&self, claim: &Self) -> Option<f64> {
        let slope = (claim.squares > 0.0).then(|| self.product(claim) / claim.squares)?;
        finite(slope)
    }

    /// The slope where the other side, too, holds noise of `sigma_c` a pixel: its share of the squares is taken out. `None`
    /// where noise is half of what there is, or more.
    pub(crate) fn slope_over_noisy(&self, other: &Self, sigma_c: f64) -> Option<f64> {
        let noise = count(self.deviations.len().saturating_sub(1)) * sigma_c * sigma_c;
        (other.squares > 2.0 * noise).then(|| self.product(other) / (other.squares - noise))
    }

    fn product(&self, other: &Self) -> f64 {
        sum_of(&self.deviations, &other.deviations, |x, y| x * y)
    }
}

pub(crate) fn correlation_of(product: f64, squares: f64, other_squares: f64) -> Option<f64> {
    if squares <= 0.0 || other_squares <= 0.0 {
        return None;
    }
    finite((product / (squares.sqrt() * other_squares.sqrt())).clamp(-1.0, 1.0))
}
