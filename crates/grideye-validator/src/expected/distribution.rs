//! How a score is spread over drawn units.

use crate::numbers::{mean_and_deviation, normal_quantile};

/// How a score is spread over drawn units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScoreDistribution {
    /// Mean.
    pub mean: f64,
    /// Standard deviation, not below zero.
    pub sd: f64,
    scale: Scale,
    /// Mean and standard deviation on that scale.
    on_scale: (f64, f64),
}

/// The scale on which a score is spread normally, near enough.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Scale {
    /// Its own.
    Plain,
    /// Correlations, up to 1: the inverse hyperbolic tangent (Fisher, 1921).
    Correlation,
    /// Gains, up to 1: the logarithm of the ratio of errors that they are made of.
    Gain,
}

/// Correlations and gains nearer to 1 than this are taken for this near.
const NEAREST: f64 = 1e-6;

impl ScoreDistribution {
    /// Of what the draws scored; `None` where fewer than half of them have that score at all.
    pub(crate) fn of(scale: Scale, values: impl Iterator<Item = Option<f64>>) -> Option<Self> {
        let all: Vec<Option<f64>> = values.collect();
        let known: Vec<f64> = all.iter().copied().flatten().collect();
        if 2 * known.len() < all.len() {
            return None;
        }
        let (mean, sd) = mean_and_deviation(&known)?;
        let scaled: Vec<f64> = known.iter().map(|&value| scale.forth(value)).collect();
        Some(Self {
            mean,
            sd,
            scale,
            on_scale: mean_and_deviation(&scaled)?,
        })
    }

    /// Less than this has only that share of the units.
    #[must_use]
    pub fn low(&self, share: f64) -> f64 {
        let (mean, sd) = self.on_scale;
        self.scale.back(mean - normal_quantile(share) * sd)
    }

    /// More than this has only that share of the units.
    #[must_use]
    pub fn high(&self, share: f64) -> f64 {
        let (mean, sd) = self.on_scale;
        self.scale.back(mean + normal_quantile(share) * sd)
    }

    /// More than this has only that share of the units where the score is the largest of many, which Gumbel's law is for.
    #[must_use]
    pub fn high_of_largest(&self, share: f64) -> f64 {
        const EULER: f64 = 0.577_215_664_9;
        let scale = self.sd * 6.0_f64.sqrt() / std::f64::consts::PI;
        let location = self.mean - EULER * scale;
        location - scale * (-(1.0 - share).ln()).ln()
    }
}

impl Scale {
    fn forth(self, value: f64) -> f64 {
        match self {
            Self::Plain => value,
            Self::Correlation => value.clamp(NEAREST - 1.0, 1.0 - NEAREST).atanh(),
            Self::Gain => -(1.0 - value).max(NEAREST).ln(),
        }
    }

    fn back(self, scaled: f64) -> f64 {
        match self {
            Self::Plain => scaled,
            Self::Correlation => scaled.tanh(),
            Self::Gain => 1.0 - (-scaled).exp(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law(scale: Scale, values: &[f64]) -> ScoreDistribution {
        ScoreDistribution::of(scale, values.iter().map(|&value| Some(value))).unwrap()
    }

    #[test]
    fn a_law_is_that_of_the_draws_that_have_a_score() {
        let values = [Some(1.0), None, Some(3.0)];
        let law = ScoreDistribution::of(Scale::Plain, values.into_iter()).unwrap();
        assert_eq!((law.mean, law.sd), (2.0, 1.0));
        assert!((law.low(0.001) - (2.0 - 3.090_232)).abs() < 1e-4);
        assert!((law.high(0.001) - (2.0 + 3.090_232)).abs() < 1e-4);
        let few = [Some(1.0), None, None];
        assert_eq!(ScoreDistribution::of(Scale::Plain, few.into_iter()), None);
        assert_eq!(
            ScoreDistribution::of(Scale::Plain, std::iter::empty()),
            None
        );
    }

    /// By hand: atanh 0.5 and 0.8 are 0.5493 and 1.0986, their mean 0.8240 and their deviation 0.2747. Ratios of 0.5 and
    /// 0.125 have logarithms of mean ln 0.25 and deviation ln 2.
    #[test]
    fn what_cannot_pass_1_is_spread_on_a_scale_that_can() {
        let correlations = law(Scale::Correlation, &[0.5, 0.8]);
        assert!((correlations.mean - 0.65).abs() < 1e-12);
        let expected = (0.823_96_f64 + 3.090_232 * 0.274_65).tanh();
        assert!((correlations.high(0.001) - expected).abs() < 1e-4);
        let gains = law(Scale::Gain, &[0.5, 0.875]);
        let low = 1.0 - 0.25 * 2.0_f64.powf(3.090_232);
        assert!(
            (gains.low(0.001) - low).abs() < 1e-3,
            "{}",
            gains.low(0.001)
        );
        assert!(gains.high(0.001) < 1.0);
        assert!(law(Scale::Correlation, &[1.0, 1.0]).low(0.001) > 0.999);
    }

    /// Gumbel: mean + sd √6/π (-ln(-ln(0.999)) - 0.5772) = 0.7797 (6.9073 - 0.5772).
    #[test]
    fn the_largest_of_many_has_a_longer_tail() {
        let law = law(Scale::Plain, &[-1.0, 1.0]);
        assert!((law.high_of_largest(0.001) - 4.9355).abs() < 1e-3);
    }
}
