//! Independent noise of every pixel, as a function of seed, sensor and time.

use crate::radiometry::ABSOLUTE_ZERO_C;
use rand_chacha::ChaCha12Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use std::time::Duration;

/// Adds one draw of N(0, `sigma`) to each pixel, in row order; absolute zero cuts off.
///
/// ChaCha with 12 rounds. Key, little-endian: the seed (8), the FNV-1a hash of the sensor's name (8), the high half of
/// the time in nanoseconds (8), `grideye1` (8). Stream: the low half of the time, so that frames are independent.
pub(crate) fn add_noise(celsius: &mut [f64], sigma: f64, seed: u64, sensor: &str, time: Duration) {
    let mut generator = generator(seed, sensor, time);
    for pixel in celsius {
        let draw: f64 = StandardNormal.sample(&mut generator);
        *pixel = (*pixel + sigma * draw).max(ABSOLUTE_ZERO_C);
    }
}

fn generator(seed: u64, sensor: &str, time: Duration) -> ChaCha12Rng {
    let nanoseconds = time.as_nanos().to_le_bytes();
    let mut key = [0; 32];
    let (low, high) = nanoseconds.split_at(8);
    key[..8].copy_from_slice(&seed.to_le_bytes());
    key[8..16].copy_from_slice(&fnv1a(sensor).to_le_bytes());
    key[16..24].copy_from_slice(high);
    key[24..].copy_from_slice(b"grideye1");
    let mut generator = ChaCha12Rng::from_seed(key);
    let mut stream = [0; 8];
    stream.copy_from_slice(low);
    generator.set_stream(u64::from_le_bytes(stream));
    generator
}

/// The FNV-1a hash of a text, 64 bits (Fowler, Noll, Vo).
#[must_use]
pub fn fnv1a(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_fnv1a() {
        // Test values of the algorithm's authors (Fowler, Noll, Vo).
        assert_eq!(fnv1a(""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(fnv1a("a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(fnv1a("foobar"), 0x8594_4171_f739_67e8);
    }
}
