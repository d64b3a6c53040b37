//! Uneven walking: dynamic time warping in a band (Sakoe and Chiba, IEEE Trans. ASSP 26:43, 1978).
//!
//! The pace stays between 0.5 and 1.5 of the line's, and a change of pace costs what a random walk would. So the path
//! cannot stand still, run backwards or pick frames that suit it.

use crate::align::clock::{Line, Warp};
use crate::align::film::{Film, Fit, Sample, whole};
use crate::frames::types::Pixels;
use crate::numbers::{count, windowed_mean};
use grideye_frame::PIXELS;

/// Frames used for the search; more are thinned evenly.
const FRAMES: usize = 600;
/// Frames closer than this are thinned, seconds: a change of pace takes time to show.
const FRAME_STEP_S: f64 = 0.1;
const LEVELS_MAX: usize = 161;
/// Largest departure from the line gained per second, seconds.
const PACE_MAX: f64 = 0.5;
/// Standard deviation of the departure after one second of walking, seconds.
const WANDER_S: f64 = 0.3;
/// The path is averaged over this, seconds.
const SMOOTH_S: f64 = 0.6;

pub(crate) fn best_warp(sample: &Sample, film: &Film, line: Line, fit: &Fit, band_s: f64) -> Warp {
    let number = whole((sample.span_s() / FRAME_STEP_S).ceil().max(2.0)).min(FRAMES);
    let sample = sample.thinned(number);
    let gap_s = sample.span_s() / count(sample.frames.len().saturating_sub(1).max(1));
    let step_s = (gap_s * PACE_MAX / 2.0).max(2.0 * band_s / count(LEVELS_MAX - 1));
    let half = whole((band_s / step_s + 1e-9).floor());
    let levels: Vec<f64> = (0..=2 * half)
        .map(|level| (count(level) - count(half)) * step_s)
        .collect();
    let costs = costs(&sample, film, line, fit, &levels);
    let path = cheapest(&costs, &sample.times_s, &levels);
    let knots: Vec<(f64, f64)> = sample
        .times_s
        .iter()
        .zip(path)
        .map(|(&time_s, level)| (time_s, levels[level]))
        .collect();
    Warp {
        knots: windowed_mean(&knots, SMOOTH_S),
    }
}

/// For each frame and departure, half the squared residual in units of the noise.
fn costs(sample: &Sample, film: &Film, line: Line, fit: &Fit, levels: &[f64]) -> Vec<Vec<f64>> {
    let mean = sample.mean_claim(film, |time_s| line.scene_s(time_s));
    let variance = (fit.left_c2 / count(sample.frames.len() * PIXELS)).max(1e-4);
    let cost = |real: &Pixels, scene_s: f64| -> f64 {
        let squares: f64 = match film.at(scene_s) {
            Some(claim) => (0..PIXELS)
                .map(|pixel| real[pixel] - fit.amplitude * (claim[pixel] - mean[pixel]))
                .map(|left| left * left)
                .sum(),
            None => real.iter().map(|real| real * real).sum(),
        };
        squares / variance / 2.0
    };
    sample
        .times_s
        .iter()
        .zip(&sample.frames)
        .map(|(&time_s, real)| {
            let scene_s = line.scene_s(time_s);
            levels
                .iter()
                .map(|by_s| cost(real, scene_s + by_s))
                .collect()
        })
        .collect()
}

/// The cheapest path through the table, one level per row.
fn cheapest(costs: &[Vec<f64>], times_s: &[f64], levels: &[f64]) -> Vec<usize> {
    let Some(first) = costs.first() else {
        return Vec::new();
    };
    let step_s = levels.get(1).map_or(1.0, |next| next - levels[0]);
    let mut sums = first.clone();
    let mut from: Vec<Vec<usize>> = Vec::with_capacity(costs.len());
    for (row, costs) in costs.iter().enumerate().skip(1) {
        let gap_s = (times_s[row] - times_s[row - 1]).max(1e-3);
        let reach = whole((PACE_MAX * gap_s / step_s + 1e-9).floor()).max(1);
        let price = step_s * step_s / (2.0 * WANDER_S * WANDER_S * gap_s);
        let mut origins = Vec::with_capacity(levels.len());
        let mut next = Vec::with_capacity(levels.len());
        for (level, cost) in costs.iter().enumerate() {
            let near = level.saturating_sub(reach)..(level + reach + 1).min(levels.len());
            let paid = |origin: usize| {
                let departs = count(origin.abs_diff(level));
                sums[origin] + price * departs * departs
            };
            let origin = near
                .min_by(|&left, &right| paid(left).total_cmp(&paid(right)))
                .unwrap_or(level);
            origins.push(origin);
            next.push(paid(origin) + cost);
        }
        from.push(origins);
        sums = next;
    }
    let mut level = (0..levels.len())
        .min_by(|&left, &right| sums[left].total_cmp(&sums[right]))
        .unwrap_or(0);
    let mut path = vec![level];
    for origins in from.iter().rev() {
        level = origins[level];
        path.push(level);
    }
    path.reverse();
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cheapest_path_is_that_of_brute_force() {
        let levels = [-0.1, -0.05, 0.0, 0.05, 0.1];
        let times_s = [0.0, 0.1, 0.2, 0.35, 0.45];
        let mut state = 12_345_u32;
        for _ in 0..50 {
            let mut random = || {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f64::from(state >> 16) / 65_536.0
            };
            let costs: Vec<Vec<f64>> = (0..5)
                .map(|_| (0..5).map(|_| 0.3 * random()).collect())
                .collect();
            let price = |path: &[usize]| -> Option<f64> {
                let mut sum = costs[0][path[0]];
                for row in 1..5 {
                    let gap_s: f64 = times_s[row] - times_s[row - 1];
                    let by_s: f64 = levels[path[row]] - levels[path[row - 1]];
                    if by_s.abs() > (PACE_MAX * gap_s).max(0.05) + 1e-9 {
                        return None;
                    }
                    sum += costs[row][path[row]] + by_s * by_s / (2.0 * 0.09 * gap_s);
                }
                Some(sum)
            };
            let least = (0..5_usize.pow(5))
                .filter_map(|code| {
                    let path: Vec<usize> =
                        (0..5).map(|digit| code / 5_usize.pow(digit) % 5).collect();
                    price(&path)
                })
                .fold(f64::INFINITY, f64::min);
            let found = price(&cheapest(&costs, &times_s, &levels)).unwrap();
            assert!((found - least).abs() < 1e-12, "{found} {least}");
        }
    }

    #[test]
    fn a_departure_between_knots_is_on_the_line_between_them() {
        let warp = Warp {
            knots: vec![(1.0, 0.2), (2.0, -0.2)],
        };
        for (time_s, by_s) in [
            (0.0, 0.2),
            (1.0, 0.2),
            (1.25, 0.1),
            (2.0, -0.2),
            (9.0, -0.2),
        ] {
            assert!((warp.by_s(time_s) - by_s).abs() < 1e-12, "{time_s}");
        }
        assert_eq!(warp.departure_max_s(), 0.2);
        assert_eq!(Warp { knots: Vec::new() }.by_s(1.0), 0.0);
    }

    #[test]
    fn smoothing_is_the_mean_of_the_near_knots() {
        let knots = (0..10_u32).map(|index| (f64::from(index) * 0.2, f64::from(index % 2)));
        let smooth = windowed_mean(&knots.collect::<Vec<_>>(), SMOOTH_S);
        // Three knots lie within 0.3 s either way in the middle, two at the ends.
        assert!((smooth[4].1 - 1.0 / 3.0 * 2.0).abs() < 1e-12, "{smooth:?}");
        assert!((smooth[0].1 - 0.5).abs() < 1e-12);
    }

    /// A pixel warm for about a second and a half, with two seconds of nothing at either end.
    fn hump(time_s: f64) -> Pixels {
        let mut frame = [0.0; PIXELS];
        frame[27] = 4.0 * (-((time_s - 3.0) / 0.75).powi(2)).exp();
        frame
    }

    fn film_and_walk(late_s: f64) -> (Film, Sample) {
        let times_s: Vec<f64> = (0..=60_u32).map(|step| f64::from(step) / 10.0).collect();
        let film: Vec<Pixels> = times_s.iter().map(|&time_s| hump(time_s)).collect();
        let seen = times_s
            .iter()
            .map(|&time_s| hump(time_s - late_s))
            .collect();
        (Film::of_frames(&times_s, &film), Sample::new(times_s, seen))
    }

    const STRAIGHT: Line = Line::new(0.0, 0.0, 0.0);

    /// A recording equal to the scene leaves no residual where it is not moved.
    #[test]
    fn a_walk_equal_to_the_scene_costs_nothing_at_its_own_time() {
        let (film, sample) = film_and_walk(0.0);
        let fit = sample.fit(&film, |time_s| time_s);
        for (row, costs) in costs(&sample, &film, STRAIGHT, &fit, &[-0.3, 0.0, 0.3])
            .into_iter()
            .enumerate()
        {
            assert!(costs[1].abs() < 1e-6, "row {row}: {costs:?}");
        }
    }

    /// Seen 0.2 s late, the hump is where the scene had it 0.2 s earlier.
    #[test]
    fn a_late_walk_departs_by_its_delay() {
        let (film, sample) = film_and_walk(0.2);
        let fit = sample.fit(&film, |time_s| time_s - 0.2);
        let warp = best_warp(&sample, &film, STRAIGHT, &fit, 0.5);
        for time_s in [2.5, 3.0, 3.5] {
            let by_s = warp.by_s(time_s);
            assert!((by_s + 0.2).abs() < 0.05, "{time_s} s: {by_s} s");
        }
    }
}
