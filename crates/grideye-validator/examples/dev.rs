#![allow(clippy::all, clippy::pedantic, clippy::unwrap_used, missing_docs)]
use grideye_recording::Record;
use grideye_recording::csv::Reader;
use grideye_scene::Scene;
use grideye_validator::*;
use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

fn cpu_s() -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let told = told.and_then(|text| text.split(' ').next()?.parse().ok());
    1e-9 * told.unwrap_or(0.0)
}

use grideye_frame::{Celsius, Reading, RecordedFrame, ThermistorWord};
use grideye_recording::{ClockState, Stamp};
use grideye_scene::Simulator;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

fn recorded(
    simulator: &Simulator,
    frames: u32,
    pattern_c: f64,
    seed: u64,
    start_s: f64,
    to: impl Fn(f64) -> f64,
    step_ms: u64,
) -> Vec<Record> {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let mut normal = |sd: f64| {
        let d: f64 = StandardNormal.sample(&mut random);
        sd * d
    };
    let level = normal(0.3);
    let pattern: Vec<f64> = (0..64).map(|_| level + normal(pattern_c)).collect();
    (0..frames)
        .map(|i| {
            let time = std::time::Duration::from_secs_f64((start_s + 0.1 * f64::from(i)).max(0.0));
            let image = simulator.image(time).celsius;
            let pixels = std::array::from_fn(|p| {
                amg8833::word::pixel_word(Celsius::new(
                    to(image[p] + pattern[p] + normal(0.2)) as f32
                ))
                .unwrap()
            });
            Record {
                seq: i.into(),
                stamp: Stamp {
                    t_boot_ns: 3_000_000_000 + u64::from(i) * step_ms * 1_000_000,
                    t_utc_ns: 0,
                    clock: ClockState::Unsynced,
                },
                reading: Reading::Frame(RecordedFrame {
                    thermistor: Some(ThermistorWord(400)),
                    pixels,
                }),
            }
        })
        .collect()
}

fn ship(args: &[String]) {
    let folder = "scenes/";
    let seeds: u64 = args.get(2).and_then(|a| a.parse().ok()).unwrap_or(1);
    for name in args[3..].iter() {
        let text = std::fs::read_to_string(format!("{folder}{name}.toml")).unwrap();
        let read = |name: &str| std::fs::read_to_string(format!("{folder}{name}"));
        let scene = Scene::parse(&text, name, &read).unwrap().scene;
        let sensor = scene
            .sensors()
            .iter()
            .find(|s| (s.columns, s.rows) == (8, 8))
            .unwrap()
            .name
            .clone();
        let simulator = Simulator::without_grid(&scene, &sensor).unwrap();
        for seed in 0..seeds {
            let frames = 600.min(if scene.is_static() {
                600
            } else {
                scene.frame_count(scene.sensor(&sensor).unwrap()) as u32
            });
            let records = recorded(&simulator, frames, 0.38, 1000 + seed, 0.0, |c| c, 100);
            let options = Options {
                shuffles: 1,
                frames: Some(10),
                ..Options::default()
            };
            let before = cpu_s();
            let found = compare_scene(&records, &scene, &sensor, &options).unwrap();
            let right = found.decision.as_ref().unwrap();
            println!(
                "{name} {frames} {:.2}s {} p {:.3} || {} || untold {:?}",
                cpu_s() - before,
                found.judgment.verdict,
                right.right,
                found.judgment.headline,
                right
                    .alternatives
                    .iter()
                    .filter(|a| !a.is_told() && a.counts())
                    .map(|a| a.what.clone())
                    .collect::<Vec<_>>()
            );
        }
    }
}

fn main() {
    let args: Vec<String> = std::env::args().collect();
    if args[1] == "ship" {
        return ship(&args);
    }
    let folder = "target/tracked/";
    let list = std::fs::read_to_string(format!("{folder}list")).unwrap();
    let only = args.get(1).cloned().unwrap_or_default();
    let with_profile = args.iter().any(|a| a == "profile");
    let advises = args.iter().any(|a| a == "advise");
    let say = args.iter().any(|a| a == "say");
    let jobs: Vec<Vec<String>> = list
        .lines()
        .map(|l| l.split('\t').map(str::to_owned).collect())
        .filter(|j: &Vec<String>| only == "all" || only.split('|').any(|o| j[0] == o))
        .collect();
    let next = AtomicUsize::new(0);
    let out: Mutex<BTreeMap<String, [usize; 3]>> = Mutex::new(BTreeMap::new());
    let cpu = Mutex::new((0.0, 0));
    std::thread::scope(|s| {
        for _ in 0..2 {
            s.spawn(|| {
                loop {
                    let i = next.fetch_add(1, Ordering::Relaxed);
                    let Some(job) = jobs.get(i) else { return };
                    let text = std::fs::read_to_string(format!("{folder}{}", job[2])).unwrap();
                    let read = |name: &str| std::fs::read_to_string(format!("{folder}{name}"));
                    let scene = Scene::parse(&text, "scene.toml", &read).unwrap().scene;
                    let file = std::fs::File::open(format!("{folder}{}", job[1])).unwrap();
                    let records: Vec<Record> = Reader::new(file)
                        .unwrap()
                        .map(|r| r.unwrap().record)
                        .collect();
                    let unit = with_profile.then(|| {
                        let text = std::fs::read_to_string(format!("{folder}{}", job[3])).unwrap();
                        let v: Vec<f64> = text.split(' ').map(|v| v.parse().unwrap()).collect();
                        KnownUnit {
                            pattern_c: v.try_into().unwrap(),
                            has_background: true,
                            wander_c: 0.3,
                            bias_c: 0.1,
                            spread_c: 0.0,
                        }
                    });
                    let options = Options {
                        unit,
                        advises,
                        shuffles: 1,
                        frames: Some(10),
                        ..Options::default()
                    };
                    let before = cpu_s();
                    let found = compare_scene(&records, &scene, "ceiling", &options).unwrap();
                    let took = cpu_s() - before;
                    let v = match found.judgment.verdict {
                        Verdict::Agrees => 0,
                        Verdict::Disagrees => 1,
                        Verdict::CannotTell => 2,
                    };
                    out.lock().unwrap().entry(job[0].clone()).or_default()[v] += 1;
                    let mut c = cpu.lock().unwrap();
                    c.0 += took;
                    c.1 += 1;
                    if std::env::args().any(|a| a == "powers") {
                        for a in &found.decision.as_ref().unwrap().alternatives {
                            println!(
                                "{} {:.2} {:.2} {:.4} {}",
                                a.what, a.likeness, a.limit, a.power, a.is_alike
                            );
                        }
                    }
                    if say {
                        println!(
                            "{} {} {took:.2}s: {} || {}",
                            job[0], job[1], found.judgment.headline, found.judgment.next_step
                        );
                        let right = found.decision.as_ref().unwrap();
                        println!(
                            "     p {:.3} d {:.1} c {:?} lag {:.2} empty {} untold {:?}",
                            right.right,
                            right.surprise,
                            right.contrasts,
                            right.delay_s,
                            right.is_empty,
                            right
                                .alternatives
                                .iter()
                                .filter(|a| !a.is_told() && a.counts())
                                .map(|a| a.what.clone())
                                .collect::<Vec<_>>()
                        );
                    }
                }
            });
        }
    });
    for (what, counts) in out.lock().unwrap().iter() {
        println!("{what}: {counts:?}");
    }
    let c = cpu.lock().unwrap();
    println!("mean CPU {:.3} s of {}", c.0 / c.1 as f64, c.1);
}
