//! Small statistics.

use super::Degrees;
use grideye_frame::{COLUMNS, ROWS};

/// A count as a float.
#[expect(
    clippy::as_conversions,
    clippy::cast_precision_loss,
    reason = "counts of frames and pixels, far below 2^52"
)]
pub(crate) const fn float(count: usize) -> f64 {
    count as f64
}

/// The same for long counts.
#[expect(
    clippy::as_conversions,
    clippy::cast_precision_loss,
    reason = "counts of frames, far below 2^52"
)]
pub(crate) const fn long_float(count: u64) -> f64 {
    count as f64
}

/// The mean of the middle three quarters of the pixels: a person, on a tenth of them, hardly moves it, and unlike the
/// median it is not bound to the sensor's steps.
pub(crate) fn middle_mean(values: &Degrees) -> f64 {
    mean_between(&mut values.to_vec(), values.len() / 8)
}

/// The mean of every two by two pixels.
pub(crate) fn two_by_two(pixels: &Degrees) -> Vec<f64> {
    let corners =
        (0..ROWS - 1).flat_map(|row| (0..COLUMNS - 1).map(move |column| row * COLUMNS + column));
    corners
        .map(|at| {
            (pixels[at] + pixels[at + 1] + pixels[at + COLUMNS] + pixels[at + COLUMNS + 1]) / 4.0
        })
        .collect()
}

/// The mean of what is left without so many of the smallest and of the largest; the median if that is nothing.
pub(crate) fn mean_between(values: &mut [f64], cut: usize) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let cut = cut.min(values.len().saturating_sub(1) / 2);
    let middle = &values[cut..values.len() - cut];
    if middle.is_empty() {
        return 0.0;
    }
    middle.iter().sum::<f64>() / float(middle.len())
}

/// The middle value, or the mean of the two; 0 of nothing.
pub(crate) fn median(values: &[f64]) -> f64 {
    mean_between(&mut values.to_vec(), values.len())
}

/// Mean and variance of any number of values, one by one (Welford).
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Spread {
    count: u64,
    mean: f64,
    squares: f64,
}

impl Spread {
    pub(crate) fn push(&mut self, value: f64) {
        self.count += 1;
        let off = value - self.mean;
        self.mean += off / long_float(self.count);
        self.squares += off * (value - self.mean);
    }

    pub(crate) const fn count(&self) -> u64 {
        self.count
    }

    pub(crate) const fn mean(&self) -> f64 {
        self.mean
    }

    /// About the mean, with one degree of freedom less; 0 of fewer than two.
    pub(crate) fn variance(&self) -> f64 {
        if self.count < 2 {
            return 0.0;
        }
        self.squares / long_float(self.count - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn middles() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), 2.5);
        assert_eq!(median(&[]), 0.0);
        assert_eq!(
            mean_between(&mut [100.0, 1.0, 2.0, 4.0, -50.0], 1),
            7.0 / 3.0
        );
        let mut person = [20.0; 64];
        person[10..17].fill(25.0);
        assert_eq!(middle_mean(&person), 20.0);
    }

    #[test]
    fn spread_of_known_values() {
        let mut spread = Spread::default();
        for value in [2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0] {
            spread.push(value);
        }
        assert_eq!(spread.mean(), 5.0);
        assert!((spread.variance() - 32.0 / 7.0).abs() < 1e-12);
    }
}
