//! The search: from several starts on few frames, then on all, weighted by the residuals.

use crate::calibrate::frames::Frames;
use crate::calibrate::model::Model;
use crate::calibrate::noise::{self, Freedom, Noise, Parts};
use crate::calibrate::solver::{Solution, State, Until};
use crate::calibrate::types::{Options, STARTS_MAX};
use crate::calibrate::uncertainty::Uncertainty;
use crate::constants::{ALIKE, SAME_COST, SAME_GAIN};
use crate::error::ValidatorError;
use grideye_scene::uncertain::Normal;
use rand_chacha::ChaCha12Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};
use rand_distr::{Distribution as _, StandardNormal};

const COARSE_FRAMES: usize = 24;
const COARSE_STEPS: usize = 12;
const FINE_STEPS: usize = 40;
/// How often the noise is measured again on the residuals of the best fit.
const ROUNDS: usize = 3;
/// Each start ends where a step would gain less than these.
const COARSE: Until = Until {
    gain: 0.05,
    share: 1e-4,
    is_sure: true,
    is_far: true,
};
/// What a tenth of a standard uncertainty in one direction costs.
const FINE: Until = Until {
    gain: 5e-3,
    share: 0.0,
    is_sure: true,
    is_far: false,
};
/// While the noise is still measured again after it.
const ROUGH: Until = Until {
    is_sure: false,
    ..FINE
};

pub(crate) fn steps_in_frames(frames: &Frames, options: &Options) -> usize {
    let few = frames.len().min(COARSE_FRAMES);
    (starts(options) + ROUNDS) * COARSE_STEPS * few + (ROUNDS + 1) * FINE_STEPS * frames.len()
}

pub(crate) fn starts(options: &Options) -> usize {
    options.starts.clamp(1, STARTS_MAX)
}

/// The best end from several starts on few frames, and the noise there; the number of starts, and of those that reached it.
pub(crate) fn from_several_starts(
    model: &mut Model<'_>,
    frames: &Frames,
    options: &Options,
) -> Result<(Vec<f64>, Noise, [usize; 2]), ValidatorError> {
    let few = frames.fewer(COARSE_FRAMES);
    let noise = Noise::first(few.len());
    let mut generator = ChaCha12Rng::seed_from_u64(options.seed);
    let starts = starts(options);
    let priors = model.priors();
    let mut ends: Vec<(f64, State)> = Vec::with_capacity(starts);
    for number in 0..starts {
        let mut start = model.start();
        if number > 0 {
            let values = start.iter_mut().zip(&priors);
            values.for_each(|(value, law)| *value = draw(&mut generator, law));
        }
        let mut state = model.begin(&start, &few)?;
        let cost = model.search((&few, &noise), &mut state, (COARSE_STEPS, COARSE))?;
        ends.push((cost, state));
        if (ALIKE..starts).contains(&ends.len()) && same(&ends) == ends.len() {
            model.skip((starts - ends.len()) * COARSE_STEPS, &few);
            break;
        }
    }
    let reached = [ends.len(), same(&ends)];
    ends.sort_by(|(one, _), (other, _)| one.total_cmp(other));
    let Some((_, mut best)) = ends.into_iter().next() else {
        return Ok((model.start(), noise, reached));
    };
    // Few frames cost little, so the noise is known, and the end near, before all are simulated.
    let mut noise = noise;
    for _ in 0..ROUNDS {
        noise = Noise::of(&Parts::of(&best.raw, few.len()), &Freedom::default(), None);
        model.search((&few, &noise), &mut best, (COARSE_STEPS, ROUGH))?;
    }
    Ok((best.point, noise.of_more(frames.len()), reached))
}

/// How many ends are as good as the best.
fn same(ends: &[(f64, State)]) -> usize {
    let costs = || ends.iter().map(|(cost, _)| *cost);
    let least = costs().fold(f64::INFINITY, f64::min);
    costs()
        .filter(|cost| *cost <= least * (1.0 + SAME_COST) + SAME_GAIN)
        .count()
}

/// Between the bounds, or from the law that is known.
fn draw(generator: &mut ChaCha12Rng, law: &Option<Normal>) -> f64 {
    let Some(law) = law else {
        return f64::from(generator.next_u32()) / 4_294_967_296.0;
    };
    let normal: f64 = StandardNormal.sample(generator);
    (law.mean + law.sd * normal).clamp(0.0, 1.0)
}

pub(crate) struct FineSearch {
    pub(crate) solution: Solution,
    pub(crate) noise: Noise,
    pub(crate) left_over: Vec<f64>,
    pub(crate) uncertainty: Uncertainty,
}

impl FineSearch {
    pub(crate) fn search(
        model: &mut Model<'_>,
        frames: &Frames,
        (coarse, mut noise): (&[f64], Noise),
        options: &Options,
    ) -> Result<Self, ValidatorError> {
        let known = options.profile.as_ref().map(|profile| {
            noise::of_profile(&profile.common_mode, frames.len(), frames.interval_s())
        });
        let mut state = model.begin(coarse, frames)?;
        let mut used = Freedom::default();
        let mut round = 0;
        loop {
            let until = if round == ROUNDS { FINE } else { ROUGH };
            model.search((frames, &noise), &mut state, (FINE_STEPS, until))?;
            let solution = model.solution(&state, &noise);
            let uncertainty = Uncertainty::of(&solution, &noise, &used, known.is_some());
            if round == ROUNDS {
                return Ok(Self {
                    solution,
                    noise,
                    left_over: state.raw,
                    uncertainty,
                });
            }
            used = uncertainty.used;
            model.stride_as_found(&mut state, (frames, &noise))?;
            noise = Noise::of(&Parts::of(&state.raw, frames.len()), &used, known.clone());
            round += 1;
            if round == ROUNDS {
                // As wide as matters: two standard uncertainties.
                let mut halves = vec![0.0; state.point.len()];
                for (number, &place) in uncertainty.told.iter().enumerate() {
                    halves[place] = 2.0 * uncertainty.covariance[number][number].sqrt();
                }
                model.refine(&mut state, frames, &halves)?;
            }
        }
    }
}
