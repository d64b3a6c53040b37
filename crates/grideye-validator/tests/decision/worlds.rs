//! Recordings of rooms that differ from a scene as far as the scene leaves open, or otherwise; drawn by other code than the
//! validator's.

use grideye_frame::{PixelWord, RawFrame, Reading, ThermistorWord};
use grideye_recording::{ClockState, Record, Stamp};
use grideye_scene::{Scene, Simulator};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::fmt::Write as _;
use std::io;
use std::time::Duration;

pub(crate) const SENSOR: &str = "ceiling";
pub(crate) const AMBIENT_C: f64 = 22.0;

/// One person in a room of 6 x 6 x 2.7 m, under a sensor.
#[derive(Clone, Copy)]
pub(crate) enum Way {
    /// On this spot, meters from the point under the sensor.
    Stands(f64, f64),
    /// Around the point under the sensor, on a curve that never repeats within a minute.
    Walks { ahead_s: f64 },
}

/// How a recording differs from the scene.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Truth {
    Right,
    Nobody,
    /// The last person is not there.
    Missing,
    /// One more walks, 17 s behind.
    More,
    /// The first person is gone for the fifth of the time in which it is nearest to the middle of the view.
    Gone,
    /// The image is mirrored left to right, top to bottom, or turned by a quarter.
    MirroredX,
    MirroredY,
    Quarter,
    /// Everybody is this far aside, in a drawn direction, meters.
    Aside(f64),
    /// Everything is this much later, seconds.
    Late(f64),
    Backwards,
    /// The contrast is this many times the drawn one.
    Contrast(f64),
    /// All pixels drift by so much over the recording, °C.
    Drift(f64),
    /// One frame, at this share of the recording, is of another time.
    Stray(f64),
    /// Noise that is correlated by .8 from frame to frame, and from .15 to .4 °C over the pixels.
    Correlated,
}

#[derive(Clone, Copy)]
pub(crate) struct Unit {
    pub(crate) pattern_c: f64,
    pub(crate) noise_c: f64,
}

fn place(way: Way, time_s: f64) -> [f64; 2] {
    match way {
        Way::Stands(x, y) => [x, y],
        Way::Walks { ahead_s } => {
            let t = time_s + ahead_s;
            [0.9 * (0.61 * t).sin() + 0.3 * (0.233 * t).cos(), 0.9 * (0.47 * t + 0.8).cos() + 0.3 * (0.31 * t).sin()]
        }
    }
}

/// The scene's text, and its trajectories by file name; each person is where `at` has it.
fn text(ways: &[Way], end_s: f64, at: impl Fn(usize, f64) -> [f64; 2]) -> (String, Vec<(String, String)>) {
    let mut text = format!(
        "model = \"physical\"\ncollisions = \"ignore\"\n[room]\nsize_mm = [6000, 6000, 2700]\nambient_c = {AMBIENT_C}\n\
         [[sensor]]\nname = \"{SENSOR}\"\npreset = \"grid-eye\"\nposition_mm = [3000, 3000, 2700]\nelevation_deg = 90\nazimuth_deg = 0\n"
    );
    let mut files = Vec::new();
    for (person, way) in ways.iter().enumerate() {
        let mm = |time_s: f64| at(person, time_s).map(|m| 3000.0 + 1000.0 * m);
        let _ = writeln!(text, "[[agent]]\nname = \"p{person}\"\nperson = {{}}");
        if let Way::Stands(..) = way {
            let [x, y] = mm(0.0);
            let _ = writeln!(text, "position_mm = [{x:.1}, {y:.1}, 0]");
        } else {
            let mut rows = "t_s,x_mm,y_mm\n".to_owned();
            let mut time_s = 0.0;
            while time_s <= end_s {
                let [x, y] = mm(time_s);
                let _ = writeln!(rows, "{time_s:.2},{x:.1},{y:.1}");
                time_s += 0.1;
            }
            let _ = writeln!(text, "trajectory = \"p{person}.csv\"");
            files.push((format!("p{person}.csv"), rows));
        }
    }
    (text, files)
}

fn nearest_fifth(way: Option<Way>, frames: usize) -> usize {
    let Some(way) = way else { return 0 };
    let far = |index: usize| {
        let [x, y] = place(way, index as f64 / 10.0);
        x.hypot(y)
    };
    let sum = |from: usize| (from..from + frames / 5).map(far).sum::<f64>();
    (0..frames * 4 / 5).min_by(|a, b| sum(*a).total_cmp(&sum(*b))).unwrap_or(0)
}

fn parse((text, files): &(String, Vec<(String, String)>)) -> Scene {
    let read = |name: &str| {
        let file = files.iter().find(|file| file.0 == name);
        file.map(|file| file.1.clone()).ok_or_else(|| io::Error::from(io::ErrorKind::NotFound))
    };
    Scene::parse(text, "scene.toml", &read).unwrap_or_else(|error| panic!("{error}")).scene
}

/// What the user claims.
pub(crate) fn scene(ways: &[Way], frames: usize, more: &str) -> Scene {
    let (mut text, files) = text(ways, frames as f64 / 10.0 + 30.0, |person, time_s| place(ways[person], time_s));
    text.push_str(more);
    parse(&(text, files))
}

/// Draws by the laws that scenes have by default.
pub(crate) fn record(ways: &[Way], frames: usize, truth: Truth, unit: Unit, seed: u64) -> Vec<Record> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
    let span_s = frames as f64 / 10.0;
    let lag_s = 0.07 * draw() + if let Truth::Late(by_s) = truth { by_s } else { 0.0 };
    let angle = 1.7 * draw();
    let aside = if let Truth::Aside(by_m) = truth { by_m } else { 0.0 };
    let mut ways = ways.to_vec();
    let contrasts: Vec<f64> = (0..ways.len() + 1).map(|_| (0.35 * draw()).exp()).collect();
    match truth {
        Truth::Nobody => ways.clear(),
        Truth::Missing => {
            let _ = ways.pop();
        }
        Truth::More => ways.push(Way::Walks { ahead_s: -17.0 }),
        _ => {}
    }
    let fifth = frames / 5;
    let gone_from = nearest_fifth(ways.first().copied(), frames);
    let mut shown = vec![[AMBIENT_C; 64]; frames];
    for (person, way) in ways.iter().enumerate() {
        let offset = [aside * angle.cos() + 0.07 * draw(), aside * angle.sin() + 0.07 * draw()];
        let steps = (10.0 * span_s) as usize + 400;
        let kept = (-0.1_f64 / 0.7).exp();
        let mut wander = [[0.0; 2]; 1].to_vec();
        let sd = if matches!(way, Way::Stands(..)) { 0.0 } else { 0.07 };
        let mut now = [sd * draw(), sd * draw()];
        for _ in 0..steps {
            wander.push(now);
            now = now.map(|now| kept * now + sd * (1.0 - kept * kept).sqrt() * draw());
        }
        let at = |_: usize, time_s: f64| {
            let [x, y] = place(*way, time_s);
            let step = wander[((10.0 * time_s) as usize).min(steps)];
            [x + offset[0] + step[0], y + offset[1] + step[1]]
        };
        let alone = parse(&text(&[*way], span_s + 30.0, at));
        let simulator = Simulator::without_grid(&alone, SENSOR).unwrap();
        for (index, image) in shown.iter_mut().enumerate() {
            let mut time_s = index as f64 / 10.0;
            if truth == Truth::Backwards {
                time_s = span_s - time_s;
            }
            if let Truth::Stray(at) = truth
                && index == (at * (frames - 1) as f64) as usize
            {
                time_s = (time_s + 0.4 * span_s) % span_s;
            }
            let is_gone = truth == Truth::Gone && person == 0 && (gone_from..gone_from + fifth).contains(&index);
            if is_gone {
                continue;
            }
            let seen = simulator.image(Duration::from_secs_f64((time_s - lag_s).max(0.0))).celsius;
            let mut contrast = contrasts[person];
            if let Truth::Contrast(times) = truth {
                contrast = times;
            }
            for (pixel, celsius) in image.iter_mut().zip(seen) {
                *pixel += contrast * (celsius - AMBIENT_C);
            }
        }
    }
    let level_c = 0.5 * draw();
    let pattern: Vec<f64> = (0..64).map(|_| unit.pattern_c * draw()).collect();
    let correlated = truth == Truth::Correlated;
    let noises: Vec<f64> = (0..64)
        .map(|pixel| if correlated { 0.15 + 0.25 * f64::from(pixel % 8) / 7.0 } else { unit.noise_c })
        .collect();
    let kept: f64 = if correlated { 0.8 } else { 0.0 };
    let mut noise: Vec<f64> = noises.iter().map(|sd| sd * draw()).collect();
    let mut records = Vec::with_capacity(frames);
    for (index, image) in shown.iter().enumerate() {
        let drift_c = if let Truth::Drift(by_c) = truth { by_c * index as f64 / frames as f64 } else { 0.0 };
        for (noise, sd) in noise.iter_mut().zip(&noises) {
            *noise = kept * *noise + sd * (1.0 - kept * kept).sqrt() * draw();
        }
        let pixels = std::array::from_fn(|pixel| {
            let (row, column) = (pixel / 8, pixel % 8);
            let from = match truth {
                Truth::MirroredX => row * 8 + 7 - column,
                Truth::MirroredY => (7 - row) * 8 + column,
                Truth::Quarter => column * 8 + 7 - row,
                _ => pixel,
            };
            let celsius = image[from] + level_c + pattern[pixel] + noise[pixel] + drift_c;
            PixelWord((celsius * 4.0).round() as u16)
        });
        records.push(Record {
            seq: index as u64,
            stamp: Stamp {
                t_boot_ns: 3_000_000_000 + index as u64 * 100_000_000,
                t_utc_ns: 0,
                clock: ClockState::Unsynced,
            },
            reading: Reading::Frame(RawFrame {
                thermistor: ThermistorWord(((AMBIENT_C + 4.5) * 16.0) as u16),
                pixels,
            }),
        });
    }
    records
}
