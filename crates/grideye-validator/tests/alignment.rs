//! Alignment on walks whose delay, rate, pace and orientation are known, and on scenes that are wrong: what is found,
//! what it regains, and that nothing wrong is made to agree.
#![expect(
    clippy::unwrap_used,
    clippy::as_conversions,
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "what fails in a helper fails the test, and its counts are small"
)]

use grideye_frame::{PixelWord, RawFrame, Reading, ThermistorWord};
use grideye_recording::{ClockState, Record, Stamp, linaige};
use grideye_scene::{Scene, Simulator};
use grideye_validator::align::{AlignOptions, Orientation, TimeAlignment, TimeFound, align_films};
use grideye_validator::{Comparison, LeftOut, Measure, Options, Verdict, compare_scene};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use std::time::Duration;

const SENSOR: &str = "ceiling";
/// Seeds of every row of the tables, of which `GRIDEYE_ALL_SEEDS=1` runs all.
const SEEDS: u64 = 20;
const SEEDS_BY_DEFAULT: u64 = 4;
/// Seeds of the slower ones.
const FEWER_SEEDS: u64 = 5;
const FEWER_SEEDS_BY_DEFAULT: u64 = 2;

fn all_seeds() -> bool {
    std::env::var_os("GRIDEYE_ALL_SEEDS").is_some_and(|value| value == "1")
}

fn seeds() -> u64 {
    if all_seeds() { SEEDS } else { SEEDS_BY_DEFAULT }
}

fn fewer_seeds() -> u64 {
    if all_seeds() {
        FEWER_SEEDS
    } else {
        FEWER_SEEDS_BY_DEFAULT
    }
}

/// Says how to run what a test has left out.
fn closing_note() {
    if !all_seeds() {
        println!(
            "{SEEDS_BY_DEFAULT} of {SEEDS} seeds and {FEWER_SEEDS_BY_DEFAULT} of {FEWER_SEEDS}: GRIDEYE_ALL_SEEDS=1 runs all"
        );
    }
}

struct Walk {
    way: &'static str,
    azimuth_deg: f64,
    elevation_deg: f64,
    radiator: &'static str,
    speed: f64,
    /// How long the second way-point is stood at.
    stop_s: u32,
}

const WALK: Walk = Walk {
    way: "1200,1500,0\n3800,1700,0\n3300,3600,0\n1600,3300,0\n",
    azimuth_deg: -90.0,
    elevation_deg: 90.0,
    radiator: "",
    speed: 600.0,
    stop_s: 0,
};

const RADIATOR: &str = "[[object]]\nname = \"radiator\"\nposition_mm = [1250, 3300, 0]\nsize_mm = [200, 700, 600]\ntemperature_c = 34\n";

impl Walk {
    fn scene(&self) -> Scene {
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

/// What a sensor adds: noise, quantisation, a fixed pattern and a slow drift.
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

/// A recording of `seen` at 10 Hz, as long as the walk, whose frame at time t shows the scene's second `scene_s(t)`: before
/// the walk and after it the person stands.
fn record(seen: &Scene, seed: u64, scene_s: impl Fn(f64) -> f64) -> Vec<Record> {
    let simulator = Simulator::without_grid(seen, SENSOR).unwrap();
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

fn row(index: u32, time_s: f64, pixels: [PixelWord; 64]) -> Record {
    Record {
        seq: u64::from(index),
        stamp: Stamp {
            t_boot_ns: 7_000_000_000 + (time_s * 1e9).round() as u64,
            t_utc_ns: 0,
            clock: ClockState::Unsynced,
        },
        reading: Reading::Frame(RawFrame {
            thermistor: ThermistorWord(400),
            pixels,
        }),
    }
}

fn compared(records: &[Record], claimed: &Scene, align: AlignOptions, seed: u64) -> Comparison {
    let options = Options {
        seed,
        shuffles: 20,
        align,
        ..Options::default()
    };
    compare_scene(records, claimed, SENSOR, &options).unwrap()
}

fn with(time: TimeAlignment, shift_max_s: f64) -> AlignOptions {
    AlignOptions {
        time,
        shift_max: Duration::from_secs_f64(shift_max_s),
        ..AlignOptions::default()
    }
}

fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * share).round() as usize]
}

fn skill(comparison: &Comparison, measure: Measure) -> f64 {
    comparison.score(measure).skill().unwrap_or(0.0)
}

/// C and gain, the two that the verdict rests on.
fn both(comparison: &Comparison) -> f64 {
    let value = |measure| comparison.score(measure).value.unwrap_or(0.0);
    value(Measure::Correlation) + value(Measure::Gain)
}

struct Truth {
    name: &'static str,
    shift_s: f64,
    rate: f64,
    shift_max_s: f64,
}

const fn narrow(name: &'static str, shift_s: f64, rate: f64) -> Truth {
    Truth {
        name,
        shift_s,
        rate,
        shift_max_s: 0.5,
    }
}

const fn wide(name: &'static str, shift_s: f64, rate: f64) -> Truth {
    Truth {
        shift_max_s: 3.0,
        ..narrow(name, shift_s, rate)
    }
}

const TRUTHS: [Truth; 7] = [
    narrow("none", 0.0, 0.0),
    narrow("0.25 s", 0.25, 0.0),
    narrow("-0.43 s", -0.43, 0.0),
    narrow("4 % fast", 0.0, 0.04),
    narrow("0.3 s and 5 % slow", 0.3, -0.05),
    wide("1.5 s, up to 3 s allowed", 1.5, 0.0),
    wide("-2.2 s and 4 % fast, up to 3 s", -2.2, 0.04),
];

/// Known delays and rates: errors, and how much of what the delay cost is regained.
#[test]
fn delay_and_rate_are_found_and_the_scores_regained() {
    let scene = WALK.scene();
    println!(
        "\n{:<34}{:>12}{:>12}{:>12}{:>12}{:>11}{:>11}{:>9}",
        "truth", "|shift| med", "95 %, s", "|rate| med", "95 %", "regained", "10 %", "agrees"
    );
    let ideal: Vec<f64> = (0..seeds())
        .map(|seed| {
            both(&unaligned(
                &record(&scene, seed, |time_s| time_s),
                &scene,
                seed,
            ))
        })
        .collect();
    let found: Vec<Recovered> = TRUTHS
        .iter()
        .map(|truth| recovered(&scene, truth, &ideal))
        .collect();
    closing_note();
    for (truth, found) in TRUTHS.iter().zip(found) {
        found.hold_to(truth);
    }
}

fn unaligned(records: &[Record], claimed: &Scene, seed: u64) -> Comparison {
    compared(records, claimed, with(TimeAlignment::None, 0.5), seed)
}

/// What alignment made of one truth, over the seeds.
struct Recovered {
    /// 95 % quantiles of the errors.
    shift_s: f64,
    rate: f64,
    /// 10 % quantile of the share of the scores that came back.
    regained: f64,
    agrees: u64,
}

fn recovered(scene: &Scene, truth: &Truth, ideal: &[f64]) -> Recovered {
    let (mut shifts, mut rates, mut regained, mut agrees) = (vec![], vec![], vec![], 0);
    let align = with(TimeAlignment::Rate, truth.shift_max_s);
    for (seed, ideal) in (0..).zip(ideal) {
        let warped = record(scene, seed, |time_s| {
            time_s + truth.shift_s + truth.rate * time_s
        });
        let aligned = compared(&warped, scene, align, seed);
        let before = both(&unaligned(&warped, scene, seed));
        let time = aligned.alignment.as_ref().unwrap().time.clone().unwrap();
        assert!(time.applied, "{}: {time:?}", truth.name);
        shifts.push((time.shift_s - truth.shift_s).abs());
        rates.push((time.rate - truth.rate).abs());
        regained.push((both(&aligned) - before) / (ideal - before));
        agrees += u64::from(aligned.judgement.verdict == Verdict::Agrees);
    }
    let found = Recovered {
        shift_s: quantile(&mut shifts, 0.95),
        rate: quantile(&mut rates, 0.95),
        regained: quantile(&mut regained, 0.1),
        agrees,
    };
    let share = |regained: f64| {
        if truth.shift_s == 0.0 && truth.rate == 0.0 {
            "-".to_owned()
        } else {
            format!("{:.0} %", 100.0 * regained)
        }
    };
    println!(
        "{:<34}{:>12.4}{:>12.4}{:>12.5}{:>12.5}{:>11}{:>11}{:>6}/{}",
        truth.name,
        quantile(&mut shifts, 0.5),
        found.shift_s,
        quantile(&mut rates, 0.5),
        found.rate,
        share(quantile(&mut regained, 0.5)),
        share(found.regained),
        agrees,
        ideal.len()
    );
    found
}

impl Recovered {
    /// Half a frame, and what half a frame is at the ends of the recording.
    fn hold_to(&self, truth: &Truth) {
        let name = truth.name;
        assert!(self.shift_s < 0.05, "{name}: {} s", self.shift_s);
        assert!(self.rate < 0.01, "{name}: {}", self.rate);
        assert!(
            self.agrees + seeds() / 20 >= seeds(),
            "{name}: {}",
            self.agrees
        );
        if truth.shift_s != 0.0 {
            assert!(self.regained > 0.8, "{name}: {}", self.regained);
        }
    }
}

const ALIGNMENTS: [(&str, TimeAlignment, f64, bool); 6] = [
    ("none", TimeAlignment::None, 0.5, true),
    ("shift", TimeAlignment::Shift, 0.5, false),
    ("rate", TimeAlignment::Rate, 0.5, true),
    ("warp", TimeAlignment::Warp, 0.5, false),
    ("law", TimeAlignment::Law, 0.5, false),
    ("rate, 3 s", TimeAlignment::Rate, 3.0, false),
];

/// How often a claimed scene agreed under each of [`ALIGNMENTS`], of so many seeds.
type Cells = Vec<(u64, u64)>;

/// A wrong scene stays wrong, whatever may be aligned.
#[test]
fn a_wrong_scene_is_not_aligned_into_agreement() {
    println!("\nverdict agrees, of so many seeds");
    let names: String = ALIGNMENTS
        .iter()
        .map(|(name, ..)| format!("{name:>10}"))
        .collect();
    println!("{:<32}{names}{:>10}", "claimed scene", "likeness");
    let mut wrong = Vec::new();
    for (name, walk) in wrong_walks() {
        let cells = agreements(name, &walk.scene());
        if !is_bearable(&cells) {
            wrong.push((name, cells));
        }
    }
    let right = agreements("the right scene", &WALK.scene());
    closing_note();
    assert!(
        right.iter().all(|(agrees, seeds)| agrees == seeds),
        "{right:?}"
    );
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// By default not once; with more freedom asked for, one of all seeds is allowed to slip.
fn is_bearable(cells: &[(u64, u64)]) -> bool {
    cells[..3].iter().all(|(agrees, _)| *agrees == 0)
        && cells[3..].iter().all(|(agrees, _)| *agrees <= 1)
}

fn wrong_walks() -> [(&'static str, Walk); 10] {
    let way = |way| Walk { way, ..WALK };
    let at = |elevation_deg, azimuth_deg| Walk {
        elevation_deg,
        azimuth_deg,
        ..WALK
    };
    let speed = |speed| Walk { speed, ..WALK };
    let radiator = Walk {
        radiator: RADIATOR,
        ..WALK
    };
    [
        (
            "walks elsewhere",
            way("3800,3500,0\n1200,3300,0\n1700,1400,0\n3400,1700,0\n"),
        ),
        (
            "walks 0.8 m beside",
            way("1200,2300,0\n3800,2500,0\n3300,4400,0\n1600,4100,0\n"),
        ),
        (
            "walks backwards",
            way("1600,3300,0\n3300,3600,0\n3800,1700,0\n1200,1500,0\n"),
        ),
        ("a radiator too many", radiator),
        ("sensor tilted by 10 degrees", at(80.0, -90.0)),
        ("sensor tilted the other way", at(80.0, 0.0)),
        ("sensor turned by 90 degrees", at(90.0, 0.0)),
        ("twice as fast", speed(1200.0)),
        ("half as fast", speed(300.0)),
        ("stops for 2 s on the way", Walk { stop_s: 2, ..WALK }),
    ]
}

fn agreements(name: &str, claimed: &Scene) -> Cells {
    let seen = WALK.scene();
    let (mut cells, mut likeness) = (Vec::new(), Vec::new());
    for (_, time, shift_max_s, is_default) in ALIGNMENTS {
        let seeds = if is_default { seeds() } else { fewer_seeds() };
        let mut agrees = 0;
        for seed in 0..seeds {
            let records = record(&seen, seed, |time_s| time_s);
            let found = compared(&records, claimed, with(time, shift_max_s), seed);
            agrees += u64::from(found.judgement.verdict == Verdict::Agrees);
            likeness.extend(found.alignment.unwrap().time.map(|time| time.likeness));
        }
        cells.push((agrees, seeds));
    }
    let shown: String = cells
        .iter()
        .map(|(agrees, seeds)| format!("{:>10}", format!("{agrees}/{seeds}")))
        .collect();
    println!("{name:<32}{shown}{:>10.2}", quantile(&mut likeness, 0.5));
    cells
}

/// A mirrored or turned image is found, reported and not silently aligned; asked for, it is turned back.
#[test]
fn an_image_that_lies_otherwise_is_reported_and_turned_if_asked() {
    let scene = WALK.scene();
    for orientation in Orientation::ALL {
        let mut found = 0;
        for seed in 0..fewer_seeds() {
            let records: Vec<Record> = record(&scene, seed, |time_s| time_s + 0.2)
                .into_iter()
                .map(|record| turned(record, orientation))
                .collect();
            let silent = compared(&records, &scene, AlignOptions::default(), seed);
            let seen = silent.alignment.as_ref().unwrap().orientation.unwrap();
            found += u64::from(seen.orientation == orientation);
            assert!(!seen.applied);
            let asked = AlignOptions {
                orientation: true,
                ..AlignOptions::default()
            };
            let turned = compared(&records, &scene, asked, seed);
            assert_eq!(
                turned.judgement.verdict,
                Verdict::Agrees,
                "{orientation} {seed}"
            );
            if orientation != Orientation::Upright {
                assert_eq!(
                    silent.judgement.verdict,
                    Verdict::Disagrees,
                    "{orientation} {seed}"
                );
                let told = silent
                    .notes
                    .iter()
                    .any(|note| note.starts_with(&format!("The image is {orientation}")));
                assert!(told, "{:?}", silent.notes);
            }
        }
        println!("{orientation:<40} found {found} of {}", fewer_seeds());
        assert_eq!(found, fewer_seeds(), "{orientation}");
    }
}

fn turned(record: Record, orientation: Orientation) -> Record {
    let reading = record.reading.map(|mut raw| {
        let words = raw.pixels.map(|word| f64::from(word.0));
        raw.pixels = orientation.apply(&words).map(|word| PixelWord(word as u16));
        raw
    });
    Record { reading, ..record }
}

/// Uneven walking: minimum jerk where the scene has constant speed, and a pace that swings.
#[test]
fn pace_is_found_by_law_and_by_warp() {
    let scene = WALK.scene();
    let end_s = scene.duration().as_secs_f64();
    let jerk = |time_s: f64| {
        let u = (time_s / end_s).clamp(0.0, 1.0);
        end_s * u * u * u * (10.0 + u * (6.0 * u - 15.0))
    };
    let swing = |time_s: f64| time_s + 0.35 * (time_s * std::f64::consts::TAU / end_s).sin();
    println!(
        "\n{:<28}{:>8}{:>9}{:>9}{:>9}",
        "pace", "align", "C skill", "gain", "agrees"
    );
    for (name, pace) in [
        ("minimum jerk", &jerk as &dyn Fn(f64) -> f64),
        ("swings by 0.35 s", &swing),
    ] {
        for time in [
            TimeAlignment::None,
            TimeAlignment::Rate,
            TimeAlignment::Warp,
            TimeAlignment::Law,
        ] {
            let (mut c, mut gain, mut agrees) = (vec![], vec![], 0);
            for seed in 0..fewer_seeds() {
                let found = compared(&record(&scene, seed, pace), &scene, with(time, 0.8), seed);
                c.push(skill(&found, Measure::Correlation));
                gain.push(skill(&found, Measure::Gain));
                agrees += u64::from(found.judgement.verdict == Verdict::Agrees);
            }
            println!(
                "{name:<28}{:>8}{:>9.2}{:>9.2}{agrees:>6}/{}",
                time.name(),
                quantile(&mut c, 0.5),
                quantile(&mut gain, 0.5),
                fewer_seeds()
            );
        }
    }
    let found = compared(
        &record(&scene, 1, jerk),
        &scene,
        with(TimeAlignment::Law, 0.8),
        1,
    );
    let law = found.alignment.unwrap().time.unwrap().law.unwrap();
    assert!(
        (law.ease - 1.0).abs() < 0.25 && law.begins_late_s.abs() < 0.3,
        "{law:?}"
    );
    let found = compared(
        &record(&scene, 1, swing),
        &scene,
        with(TimeAlignment::Warp, 0.8),
        1,
    );
    let warp = found.alignment.unwrap().time.unwrap().warp.unwrap();
    assert!((warp.departure_max_s() - 0.35).abs() < 0.15, "{warp:?}");
}

/// Two hundred seconds there and back at 10 Hz, a clock that is 3 % fast: the rate is known to a tenth of a per mille.
#[test]
fn two_thousand_frames_are_aligned() {
    let way = "1200,1500,0\n3800,1700,0\n3300,3600,0\n1600,3300,0\n".repeat(16);
    let scene = Walk {
        way: Box::leak(way.into_boxed_str()),
        ..WALK
    }
    .scene();
    let records = record(&scene, 4, |time_s| time_s + 0.2 + 0.03 * time_s);
    let records = &records[..records.len().min(2_000)];
    for time in [
        TimeAlignment::None,
        TimeAlignment::Rate,
        TimeAlignment::Warp,
        TimeAlignment::Law,
    ] {
        let begin = std::time::Instant::now();
        let found = compared(records, &scene, with(time, 0.5), 1);
        println!(
            "{} frames, {}: {:.2} s",
            records.len(),
            time.name(),
            begin.elapsed().as_secs_f64()
        );
        if time == TimeAlignment::Rate {
            let time = found.alignment.unwrap().time.unwrap();
            println!("shift {:.4} s, rate {:.5}", time.shift_s, time.rate);
            assert!((time.shift_s - 0.2).abs() < 0.02, "{time:?}");
            assert!((time.rate - 0.03).abs() < 0.000_2, "{time:?}");
            assert_eq!(found.judgement.verdict, Verdict::Agrees);
        }
    }
}

/// A recording that begins in the middle of the walk: the delay counts at its own first frame, whatever second of the scene
/// that is, and without the second nothing is found.
#[test]
fn a_recording_that_begins_later_is_aligned_from_its_first_frame() {
    let way = WALK.way.repeat(4);
    let scene = Walk {
        way: Box::leak(way.into_boxed_str()),
        ..WALK
    }
    .scene();
    let scene_s = |time_s: f64| time_s + 20.0 + 0.2 + 0.03 * time_s;
    let end_s = scene.duration().as_secs_f64();
    let mut records = record(&scene, 6, scene_s);
    let seen = (0..records.len())
        .filter(|&index| scene_s(index as f64 / 10.0) < end_s)
        .count();
    records.truncate(seen);
    let found = |start_s: u64| {
        let options = Options {
            start: Duration::from_secs(start_s),
            shuffles: 20,
            align: with(TimeAlignment::Rate, 0.5),
            ..Options::default()
        };
        let found = compare_scene(&records, &scene, SENSOR, &options).unwrap();
        let time = found.alignment.as_ref().unwrap().time.clone().unwrap();
        (found.judgement.verdict, time)
    };
    let (verdict, time) = found(20);
    assert!(time.applied, "{time:?}");
    assert!((time.shift_s - 0.2).abs() < 0.1, "{time:?}");
    assert!((time.rate - 0.03).abs() < 0.01, "{time:?}");
    assert_eq!(verdict, Verdict::Agrees);
    assert_ne!(found(0).0, Verdict::Agrees);
}

/// Faults planted into a recording are left out, each with its reason, and nothing else.
#[test]
fn what_says_nothing_of_its_moment_is_left_out_with_the_reason() {
    let scene = WALK.scene();
    let mut records = record(&scene, 3, |time_s| time_s);
    let pixels = |records: &[Record], index: usize| records[index].reading.frame().unwrap().pixels;
    let put = |records: &mut Vec<Record>, index: usize, from: std::ops::Range<usize>| {
        let before = pixels(records, index - 1);
        let mut now = pixels(records, index);
        now[from.clone()].copy_from_slice(&before[from]);
        records[index] = row(index as u32, index as f64 / 10.0, now);
    };
    put(&mut records, 10, 40..64);
    put(&mut records, 20, 0..64);
    for index in 40..46 {
        put(&mut records, index, 0..64);
    }
    records[5].reading = Reading::NoData(grideye_frame::NoData::Nack);
    // A stall of a second, and three rows that came at once.
    for (index, record) in records.iter_mut().enumerate().skip(60) {
        let late_s = if index < 63 {
            1.0 + 0.002 * (index - 60) as f64 - (index - 60) as f64 / 10.0
        } else {
            1.0
        };
        record.stamp.t_boot_ns = 7_000_000_000 + ((index as f64 / 10.0 + late_s) * 1e9) as u64;
    }
    let found = compared(&records, &scene, AlignOptions::default(), 1);
    let left: Vec<(LeftOut, usize, u64)> = found
        .alignment
        .unwrap()
        .left_out
        .iter()
        .map(|left| (left.reason, left.rows, left.first_seq))
        .filter(|left| left.0 != LeftOut::OutsideScene)
        .collect();
    println!("{left:?}");
    assert_eq!(
        left,
        [
            (LeftOut::Missing(grideye_frame::NoData::Nack), 1, 5),
            (LeftOut::Torn, 1, 10),
            (LeftOut::Duplicate, 1, 20),
            (LeftOut::Stalled, 6, 40),
            (LeftOut::Burst, 2, 61),
        ]
    );
}

/// A sensor without noise repeats itself in a still room: that is no fault of its recording.
#[test]
fn a_sensor_without_noise_is_not_taken_for_one_that_repeats_frames() {
    let scene = Walk {
        way: "2000,2000,0\n",
        speed: 600.0,
        ..WALK
    }
    .scene();
    let simulator = Simulator::without_grid(&scene, SENSOR).unwrap();
    let image = simulator.image(Duration::ZERO).celsius;
    let records: Vec<Record> = (0..50)
        .map(|index| {
            row(
                index,
                f64::from(index) / 10.0,
                std::array::from_fn(|pixel| PixelWord((image[pixel] * 4.0).round() as u16)),
            )
        })
        .collect();
    let found = compared(&records, &scene, AlignOptions::default(), 1);
    assert!(found.alignment.unwrap().left_out.is_empty());
}

/// Rows 0 to 1054 of session 3 of LINAIGE (`recordings/linaige/SOURCE.md`): its even frames are the film, its odd ones
/// the recording, delayed and resampled; both hold the noise of a real sensor, and not the same.
#[test]
fn a_real_recording_is_aligned_with_itself() {
    let frames = session_3();
    let (film, real) = (half(&frames, 0), half(&frames, 1));
    println!("\nLINAIGE session 3, rows 0 to 1054; film: even rows, recording: odd rows");
    println!(
        "{:>8}{:>8}{:>12}{:>12}{:>10}{:>10}",
        "shift", "rate", "shift found", "rate found", "likeness", "chance"
    );
    for (shift_s, rate) in [
        (0.0, 0.0),
        (0.25, 0.0),
        (-0.4, 0.0),
        (0.0, 0.04),
        (0.3, -0.05),
        (2.0, 0.03),
    ] {
        real_delay_is_found(&film, &real, shift_s, rate);
    }
    // A minute later in the same room, other steps of the same person: nothing to align.
    let (later_s, later): (Vec<f64>, Vec<[f64; 64]>) = real
        .0
        .iter()
        .zip(real.1.iter().skip(real.1.len() / 2))
        .map(|(time_s, celsius)| (*time_s, *celsius))
        .unzip();
    let found = films_aligned(&film, &(later_s, later));
    println!(
        "half the recording later: likeness {:.3}, chance {:.3}, applied {}",
        found.likeness,
        found.chance.unwrap(),
        found.applied
    );
    assert!(!found.applied, "{found:?}");
}

/// Times in seconds, and the frames of them.
type Film = (Vec<f64>, Vec<[f64; 64]>);

fn session_3() -> Vec<(f64, [f64; 64])> {
    let name = "Session3_2021-07-06_RoomA_v2.csv";
    let path = format!(
        "{}/../../recordings/linaige/{name}",
        env!("CARGO_MANIFEST_DIR")
    );
    linaige::Reader::new(
        std::fs::File::open(path).unwrap(),
        linaige::Date::from_file_name(name).unwrap(),
        linaige::stream_from_file_name(name),
    )
    .unwrap()
    .take(1055)
    .filter_map(|row| {
        let record = row.unwrap().row.record;
        let pixels = record.reading.frame()?.pixels;
        let celsius = pixels.map(|word| f64::from(word.0 & 0xFFF) * 0.25);
        Some((record.stamp.t_boot_ns as f64 / 1e9, celsius))
    })
    .collect()
}

fn half(frames: &[(f64, [f64; 64])], first: usize) -> Film {
    let first_s = frames[0].0;
    frames
        .iter()
        .skip(first)
        .step_by(2)
        .map(|(time_s, celsius)| (time_s - first_s, *celsius))
        .unzip()
}

fn films_aligned(film: &Film, recording: &Film) -> TimeFound {
    align_films(
        (&film.0, &film.1),
        (&recording.0, &recording.1),
        &with(TimeAlignment::Rate, 3.0),
    )
    .unwrap()
    .unwrap()
}

fn real_delay_is_found(film: &Film, (real_s, real): &Film, shift_s: f64, rate: f64) {
    // The recording's clock is such that scene = t + shift + rate * (t - origin); the origin is its first frame.
    let origin_s = real_s[0];
    let times_s: Vec<f64> = real_s
        .iter()
        .map(|scene_s| (scene_s - shift_s + rate * origin_s) / (1.0 + rate))
        .collect();
    // The shift is that at the recording's first frame, which is not at the origin.
    let expected_s = shift_s + rate * (times_s[0] - origin_s);
    let found = films_aligned(film, &(times_s, real.clone()));
    println!(
        "{shift_s:>8.2}{rate:>8.3}{:>12.4}{:>12.5}{:>10.3}{:>10.3}",
        found.shift_s,
        found.rate,
        found.likeness,
        found.chance.unwrap()
    );
    assert!(found.applied);
    assert!(
        (found.shift_s - expected_s).abs() < 0.05,
        "{expected_s} {found:?}"
    );
    assert!((found.rate - rate).abs() < 0.001, "{found:?}");
}

#[test]
fn bounds_out_of_range_are_refused() {
    let scene = WALK.scene();
    let records = record(&scene, 1, |time_s| time_s);
    for align in [
        AlignOptions {
            shift_max: Duration::from_millis(60_001),
            ..AlignOptions::default()
        },
        AlignOptions {
            rate_max: 0.201,
            ..AlignOptions::default()
        },
        AlignOptions {
            rate_max: f64::NAN,
            ..AlignOptions::default()
        },
    ] {
        let options = Options {
            align,
            ..Options::default()
        };
        let error = compare_scene(&records, &scene, SENSOR, &options).unwrap_err();
        assert!(error.to_string().starts_with("setting `max-"), "{error}");
    }
    // The largest that are allowed are.
    let most = AlignOptions {
        shift_max: grideye_validator::align::SHIFT_MAX,
        rate_max: grideye_validator::align::RATE_MAX,
        ..AlignOptions::default()
    };
    compared(&records, &scene, most, 1);
}
