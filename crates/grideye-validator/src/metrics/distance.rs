//! Correlation, similarity and errors of two frames.

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

/// RMS difference, °C.
#[must_use]
pub fn rmse(real: &[f64], simulated: &[f64]) -> Option<f64> {
    comparable(real, simulated)?;
    finite((sum_of(real, simulated, |x, y| (y - x) * (y - x)) / count(real.len())).sqrt())
}

/// Mean of real minus simulated, °C: above zero if the simulation is too cold.
#[must_use]
pub fn bias(real: &[f64], simulated: &[f64]) -> Option<f64> {
    comparable(real, simulated)?;
    finite(sum_of(real, simulated, |x, y| x - y) / count(real.len()))
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
        let product = sum_of(&self.deviations, &other.deviations, |x, y| x * y);
        finite((product / (squares.sqrt() * others.sqrt())).clamp(-1.0, 1.0))
    }
}
