//! Searches for the best delay and clock rate within the bounds: a grid, then a compass search from its best places.

use crate::align::clock::{Bounds, Clock};
use crate::align::series::{Fit, Sample, Series};
use crate::numbers::{climb, count, index};

/// Step of the grid's shifts, seconds: a walker's image still resembles that of the next moment.
const SHIFT_STEP_S: f64 = 0.1;
/// Step of the grid's rates, as seconds between first and last frame.
const RATE_STEP_S: f64 = 0.3;
/// Frames for the grid search, if the grid is small.
const GRID_FRAMES: usize = 256;
const GRID_FRAMES_MIN: usize = 48;
/// From this many places on, the grid search uses fewer frames.
const GRID_PLACES: usize = 20_000;
const STARTS: usize = 5;
const SHIFT_LAST_S: f64 = 0.000_5;

pub(crate) fn best_clock(sample: &Sample, series: &Series, bounds: &Bounds) -> (Clock, Fit) {
    let grid = Grid::new(sample, bounds);
    let coarse = sample.thinned(grid.frames());
    let start = grid
        .best(&coarse, series, STARTS)
        .into_iter()
        .map(|(_, clock)| grid.downhill(&coarse, series, clock, SHIFT_LAST_S * 20.0))
        .max_by(|left, right| left.0.total_cmp(&right.0))
        .map_or(grid.center(), |(_, clock)| clock);
    let (_, clock) = grid.downhill(sample, series, start, SHIFT_LAST_S);
    (clock, sample.fit(series, |time_s| clock.scene_s(time_s)))
}

/// [`best_clock`] less finely: only the likeness.
pub(crate) fn rough_likeness(sample: &Sample, series: &Series, bounds: &Bounds) -> f64 {
    rough_clock(sample, series, bounds).0
}

fn rough_clock(sample: &Sample, series: &Series, bounds: &Bounds) -> (f64, Clock) {
    let grid = Grid::new(sample, bounds);
    let coarse = sample.thinned(grid.frames());
    let best = grid.best(&coarse, series, 1);
    let start = best.first().map_or(grid.center(), |(_, clock)| *clock);
    grid.downhill(&coarse, series, start, SHIFT_STEP_S / 4.0)
}

struct Grid {
    origin_s: f64,
    /// Half the recording's length. The shift at its middle hardly depends on the rate.
    half_s: f64,
    shift_max_s: f64,
    rate_max: f64,
    shifts: usize,
    rates: usize,
}

impl Grid {
    fn new(sample: &Sample, bounds: &Bounds) -> Self {
        let span_s = sample.span_s();
        let steps = |range: f64, step: f64| index((range / step).ceil().clamp(0.0, 10_000.0));
        Self {
            origin_s: bounds.origin_s,
            half_s: span_s / 2.0,
            shift_max_s: bounds.shift_max_s,
            rate_max: bounds.rate_max,
            shifts: steps(bounds.shift_max_s, SHIFT_STEP_S),
            rates: steps(bounds.rate_max * span_s, RATE_STEP_S),
        }
    }

    fn places(&self) -> usize {
        (2 * self.shifts + 1) * (2 * self.rates + 1)
    }

    fn frames(&self) -> usize {
        (GRID_FRAMES * GRID_PLACES / self.places().max(GRID_PLACES)).max(GRID_FRAMES_MIN)
    }

    fn center(&self) -> Clock {
        Clock::new(0.0, 0.0, self.origin_s)
    }

    fn clocks(&self) -> impl Iterator<Item = Clock> + '_ {
        let ends = |steps: usize, most: f64| {
            let step = most / count(steps.max(1));
            (0..=2 * steps).map(move |index| (count(index) - count(steps)) * step)
        };
        ends(self.rates, self.rate_max).flat_map(move |rate| {
            ends(self.shifts, self.shift_max_s)
                .map(move |shift_s| Clock::new(shift_s, rate, self.origin_s))
        })
    }

    fn best(&self, sample: &Sample, series: &Series, number: usize) -> Vec<(f64, Clock)> {
        let mut best: Vec<(f64, Clock)> = Vec::with_capacity(number + 1);
        for clock in self.clocks() {
            let likeness = sample.fit(series, |time_s| clock.scene_s(time_s)).likeness;
            let place = best.partition_point(|(other, _)| *other >= likeness);
            if place < number {
                best.insert(place, (likeness, clock));
                best.truncate(number);
            }
        }
        best
    }

    fn downhill(
        &self,
        sample: &Sample,
        series: &Series,
        start: Clock,
        last_s: f64,
    ) -> (f64, Clock) {
        let likeness = |clock: &Clock| sample.fit(series, |time_s| clock.scene_s(time_s)).likeness;
        let neighbors = |clock: &Clock, step_s| self.neighbors(*clock, step_s);
        climb(start, (SHIFT_STEP_S, last_s), likeness, neighbors)
    }

    /// Lines shifted as a whole or turned about the recording's middle.
    fn neighbors(&self, clock: Clock, step_s: f64) -> impl Iterator<Item = Clock> {
        let turn = if self.rate_max > 0.0 && self.half_s > 0.0 {
            step_s / self.half_s
        } else {
            0.0
        };
        let (shift_max_s, rate_max, half_s) = (self.shift_max_s, self.rate_max, self.half_s);
        [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)]
            .into_iter()
            .map(move |(shifted, turned): (f64, f64)| {
                let rate = (clock.rate + turned * turn).clamp(-rate_max, rate_max);
                let shift_s = clock.shift_s + shifted * step_s - (rate - clock.rate) * half_s;
                Clock {
                    shift_s: shift_s.clamp(-shift_max_s, shift_max_s),
                    rate,
                    ..clock
                }
            })
    }
}

/// Standard errors of shift (at the origin) and rate, with residuals taken as independent between frames.
pub(crate) fn standard_errors(
    sample: &Sample,
    series: &Series,
    clock: Clock,
    fit: &Fit,
) -> Option<(f64, f64)> {
    const NUDGE_S: f64 = 0.05;
    let (mut ones, mut cross, mut squares) = (0.0, 0.0, 0.0);
    for &time_s in &sample.times_s {
        let scene_s = clock.scene_s(time_s);
        let (before, after) = (series.at(scene_s - NUDGE_S), series.at(scene_s + NUDGE_S));
        let slope: f64 = before
            .iter()
            .zip(&after)
            .map(|(before, after)| ((after - before) / (2.0 * NUDGE_S) * fit.amplitude).powi(2))
            .sum();
        let since_s = time_s - clock.origin_s;
        ones += slope;
        cross += slope * since_s;
        squares += slope * since_s * since_s;
    }
    let determinant = ones * squares - cross * cross;
    let variance = fit.left_c2 / count(sample.frames.len() * grideye_frame::PIXELS);
    if determinant <= 0.0 {
        return None;
    }
    Some((
        (variance * squares / determinant).sqrt(),
        (variance * ones / determinant).sqrt(),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::types::Pixels;
    use crate::numbers::assert_near;
    use grideye_frame::PIXELS;

    fn bounds(shift_max_s: f64, rate_max: f64) -> Bounds {
        Bounds {
            origin_s: 2.0,
            shift_max_s,
            rate_max,
        }
    }

    fn grid(seconds: f64, shift_max_s: f64, rate_max: f64) -> Grid {
        let sample = Sample::new(vec![0.0, seconds], vec![[0.0; PIXELS]; 2]);
        Grid::new(&sample, &bounds(shift_max_s, rate_max))
    }

    /// Compares shifts and rates of clocks with their origin at 2 s.
    #[track_caller]
    fn is_near(found: impl Iterator<Item = Clock>, expected: &[(f64, f64)]) {
        let found: Vec<Clock> = found.collect();
        assert_eq!(found.len(), expected.len(), "{found:?}, not {expected:?}");
        for (clock, (shift_s, rate)) in found.into_iter().zip(expected) {
            assert_near(clock.shift_s, *shift_s, 1e-12);
            assert_near(clock.rate, *rate, 1e-12);
            assert_eq!(clock.origin_s, 2.0);
        }
    }

    #[test]
    fn a_line_is_shifted_and_turned_about_its_origin() {
        let clock = Clock::new(0.2, 0.01, 10.0);
        assert_near(clock.scene_s(10.0), 10.2, 1e-12);
        assert_near(clock.scene_s(30.0), 30.4, 1e-12);
    }

    /// By hand: 0.5 s in steps of 0.1 s; 6 % of a minute is 3.6 s, in steps of 0.3 s.
    #[test]
    fn the_grid_has_the_stated_places_and_frames() {
        let usual = grid(60.0, 0.5, 0.06);
        assert_eq!((usual.shifts, usual.rates), (5, 12));
        assert_eq!((usual.places(), usual.frames()), (11 * 25, 256));
        let wide = grid(60.0, 60.0, 0.06);
        assert_eq!((wide.places(), wide.frames()), (1_201 * 25, 170));
        assert_eq!(grid(60.0, 600.0, 0.06).frames(), 48);
        assert_eq!(usual.center(), Clock::new(0.0, 0.0, 2.0));
    }

    #[test]
    fn the_grid_reaches_both_bounds_and_nothing_beyond() {
        let along = |rate| [-0.2, -0.1, 0.0, 0.1, 0.2].map(|shift_s| (shift_s, rate));
        is_near(
            grid(10.0, 0.2, 0.03).clocks(),
            &[-0.03, 0.0, 0.03].map(along).concat(),
        );
        is_near(grid(10.0, 0.0, 0.0).clocks(), &[(0.0, 0.0)]);
    }

    /// Turning a minute's clock by 0.1 s at its ends changes the rate by 0.1 in 30 and the shift by 0.1 s the other way.
    #[test]
    fn neighbors_are_shifted_or_turned_about_the_middle_within_the_bounds() {
        let turn = 0.1 / 30.0;
        let free = [(0.1, 0.0), (-0.1, 0.0), (-0.1, turn), (0.1, -turn)];
        let corner = [(0.5, 0.06), (0.4, 0.06), (0.5, 0.06), (0.5, 0.06 - turn)];
        let timed = [(0.1, 0.0), (-0.1, 0.0), (0.0, 0.0), (0.0, 0.0)];
        for (rate_max, (shift_s, rate), expected) in [
            (0.06, (0.0, 0.0), free),
            (0.06, (0.5, 0.06), corner),
            (0.0, (0.0, 0.0), timed),
        ] {
            let clock = Clock::new(shift_s, rate, 2.0);
            is_near(grid(60.0, 0.5, rate_max).neighbors(clock, 0.1), &expected);
        }
    }

    /// Something warm that crosses the pixels, one per second.
    fn series(time_s: f64) -> Pixels {
        std::array::from_fn(|pixel| (-(time_s - count(pixel % 16) - 2.0).powi(2)).exp())
    }

    fn recorded_late(late_s: f64) -> (Sample, Series) {
        let recorded = (0..150).map(|index| 2.0 + count(index) * 0.1);
        let (recorded_s, recorded) = recorded
            .map(|time_s| (time_s, series(time_s + late_s)))
            .unzip();
        (
            Sample::new(recorded_s, recorded),
            Series::evenly(0.0, 20.0, series),
        )
    }

    /// Between two places of the grid: found to half a millisecond, roughly to a quarter of a step.
    #[test]
    fn a_delay_is_found_to_the_stated_precision() {
        let (sample, series) = recorded_late(0.137);
        let bounds = bounds(0.5, 0.0);
        let (clock, fit) = best_clock(&sample, &series, &bounds);
        assert!((clock.shift_s - 0.137).abs() <= 0.001, "{clock:?}");
        assert!(fit.likeness > 0.9999, "{fit:?}");
        let (likeness, rough) = rough_clock(&sample, &series, &bounds);
        assert!((rough.shift_s - 0.137).abs() <= 0.025, "{rough:?}");
        assert_eq!(likeness, rough_likeness(&sample, &series, &bounds));
        let best = Grid::new(&sample, &bounds).best(&sample, &series, 3);
        assert!(best[0].0 > best[1].0 && best[1].0 > best[2].0, "{best:?}");
        for ((_, clock), expected) in best.iter().zip([0.1, 0.2, 0.0]) {
            assert_near(clock.shift_s, expected, 1e-9);
        }
    }

    /// By hand: 64 squares of 2 per frame, 0, 1 and 2 s after the origin: sums 768, 768 and 1,280, determinant 393,216.
    #[test]
    fn standard_errors_are_those_of_a_line_through_three_frames() {
        let series = Series::evenly(0.0, 10.0, |time_s| [time_s; PIXELS]);
        let sample = Sample::new(vec![1.0, 2.0, 3.0], vec![[0.0; PIXELS]; 3]);
        let clock = Clock::new(0.0, 0.0, 1.0);
        let fit = Fit {
            likeness: 0.0,
            amplitude: 2.0,
            left_c2: 192.0,
        };
        let (shift_s, rate) = standard_errors(&sample, &series, clock, &fit).unwrap();
        assert_near(shift_s, (1_280.0_f64 / 393_216.0).sqrt(), 1e-9);
        assert_near(rate, (768.0_f64 / 393_216.0).sqrt(), 1e-9);
        let one = Sample::new(vec![1.0], vec![[0.0; PIXELS]]);
        assert_eq!(standard_errors(&one, &series, clock, &fit), None);
        let elsewhere = Sample::new(vec![30.0, 31.0], vec![[0.0; PIXELS]; 2]);
        assert_eq!(standard_errors(&elsewhere, &series, clock, &fit), None);
    }
}
