//! Measures the time to calibrate 8 unknowns on 100 frames: `scenes/calibration.toml` on recordings of
//! `scenes/experiment-3.toml`, with the noise of five seeds.

use grideye_frame::{Celsius, RawFrame, Reading, ThermistorWord};
use grideye_recording::{ClockState, Record, Stamp};
use grideye_scene::{Scene, Simulator};
use grideye_validator::calibrate::{Options, calibrate};
use std::error::Error;
use std::io;
use std::time::{Duration, Instant};

const SCENES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes");
const SENSOR: &str = "ceiling";
/// Frames used; more are recorded, because the end of the walk is left out if the recording may begin later.
const FRAMES: usize = 100;
const RECORDED: u32 = 130;
const SEEDS: u64 = 5;

fn main() -> Result<(), Box<dyn Error>> {
    let unknown = read("calibration.toml")?;
    let options = Options {
        frames: Some(FRAMES),
        ..Options::default()
    };
    let mut seconds = Vec::new();
    for seed in 0..SEEDS {
        let records = record(seed)?;
        let start = Instant::now();
        let found = calibrate(
            &records,
            (&unknown, "calibration.toml"),
            &read,
            SENSOR,
            &options,
            &mut |_| (),
        )?;
        seconds.push(start.elapsed().as_secs_f64());
        println!(
            "seed {seed}: {} unknowns, {} frames, {} starts, {} simulations of them: {:.2} s",
            found.found.len(),
            found.frames,
            found.starts[0],
            found.evaluations,
            seconds[seconds.len() - 1]
        );
    }
    let most = seconds.into_iter().fold(0.0, f64::max);
    println!("at most {most:.2} s on one core");
    Ok(())
}

fn read(name: &str) -> io::Result<String> {
    std::fs::read_to_string(format!("{SCENES}/{name}"))
}

/// The walk in [`RECORDED`] frames, evenly spaced.
fn record(seed: u64) -> Result<Vec<Record>, Box<dyn Error>> {
    let scene = Scene::parse(&read("experiment-3.toml")?, "experiment-3.toml", &read)?.scene;
    let simulator = Simulator::new(&scene, SENSOR)?;
    let between = scene.duration() / RECORDED;
    let mut records = Vec::new();
    for index in 0..RECORDED {
        let time: Duration = index * between;
        let frame = simulator.noisy(time, seed).to_frame(Celsius::new(25.0));
        let frame = frame.ok_or("the sensor has no 8 x 8 pixels")?;
        let mut pixels = [grideye_frame::PixelWord(0); grideye_frame::PIXELS];
        for (word, pixel) in pixels.iter_mut().zip(frame.pixels) {
            *word = amg8833::word::pixel_word(pixel)?;
        }
        let thermistor = ThermistorWord(400);
        records.push(Record {
            seq: u64::from(index),
            stamp: Stamp {
                t_boot_ns: u64::try_from(time.as_nanos())?,
                t_utc_ns: 0,
                clock: ClockState::Unsynced,
            },
            reading: Reading::Frame(RawFrame { thermistor, pixels }),
        });
    }
    Ok(records)
}
