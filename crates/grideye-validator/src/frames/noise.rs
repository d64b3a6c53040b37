//! The sensor's noise, from how frames differ: a Gaussian fitted to the middle of the differences, because people make the
//! tails. What all pixels do together is no noise of theirs.

use crate::frames::types::{Pixels, middle_mean};
use crate::numbers::{count, index, long_count};
use grideye_frame::PIXELS;

const BINS_A_SIDE: usize = 512;
/// Values beyond this many standard deviations are cut off, since they are mostly not noise.
const CUT_SIGMAS: f64 = 3.0;
/// Variance of a normal distribution cut off at three standard deviations: 1 - 2 · 3 φ(3) / (2 Φ(3) - 1).
const CUT_VARIANCE: f64 = 0.973_337;
/// Distance between the quartiles of a normal distribution, in standard deviations.
const QUARTILES_APART: f64 = 1.348_98;
/// Most steps of the fit, which gains about a digit per step.
const FIT_STEPS_MAX: u32 = 50;

/// Counts in equal bins around zero; values beyond count in the end bins.
#[derive(Debug, Clone)]
pub(crate) struct Histogram {
    bin: f64,
    counts: Vec<u64>,
    pub(crate) total: u64,
}

impl Default for Histogram {
    fn default() -> Self {
        Self::new(DIFFERENCE_BIN_C)
    }
}

impl Histogram {
    pub(crate) fn new(bin: f64) -> Self {
        Self {
            bin,
            counts: vec![0; 2 * BINS_A_SIDE + 1],
            total: 0,
        }
    }

    pub(crate) fn push(&mut self, value: f64) {
        let place = (value / self.bin).round() + count(BINS_A_SIDE);
        let place = index(place).min(2 * BINS_A_SIDE);
        self.counts[place] += 1;
        self.total += 1;
    }

    pub(crate) fn extent(&self) -> Option<(f64, f64)> {
        let (_, low) = self.bins().next()?;
        let (_, high) = self.bins().last()?;
        Some((low, high))
    }

    /// Quantile, with the values of a bin spread evenly over it.
    pub(crate) fn quantile(&self, share: f64) -> Option<f64> {
        let wanted = share * long_count(self.total);
        let mut below = 0.0;
        for (count, middle) in self.bins() {
            if below + count >= wanted {
                return Some(middle + ((wanted - below) / count - 0.5) * self.bin);
            }
            below += count;
        }
        None
    }

    /// Standard deviation of the normal distribution that fits the values within three of it; `None` below 10 values.
    pub(crate) fn gaussian_sigma(&self) -> Option<f64> {
        if self.total < 10 {
            return None;
        }
        let middle = self.quantile(0.5)?;
        let mut sigma = (self.quantile(0.75)? - self.quantile(0.25)?) / QUARTILES_APART;
        // More than half of the values are in one bin, so the quartiles tell nothing.
        if sigma < self.bin {
            sigma = self.cut_variance(middle, f64::INFINITY).sqrt();
        }
        for _ in 0..FIT_STEPS_MAX {
            let next = (self.cut_variance(middle, CUT_SIGMAS * sigma) / CUT_VARIANCE).sqrt();
            if (next - sigma).abs() <= 1e-9 {
                return Some(next);
            }
            sigma = next;
        }
        Some(sigma)
    }

    /// Variance of the values within `reach` of `middle`, around their own mean.
    fn cut_variance(&self, middle: f64, reach: f64) -> f64 {
        let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
        for (in_bin, value) in self.bins() {
            let off = value - middle;
            if off.abs() <= reach {
                count += in_bin;
                sum += in_bin * off;
                squares += in_bin * off * off;
            }
        }
        if count < 2.0 {
            return 0.0;
        }
        ((squares - sum * sum / count) / count).max(0.0)
    }

    fn bins(&self) -> impl Iterator<Item = (f64, f64)> {
        let value = |place: usize| (count(place) - count(BINS_A_SIDE)) * self.bin;
        let places = self.counts.iter().enumerate();
        places
            .filter(|(_, number)| **number > 0)
            .map(move |(place, number)| (long_count(*number), value(place)))
    }
}

#[derive(Debug)]
pub(crate) struct PixelHistograms(pub(crate) Vec<Histogram>);

impl Default for PixelHistograms {
    fn default() -> Self {
        Self(vec![Histogram::default(); PIXELS])
    }
}

impl PixelHistograms {
    pub(crate) fn push(&mut self, values: &Pixels) {
        for (histogram, value) in self.0.iter_mut().zip(values) {
            histogram.push(*value);
        }
    }

    /// Each pixel's noise in one frame from differences of two, °C; 0 where there are too few.
    pub(crate) fn noise_c(&self) -> Pixels {
        std::array::from_fn(|pixel| self.0[pixel].noise_c().unwrap_or(0.0))
    }
}

/// How a frame differs from another, pixel by pixel, less what all pixels do together.
pub(crate) fn apart(now: &Pixels, before: &Pixels) -> Pixels {
    let difference: Pixels = std::array::from_fn(|pixel| now[pixel] - before[pixel]);
    let together = middle_mean(&difference);
    difference.map(|own| own - together)
}

impl Histogram {
    /// One frame's noise from these differences of two, corrected for the share that is removed with what pixels do together.
    pub(crate) fn noise_c(&self) -> Option<f64> {
        let of_pixels = count(PIXELS);
        let scale = (of_pixels / (of_pixels - 1.0) / 2.0).sqrt();
        Some(self.gaussian_sigma()? * scale)
    }
}

/// Noise of one frame, all pixels alike, °C; `None` without pairs.
pub(crate) fn noise_of<'a>(pairs: impl Iterator<Item = (&'a Pixels, &'a Pixels)>) -> Option<f64> {
    let mut differences = Histogram::default();
    for (now, then) in pairs {
        let pixels = apart(now, then).into_iter();
        pixels.for_each(|own| differences.push(own));
    }
    differences.noise_c()
}

/// Width of the bins for differences, °C: fine against the sensor's step of 0.25.
const DIFFERENCE_BIN_C: f64 = 1.0 / 64.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numbers::{assert_near, normal_draws};

    fn filled(sigma: f64, step: Option<f64>, intruders: u32) -> Histogram {
        let mut noise = normal_draws(1);
        let mut histogram = Histogram::new(1.0 / 64.0);
        for _ in 0..20_000 {
            let value = sigma * noise();
            histogram.push(step.map_or(value, |step| (value / step).round() * step));
        }
        for intruder in 0..intruders {
            histogram.push(2.0 + f64::from(intruder % 7) / 3.0);
        }
        histogram
    }

    #[test]
    fn the_sigma_of_a_normal_distribution_is_found_with_and_without_intruders() {
        // 20,000 draws determine their standard deviation to 0.5 %.
        for intruders in [0, 1000, 3000] {
            let found = filled(0.47, None, intruders).gaussian_sigma().unwrap();
            assert_near(found / 0.47, 1.0, 0.02);
        }
    }

    /// Sheppard: rounding adds a twelfth of the step's square to the variance.
    #[test]
    fn rounding_to_the_sensors_step_adds_its_known_share() {
        for sigma in [0.2, 0.33, 0.47, 0.8] {
            let expected = (sigma * sigma + 0.0625_f64 / 12.0).sqrt();
            let found = filled(sigma, Some(0.25), 0).gaussian_sigma().unwrap();
            assert_near(found / expected, 1.0, 0.04);
        }
    }

    /// Noise of 0.3 °C in each of two frames, a wander of all pixels, and a person on eight of them.
    #[test]
    fn noise_is_that_of_one_frame_without_wander_and_people() {
        let mut draw = normal_draws(7);
        let mut frame = |level: f64, person: f64| -> Pixels {
            std::array::from_fn(|pixel| {
                let warm = if pixel < 8 { person } else { 0.0 };
                20.0 + level + warm + 0.3 * draw()
            })
        };
        let pairs: Vec<(Pixels, Pixels)> = (0..100)
            .map(|place| (frame(0.0, 3.0), frame(0.01 * f64::from(place), 0.0)))
            .collect();
        let found = noise_of(pairs.iter().map(|(now, then)| (now, then))).unwrap();
        assert_near(found / 0.3, 1.0, 0.03);
        assert_eq!(noise_of(std::iter::empty()), None);
    }

    #[test]
    fn constant_and_empty_histograms() {
        for value in [0.0, 1.0] {
            let mut still = Histogram::new(1.0 / 64.0);
            (0..100).for_each(|_| still.push(value));
            assert_eq!(still.gaussian_sigma(), Some(0.0), "{value}");
        }
        let empty = Histogram::new(1.0);
        assert_eq!(empty.gaussian_sigma(), None);
        assert_eq!(empty.quantile(0.5), None);
    }

    #[test]
    fn quantiles_and_ends() {
        let mut histogram = Histogram::new(0.5);
        for value in [-1000.0, 0.0, 0.5, 1000.0] {
            histogram.push(value);
        }
        assert_eq!(histogram.total, 4);
        assert_eq!(histogram.quantile(0.5), Some(0.25));
        assert_eq!(histogram.quantile(1.0), Some(256.25));
    }
}
