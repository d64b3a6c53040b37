//! Time to count the people in one frame on one core, beside the 0.2 ms that a collector of many sensors has for it.

use grideye_count::{Counter, Network};
use std::hint::black_box;
use std::time::Instant;

const FRAMES: u32 = 50_000;
const LIMIT_US: f64 = 200.0;

fn main() {
    let (network, mut counter) = (Network::default(), Counter::with_background([22.0; 64]));
    // Somebody in another place in each frame.
    let frame = |number: u32| {
        let middle = f64::from(number % 64);
        std::array::from_fn(|pixel| {
            let (row, column) = (pixel / 8, pixel % 8);
            let near = f64::from(u32::try_from(row * 8 + column).unwrap_or(0)) - middle;
            if near.abs() < 3.0 { 24.5 } else { 22.0 }
        })
    };
    let frames: Vec<[f32; 64]> = (0..64).map(frame).collect();
    let began = Instant::now();
    for number in 0..FRAMES {
        let frame = &frames[usize::try_from(number % 64).unwrap_or(0)];
        black_box(counter.see(&network, f64::from(number) / 10.0, black_box(frame)));
    }
    let us = began.elapsed().as_secs_f64() * 1e6 / f64::from(FRAMES);
    println!("{us:.1} us a frame, {:.2} of {LIMIT_US} us", us / LIMIT_US);
}
