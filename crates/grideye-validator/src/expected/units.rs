//! The units that are drawn, and what they score.

use crate::align::Orientation;
use crate::expected::claim::{Claim, Recorded, Statistics};
use crate::expected::distribution::{Scale, ScoreDistribution};
use crate::numbers::count;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Units that are drawn.
pub const DRAWS: usize = 100;

/// What is known of the unit that recorded, and of its recording.
#[derive(Debug, Clone)]
pub(crate) struct UnitSpecification {
    /// Noise of a pixel from frame to frame, its rounding included, °C.
    pub(crate) noise_c: f64,
    /// Standard deviation of what each pixel shows too much, as far as that is not known, row by row, °C.
    pub(crate) pattern_c: Vec<f64>,
    /// The sensor's step, °C.
    pub(crate) step_c: f64,
    /// Frames that it recorded.
    pub(crate) frames: usize,
    /// Frames of the empty room that its map was learned from, if it was.
    pub(crate) learned_from: Option<usize>,
    pub(crate) seed: u64,
}

/// The laws of what drawn units score.
#[derive(Debug, Clone)]
pub(crate) struct Expected {
    /// Where the claim is right.
    right: Vec<Statistics>,
    /// Where its people are not there.
    nobody: Vec<Statistics>,
    /// Where nothing is there.
    blank: Vec<Statistics>,
}

/// One of the scores.
pub(crate) type Pick = fn(&Statistics) -> Option<f64>;

impl Expected {
    /// Draws units and scores what they record.
    pub(crate) fn new(claim: &Claim, unit: &UnitSpecification) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(unit.seed ^ UNITS_SEED);
        let mut expected = Self {
            right: Vec::with_capacity(DRAWS),
            nobody: Vec::with_capacity(DRAWS),
            blank: Vec::with_capacity(DRAWS),
        };
        let scene: Vec<&[f64]> = (0..unit.frames).map(|index| claim.claimed(index)).collect();
        let empty: Vec<&[f64]> = (0..unit.frames).map(|index| claim.nobody(index)).collect();
        let ambient = vec![claim.ambient_c(); claim.pixels()];
        let nothing = vec![ambient.as_slice(); unit.frames];
        for _ in 0..DRAWS {
            let drawn = unit.draw(&mut random, claim);
            let room = drawn.learned.as_deref();
            let right = drawn.recorded(unit.step_c, &scene);
            expected.right.push(claim.of_all(Recorded {
                frames: &right,
                room,
            }));
            if claim.knows_nobody() {
                let nobody = drawn.recorded(unit.step_c, &empty);
                expected.nobody.push(claim.of_people(Recorded {
                    frames: &nobody,
                    room,
                }));
            }
            let blank = drawn.recorded(unit.step_c, &nothing);
            expected.blank.push(claim.of_image(Recorded {
                frames: &blank,
                room,
            }));
        }
        expected
    }

    /// A score where the claim is right.
    pub(crate) fn right(&self, scale: Scale, pick: Pick) -> Option<ScoreDistribution> {
        ScoreDistribution::of(scale, self.right.iter().map(pick))
    }

    /// A score where the scene's people are not there.
    pub(crate) fn nobody(&self, scale: Scale, pick: Pick) -> Option<ScoreDistribution> {
        ScoreDistribution::of(scale, self.nobody.iter().map(pick))
    }

    /// A score where nothing is there.
    pub(crate) fn blank(&self, scale: Scale, pick: Pick) -> Option<ScoreDistribution> {
        ScoreDistribution::of(scale, self.blank.iter().map(pick))
    }

    /// By how much recordings of the claim are more like it upright than in that orientation.
    pub(crate) fn upright(&self, orientation: Orientation) -> Option<ScoreDistribution> {
        let of = |statistics: &Statistics| {
            let mut all = statistics.upright.iter();
            all.find(|(other, _)| *other == orientation)
                .map(|(_, by)| *by)
        };
        ScoreDistribution::of(Scale::Plain, self.right.iter().map(of))
    }
}

/// One unit, and what it adds to each pixel of each frame before it rounds.
struct Drawn {
    errors: Vec<Vec<f64>>,
    /// What it shows of the empty room.
    learned: Option<Vec<f64>>,
}

/// Keeps the units apart from noise and orders of the same seed.
const UNITS_SEED: u64 = 0x0075_6E69_7473;

impl UnitSpecification {
    fn draw(&self, random: &mut ChaCha8Rng, claim: &Claim) -> Drawn {
        let mut normal = |sigma: f64| -> f64 {
            let draw: f64 = StandardNormal.sample(random);
            sigma * draw
        };
        // Where in a step the level lies decides how the pattern is rounded.
        let level_c = normal(self.step_c);
        let pattern: Vec<f64> = self
            .pattern_c
            .iter()
            .map(|&sigma_c| level_c + normal(sigma_c))
            .collect();
        // What was measured has the rounding in it, which is done again.
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
    /// What this unit records of the frames of a scene.
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

#[cfg(test)]
impl Expected {
    /// What is known already of drawn units: where the claim is right, where its people are not there, where nothing is.
    pub(crate) fn known([right, nobody, blank]: [Vec<Statistics>; 3]) -> Self {
        Self {
            right,
            nobody,
            blank,
        }
    }
}
