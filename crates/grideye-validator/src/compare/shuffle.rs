//! Random orders of the pixels.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

/// `number` orders in which `pixels` pixels can stand, the same for the same seed on every machine.
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
