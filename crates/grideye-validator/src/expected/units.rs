//! The drawn units, and the distribution of their scores.

use crate::align::Orientation;
use crate::expected::claim::{Claim, Statistics};
use crate::numbers::{count, mean_and_deviation, normal_quantile};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::Serialize;

/// Number of drawn units.
pub const DRAWS: usize = 100;

#[derive(Debug, Clone)]
pub(crate) struct UnitSpecification {
    /// Noise of a pixel from frame to frame, including rounding, °C.
    pub(crate) noise_c: f64,
    /// Standard deviation of the unknown part of each pixel's fixed pattern, row by row, °C.
    pub(crate) pattern_c: Vec<f64>,
    pub(crate) step_c: f64,
    pub(crate) frames: usize,
    /// Empty frames that the room was learned from, if it was.
    pub(crate) learned_from: Option<usize>,
    pub(crate) seed: u64,
}

#[derive(Debug, Clone)]
pub(crate) struct Expected {
    /// If the claim is right.
    pub(crate) right: Vec<Statistics>,
    /// If its people are not there.
    pub(crate) nobody: Vec<Statistics>,
    /// If nothing is there.
    pub(crate) blank: Vec<Statistics>,
}

pub(crate) type Pick = fn(&Statistics) -> Option<f64>;

impl Expected {
    pub(crate) fn new(claim: &Claim, unit: &UnitSpecification) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(unit.seed ^ UNITS_SEED);
        let mut expected = Self {
            right: Vec::with_capacity(DRAWS),
            nobody: Vec::with_capacity(DRAWS),
            blank: Vec::with_capacity(DRAWS),
        };
        let scene: Vec<&[f64]> = (0..unit.frames).map(|index| claim.claimed(index)).collect();
        let empty: Vec<&[f64]> = (0..unit.frames).map(|index| claim.nobody(index)).collect();
        let ambient = vec![claim.ambient_c; claim.pixels()];
        let nothing = vec![ambient.as_slice(); unit.frames];
        for _ in 0..DRAWS {
            let drawn = unit.draw(&mut random, claim);
            let room = drawn.learned.as_deref();
            let recorded = |shown: &[&[f64]]| drawn.recorded(unit.step_c, shown);
            expected.right.push(claim.of_all(&recorded(&scene), room));
            if claim.knows_nobody() {
                expected
                    .nobody
                    .push(claim.of_people(&recorded(&empty), room));
            }
            expected.blank.push(claim.of_image(&recorded(&nothing)));
        }
        expected
    }

    /// How much more recordings of the claim resemble it upright than in that orientation.
    pub(crate) fn upright(&self, orientation: Orientation) -> Option<ScoreDistribution> {
        let of = |statistics: &Statistics| {
            let mut all = statistics.upright.iter();
            all.find(|(other, _)| *other == orientation)
                .map(|(_, by)| *by)
        };
        ScoreDistribution::of(Scale::Plain, self.right.iter().map(of))
    }
}

struct Drawn {
    errors: Vec<Vec<f64>>,
    /// The empty room as this unit shows it.
    learned: Option<Vec<f64>>,
}

/// Separates these draws from noise and orders of the same seed.
const UNITS_SEED: u64 = 0x0075_6E69_7473;

impl UnitSpecification {
    fn draw(&self, random: &mut ChaCha8Rng, claim: &Claim) -> Drawn {
        let mut normal = |sigma: f64| -> f64 {
            let draw: f64 = StandardNormal.sample(random);
            sigma * draw
        };
        // The level's place within a step decides how the pattern is rounded.
        let level_c = normal(self.step_c);
        let pattern: Vec<f64> = self
            .pattern_c
            .iter()
            .map(|&sigma_c| level_c + normal(sigma_c))
            .collect();
        // The measured noise includes rounding, which is applied again below.
        let unrounded = self.noise_c * self.noise_c - self.step_c * self.step_c / 12.0;
        let noise_c = unrounded.max(0.0).sqrt();
        let learned = self.learned_from.map(|frames| {
            let left_c = self.noise_c / count(frames.max(1)).sqrt();
            let room = claim.nobody(0).iter().zip(&pattern);
            room.map(|(room, fixed)| room + fixed + normal(left_c))
                .collect()
        });
        let frame = |_| -> Vec<f64> {
            pattern
                .iter()
                .map(|fixed| fixed + normal(noise_c))
                .collect()
        };
        Drawn {
            errors: (0..self.frames).map(frame).collect(),
            learned,
        }
    }
}

impl Drawn {
    fn recorded(&self, step_c: f64, scene: &[&[f64]]) -> Vec<Vec<f64>> {
        let frame = |(frame, errors): (&&[f64], &Vec<f64>)| {
            let pixels = frame.iter().zip(errors);
            pixels
                .map(|(celsius, error)| ((celsius + error) / step_c).round() * step_c)
                .collect()
        };
        scene.iter().zip(&self.errors).map(frame).collect()
    }
}

/// Distribution of a score over the drawn units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ScoreDistribution {
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub sd: f64,
    #[serde(skip)]
    scale: Scale,
    /// Mean and standard deviation on that scale.
    #[serde(skip)]
    on_scale: (f64, f64),
}

/// A scale on which the score is nearly normal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Scale {
    Plain,
    /// Correlations, up to 1: the inverse hyperbolic tangent (Fisher, 1921).
    Correlation,
    /// Gains, up to 1: the logarithm of their ratio of errors.
    Gain,
}

/// Smallest distance of a correlation or gain from 1 on its scale.
const NEAREST: f64 = 1e-6;

impl ScoreDistribution {
    /// From the draws' scores; `None` if fewer than half of them are defined.
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

    /// The score that only this share of the units falls below.
    #[must_use]
    pub fn low(&self, share: f64) -> f64 {
        let (mean, sd) = self.on_scale;
        self.scale.back(mean - normal_quantile(share) * sd)
    }

    /// The score that only this share of the units exceeds.
    #[must_use]
    pub fn high(&self, share: f64) -> f64 {
        let (mean, sd) = self.on_scale;
        self.scale.back(mean + normal_quantile(share) * sd)
    }

    /// [`high`](Self::high) for a score that is the largest of many (Gumbel's law).
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
    use crate::numbers::assert_near;

    fn law(scale: Scale, values: &[f64]) -> ScoreDistribution {
        ScoreDistribution::of(scale, values.iter().map(|&value| Some(value))).unwrap()
    }

    #[test]
    fn a_distribution_uses_only_defined_scores() {
        let values = [Some(1.0), None, Some(3.0)];
        let law = ScoreDistribution::of(Scale::Plain, values.into_iter()).unwrap();
        assert_eq!((law.mean, law.sd), (2.0, 1.0));
        assert_near(law.low(0.001), 2.0 - 3.090_232, 1e-4);
        assert_near(law.high(0.001), 2.0 + 3.090_232, 1e-4);
        for few in [[Some(1.0), None, None].as_slice(), &[]] {
            let law = ScoreDistribution::of(Scale::Plain, few.iter().copied());
            assert_eq!(law, None, "{few:?}");
        }
    }

    /// By hand: atanh 0.5 and 0.8 have mean 0.8240, deviation 0.2747; ratios 0.5 and 0.125 have mean ln 0.25, deviation
    /// ln 2.
    #[test]
    fn scores_up_to_1_use_a_scale_without_that_limit() {
        let correlations = law(Scale::Correlation, &[0.5, 0.8]);
        assert!((correlations.mean - 0.65).abs() < 1e-12);
        let expected = (0.823_96_f64 + 3.090_232 * 0.274_65).tanh();
        assert!((correlations.high(0.001) - expected).abs() < 1e-4);
        let gains = law(Scale::Gain, &[0.5, 0.875]);
        let low = 1.0 - 0.25 * 2.0_f64.powf(3.090_232);
        assert_near(gains.low(0.001), low, 1e-3);
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
