//! Measures the static protocol on 1,000 x 1,000 frames of a real session: scores, floors and ceilings. Best of several
//! rounds, so that other work counts little.

use grideye_validator::{Protocol, RealFrame, Settings, SimulatedFrame, compare};
use std::error::Error;
use std::hint::black_box;
use std::path::Path;
use std::time::{Duration, Instant};

const ROUNDS: usize = 3;
const SESSION: &str = "../../recordings/linaige/Session2_2021-07-01_RoomB_v2.csv";

fn main() -> Result<(), Box<dyn Error>> {
    let frames = session()?;
    println!("{} frames of {SESSION}", frames.len());
    let seconds = static_protocol(&frames)?;
    println!(
        "static protocol, 1000 x 1000 frames: {seconds:.3} s, {:.0} ns a pair",
        seconds * 1e3
    );
    Ok(())
}

fn static_protocol(frames: &[[f64; 64]]) -> Result<f64, Box<dyn Error>> {
    let time = Duration::ZERO;
    let real: Vec<RealFrame> = frames[..1_003]
        .windows(4)
        .map(|frames| RealFrame {
            time,
            celsius: frames[0],
            later: Some(frames[3]),
        })
        .collect();
    let simulated: Vec<SimulatedFrame> = frames[800..1_800]
        .iter()
        .map(|frame| SimulatedFrame {
            time,
            celsius: *frame,
            noise_free: frames[400],
        })
        .collect();
    let settings = Settings::new(Protocol::Static, 25.0, 0.25);
    let mut fastest = f64::INFINITY;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        black_box(compare(&real, &simulated, &settings)?);
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
