//! Recordings of simulated scenes, and their comparison.

use grideye_frame::{PixelWord, Reading, RecordedFrame, ThermistorWord};
use grideye_recording::{ClockState, Record, Stamp};
use grideye_scene::{Scene, Simulator};
use grideye_validator::{Comparison, KnownUnit, Options, State, compare_scene};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::time::Duration;

pub(crate) const FIRST_SEED: u64 = 2_000;
const SEEDS: u64 = 50;
const SEEDS_BY_DEFAULT: u64 = 1;
const FAULT_SEEDS: u64 = 10;
const FAULT_SEEDS_BY_DEFAULT: u64 = 1;
/// Scenes, and a sensor of each.
const SCENES: [(&str, &str); 12] = [
    ("experiment-1", "ceiling"),
    ("experiment-2", "ceiling"),
    ("experiment-3", "ceiling"),
    ("experiment-4", "ceiling"),
    ("clothed-walk", "ceiling"),
    ("scenario-b-standing", "A"),
    ("scenario-b-standing", "B"),
    ("scenario-b-standing", "C"),
    ("attic", "ridge"),
    ("two-people", "wall"),
    ("three-motions", "ceiling"),
    ("l-shaped-room", "right-arm"),
];

/// Whether `GRIDEYE_ALL_SEEDS=1` requests all seeds.
pub(crate) fn all_seeds() -> bool {
    std::env::var_os("GRIDEYE_ALL_SEEDS").is_some_and(|value| value == "1")
}

/// Seeds of a right scene.
pub(crate) fn seeds() -> std::ops::Range<u64> {
    let number = if all_seeds() { SEEDS } else { SEEDS_BY_DEFAULT };
    FIRST_SEED..FIRST_SEED + number
}

/// Seeds of a planted fault.
pub(crate) fn fault_seeds() -> std::ops::Range<u64> {
    let number = if all_seeds() {
        FAULT_SEEDS
    } else {
        FAULT_SEEDS_BY_DEFAULT
    };
    FIRST_SEED..FIRST_SEED + number
}

pub(crate) fn folder() -> String {
    format!("{}/../../scenes", env!("CARGO_MANIFEST_DIR"))
}

pub(crate) fn text(name: &str) -> String {
    std::fs::read_to_string(format!("{}/{name}.toml", folder())).unwrap()
}

pub(crate) fn parse(text: &str) -> Scene {
    let files = |relative: &str| std::fs::read_to_string(format!("{}/{relative}", folder()));
    Scene::parse(text, "scene.toml", &files).unwrap().scene
}

/// What a unit adds to the scene, drawn from the seed: noise, fixed pattern, and a level of its own.
#[derive(Clone, Copy)]
pub(crate) struct Unit {
    pub(crate) sigma_c: f64,
    pub(crate) pattern_c: f64,
}

/// Middle of the ranges measured on public recordings (0.23 to 0.26 and 0.15 to 0.25 °C).
pub(crate) const UNIT: Unit = Unit {
    sigma_c: 0.24,
    pattern_c: 0.2,
};
pub(crate) const PERFECT: Unit = Unit {
    sigma_c: 0.24,
    pattern_c: 0.0,
};

/// A 10 Hz recording of a scene: whole, or 40 frames if nothing moves. The scene's frame at t comes at t / `pace`.
pub(crate) fn record_at(
    scene: &Scene,
    sensor: &str,
    unit: Unit,
    seed: u64,
    pace: f64,
) -> Vec<Record> {
    let simulator = Simulator::new(scene, sensor).unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = |sigma: f64| -> f64 {
        let value: f64 = StandardNormal.sample(&mut random);
        sigma * value
    };
    let pattern = pattern_c(unit, seed);
    let end_s = scene.duration().as_secs_f64();
    let frames = if end_s > 0.0 {
        (end_s / pace * 10.0 + 1e-6) as u32 + 1
    } else {
        40
    };
    let mut frame = |index: u32| {
        let time_s = f64::from(index) / 10.0;
        let image = simulator
            .image(Duration::from_secs_f64(time_s * pace))
            .celsius;
        let pixels = std::array::from_fn(|pixel| {
            PixelWord(((image[pixel] + pattern[pixel] + draw(unit.sigma_c)) * 4.0).round() as u16)
        });
        let thermistor = ((simulator.ambient_c() + 4.5 + draw(0.02)) * 16.0).round() as u16;
        row(
            u64::from(index),
            time_s,
            RecordedFrame {
                thermistor: Some(ThermistorWord(thermistor)),
                pixels,
            },
        )
    };
    (0..frames).map(&mut frame).collect()
}

/// The unit's excess at each pixel.
pub(crate) fn pattern_c(unit: Unit, seed: u64) -> [f64; 64] {
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x0070_6174);
    std::array::from_fn(|_| {
        let value: f64 = StandardNormal.sample(&mut random);
        unit.pattern_c * value
    })
}

pub(crate) fn record(scene: &Scene, sensor: &str, unit: Unit, seed: u64) -> Vec<Record> {
    record_at(scene, sensor, unit, seed, 1.0)
}

pub(crate) fn row(seq: u64, time_s: f64, frame: RecordedFrame) -> Record {
    Record {
        seq,
        stamp: Stamp {
            t_boot_ns: 3_000_000_000 + (time_s * 1e9).round() as u64,
            t_utc_ns: 0,
            clock: ClockState::Unsynced,
        },
        reading: Reading::Frame(frame),
    }
}

pub(crate) fn options(seed: u64) -> Options {
    Options {
        seed,
        shuffles: 20,
        ..Options::default()
    }
}

pub(crate) fn compared(records: &[Record], scene: &Scene, sensor: &str, seed: u64) -> Comparison {
    compare_scene(records, scene, sensor, &options(seed)).unwrap()
}

/// All scenes, or those whose people take little time to render at many places.
pub(crate) fn right() -> Vec<(&'static str, Scene, &'static str)> {
    const SLOW: [&str; 3] = ["attic", "clothed-walk", "three-motions"];
    let mut all = SCENES.to_vec();
    all.retain(|(name, _)| all_seeds() || !SLOW.contains(name));
    let scene = |(name, sensor)| (name, parse(&text(name)), sensor);
    all.into_iter().map(scene).collect()
}

/// What the unit's profile would say of its pattern.
pub(crate) fn known(unit: Unit, seed: u64) -> KnownUnit {
    KnownUnit {
        pattern_c: pattern_c(unit, seed),
        has_background: true,
        wander_c: 0.0,
        bias_c: 0.0,
        spread_c: 0.0,
    }
}

pub(crate) fn failed(comparison: &Comparison) -> Vec<&'static str> {
    comparison
        .judgment
        .criteria
        .iter()
        .filter(|criterion| criterion.state == State::Failed)
        .map(|criterion| criterion.name)
        .collect()
}
