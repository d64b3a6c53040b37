//! Sensor profiles: their numbers appear in the measurements, results repeat to the last bit, and every mistake in a
//! file is reported with its place.

#![expect(
    clippy::as_conversions,
    clippy::cast_precision_loss,
    clippy::unwrap_used,
    reason = "a test that panics has failed, and its counts are small"
)]

mod file;
mod measured;

use grideye_frame::{Celsius, Frame, PIXELS};
use grideye_scene::profile::{BUILT_IN, CYCLE_TICKS, NAME_CHARACTERS_MAX, Profile, TEXT_BYTES_MAX};
use std::time::Duration;

fn parse(text: &str) -> Profile {
    Profile::parse(text, "sensor.toml").unwrap()
}

fn refusal(text: &str) -> String {
    Profile::parse(text, "sensor.toml")
        .map(|_| "accepted".to_owned())
        .unwrap_or_else(|error| error.to_string())
}

fn room() -> Frame {
    Frame::uniform(Celsius::new(20.0))
}

fn tick_time(index: u64) -> Duration {
    Duration::from_millis(100 * index)
}

/// The excess of every pixel over the room in the first `ticks` ticks.
fn excess(profile: &Profile, seed: u64, ticks: u64) -> Vec<[f64; PIXELS]> {
    (0..ticks)
        .map(|index| {
            let frame = profile.apply(seed, index, tick_time(index), room());
            frame.pixels.map(|pixel| f64::from(pixel.get()) - 20.0)
        })
        .collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn sd(values: &[f64]) -> f64 {
    let mean = mean(values);
    let squares: Vec<f64> = values.iter().map(|value| (value - mean).powi(2)).collect();
    (squares.iter().sum::<f64>() / (values.len() - 1) as f64).sqrt()
}

fn pixel(frames: &[[f64; PIXELS]], pixel: usize) -> Vec<f64> {
    frames.iter().map(|frame| frame[pixel]).collect()
}

fn common(frames: &[[f64; PIXELS]]) -> Vec<f64> {
    frames.iter().map(|frame| mean(frame)).collect()
}
