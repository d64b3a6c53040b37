//! The random numbers of one unit: each purpose has its own stream.

use grideye_frame::PIXELS;
use rand_chacha::ChaCha12Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};

pub(crate) struct Draws(ChaCha12Rng);

const TICK: u64 = 1;
const KNOT: u64 = 2;
const SPECIMEN: u64 = 3;

impl Draws {
    pub(crate) fn tick(seed: u64, index: u64) -> Self {
        Self::new(seed, TICK, 0, index)
    }

    pub(crate) fn knot(seed: u64, octave: u32, number: u64) -> Self {
        Self::new(seed, KNOT, octave, number)
    }

    pub(crate) fn unit(seed: u64) -> Self {
        Self::new(seed, SPECIMEN, 0, 0)
    }

    fn new(seed: u64, purpose: u64, octave: u32, stream: u64) -> Self {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..16].copy_from_slice(&purpose.to_le_bytes());
        key[16..24].copy_from_slice(&u64::from(octave).to_le_bytes());
        key[24..].copy_from_slice(b"grideyep");
        let mut generator = ChaCha12Rng::from_seed(key);
        generator.set_stream(stream);
        Self(generator)
    }

    pub(crate) fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// True with this probability: never at 0, always at 1.
    pub(crate) fn happens(&mut self, probability: f64) -> bool {
        let draw = f64::from(self.0.next_u32()) / TWO_TO_32;
        draw < probability
    }

    /// One pixel, each as likely as any other.
    pub(crate) fn pixel(&mut self) -> usize {
        // 64 divides the range of a byte evenly.
        usize::from(self.0.next_u32().to_le_bytes()[0]) % PIXELS
    }
}

const TWO_TO_32: f64 = 4_294_967_296.0;
