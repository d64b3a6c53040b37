//! What the simulation scores with its pixels in random order.

use crate::compare::prepared::{ComparedFrames, thinned};
use crate::compare::settings::{SHUFFLED_PAIRS_MAX, Settings};
use crate::compare::sums::Sums;
use crate::metrics::score::{Better, Measure, Shuffled, Values};
use crate::numbers::{mean, percentile};
use grideye_frame::PIXELS;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

/// Of each measure. Each round uses one order of the pixels for all frames, so that only their place varies between rounds.
pub(crate) fn shuffled(
    view: &ComparedFrames,
    pairs: &[(usize, usize)],
    settings: &Settings,
) -> [Option<Shuffled>; Measure::ALL.len()] {
    let thinned = thinned(pairs, SHUFFLED_PAIRS_MAX);
    let orders = orders(PIXELS, settings.shuffles, settings.seed);
    let round = |order: &Vec<usize>| {
        let mut sums = Sums::default();
        for &(real, put) in &thinned {
            let put = view.preparation.permuted(&view.simulated[put], order);
            sums.pair(&view.real[real], &put);
        }
        sums.means()
    };
    let rounds: Vec<Values> = orders.iter().map(round).collect();
    Measure::ALL.map(|measure| {
        let values = rounds.iter().filter_map(|round| round[measure.place()]);
        summary(measure, values.collect())
    })
}

fn summary(measure: Measure, mut values: Vec<f64>) -> Option<Shuffled> {
    let mean = mean(&values)?;
    values.sort_unstable_by(f64::total_cmp);
    if measure.better() == Better::Lower {
        values.reverse();
    }
    let p95 = percentile(&values, 95)?;
    Some(Shuffled { mean, p95 })
}

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
        for (measure, p95) in [(Measure::Correlation, 95.0), (Measure::Rmse, 6.0)] {
            let found = summary(measure, values.clone()).unwrap();
            assert_eq!((found.mean, found.p95), (50.5, p95), "{measure}");
        }
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
