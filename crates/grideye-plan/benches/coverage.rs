//! The cost of finding the best poses of a room on this machine, and what they reach beside random ones.

use grideye_plan::coverage::{Figure, Grain, Mounts, Survey, Wish, candidates, preset, search};
use grideye_scene::Scene;
use std::error::Error;
use std::path::Path;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    println!(
        "scene                 model     places  best  poses tried  seconds, 1 thread  2 threads  detected"
    );
    for name in ["bedroom.toml", "l-shaped-flat.toml"] {
        let files = |relative: &str| std::fs::read_to_string(folder.join(relative));
        let text = files(name)?;
        for model in ["paper", "physical"] {
            let text = format!("model = \"{model}\"\n{text}");
            let scene = Scene::parse(&text, name, &files)?.scene;
            let survey = Survey::new(&scene, &Figure::standing(), &Grain::default())?;
            let mounts = Mounts::default();
            let poses = candidates(&survey, &mounts, &preset("grid-eye")?)?;
            let places = survey.floor().places();
            for best in [1, 2] {
                let mut seconds = [0.0; 2];
                let mut found = None;
                for (threads, seconds) in [1, 2].into_iter().zip(&mut seconds) {
                    let start = Instant::now();
                    let wish = Wish::default();
                    found = Some(search(
                        &survey,
                        (&poses, &mounts),
                        &[],
                        (best, &wish),
                        threads,
                        &|_, _| (),
                    )?);
                    *seconds = start.elapsed().as_secs_f64();
                }
                let found = found.ok_or("nothing found")?;
                let [one, two] = seconds;
                let reached = found.steps.last().map_or(0.0, |step| step.objective);
                println!(
                    "{name:20}  {model:8}  {places:6}  {best:4}  {:11}  {one:17.1}  {two:9.1}  {:6.1} %",
                    found.tried,
                    100.0 * reached
                );
            }
        }
    }
    Ok(())
}
