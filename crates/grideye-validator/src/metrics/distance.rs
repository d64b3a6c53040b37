//! Correlation, similarity, errors and contrast of two frames.

use crate::numbers::{comparable, count, differences, finite, is_constant, mean, sum_of};

/// Accuracy of the AMG8833, °C (AMG88 spec, "temperature accuracy").
pub const SENSOR_ACCURACY_C: f64 = 2.5;
/// Threshold of the image similarity, °C: two sigma, where three are the accuracy (PeerJ CS 11:e3124; printed as 1.66).
pub const IS_THRESHOLD: f64 = 2.0 * SENSOR_ACCURACY_C / 3.0;

/// Pearson's correlation coefficient, -1 to 1 (PeerJ CS 11:e3124, Eq. 1); `None` if a frame is constant.
#[must_use]
pub fn correlation(real: &[f64], simulated: &[f64]) -> Option<f64> {
    comparable(real, simulated)?;
    Centered::new(real).correlation(&Centered::new(simulated))
}

/// Share of pixels, 0 to 1, that differ by strictly less than `threshold` °C (PeerJ CS 11:e3124).
#[must_use]
pub fn image_similarity(real: &[f64], simulated: &[f64], threshold: f64) -> Option<f64> {
    comparable(real, simulated)?;
    let below = differences(real, simulated)
        .filter(|difference| difference.abs() < threshold)
        .count();
    Some(count(below) / count(real.len()))
}

/// The image similarity at each of several thresholds, °C: the paper's evaluation graph.
#[must_use]
pub fn evaluation_graph(real: &[f64], simulated: &[f64], thresholds: &[f64]) -> Option<Vec<f64>> {
    thresholds
        .iter()
        .map(|&threshold| image_similarity(real, simulated, threshold))
        .collect()
}

/// RMS difference, °C.
#[must_use]
pub fn rmse(real: &[f64], simulated: &[f64]) -> Option<f64> {
    comparable(real, simulated)?;
    finite((sum_of(real, simulated, |x, y| (y - x) * (y - x)) / count(real.len())).sqrt())
}

/// RMS difference over the pixels of a mask, such as those that an agent covers; `None` if it marks none.
#[must_use]
pub fn foreground_rmse(real: &[f64], simulated: &[f64], mask: &[bool]) -> Option<f64> {
    comparable(real, simulated)?;
    if mask.len() != real.len() {
        return None;
    }
    let pixels = mask.iter().filter(|&&marked| marked).count();
    let marked = |(difference, &marked): (f64, &bool)| marked.then_some(difference * difference);
    let squares: f64 = differences(real, simulated)
        .zip(mask)
        .filter_map(marked)
        .sum();
    finite((squares / count(pixels)).sqrt()).filter(|_| pixels > 0)
}

/// Mean absolute difference, °C.
#[must_use]
pub fn mae(real: &[f64], simulated: &[f64]) -> Option<f64> {
    comparable(real, simulated)?;
    finite(sum_of(real, simulated, |x, y| (y - x).abs()) / count(real.len()))
}

/// Mean of simulated less real, °C: above zero if the simulation is too warm.
#[must_use]
pub fn bias(real: &[f64], simulated: &[f64]) -> Option<f64> {
    comparable(real, simulated)?;
    finite(sum_of(real, simulated, |x, y| y - x) / count(real.len()))
}

/// Slope of the least-squares line of real over noise-free claim: 1 if the contrast is right; `None` if the claim is
/// flat.
#[must_use]
pub fn contrast_slope(real: &[f64], claim: &[f64]) -> Option<f64> {
    comparable(real, claim)?;
    Centered::new(real).slope_over(&Centered::new(claim))
}

/// Slope of the least-squares line through points `(x, y)`; `None` if all x are equal.
#[must_use]
pub fn slope(points: &[(f64, f64)]) -> Option<f64> {
    let (x, y): (Vec<f64>, Vec<f64>) = points.iter().copied().unzip();
    contrast_slope(&y, &x)
}

#[derive(Debug, Clone)]
pub(crate) struct Centered {
    deviations: Vec<f64>,
    squares: f64,
}

impl Centered {
    pub(crate) fn new(frame: &[f64]) -> Self {
        let mean = mean(frame).unwrap_or(0.0);
        let deviations: Vec<f64> = frame.iter().map(|value| value - mean).collect();
        // The mean of equal numbers may differ from them by rounding, which would correlate noise.
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

    pub(crate) fn permuted(&self, order: &[usize]) -> Self {
        Self {
            deviations: order.iter().map(|&index| self.deviations[index]).collect(),
            squares: self.squares,
        }
    }

    pub(crate) fn correlation(&self, other: &Self) -> Option<f64> {
        let (squares, others) = (self.squares, other.squares);
        if squares <= 0.0 || others <= 0.0 {
            return None;
        }
        finite((self.product(other) / (squares.sqrt() * others.sqrt())).clamp(-1.0, 1.0))
    }

    pub(crate) fn slope_over(&self, claim: &Self) -> Option<f64> {
        finite((claim.squares > 0.0).then(|| self.product(claim) / claim.squares)?)
    }

    /// Slope over a side with noise `sigma_c`, corrected for that noise; `None` if it is half or more of the squares.
    pub(crate) fn slope_over_noisy(&self, other: &Self, sigma_c: f64) -> Option<f64> {
        let noise = count(self.deviations.len().saturating_sub(1)) * sigma_c * sigma_c;
        (other.squares > 2.0 * noise).then(|| self.product(other) / (other.squares - noise))
    }

    fn product(&self, other: &Self) -> f64 {
        sum_of(&self.deviations, &other.deviations, |x, y| x * y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numbers::assert_near;

    /// By hand: products sum to 6, squares to 2; noise of 0.25 in five pixels makes 0.25 of that 2, noise of 0.5 half.
    #[test]
    fn noise_on_the_other_side_does_not_flatten_the_slope() {
        let steep = Centered::new(&[23.0, 17.0, 20.0, 20.0, 20.0]);
        let noisy = Centered::new(&[1.0, -1.0, 0.0, 0.0, 0.0]);
        let close = |found: Option<f64>, expected| assert_near(found.unwrap(), expected, 1e-9);
        close(steep.slope_over_noisy(&noisy, 0.0), 3.0);
        close(steep.slope_over_noisy(&noisy, 0.25), 6.0 / 1.75);
        assert_eq!(steep.slope_over_noisy(&noisy, 0.5), None);
    }
}
