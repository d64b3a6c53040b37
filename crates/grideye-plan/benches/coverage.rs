//! The cost of looking from many poses on this machine: pairs of a pose and a place, on one thread and on two.

use grideye_plan::coverage::{Figure, Grain, Mounts, Survey, Wish, candidates, pick, preset};
use grideye_scene::{Scene, Sensor};
use std::error::Error;
use std::path::Path;
use std::time::Instant;

const ROUNDS: usize = 5;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    println!(
        "scene                poses  places  turns  pairs/s, 1 thread  2 threads  ratio  pick 2, ms"
    );
    for name in ["bedroom.toml", "l-shaped-flat.toml"] {
        let files = |relative: &str| std::fs::read_to_string(folder.join(relative));
        let scene = Scene::parse(&files(name)?, name, &files)?.scene;
        let grain = Grain::default();
        let survey = Survey::new(&scene, &Figure::standing(), &grain)?;
        let poses = candidates(&survey, &Mounts::default(), &preset("grid-eye")?)?;
        let sensors: Vec<Sensor> = poses.iter().map(|pose| pose.sensor.clone()).collect();
        let places = survey.floor().places();
        let pairs = f64::from(u32::try_from(sensors.len() * places)?);
        let mut fastest = [f64::INFINITY; 2];
        for _ in 0..ROUNDS {
            for (threads, fastest) in [1, 2].into_iter().zip(&mut fastest) {
                let start = Instant::now();
                survey.look_all(&sensors, threads, &|| ())?;
                *fastest = fastest.min(start.elapsed().as_secs_f64());
            }
        }
        let looks = survey.look_all(&sensors, 2, &|| ())?;
        let start = Instant::now();
        pick(survey.floor(), &looks, &[], 2, &Wish::default())?;
        let picked_ms = start.elapsed().as_secs_f64() * 1000.0;
        let [one, two] = fastest.map(|seconds| pairs / seconds);
        println!(
            "{name:20} {:5}  {places:6}  {:5}  {one:17.0}  {two:9.0}  {:5.2}  {picked_ms:10.1}",
            sensors.len(),
            grain.turns,
            two / one
        );
    }
    Ok(())
}
