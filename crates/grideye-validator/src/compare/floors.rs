//! What chance scores on the same frames: blank frame, shuffled pixels, images of noise.

use crate::compare::prepared::{ComparedFrames, FrameSet, thinned};
use crate::compare::settings::{NOISE_IMAGES, SHUFFLED_PAIRS_MAX, Settings};
use crate::compare::sums::{Sums, in_threads, sums};
use crate::metrics::score::{Better, Measure, Shuffled};
use crate::numbers::{count, evenly, mean, percentile};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Scores of the blank frame. Its gain over itself is 0 by definition.
pub(crate) fn blank(view: &ComparedFrames, pairs: &[(usize, usize)]) -> Sums {
    let side = FrameSet::new(vec![view.blank.clone()]);
    let mut frames: Vec<usize> = pairs.iter().map(|&(real, _)| real).collect();
    frames.dedup();
    let pairs: Vec<(usize, usize)> = frames.into_iter().map(|real| (real, 0)).collect();
    let mut sums = sums(view, &pairs, &side, (SHUFFLED_PAIRS_MAX, 1));
    for measure in [Measure::Gain, Measure::GainWithOffset] {
        sums.means.set(measure, Some(0.0));
    }
    sums
}

/// Scores of images that show only sensor noise around ambient and claim nothing.
pub(crate) fn noise(view: &ComparedFrames, seed: u64) -> Sums {
    let mut generator = ChaCha8Rng::seed_from_u64(seed ^ NOISE_SEED);
    let mut image = || -> Vec<f64> {
        let noise = |_| {
            let draw: f64 = StandardNormal.sample(&mut generator);
            view.ambient_c + view.sigma_c * draw
        };
        (0..view.pixels()).map(noise).collect()
    };
    let images = (0..NOISE_IMAGES).map(|_| {
        view.preparation
            .simulated(&image(), &view.blank.steady, None)
    });
    let side = FrameSet::new(images.collect());
    // Each image meets some frames, and each frame some images.
    let pairs: Vec<(usize, usize)> = evenly(view.real.len(), SHUFFLED_PAIRS_MAX)
        .into_iter()
        .flat_map(|real| {
            [
                (real, real % NOISE_IMAGES),
                (real, (real + 7) % NOISE_IMAGES),
            ]
        })
        .collect();
    sums(view, &pairs, &side, (SHUFFLED_PAIRS_MAX, 1))
}

/// Separates these draws from the shuffles of the same seed.
const NOISE_SEED: u64 = 0x006E_6F69_7365;
/// Pairs per shuffle with measures of places and structure, which cost as much as all others.
const SHUFFLED_PLACES_MAX: usize = 20;

/// Each round uses one order of the pixels for all frames, so that only their place varies between rounds.
pub(crate) fn shuffled(
    view: &ComparedFrames,
    pairs: &[(usize, usize)],
    settings: &Settings,
) -> Vec<(Measure, Shuffled)> {
    let (side, thinned) = view.simulated.of_pairs(&thinned(pairs, SHUFFLED_PAIRS_MAX));
    let found = sums(view, &thinned, &side, (SHUFFLED_PLACES_MAX, 1));
    let orders = orders(view.pixels(), settings.shuffles, settings.seed);
    let rounds = in_threads(&orders, settings.threads, |order| {
        let permuted = side.permuted(&view.preparation, order);
        sums(view, &thinned, &permuted, (SHUFFLED_PLACES_MAX, 1))
    });
    let of = |&measure: &Measure| {
        let values: Vec<f64> = rounds
            .iter()
            .filter_map(|round| round.means.get(measure))
            .collect();
        Some((measure, summary(measure, values, found.means.get(measure))?))
    };
    Measure::ALL.iter().filter_map(of).collect()
}

fn summary(measure: Measure, mut values: Vec<f64>, found: Option<f64>) -> Option<Shuffled> {
    let mean = mean(&values)?;
    let as_good = |&value: &f64| match (measure.better(), found) {
        (Better::Higher, Some(found)) => value >= found - ROUNDING,
        (Better::Lower, Some(found)) => value <= found + ROUNDING,
        // An undefined value is no better than any order.
        _ => true,
    };
    let p = (1.0 + count(values.iter().filter(|value| as_good(value)).count()))
        / (1.0 + count(values.len()));
    values.sort_unstable_by(f64::total_cmp);
    if measure.better() == Better::Lower {
        values.reverse();
    }
    Some(Shuffled {
        mean,
        p95: percentile(&values, 95)?,
        p: (measure.better() != Better::Neither).then_some(p),
    })
}

/// Another order may give the same sum except for rounding, which must not make it worse.
const ROUNDING: f64 = 1e-12;

/// Random pixel orders, the same for the same seed on every machine.
pub(crate) fn orders(pixels: usize, number: usize, seed: u64) -> Vec<Vec<usize>> {
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    let shuffled = |_| {
        let mut order: Vec<usize> = (0..pixels).collect();
        order.shuffle(&mut generator);
        order
    };
    (0..number).map(shuffled).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::prepared::pairs;
    use crate::frames::Protocol;

    #[test]
    fn many_pairs_are_thinned_to_the_limit() {
        let hundred = pairs(Protocol::Static, 10, 10);
        assert_eq!(thinned(&hundred, SHUFFLED_PAIRS_MAX), hundred);
        let many = thinned(&pairs(Protocol::Static, 70, 70), SHUFFLED_PAIRS_MAX);
        assert_eq!(many.len(), SHUFFLED_PAIRS_MAX);
        assert_eq!((many[0], many[SHUFFLED_PAIRS_MAX - 1]), ((0, 0), (69, 69)));
    }

    #[test]
    fn the_95th_of_a_hundred_is_the_95th_best() {
        let values: Vec<f64> = (1..=100).map(f64::from).collect();
        for (measure, found, p95, as_good) in [
            (Measure::Correlation, 96.5, 95.0, 5.0),
            (Measure::Rmse, 3.0, 6.0, 4.0),
        ] {
            let found = summary(measure, values.clone(), Some(found)).unwrap();
            assert_eq!((found.mean, found.p95), (50.5, p95), "{measure}");
            assert_eq!(found.p, Some(as_good / 101.0), "{measure}");
        }
    }

    /// Two of five orders do as well; with the true one that is 3 of 6.
    #[test]
    fn a_p_value_counts_the_true_order_and_its_equals() {
        let values = || vec![1.0, 2.0, 3.0, 4.0, 5.0];
        let p = |measure, found| summary(measure, values(), found).unwrap().p;
        assert_eq!(p(Measure::MutualInformationBinned, Some(4.0)), Some(0.5));
        assert_eq!(p(Measure::Rmse, Some(2.0)), Some(0.5));
        assert_eq!(p(Measure::Rmse, Some(0.5)), Some(1.0 / 6.0));
        assert_eq!(p(Measure::Rmse, None), Some(1.0));
        assert_eq!(p(Measure::Bias, Some(2.0)), None);
    }

    #[test]
    fn orders_hold_every_pixel_once_and_follow_the_seed() {
        let first = orders(64, 3, 7);
        assert_eq!(first, orders(64, 3, 7));
        assert_ne!(first, orders(64, 3, 8));
        assert_ne!(first[0], first[1]);
        for mut order in first {
            order.sort_unstable();
            assert_eq!(order, (0..64).collect::<Vec<_>>());
        }
    }
}
