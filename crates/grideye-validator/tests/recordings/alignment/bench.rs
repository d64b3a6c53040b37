//! Walks, the errors that a sensor adds, and the comparison of such recordings.

use grideye_frame::{PixelWord, Reading, RecordedFrame, ThermistorWord};
use grideye_recording::{ClockState, Record, Stamp};
use grideye_scene::{Scene, Simulator};
use grideye_validator::align::{AlignOptions, TimeAlignment};
use grideye_validator::{Comparison, Measure, Options, compare_scene};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use std::time::Duration;

pub(crate) const SENSOR: &str = "ceiling";
/// Seeds per row of the tables; all run with `GRIDEYE_ALL_SEEDS=1`.
const SEEDS: u64 = 20;
const SEEDS_BY_DEFAULT: u64 = 1;
/// Seeds of the slower tests.
const FEWER_SEEDS: u64 = 5;
const FEWER_SEEDS_BY_DEFAULT: u64 = 1;

fn all_seeds() -> bool {
    std::env::var_os("GRIDEYE_ALL_SEEDS").is_some_and(|value| value == "1")
}

pub(crate) fn seeds() -> u64 {
    if all_seeds() { SEEDS } else { SEEDS_BY_DEFAULT }
}

pub(crate) fn fewer_seeds() -> u64 {
    if all_seeds() {
        FEWER_SEEDS
    } else {
        FEWER_SEEDS_BY_DEFAULT
    }
}

/// Prints how to run the seeds left out.
pub(crate) fn closing_note() {
    if !all_seeds() {
        println!(
            "{SEEDS_BY_DEFAULT} of {SEEDS} seeds and {FEWER_SEEDS_BY_DEFAULT} of {FEWER_SEEDS}: GRIDEYE_ALL_SEEDS=1 runs all"
        );
    }
}

pub(crate) struct Walk {
    pub(crate) way: &'static str,
    pub(crate) azimuth_deg: f64,
    pub(crate) elevation_deg: f64,
    pub(crate) radiator: &'static str,
    pub(crate) speed: f64,
    /// Pause at the second waypoint.
    pub(crate) stop_s: u32,
}

pub(crate) const WALK: Walk = Walk {
    way: "1200,1500,0\n3800,1700,0\n3300,3600,0\n1600,3300,0\n",
    azimuth_deg: -90.0,
    elevation_deg: 90.0,
    radiator: "",
    speed: 600.0,
    stop_s: 0,
};

pub(crate) const RADIATOR: &str = "[[object]]\nname = \"radiator\"\nposition_mm = [1250, 3300, 0]\nsize_mm = [200, 700, 600]\ntemperature_c = 60\n";

impl Walk {
    pub(crate) fn scene(&self) -> Scene {
        let text = format!(
            "[room]\nsize_mm = [5000, 5000, 2700]\nambient_c = 21\n\n[[object]]\nname = \"heater\"\nposition_mm = [3400, 1200, 0]\nsize_mm = [400, 200, 500]\ntemperature_c = 30\n\n{}[[agent]]\nname = \"person\"\nsize_mm = [300, 450, 1750]\ntemperature_c = 29\ntrajectory = \"way.csv\"\nspeed_mm_per_s = {}\n\n[[sensor]]\nname = \"ceiling\"\npreset = \"grid-eye\"\nsampling_hz = 10\nposition_mm = [2500, 2500, 2700]\nelevation_deg = {}\nazimuth_deg = {}\n",
            self.radiator, self.speed, self.elevation_deg, self.azimuth_deg
        );
        let way = if self.stop_s == 0 {
            format!("x_mm,y_mm,z_mm\n{}", self.way)
        } else {
            let row =
                |(index, row)| format!("{row},{}\n", if index == 1 { self.stop_s } else { 0 });
            let rows: String = self.way.lines().enumerate().map(row).collect();
            format!("x_mm,y_mm,z_mm,dwell_s\n{rows}")
        };
        Scene::parse(&text, "scene.toml", &|_: &str| Ok(way.clone()))
            .unwrap()
            .scene
    }
}

/// What a sensor adds: noise, quantization, a fixed pattern and a slow drift.
struct Unit {
    sigma_c: f64,
    pattern_c: f64,
    drift_c_per_s: f64,
}

const UNIT: Unit = Unit {
    sigma_c: 0.3,
    pattern_c: 0.15,
    drift_c_per_s: 0.01,
};

/// A recording of `seen` at 10 Hz, as long as the walk. Its frame at time t shows the scene at `scene_s(t)`; before and
/// after the walk the person stands.
pub(crate) fn record(seen: &Scene, seed: u64, scene_s: impl Fn(f64) -> f64) -> Vec<Record> {
    let simulator = Simulator::new(seen, SENSOR).unwrap();
    let end_s = seen.duration().as_secs_f64();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let pattern = Normal::new(0.0, UNIT.pattern_c).unwrap();
    let noise = Normal::new(0.0, UNIT.sigma_c).unwrap();
    let pattern: Vec<f64> = (0..64).map(|_| pattern.sample(&mut random)).collect();
    let mut records = Vec::new();
    for index in 0..(end_s * 10.0) as u32 + 1 {
        let time_s = f64::from(index) / 10.0;
        let at_s = scene_s(time_s).clamp(0.0, end_s);
        let image = simulator.image(Duration::from_secs_f64(at_s)).celsius;
        let pixels = std::array::from_fn(|pixel| {
            let celsius = image[pixel]
                + pattern[pixel]
                + noise.sample(&mut random)
                + UNIT.drift_c_per_s * time_s;
            PixelWord((celsius * 4.0).round() as u16)
        });
        records.push(row(index, time_s, pixels));
    }
    records
}

pub(crate) fn row(index: u32, time_s: f64, pixels: [PixelWord; 64]) -> Record {
    Record {
        seq: u64::from(index),
        stamp: Stamp {
            t_boot_ns: 7_000_000_000 + (time_s * 1e9).round() as u64,
            t_utc_ns: 0,
            clock: ClockState::Unsynced,
        },
        reading: Reading::Frame(RecordedFrame {
            thermistor: Some(ThermistorWord(400)),
            pixels,
        }),
    }
}

pub(crate) fn compared(
    records: &[Record],
    claimed: &Scene,
    align: AlignOptions,
    seed: u64,
) -> Comparison {
    let options = Options {
        seed,
        shuffles: 20,
        align,
        ..Options::default()
    };
    compare_scene(records, claimed, SENSOR, &options).unwrap()
}

pub(crate) fn with(time: TimeAlignment, shift_max_s: f64) -> AlignOptions {
    AlignOptions {
        time,
        shift_max: Duration::from_secs_f64(shift_max_s),
        ..AlignOptions::default()
    }
}

pub(crate) fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * share).round() as usize]
}

pub(crate) fn correlation(comparison: &Comparison) -> f64 {
    let score = comparison.score(Measure::Correlation);
    score.value.unwrap_or(0.0)
}
