//! The memory of one sensor in the reference work, in bytes. A separate program, because counting slows every
//! allocation and makes threads wait for each other.

use grideye_scene::{Scene, Simulator};
use peak_alloc::PeakAlloc;
use std::error::Error;
use std::hint::black_box;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

const SCENE: &str = include_str!("reference.toml");
const WAY: &str = include_str!("way.csv");

fn main() -> Result<(), Box<dyn Error>> {
    let files = |_: &str| Ok(WAY.to_owned());
    let scene = Scene::parse(SCENE, "reference.toml", &files)?.scene;
    let sensor = &scene.sensors()[0];
    let frames = u32::try_from(scene.frame_count(sensor)).unwrap_or(u32::MAX);
    println!(
        "bytes of one sensor                    kept      at most while it is made    while a frame is made"
    );
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let simulator = Simulator::new(&scene, &sensor.name)?;
    let (kept, making) = (
        MEMORY.current_usage() - before,
        MEMORY.peak_usage() - before,
    );
    let mut frame = 0;
    for index in 0..frames {
        MEMORY.reset_peak_usage();
        let before = MEMORY.current_usage();
        black_box(simulator.image(sensor.frame_time(index)));
        frame = frame.max(MEMORY.peak_usage() - before);
    }
    println!("{:30} {kept:12} {making:25} {:24}", "", kept + frame);
    Ok(())
}
