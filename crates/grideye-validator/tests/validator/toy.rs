//! A minimal sensor and simulator, independent of each other and of grideye-scene.

use grideye_validator::{
    Comparison, Protocol, RealFrame, Settings, SimulatedFrame, ValidatorError, compare,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use std::time::Duration;

pub(crate) const AMBIENT_C: f64 = 21.0;
const STEP_C: f64 = 0.25;

/// An object: its place in pixels from the corner of the image, and its apparent warmth above ambient.
#[derive(Clone, Copy)]
pub(crate) struct Blob {
    pub(crate) column: f64,
    pub(crate) row: f64,
    pub(crate) contrast_c: f64,
}

pub(crate) const PERSON: Blob = Blob {
    column: 2.2,
    row: 4.6,
    contrast_c: 2.6,
};

/// What the unit adds to the scene.
#[derive(Clone, Copy)]
pub(crate) struct Unit {
    pub(crate) noise_c: f64,
    pub(crate) pattern_c: f64,
    pub(crate) offset_c: f64,
}

pub(crate) const UNIT: Unit = Unit {
    noise_c: 0.25,
    pattern_c: 0.15,
    offset_c: 0.0,
};

/// The scene without noise.
pub(crate) fn clean(blobs: &[Blob]) -> [f64; 64] {
    std::array::from_fn(|index| {
        let index = u32::try_from(index).unwrap();
        let (row, column) = (f64::from(index / 8), f64::from(index % 8));
        let warmth = |blob: &Blob| {
            let squared = (row - blob.row).powi(2) + (column - blob.column).powi(2);
            blob.contrast_c * (-squared / (2.0 * 1.1 * 1.1)).exp()
        };
        AMBIENT_C + blobs.iter().map(warmth).sum::<f64>()
    })
}

fn noisy(clean: &[f64; 64], sigma: f64, generator: &mut ChaCha8Rng) -> [f64; 64] {
    let noise = Normal::new(0.0, sigma).unwrap();
    clean.map(|value| value + noise.sample(generator))
}

/// Real frames of a scene that may move, each with its repeat three frames later.
pub(crate) fn recording(
    frames: u32,
    unit: Unit,
    seed: u64,
    scene: impl Fn(u32) -> Vec<Blob>,
) -> Vec<RealFrame> {
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    let pattern = noisy(&[unit.offset_c; 64], unit.pattern_c, &mut generator);
    let mut measure = |index: u32| {
        let scene = clean(&scene(index));
        let seen = std::array::from_fn(|pixel| scene[pixel] + pattern[pixel]);
        let frame = noisy(&seen, unit.noise_c, &mut generator);
        frame.map(|value| (value / STEP_C).round() * STEP_C)
    };
    (0..frames)
        .map(|index| RealFrame {
            time: time(index),
            celsius: measure(index),
            later: Some(measure(index + 3)),
        })
        .collect()
}

/// Simulated frames with noise of 0.2 degrees, as in the paper.
pub(crate) fn simulation(
    frames: u32,
    seed: u64,
    scene: impl Fn(u32) -> Vec<Blob>,
) -> Vec<SimulatedFrame> {
    let mut generator = ChaCha8Rng::seed_from_u64(seed ^ 0x5117);
    (0..frames)
        .map(|index| {
            let noise_free = clean(&scene(index));
            SimulatedFrame {
                time: time(index),
                celsius: noisy(&noise_free, 0.2, &mut generator),
                noise_free,
            }
        })
        .collect()
}

pub(crate) fn settings(protocol: Protocol) -> Settings {
    Settings {
        shuffles: 20,
        ..Settings::new(protocol, AMBIENT_C, STEP_C)
    }
}

fn time(index: u32) -> Duration {
    Duration::from_millis(100) * index
}

/// One frame compared with another.
pub(crate) fn pair(real: &[f64; 64], simulated: &[f64; 64]) -> Result<Comparison, ValidatorError> {
    let time = Duration::ZERO;
    let real = RealFrame {
        time,
        celsius: *real,
        later: None,
    };
    let simulated = SimulatedFrame {
        time,
        celsius: *simulated,
        noise_free: *simulated,
    };
    let settings = Settings {
        shuffles: 1,
        ..Settings::new(Protocol::Static, AMBIENT_C, STEP_C)
    };
    compare(&[real], &[simulated], &settings)
}
