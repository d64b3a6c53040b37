//! The cost of one frame of the physical model on this machine, compared with the paper's model of the same scene: best
//! of several rounds, so that other work counts little.

use grideye_scene::{Model, Scene, Simulator};
use std::error::Error;
use std::hint::black_box;
use std::path::Path;
use std::time::{Duration, Instant};

const ROUNDS: u32 = 20;
const FRAMES: u32 = 25;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    println!("microseconds a frame           set-up    image    noisy    truth   image / paper's");
    for (name, keys) in [
        ("experiment-3.toml", ""),
        ("experiment-3.toml", "band_um = [8, 14]\n"),
        ("clothed-walk.toml", ""),
        ("two-people.toml", ""),
        ("experiment-5.toml", ""),
    ] {
        let files = |relative: &str| std::fs::read_to_string(folder.join(relative));
        let text = format!("{keys}{}", files(name)?);
        let load = |model| Scene::parse_as(Some(model), &text, name, &files);
        let (paper, scene) = (load(Model::Paper)?.scene, load(Model::Physical)?.scene);
        let sensor = &scene.sensors()[0].name;
        let make = || Simulator::new(&scene, sensor);
        let (simulator, paper) = (make()?, Simulator::new(&paper, sensor)?);
        let moments: Vec<Duration> = (0..FRAMES)
            .map(|frame| scene.duration() * frame / FRAMES)
            .collect();
        let each =
            |frame: &dyn Fn(Duration)| best(|| moments.iter().for_each(|moment| frame(*moment)));
        let image = each(&|moment| drop(black_box(simulator.image(moment))));
        println!(
            "{name:18} {:9} {:8.0} {image:8.1} {:8.1} {:8.1} {:8.1}",
            if keys.is_empty() { "all" } else { "8-14 µm" },
            best(|| drop(black_box(make()))) * f64::from(FRAMES),
            each(&|moment| drop(black_box(simulator.noisy(moment, 1)))),
            each(&|moment| drop(black_box(simulator.truth(moment)))),
            image / each(&|moment| drop(black_box(paper.image(moment)))),
        );
    }
    println!(
        "people, walking below a sensor at 2.5 m: image, labels and noise, labels and noise / image"
    );
    for count in [1, 3] {
        let scene = crowd(count)?;
        let simulator = Simulator::new(&scene, "ceiling")?;
        let moments = (0..FRAMES).map(|frame| Duration::from_millis(2000 + 40 * u64::from(frame)));
        let each = |frame: &dyn Fn(Duration)| best(|| moments.clone().for_each(frame));
        let image = each(&|moment| drop(black_box(simulator.image(moment))));
        let labeled = each(&|moment| drop(black_box(simulator.labeled(moment, 1))));
        println!("{count} {image:35.1} {labeled:8.1} {:8.2}", labeled / image);
    }
    Ok(())
}

fn crowd(count: u32) -> Result<Scene, Box<dyn Error>> {
    let room = "model = \"physical\"\ncollisions = \"ignore\"\n[room]\nsize_mm = [10000, 8000, 2500]\nambient_c = 20\n";
    let sensor = "[[sensor]]\nname = \"ceiling\"\npreset = \"grid-eye\"\nposition_mm = [5000, 3000, 2500]\nelevation_deg = 90\nazimuth_deg = 0\n";
    let walker = |number: u32| {
        let speed = 500 + 150 * number;
        format!(
            "[[agent]]\nname = \"{number}\"\nperson = {{ height_mm = 1750 }}\ntrajectory = \"way.csv\"\nspeed_mm_per_s = {speed}\n"
        )
    };
    let walkers: String = (0..count).map(walker).collect();
    let files = |_: &str| Ok("x_mm,y_mm,z_mm\n3500,3000,0\n6500,3000,0\n".to_owned());
    Ok(Scene::parse(&format!("{room}{walkers}{sensor}"), "crowd.toml", &files)?.scene)
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
