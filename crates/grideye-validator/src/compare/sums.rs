//! Sums of all measures over pairs of frames.

use crate::compare::prepared::Prepared;
use crate::metrics::entropy::{Counter, mutual};
use crate::metrics::graph::Graph;
use crate::metrics::score::{Measure, Values};
use crate::metrics::{IS_THRESHOLD, bias, image_similarity, rmse};
use crate::numbers::count;
use grideye_frame::PIXELS;

/// Scores pairs, and adds them up.
pub(crate) struct Sums {
    /// Of each measure, over the pairs where it is defined, and their number.
    means: [(f64, usize); Measure::ALL.len()],
    pub(crate) graph: Graph,
    counter: Counter,
}

impl Default for Sums {
    fn default() -> Self {
        Self {
            means: Default::default(),
            graph: Graph::default(),
            counter: Counter::new(PIXELS),
        }
    }
}

impl Sums {
    /// Over pairs of a real frame and another.
    pub(crate) fn of<'a>(pairs: impl Iterator<Item = (&'a Prepared, &'a Prepared)>) -> Self {
        let mut sums = Self::default();
        for (real, put) in pairs {
            sums.pair(real, put);
        }
        sums
    }

    /// Every measure of a pair, which is added.
    pub(crate) fn pair(&mut self, real: &Prepared, put: &Prepared) -> Values {
        let (x, y) = (&real.celsius, &put.celsius);
        self.graph.add(x, y);
        let bits = real.binned.as_ref().zip(put.binned.as_ref());
        let bits = bits.map(|(x, y)| [x.entropy, y.entropy, self.counter.joint(x, y)]);
        let blobs = real.blob.as_ref().zip(put.blob.as_ref());
        let [own, others, joint] = [0, 1, 2].map(|which| bits.map(|bits| bits[which]));
        let values = [
            real.centered.correlation(&put.centered),
            own,
            others,
            joint,
            bits.map(mutual),
            image_similarity(x, y, IS_THRESHOLD),
            rmse(x, y),
            bias(x, y),
            blobs.map(|(one, other)| one.distance_pixels(other)),
        ];
        for ((sum, number), value) in self.means.iter_mut().zip(values) {
            *sum += value.unwrap_or(0.0);
            *number += usize::from(value.is_some());
        }
        values
    }

    pub(crate) fn means(&self) -> Values {
        let mean = |(sum, number)| (number > 0).then(|| sum / count(number));
        self.means.map(mean)
    }
}

/// Corrects for the repeat's noise, which a noise-free prediction would not have.
///
/// C: Spearman's correction for attenuation. RMSE: less the noise variance. Centroid error: divided by √2.
pub(crate) fn noise_once(mut means: Values, sigma_c: f64) -> Values {
    let mut correct = |measure: Measure, correct: &dyn Fn(f64) -> f64| {
        let value = &mut means[measure.place()];
        *value = value.map(correct);
    };
    correct(Measure::Correlation, &|c| {
        if c > 0.0 { c.sqrt() } else { c }
    });
    correct(Measure::Rmse, &|rmse| {
        (rmse * rmse - sigma_c * sigma_c).max(0.0).sqrt()
    });
    correct(Measure::CentroidError, &|error| {
        error / std::f64::consts::SQRT_2
    });
    means
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_of_the_repeat_is_counted_once() {
        let measures = [
            (Measure::Correlation, 0.64, 0.8),
            (Measure::Correlation, -0.5, -0.5),
            (Measure::Rmse, 0.5, 0.4),
            (Measure::CentroidError, 2.0_f64.sqrt(), 1.0),
            (Measure::ImageSimilarity, 0.9, 0.9),
        ];
        for (measure, twice, once) in measures {
            let mut means = Values::default();
            means[measure.place()] = Some(twice);
            let found = noise_once(means, 0.3)[measure.place()].unwrap();
            assert!((found - once).abs() < 1e-12, "{measure}: {found}");
        }
    }
}
