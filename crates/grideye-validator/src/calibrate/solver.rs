//! Least squares within bounds, after Levenberg and Marquardt (Marquardt 1963, SIAM J. Appl. Math. 11:431).

use crate::calibrate::linear::{self, Matrix, dot, zeros};

#[derive(Debug, Clone)]
pub(crate) struct Solution {
    pub(crate) point: Vec<f64>,
    pub(crate) residuals: Vec<f64>,
    /// Half the sum of squared residuals.
    pub(crate) cost: f64,
    /// Derivatives of the residuals, one column per coordinate.
    pub(crate) jacobian: Vec<Vec<f64>>,
}

/// Half the width of the central differences, as a share of the range between the bounds.
const STEP: f64 = 1e-4;
const DAMPING_START: f64 = 1e-3;
const DAMPING_MAX: f64 = 1e10;
/// The search ends with a step that gains less than this share of the cost, or moves less than [`MOVE_MIN`].
const GAIN_MIN: f64 = 1e-9;
const MOVE_MIN: f64 = 1e-7;

pub(crate) fn solve<E>(
    mut residuals_at: impl FnMut(&[f64]) -> Result<Vec<f64>, E>,
    mut stepped: impl FnMut(),
    start: &[f64],
    steps_max: usize,
) -> Result<Solution, E> {
    let mut point = start.to_vec();
    let mut residuals = residuals_at(&point)?;
    let mut cost = half_square(&residuals);
    let mut damping = DAMPING_START;
    let mut jacobian = differences(&mut residuals_at, &point)?;
    for _ in 0..steps_max {
        let (normal, gradient) = normal_equations(&jacobian, &residuals);
        let mut moved = None;
        while damping < DAMPING_MAX {
            let next = damped_step(&normal, &gradient, &point, damping);
            let tried = residuals_at(&next)?;
            let tried_cost = half_square(&tried);
            if tried_cost < cost {
                damping = (damping / 10.0).max(1e-12);
                moved = Some((next, tried, tried_cost));
                break;
            }
            damping *= 10.0;
        }
        let Some((next, tried, tried_cost)) = moved else {
            break;
        };
        let gain = (cost - tried_cost) / cost;
        let ways = next
            .iter()
            .zip(&point)
            .map(|(next, now)| (next - now).abs());
        let way = ways.fold(0.0, f64::max);
        (point, residuals, cost) = (next, tried, tried_cost);
        jacobian = differences(&mut residuals_at, &point)?;
        stepped();
        if gain < GAIN_MIN || way < MOVE_MIN {
            break;
        }
    }
    Ok(Solution {
        point,
        residuals,
        cost,
        jacobian,
    })
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

fn half_square(residuals: &[f64]) -> f64 {
    0.5 * dot(residuals, residuals)
}

/// Central differences; one-sided at a bound.
fn differences<E>(
    residuals_at: &mut impl FnMut(&[f64]) -> Result<Vec<f64>, E>,
    point: &[f64],
) -> Result<Vec<Vec<f64>>, E> {
    let mut columns = Vec::with_capacity(point.len());
    let mut beside = point.to_vec();
    for place in 0..point.len() {
        let low = (point[place] - STEP).max(0.0);
        let high = (point[place] + STEP).min(1.0);
        beside[place] = high;
        let mut column = residuals_at(&beside)?;
        beside[place] = low;
        let below = residuals_at(&beside)?;
        beside[place] = point[place];
        for (value, below) in column.iter_mut().zip(below) {
            *value = (*value - below) / (high - low);
        }
        columns.push(column);
    }
    Ok(columns)
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

    /// Rosenbrock's valley with its minimum at (1, 1), in [-2, 2] each.
    #[test]
    fn the_bottom_of_a_bent_valley_is_found() {
        let valley = |point: &[f64]| {
            let [x, y] = [4.0 * point[0] - 2.0, 4.0 * point[1] - 2.0];
            Ok::<_, Infallible>(vec![10.0 * (y - x * x), 1.0 - x])
        };
        let end = solve(valley, || (), &[0.2, 0.75], 100).unwrap();
        assert!(end.cost < 1e-16, "{end:?}");
        assert!(end.point.iter().all(|x| (x - 0.75).abs() < 1e-8), "{end:?}");
    }

    /// A line whose best numbers lie beyond the bounds.
    #[test]
    fn a_bound_holds_and_the_other_unknown_makes_the_best_of_it() {
        let line = |point: &[f64]| {
            let places = (0..5_u8).map(f64::from);
            let left = places.map(|at| point[0] + point[1] * at - 1.5 - 0.25 * at);
            Ok::<_, Infallible>(left.collect())
        };
        let end = solve(line, || (), &[0.3, 0.9], 100).unwrap();
        assert_eq!(end.point[0], 1.0);
        // With 1 + b t for 1.5 + t/4: b = Σ t (0.5 + t/4) / Σ t² = (5 + 7.5) / 30.
        assert!((end.point[1] - 12.5 / 30.0).abs() < 1e-6, "{end:?}");
    }
}
