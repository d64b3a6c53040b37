//! Least squares within bounds, after Levenberg and Marquardt (Marquardt 1963, SIAM J. Appl. Math. 11:431), with priors.
//!
//! Derivatives cost one simulation of all frames each. So they are one-sided, kept between steps and corrected by what a
//! step showed (Broyden 1965, Math. Comp. 19:577); taken again only where they mislead; and kept before weighting, so
//! that other weights need none.

use crate::linear::{self, Matrix, dot, zeros};
use crate::numbers::differences;
use grideye_scene::uncertain::Normal;

/// Where a search stands.
#[derive(Debug, Clone)]
pub(crate) struct State {
    pub(crate) point: Vec<f64>,
    /// Residuals before weighting.
    pub(crate) raw: Vec<f64>,
    /// Derivatives of the residuals before weighting, one column per coordinate.
    slopes: Vec<Vec<f64>>,
    /// Whether the derivatives are those of this point.
    is_fresh: bool,
    /// The width of differences.
    step: f64,
}

/// What a search minimizes: the squares of the weighted residuals and of the distances from the priors.
pub(crate) struct Weights<'a> {
    pub(crate) whiten: &'a dyn Fn(&[f64]) -> Vec<f64>,
    /// A normal law for each coordinate that has one.
    pub(crate) priors: &'a [Option<Normal>],
}

/// A search ends when another step promises less than `gain` of the cost (half of chi-squared), or this `share` of it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Until {
    pub(crate) gain: f64,
    pub(crate) share: f64,
    /// Whether it must be the derivatives at the very end that promise so little.
    pub(crate) is_sure: bool,
    /// Whether the way is long, and derivatives are taken at each step.
    pub(crate) is_far: bool,
}

#[derive(Debug, Clone)]
pub(crate) struct Solution {
    pub(crate) point: Vec<f64>,
    /// Weighted.
    pub(crate) residuals: Vec<f64>,
    /// Derivatives of the weighted residuals, one column per coordinate.
    pub(crate) jacobian: Vec<Vec<f64>>,
    /// One over the variance of each prior; 0 without one.
    pub(crate) precisions: Vec<f64>,
}

/// The least width of differences, as a share of the range between the bounds.
pub(crate) const STEP: f64 = 1e-4;
const DAMPING_START: f64 = 1e-3;
const DAMPING_MAX: f64 = 1e10;
/// A step that gains less than this share of what the derivatives promised has derivatives taken again.
const PROMISE_MIN: f64 = 0.5;
/// With derivatives of an earlier point, a step that gains more than this needs less damping; with fresh ones any does.
const PROMISE_KEPT: f64 = 0.75;

impl State {
    pub(crate) fn new<E>(
        raw_at: &mut impl FnMut(&[f64]) -> Result<Vec<f64>, E>,
        (point, step): (&[f64], f64),
    ) -> Result<Self, E> {
        let mut state = Self {
            point: point.to_vec(),
            raw: raw_at(point)?,
            slopes: Vec::new(),
            is_fresh: false,
            step,
        };
        state.refresh(raw_at)?;
        Ok(state)
    }

    /// One-sided differences, away from the nearer bound.
    fn refresh<E>(
        &mut self,
        raw_at: &mut impl FnMut(&[f64]) -> Result<Vec<f64>, E>,
    ) -> Result<(), E> {
        let mut beside = self.point.clone();
        self.slopes.clear();
        for (place, &here) in self.point.iter().enumerate() {
            beside[place] = if here > 0.5 {
                here - self.step
            } else {
                here + self.step
            };
            let mut column = raw_at(&beside)?;
            for (value, raw) in column.iter_mut().zip(&self.raw) {
                *value = (*value - raw) / (beside[place] - here);
            }
            beside[place] = here;
            self.slopes.push(column);
        }
        self.is_fresh = true;
        Ok(())
    }

    /// Central differences, this wide to either side, if a search's are as wide; one-sided at a bound.
    pub(crate) fn refine<E>(
        &mut self,
        halves: &[f64],
        raw_at: &mut impl FnMut(&[f64]) -> Result<Vec<f64>, E>,
    ) -> Result<(), E> {
        let mut beside = self.point.clone();
        for (place, column) in self.slopes.iter_mut().enumerate() {
            let here = self.point[place];
            let half = halves[place].clamp(STEP, self.step);
            let (low, high) = ((here - half).max(0.0), (here + half).min(1.0));
            beside[place] = high;
            *column = raw_at(&beside)?;
            beside[place] = low;
            let below = raw_at(&beside)?;
            beside[place] = here;
            for (value, below) in column.iter_mut().zip(below) {
                *value = (*value - below) / (high - low);
            }
        }
        self.is_fresh = true;
        Ok(())
    }

    fn go(&mut self, next: Vec<f64>, raw: Vec<f64>) {
        let way: Vec<f64> = differences(&self.point, &next).collect();
        let square = dot(&way, &way);
        let mut missed: Vec<f64> = differences(&self.raw, &raw).collect();
        for (column, step) in self.slopes.iter().zip(&way) {
            missed
                .iter_mut()
                .zip(column)
                .for_each(|(missed, slope)| *missed -= slope * step);
        }
        for (column, step) in self.slopes.iter_mut().zip(&way) {
            let share = step / square;
            column
                .iter_mut()
                .zip(&missed)
                .for_each(|(slope, missed)| *slope += share * missed);
        }
        (self.point, self.raw, self.is_fresh) = (next, raw, false);
    }
}

impl Weights<'_> {
    pub(crate) fn solution(&self, state: &State) -> Solution {
        let precision = |law: &Option<Normal>| law.map_or(0.0, |law| 1.0 / (law.sd * law.sd));
        Solution {
            point: state.point.clone(),
            residuals: (self.whiten)(&state.raw),
            jacobian: state
                .slopes
                .iter()
                .map(|column| (self.whiten)(column))
                .collect(),
            precisions: self.priors.iter().map(precision).collect(),
        }
    }

    fn pulls<'p>(&'p self, point: &'p [f64]) -> impl Iterator<Item = f64> + 'p {
        let pull = |(law, value): (&Option<Normal>, &f64)| {
            law.map_or(0.0, |law| (value - law.mean) / law.sd)
        };
        self.priors.iter().zip(point).map(pull)
    }

    /// Half the sum of squares at a point with these residuals.
    pub(crate) fn cost(&self, point: &[f64], raw: &[f64]) -> f64 {
        let residuals = (self.whiten)(raw);
        let pulls = self.pulls(point).map(|pull| pull * pull);
        0.5 * (dot(&residuals, &residuals) + pulls.sum::<f64>())
    }

    fn equations(&self, state: &State) -> (Matrix, Vec<f64>) {
        let solution = self.solution(state);
        let (mut normal, mut gradient) = normal_equations(&solution.jacobian, &solution.residuals);
        for (place, pull) in self.pulls(&state.point).enumerate() {
            normal[place][place] += solution.precisions[place];
            gradient[place] += pull * solution.precisions[place].sqrt();
        }
        (normal, gradient)
    }
}

pub(crate) fn search<E>(
    raw_at: &mut impl FnMut(&[f64]) -> Result<Vec<f64>, E>,
    mut stepped: impl FnMut(),
    weights: &Weights<'_>,
    state: &mut State,
    (steps_max, until): (usize, Until),
) -> Result<f64, E> {
    let mut damping = DAMPING_START;
    let mut cost = weights.cost(&state.point, &state.raw);
    let (mut normal, mut gradient) = weights.equations(state);
    let mut steps = 0;
    while steps < steps_max && damping < DAMPING_MAX {
        let next = damped_step(&normal, &gradient, &state.point, damping);
        let way: Vec<f64> = differences(&state.point, &next).collect();
        let bent: f64 = normal
            .iter()
            .zip(&way)
            .map(|(row, step)| step * dot(row, &way))
            .sum();
        let promised = -dot(&gradient, &way) - 0.5 * bent;
        let is_enough = promised <= until.gain.max(until.share * cost);
        if is_enough && (state.is_fresh || !until.is_sure) {
            break;
        }
        let (mut share, mut is_kept) = (0.0, false);
        if !is_enough {
            let raw = raw_at(&next)?;
            let tried = weights.cost(&next, &raw);
            share = (cost - tried) / promised;
            if share > 0.0 {
                is_kept = state.is_fresh || share > PROMISE_KEPT;
                cost = tried;
                state.go(next, raw);
                steps += 1;
                stepped();
            } else if state.is_fresh {
                damping *= 10.0;
                continue;
            }
        }
        if is_kept {
            damping = (damping / 10.0).max(1e-12);
        }
        if until.is_far || share < PROMISE_MIN {
            state.refresh(raw_at)?;
        }
        (normal, gradient) = weights.equations(state);
    }
    Ok(cost)
}

pub(crate) fn normal_equations(jacobian: &[Vec<f64>], residuals: &[f64]) -> (Matrix, Vec<f64>) {
    let size = jacobian.len();
    let mut normal = zeros(size);
    for row in 0..size {
        for column in 0..=row {
            let entry = dot(&jacobian[row], &jacobian[column]);
            normal[row][column] = entry;
            normal[column][row] = entry;
        }
    }
    let gradient = jacobian.iter().map(|column| dot(column, residuals));
    (normal, gradient.collect())
}

/// The next point: a damped step of the unknowns that are not pressed against a bound, clamped to the bounds.
fn damped_step(normal: &Matrix, gradient: &[f64], point: &[f64], damping: f64) -> Vec<f64> {
    let free: Vec<usize> = (0..point.len())
        .filter(|&place| {
            let pressed_low = point[place] <= 0.0 && gradient[place] > 0.0;
            let pressed_high = point[place] >= 1.0 && gradient[place] < 0.0;
            !(pressed_low || pressed_high)
        })
        .collect();
    let sizes = free.iter().map(|&place| normal[place][place]);
    let largest = sizes.fold(0.0, f64::max);
    let mut next = point.to_vec();
    if largest <= 0.0 {
        return next;
    }
    let mut damped = zeros(free.len());
    for (row, &from) in free.iter().enumerate() {
        for (column, &to) in free.iter().enumerate() {
            damped[row][column] = normal[from][to];
        }
        // An unknown without effect stays put instead of making the matrix singular.
        damped[row][row] += damping * normal[from][from].max(1e-9 * largest);
    }
    let Some(lower) = linear::cholesky(&damped) else {
        return next;
    };
    let downhill: Vec<f64> = free.iter().map(|&place| -gradient[place]).collect();
    for (place, step) in free.into_iter().zip(linear::solve(&lower, &downhill)) {
        next[place] = (point[place] + step).clamp(0.0, 1.0);
    }
    next
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    /// The end of a search without weights or priors.
    fn end(raw_at: impl Fn(&[f64]) -> Vec<f64>, start: &[f64]) -> (Vec<f64>, f64) {
        let mut raw_at = |point: &[f64]| Ok::<_, Infallible>(raw_at(point));
        let none = vec![None; start.len()];
        let weights = Weights {
            whiten: &|raw: &[f64]| raw.to_vec(),
            priors: &none,
        };
        let until = Until {
            gain: 1e-20,
            share: 0.0,
            is_sure: true,
            is_far: false,
        };
        let mut state = State::new(&mut raw_at, (start, STEP)).unwrap();
        let cost = search(&mut raw_at, || (), &weights, &mut state, (100, until)).unwrap();
        (state.point, cost)
    }

    /// Rosenbrock's valley with its minimum at (1, 1), in [-2, 2] each.
    #[test]
    fn the_bottom_of_a_bent_valley_is_found() {
        let valley = |point: &[f64]| {
            let [x, y] = [4.0 * point[0] - 2.0, 4.0 * point[1] - 2.0];
            vec![10.0 * (y - x * x), 1.0 - x]
        };
        let (point, cost) = end(valley, &[0.2, 0.75]);
        assert!(cost < 1e-16, "{point:?}: {cost}");
        assert!(point.iter().all(|x| (x - 0.75).abs() < 1e-8), "{point:?}");
    }

    /// A line whose best numbers lie beyond the bounds.
    #[test]
    fn a_bound_holds_and_the_other_unknown_makes_the_best_of_it() {
        let line = |point: &[f64]| {
            let places = (0..5_u8).map(f64::from);
            let left = places.map(|at| point[0] + point[1] * at - 1.5 - 0.25 * at);
            left.collect()
        };
        let (point, _) = end(line, &[0.3, 0.9]);
        assert_eq!(point[0], 1.0);
        // With 1 + b t for 1.5 + t/4: b = Σ t (0.5 + t/4) / Σ t² = (5 + 7.5) / 30.
        assert!((point[1] - 12.5 / 30.0).abs() < 1e-6, "{point:?}");
    }

    /// Of a mean of four equal residuals and a prior, each counts by its precision: (4 · 0.2 + 25 · 0.6) / 29.
    #[test]
    fn a_prior_pulls_by_its_precision() {
        let mut raw_at = |point: &[f64]| Ok::<_, Infallible>(vec![point[0] - 0.2; 4]);
        let law = Normal { mean: 0.6, sd: 0.2 };
        let weights = Weights {
            whiten: &|raw: &[f64]| raw.to_vec(),
            priors: &[Some(law)],
        };
        let until = Until {
            gain: 1e-20,
            share: 0.0,
            is_sure: true,
            is_far: false,
        };
        let mut state = State::new(&mut raw_at, (&[0.9], STEP)).unwrap();
        search(&mut raw_at, || (), &weights, &mut state, (20, until)).unwrap();
        assert!((state.point[0] - 15.8 / 29.0).abs() < 1e-9, "{state:?}");
    }
}
