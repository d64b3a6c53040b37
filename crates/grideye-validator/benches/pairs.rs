//! Measures the time to score one pair of frames, and the static protocol on 1,000 x 1,000 frames, with frames of a
//! real session. Best of several rounds, so that other work counts little.

use grideye_validator::metrics::{
    Binning, IS_THRESHOLD, Scorer, correlation, entropy, evaluation_graph, image_similarity,
    joint_entropy, mutual_information, thresholds_c,
};
use grideye_validator::{Protocol, RealFrame, Settings, Shape, SimulatedFrame, compare};
use std::error::Error;
use std::hint::black_box;
use std::path::Path;
use std::time::{Duration, Instant};

const ROUNDS: usize = 20;
const SESSION: &str = "../../recordings/linaige/Session2_2021-07-01_RoomB_v2.csv";

fn main() -> Result<(), Box<dyn Error>> {
    let frames = session()?;
    println!("{} frames of {SESSION}", frames.len());
    for (name, binning) in [
        ("256 grey levels", Binning::PaperGrey256),
        ("steps of 0.25 °C", Binning::Step { width_c: 0.25 }),
    ] {
        let fast = at_once(&frames, binning);
        let slow = one_by_one(&frames, binning);
        println!(
            "C, entropies, MI, IS and evaluation graph of a pair, {name}: {fast:.0} ns at once, {slow:.0} ns one by one, {:.1} times",
            slow / fast
        );
    }
    for threads in [1, 2] {
        let seconds = static_protocol(&frames, threads)?;
        println!("static protocol, 1000 x 1000 frames, {threads} threads: {seconds:.3} s");
    }
    Ok(())
}

/// Nanoseconds per pair.
fn at_once(frames: &[[f64; 64]], binning: Binning) -> f64 {
    let mut scorer = Scorer::new();
    best(frames, |x, y| {
        black_box(scorer.score(x, y, binning));
    })
}

fn one_by_one(frames: &[[f64; 64]], binning: Binning) -> f64 {
    let thresholds = thresholds_c();
    best(frames, |x, y| {
        black_box((
            correlation(x, y),
            entropy(x, binning),
            entropy(y, binning),
            joint_entropy(x, y, binning),
            mutual_information(x, y, binning),
            image_similarity(x, y, IS_THRESHOLD),
            evaluation_graph(x, y, &thresholds),
        ));
    })
}

fn best(frames: &[[f64; 64]], mut pair: impl FnMut(&[f64; 64], &[f64; 64])) -> f64 {
    let round = |_| {
        let start = Instant::now();
        for frames in frames.windows(2) {
            pair(black_box(&frames[0]), black_box(&frames[1]));
        }
        start.elapsed()
    };
    let fastest = (0..ROUNDS).map(round).min().unwrap_or_default();
    fastest.as_secs_f64() * 1e9 / f64::from(u32::try_from(frames.len() - 1).unwrap_or(1))
}

fn static_protocol(frames: &[[f64; 64]], threads: usize) -> Result<f64, Box<dyn Error>> {
    let time = Duration::ZERO;
    let real: Vec<RealFrame> = frames[..1_003]
        .windows(4)
        .map(|frames| RealFrame {
            time,
            celsius: frames[0].to_vec(),
            later: Some(frames[3].to_vec()),
        })
        .collect();
    let simulated: Vec<SimulatedFrame> = frames[800..1_800]
        .iter()
        .map(|frame| SimulatedFrame {
            time,
            celsius: frame.to_vec(),
            noise_free: frames[400].to_vec(),
            truth: None,
        })
        .collect();
    let shape = Shape {
        columns: 8,
        rows: 8,
    };
    let settings = Settings {
        threads,
        ..Settings::new(Protocol::Static, 25.0, 0.25)
    };
    let mut fastest = f64::INFINITY;
    for _ in 0..3 {
        let start = Instant::now();
        black_box(compare(shape, &real, &simulated, &settings)?);
        fastest = fastest.min(start.elapsed().as_secs_f64());
    }
    Ok(fastest)
}

fn session() -> Result<Vec<[f64; 64]>, Box<dyn Error>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(SESSION);
    let text = std::fs::read_to_string(path)?;
    let mut frames = Vec::new();
    for line in text.lines().skip(1) {
        let mut frame = [0.0; 64];
        for (pixel, cell) in frame.iter_mut().zip(line.split(',').skip(2)) {
            *pixel = cell.parse()?;
        }
        frames.push(frame);
    }
    Ok(frames)
}
