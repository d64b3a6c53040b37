//! The cost of one frame on this machine, scene by scene: best of several rounds, so that other work counts little.

use grideye_scene::{Scene, Simulator};
use std::error::Error;
use std::hint::black_box;
use std::path::Path;
use std::time::{Duration, Instant};

const ROUNDS: u32 = 20;
const FRAMES: u32 = 50;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    println!("                    set-up    image    noisy    truth   (microseconds a frame)");
    let papers = (1..=4).map(|number| format!("experiment-{number}.toml"));
    for name in papers.chain(["attic.toml".to_owned()]) {
        let files = |relative: &str| std::fs::read_to_string(folder.join(relative));
        let scene = Scene::parse(&files(&name)?, &name, &files)?.scene;
        let sensor = &scene.sensors()[0].name;
        let simulator = Simulator::new(&scene, sensor)?;
        let moments: Vec<Duration> = (0..FRAMES)
            .map(|frame| scene.duration() * frame / FRAMES)
            .collect();
        let set_up = best(|| drop(black_box(Simulator::new(&scene, sensor)))) * f64::from(FRAMES);
        let each =
            |frame: &dyn Fn(Duration)| best(|| moments.iter().for_each(|moment| frame(*moment)));
        println!(
            "{name:18} {set_up:7.1} {:8.1} {:8.1} {:8.1}",
            each(&|moment| drop(black_box(simulator.image(moment)))),
            each(&|moment| drop(black_box(simulator.noisy(moment, 1)))),
            each(&|moment| drop(black_box(simulator.truth(moment)))),
        );
    }
    Ok(())
}

/// Microseconds per frame of the fastest round.
fn best(round: impl Fn()) -> f64 {
    let fastest = (0..ROUNDS).map(|_| {
        let start = Instant::now();
        round();
        start.elapsed()
    });
    fastest.min().unwrap_or_default().as_secs_f64() * 1e6 / f64::from(FRAMES)
}
