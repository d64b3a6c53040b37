//! The search: from several starts on few frames, then on all, weighted by the residuals.

use crate::calibrate::frames::Frames;
use crate::calibrate::model::Model;
use crate::calibrate::noise::{self, Freedom, Noise, Parts};
use crate::calibrate::solver::{Solution, Until};
use crate::calibrate::types::{CalibrateError, Options, STARTS_MAX};
use crate::calibrate::uncertainty::Uncertainty;
use rand_chacha::ChaCha12Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};

const COARSE_FRAMES: usize = 24;
const COARSE_STEPS: usize = 12;
const FINE_STEPS: usize = 40;
/// How often the noise is measured again on the residuals of the best fit.
const ROUNDS: usize = 3;
/// Each start ends where a step would gain less than these.
const COARSE: Until = Until {
    gain: 0.05,
    share: 1e-3,
};
/// What a thirtieth of a standard uncertainty in one direction costs.
const FINE: Until = Until {
    gain: 5e-4,
    share: 0.0,
};
/// Starts within this share of the best cost, and some steps' gain, reached the same end.
const SAME_COST: f64 = 0.01;
const SAME_GAIN: f64 = 0.2;

pub(crate) fn steps_in_frames(frames: &Frames, options: &Options) -> usize {
    let few = frames.len().min(COARSE_FRAMES);
    starts(options) * COARSE_STEPS * few + (ROUNDS + 1) * FINE_STEPS * frames.len()
}

pub(crate) fn starts(options: &Options) -> usize {
    options.starts.clamp(1, STARTS_MAX)
}

/// The best end from several starts on few frames; the number of starts, and of those that reached it.
pub(crate) fn from_several_starts(
    model: &mut Model<'_>,
    frames: &Frames,
    options: &Options,
) -> Result<(Vec<f64>, [usize; 2]), CalibrateError> {
    let few = frames.fewer(COARSE_FRAMES);
    let noise = Noise::first(few.len());
    let mut generator = ChaCha12Rng::seed_from_u64(options.seed);
    let starts = starts(options);
    let mut ends: Vec<(f64, Vec<f64>)> = Vec::with_capacity(starts);
    for number in 0..starts {
        let mut start = model.start();
        if number > 0 {
            start.fill_with(|| draw(&mut generator));
        }
        let mut state = model.begin(&start, &few)?;
        let cost = model.search((&few, &noise), &mut state, (COARSE_STEPS, COARSE))?;
        ends.push((cost, state.point));
    }
    ends.sort_by(|(one, _), (other, _)| one.total_cmp(other));
    let least = ends.first().map_or(f64::INFINITY, |(cost, _)| *cost);
    let is_same = |(cost, _): &&(f64, _)| *cost <= least * (1.0 + SAME_COST) + SAME_GAIN;
    let same = ends.iter().filter(is_same).count();
    let best = ends.into_iter().next();
    let point = best.map_or_else(|| model.start(), |(_, point)| point);
    Ok((point, [starts, same]))
}

fn draw(generator: &mut ChaCha12Rng) -> f64 {
    f64::from(generator.next_u32()) / 4_294_967_296.0
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
        coarse: &[f64],
        options: &Options,
    ) -> Result<Self, CalibrateError> {
        let known = options.profile.as_ref().map(|profile| {
            noise::of_profile(&profile.common_mode, frames.len(), frames.interval_s())
        });
        let mut noise = Noise::first(frames.len());
        let mut state = model.begin(coarse, frames)?;
        let mut used = Freedom::default();
        let mut round = 0;
        loop {
            if round == ROUNDS {
                model.refine(&mut state, frames)?;
            }
            model.search((frames, &noise), &mut state, (FINE_STEPS, FINE))?;
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
            noise = Noise::of(&Parts::of(&state.raw, frames.len()), &used, known.clone());
            round += 1;
        }
    }
}
