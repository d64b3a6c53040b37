//! Sends random transactions to emulated sensors: `cargo run --release -p amg8833-emulator --example fuzz -- [COUNT
//! [SEED]]`, by default ten million from seed 1. Panics with the options if one breaks the sensor.
#![expect(clippy::unwrap_used, reason = "what fails here has to end the program")]

#[path = "../tests/common/any_options.rs"]
mod any_options;
#[path = "../tests/common/fuzz.rs"]
mod fuzz;
#[path = "../tests/common/random.rs"]
mod random;

use std::time::Instant;

fn main() {
    let mut arguments = std::env::args().skip(1).map(|text| text.parse());
    let count: u64 = arguments.next().unwrap_or(Ok(10_000_000)).unwrap();
    let seed: u64 = arguments.next().unwrap_or(Ok(1)).unwrap();
    let started = Instant::now();
    let outcome = fuzz::run(seed, count);
    let seconds = started.elapsed().as_secs_f64();
    println!("seed {seed}: {outcome:#?}");
    println!("no panic, and every life ended as it began; {seconds:.1} s");
}
