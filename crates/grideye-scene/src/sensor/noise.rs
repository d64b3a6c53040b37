//! Adds independent noise or a unit's profile to an image, and rounds to the sensor's steps.

use crate::geometry::count;
use crate::model::Sensor;
use crate::picture::Image;
use crate::profile::Profile;
use crate::radiometry::ABSOLUTE_ZERO_C;
use grideye_frame::{Celsius, TICK};
use rand_chacha::ChaCha12Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use std::time::Duration;

/// Adds one draw of N(0, [`Sensor::noise_sigma`]) to each pixel, in row order, never going below absolute zero.
///
/// ChaCha with 12 rounds. Key, little-endian: the seed (8), the FNV-1a hash of the sensor's name (8), the high half of
/// the time in nanoseconds (8), `grideye1` (8). Stream: the low half of the time, so that frames are independent.
pub(crate) fn add_noise(celsius: &mut [f64], sensor: &Sensor, (time, seed): (Duration, u64)) {
    let mut generator = generator(seed, &sensor.name, time);
    for pixel in celsius {
        let draw: f64 = StandardNormal.sample(&mut generator);
        *pixel = (*pixel + sensor.noise_sigma * draw).max(ABSOLUTE_ZERO_C);
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

/// Ticks of the slowest frame: the sensor's own mean at 1 frame per second.
const TICKS_MAX: f64 = 10.0;

/// Adds the unit's pattern, drift and noise to an 8 x 8 image; other sizes have no profile.
pub(crate) fn measure(
    profile: &Profile,
    sensor: &Sensor,
    image: &mut Image,
    (time, seed): (Duration, u64),
) {
    // The thermistor is not part of an image.
    let Some(seen) = image.to_frame(Celsius::new(0.0)) else {
        return;
    };
    // A frame's time may be rounded down by up to a nanosecond.
    let first = (time + Duration::from_nanos(1)).as_nanos() / TICK.as_nanos();
    let first = u64::try_from(first).unwrap_or(u64::MAX);
    let tick_hz = 1.0 / TICK.as_secs_f64();
    let ticks = (tick_hz / sensor.sampling_hz).round().clamp(1.0, TICKS_MAX);
    let mut sums = vec![0.0; image.celsius.len()];
    for tick in 0..count::floor(ticks) {
        let tick = u32::try_from(tick).unwrap_or(0);
        let at = time.saturating_add(TICK * tick);
        let measured = profile.apply(seed, first.saturating_add(tick.into()), at, seen);
        for (sum, celsius) in sums.iter_mut().zip(&measured.pixels) {
            *sum += f64::from(celsius.get());
        }
    }
    for (celsius, sum) in image.celsius.iter_mut().zip(sums) {
        *celsius = sum / ticks;
    }
}

pub(crate) fn quantize(celsius: &mut [f64], step_c: f64) {
    if step_c > 0.0 {
        for celsius in celsius {
            *celsius = (*celsius / step_c).round() * step_c;
        }
    }
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
