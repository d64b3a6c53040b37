//! Random numbers that depend only on the seed, their purpose, and the frame.

use grideye_scene::fnv1a;
use rand_chacha::ChaCha12Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};

/// ChaCha with 12 rounds, like the noise. Its key is the seed, the FNV-1a hash of `key`, the frame's number, and a tag
/// that keeps it apart from the noise.
pub(crate) fn generator(seed: u64, key: &str, index: u64) -> ChaCha12Rng {
    let mut bytes = [0; 32];
    bytes[..8].copy_from_slice(&seed.to_le_bytes());
    bytes[8..16].copy_from_slice(&fnv1a(key).to_le_bytes());
    bytes[16..24].copy_from_slice(&index.to_le_bytes());
    bytes[24..].copy_from_slice(b"gridvary");
    ChaCha12Rng::from_seed(bytes)
}

/// 0 to 1, excluding 1, in steps of 2⁻⁵³.
pub(crate) fn share(generator: &mut ChaCha12Rng) -> f64 {
    let high = generator.next_u32() >> 5;
    let low = generator.next_u32() >> 6;
    (f64::from(high) * 67_108_864.0 + f64::from(low)) / 9_007_199_254_740_992.0
}

/// A number below `count` (at least 1), uniform to within 2⁻³².
pub(crate) fn below(generator: &mut ChaCha12Rng, count: usize) -> usize {
    let wide = u64::from(generator.next_u32()) * u64::try_from(count).unwrap_or(u64::MAX);
    usize::try_from(wide >> 32).unwrap_or(0)
}

/// One of `count` choices, by their weights; without weights all are alike.
pub(crate) fn chosen(generator: &mut ChaCha12Rng, weights: &[f64], count: usize) -> usize {
    if weights.is_empty() {
        return below(generator, count);
    }
    let mut left = share(generator) * weights.iter().sum::<f64>();
    let passed = weights.iter().take_while(|weight| {
        left -= **weight;
        left >= 0.0
    });
    passed.count().min(count - 1)
}

/// The purpose of the noise seed: no scene key starts with a space.
pub(crate) const NOISE: &str = " noise";

/// The purpose of the moment at which a clip starts.
pub(crate) const START: &str = " start";
