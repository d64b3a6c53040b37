//! Shared arithmetic: means, medians, quantiles, variances, sums in a fixed order, the normal distribution.

/// A count of pixels, frames or pairs as a float.
#[expect(
    clippy::as_conversions,
    clippy::cast_precision_loss,
    reason = "counts of pixels and frames stay far below 2^53, where every integer is exact"
)]
pub(crate) const fn count(number: usize) -> f64 {
    number as f64
}

/// [`count`] for `u64`.
#[expect(
    clippy::as_conversions,
    clippy::cast_precision_loss,
    reason = "counts of frames and nanoseconds, far below 2^53"
)]
pub(crate) const fn long_count(number: u64) -> f64 {
    number as f64
}

/// The nearest single-precision number, for images and their templates.
#[expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    reason = "the nearest single-precision number is meant"
)]
pub(crate) const fn single(number: f64) -> f32 {
    number as f32
}

/// The whole number toward 0; beyond the range of `i32` its end.
#[expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    reason = "the conversion saturates"
)]
pub(crate) const fn whole(number: f64) -> i32 {
    number as i32
}

/// [`whole`] as an index, at least 0.
pub(crate) fn index(number: f64) -> usize {
    usize::try_from(whole(number)).unwrap_or(0)
}

pub(crate) fn mean(values: &[f64]) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    finite(sum_of(values, values, |x, _| x) / count(values.len()))
}

/// Mean of the squares; 0 if empty.
pub(crate) fn mean_square(values: &[f64]) -> f64 {
    let squares: f64 = values.iter().map(|value| value * value).sum();
    squares / count(values.len().max(1))
}

/// Mean of each pixel over the frames; empty without frames.
pub(crate) fn mean_frame<F: AsRef<[f64]>>(frames: impl IntoIterator<Item = F>) -> Vec<f64> {
    let (mut sums, mut number) = (Vec::new(), 0);
    for frame in frames {
        let frame = frame.as_ref();
        sums.resize(frame.len(), 0.0);
        sums.iter_mut()
            .zip(frame)
            .for_each(|(sum, value)| *sum += value);
        number += 1;
    }
    sums.into_iter().map(|sum| sum / count(number)).collect()
}

/// The median (mean of the middle two for an even number); `None` if empty.
pub(crate) fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let upper = *sorted.get(sorted.len() / 2)?;
    let lower = *sorted.get((sorted.len().checked_sub(1)?) / 2)?;
    Some(f64::midpoint(lower, upper))
}

/// Nearest-rank percentile of sorted values.
pub(crate) fn percentile(sorted: &[f64], percent: usize) -> Option<f64> {
    let rank = (sorted.len() * percent).div_ceil(100).saturating_sub(1);
    sorted.get(rank).copied()
}

/// Mean without the `cut` smallest and largest (the median if fewer would remain), in order of size; 0 if empty.
pub(crate) fn trimmed_mean(values: &mut [f64], cut: usize) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let cut = cut.min(values.len().saturating_sub(1) / 2);
    let middle = &values[cut..values.len() - cut];
    if middle.is_empty() {
        return 0.0;
    }
    middle.iter().sum::<f64>() / count(middle.len())
}

/// How much warmer a frame is than a reference as a whole: mean of the middle half of the differences, which a body
/// hardly moves.
pub(crate) fn common_offset(frame: &[f64], reference: &[f64]) -> f64 {
    let mut differences: Vec<f64> = differences(reference, frame).collect();
    let quarter = differences.len() / 4;
    trimmed_mean(&mut differences, quarter)
}

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct RunningVariance {
    pub(crate) count: u64,
    pub(crate) mean: f64,
    squares: f64,
}

impl RunningVariance {
    pub(crate) fn push(&mut self, value: f64) {
        self.count += 1;
        let off = value - self.mean;
        self.mean += off / long_count(self.count);
        self.squares += off * (value - self.mean);
    }

    /// Sample variance (n - 1); 0 for fewer than two values.
    pub(crate) fn variance(&self) -> f64 {
        if self.count < 2 {
            return 0.0;
        }
        self.squares / long_count(self.count - 1)
    }
}

/// Greatest common divisor of the differences to the first value; 0 until two values differ.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct CommonStep {
    first: Option<i16>,
    pub(crate) step: u16,
}

impl CommonStep {
    pub(crate) fn push(&mut self, steps: i16) {
        let first = *self.first.get_or_insert(steps);
        self.step = greatest_common_divisor(self.step, steps.abs_diff(first));
    }
}

/// Up to `number` of `total` indices, evenly spread, including first and last.
pub(crate) fn evenly(total: usize, number: usize) -> Vec<usize> {
    if number >= total {
        return (0..total).collect();
    }
    if number < 2 {
        return (0..number).collect();
    }
    (0..number)
        .map(|index| index * (total - 1) / (number - 1))
        .collect()
}

/// Linear interpolation between sorted knots, constant beyond the ends; 0 without knots.
pub(crate) fn interpolated(knots: &[(f64, f64)], place: f64) -> f64 {
    let next = knots.partition_point(|(knot, _)| *knot <= place);
    let before = next.checked_sub(1).and_then(|before| knots.get(before));
    match (before, knots.get(next)) {
        (Some((left_place, left)), Some((right_place, right))) if right_place > left_place => {
            left + (place - left_place) / (right_place - left_place) * (right - left)
        }
        (Some((_, value)), _) | (None, Some((_, value))) => *value,
        (None, None) => 0.0,
    }
}

/// For each knot, the mean of the knots within half a window of it.
pub(crate) fn windowed_mean(knots: &[(f64, f64)], window: f64) -> Vec<(f64, f64)> {
    let mean = |&(place, _): &(f64, f64)| {
        let from = knots.partition_point(|knot| knot.0 < place - window / 2.0);
        let until = knots.partition_point(|knot| knot.0 <= place + window / 2.0);
        let sum: f64 = knots[from..until].iter().map(|knot| knot.1).sum();
        (place, sum / count(until - from))
    };
    knots.iter().map(mean).collect()
}

/// Compass search for the largest value: moves to the best neighbor, halves the step if none is better, stops below
/// `last`.
pub(crate) fn climb<T: Copy, I: IntoIterator<Item = T>>(
    start: T,
    (mut step, last): (f64, f64),
    value: impl Fn(&T) -> f64,
    neighbors: impl Fn(&T, f64) -> I,
) -> (f64, T) {
    let mut best = (value(&start), start);
    while step >= last {
        let better = neighbors(&best.1, step)
            .into_iter()
            .map(|place| (value(&place), place))
            .max_by(|left, right| left.0.total_cmp(&right.0))
            .filter(|(other, _)| *other > best.0);
        match better {
            Some(better) => best = better,
            None => step /= 2.0,
        }
    }
    best
}

/// If one is 0, the other.
const fn greatest_common_divisor(mut left: u16, mut right: u16) -> u16 {
    while right != 0 {
        (left, right) = (right, left % right);
    }
    left
}

/// The share of normal draws above `z`.
pub(crate) fn normal_tail(z: f64) -> f64 {
    0.5 * libm::erfc(z * std::f64::consts::FRAC_1_SQRT_2)
}

pub(crate) fn comparable(real: &[f64], simulated: &[f64]) -> Option<()> {
    let defined = !real.is_empty()
        && real.len() == simulated.len()
        && all_finite(real)
        && all_finite(simulated);
    defined.then_some(())
}

// No early exit, so that the compiler can vectorize it.
pub(crate) fn all_finite(frame: &[f64]) -> bool {
    frame
        .iter()
        .fold(true, |all, value| all & value.is_finite())
}

/// The least and the largest value; infinite without values.
pub(crate) fn extremes(frame: &[f64]) -> (f64, f64) {
    let ends = (f64::INFINITY, f64::NEG_INFINITY);
    let values = frame.iter();
    values.fold(ends, |(low, high), &value| {
        (low.min(value), high.max(value))
    })
}

const LANES: usize = 8;

/// Sum of a function of both values over all pixels, added in the same order on every machine.
pub(crate) fn sum_of(x: &[f64], y: &[f64], term: impl Fn(f64, f64) -> f64) -> f64 {
    let whole = x.len().min(y.len()) / LANES * LANES;
    let mut lanes = [0.0; LANES];
    let chunks = x[..whole].chunks_exact(LANES);
    for (x, y) in chunks.zip(y[..whole].chunks_exact(LANES)) {
        for lane in 0..LANES {
            lanes[lane] += term(x[lane], y[lane]);
        }
    }
    let rest = x[whole..].iter().zip(&y[whole..]);
    let rest: f64 = rest.map(|(x, y)| term(*x, *y)).sum();
    let [a, b, c, d, e, f, g, h] = lanes;
    ((a + b) + (c + d)) + ((e + f) + (g + h)) + rest
}

pub(crate) fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

pub(crate) fn is_constant(frame: &[f64]) -> bool {
    frame
        .iter()
        .skip(1)
        .fold(true, |all, &value| all & (value == frame[0]))
}

pub(crate) fn differences(real: &[f64], simulated: &[f64]) -> impl Iterator<Item = f64> {
    real.iter().zip(simulated).map(|(x, y)| y - x)
}

/// Fails unless `found` is within `tolerance` of `expected`.
#[cfg(test)]
#[track_caller]
pub(crate) fn assert_near(found: f64, expected: f64, tolerance: f64) {
    let is_near = (found - expected).abs() < tolerance;
    assert!(is_near, "{found}, not {expected}");
}

/// Standard normal draws, the same for the same seed.
#[cfg(test)]
pub(crate) fn normal_draws(seed: u64) -> impl FnMut() -> f64 {
    use rand::SeedableRng as _;
    let mut generator = rand_chacha::ChaCha12Rng::seed_from_u64(seed);
    move || rand_distr::Distribution::sample(&rand_distr::StandardNormal, &mut generator)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_and_means_of_the_middle() {
        assert_eq!(median(&[]), None);
        assert_eq!(median(&[3.0]), Some(3.0));
        assert_eq!(median(&[4.0, 1.0, 3.0, 2.0]), Some(2.5));
        assert_eq!(median(&[9.0, 1.0, 2.0]), Some(2.0));
        let mut values = [100.0, 1.0, 2.0, 4.0, -50.0];
        assert_eq!(trimmed_mean(&mut values, 1), 7.0 / 3.0);
        assert_eq!(trimmed_mean(&mut [4.0, 1.0, 2.0, 3.0], 9), 2.5);
        assert_eq!(trimmed_mean(&mut [], 1), 0.0);
    }

    #[test]
    fn variance_of_known_values() {
        let values = [2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0];
        let mut running = RunningVariance::default();
        for value in values {
            running.push(value);
        }
        assert_eq!(running.mean, 5.0);
        assert!((running.variance() - 32.0 / 7.0).abs() < 1e-12);
    }

    #[test]
    fn even_choice_keeps_both_ends() {
        assert_eq!(evenly(10, 3), [0, 4, 9]);
        assert_eq!(evenly(3, 10), [0, 1, 2]);
        assert_eq!(evenly(5, 5), [0, 1, 2, 3, 4]);
        assert_eq!(evenly(5, 1), [0]);
        assert_eq!(evenly(5, 0), Vec::<usize>::new());
        assert_eq!(evenly(0, 4), Vec::<usize>::new());
    }

    #[test]
    fn offset_is_blind_to_a_warm_body_and_finer_than_a_step() {
        let warm = |index| if index % 4 == 0 { 20.25 } else { 20.0 };
        let mut frame: [f64; 64] = std::array::from_fn(warm);
        assert!((common_offset(&frame, &[20.0; 64]) - 0.0).abs() < 0.13);
        frame[10..22].fill(30.0);
        assert!((common_offset(&frame, &[20.0; 64]) - 0.0625).abs() < 0.07);
        assert_eq!(common_offset(&[21.5], &[20.0]), 1.5);
        assert_eq!(common_offset(&[], &[]), 0.0);
    }

    /// From the standard table.
    #[test]
    fn tails_are_the_tables() {
        assert_near(normal_tail(0.0), 0.5, 1e-6);
        assert_near(normal_tail(1.644_854), 0.05, 1e-6);
        assert_near(normal_tail(3.090_232), 0.001, 1e-6);
    }

    #[test]
    fn the_common_divisor_is_euclids() {
        assert_eq!(greatest_common_divisor(0, 12), 12);
        assert_eq!(greatest_common_divisor(12, 18), 6);
        assert_eq!(greatest_common_divisor(7, 0), 7);
        assert_eq!(greatest_common_divisor(7, 4), 1);
    }

    /// 1, -2, 3 … 11: squares sum to 506, values to 6. Eleven do not fill whole lanes.
    #[test]
    fn sums_include_a_partial_chunk() {
        let x = [20.0; 11];
        let y: [f64; 11] = std::array::from_fn(|index| {
            let number = count(index + 1);
            20.0 + if index % 2 == 0 { number } else { -number }
        });
        assert_eq!(sum_of(&x, &y, |x, y| (y - x) * (y - x)), 506.0);
        assert_eq!(sum_of(&x, &y, |x, y| y - x), 6.0);
        assert_eq!(extremes(&y), (10.0, 31.0));
        assert_eq!(extremes(&y[..2]), (18.0, 21.0));
    }
}
