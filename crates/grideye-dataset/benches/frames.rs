//! Labeled frames per second of CPU time on this machine, without writing them.

use grideye_dataset::{
    Cause, CountsFrom, Folder, Frames, Manifest, Output, Part, Remembered, Shard, Splits, Subject,
    Table, make,
};
use grideye_scene::Scene;
use grideye_variation::Recipe;
use std::error::Error;
use std::fs::{self, File};
use std::io;
use std::path::Path;

const FRAMES: u32 = 1000;
const SCENES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes");

const PERSON: &str = "person = { height_mm = 1700 }\n";
const PARTS: &str = "[[agent.part]]\nname = \"trunk\"\nshape = \"capsule\"\nposition_mm = [0, 0, 700]\nsize_mm = [240, 400, 780]\ntemperature_c = 27\n\
    [[agent.part]]\nname = \"legs\"\nshape = \"capsule\"\nposition_mm = [0, 0, 0]\nsize_mm = [200, 300, 700]\ntemperature_c = 25\n\
    [[agent.part]]\nname = \"head\"\nshape = \"ellipsoid\"\nposition_mm = [0, 0, 1480]\nsize_mm = [190, 160, 240]\ntemperature_c = 32\n";
const BOX: &str = "size_mm = [300, 500, 1750]\ntemperature_c = 29\n";

fn main() -> Result<(), Box<dyn Error>> {
    println!("labeled frames a CPU second");
    for (name, clip, more) in [
        ("counting", 1, None),
        ("counting", 1, Some("people=3")),
        ("falls", 50, None),
    ] {
        let frames = preset(name, clip, more)?;
        let taken_s = taken_s(&frames)?;
        let name = format!("preset {name} {}", more.unwrap_or_default());
        println!("{name:30} {:8.0}", f64::from(FRAMES) / taken_s);
    }
    println!("three agents on the floor of a room without objects");
    for (name, model, body, key) in [
        (
            "physical, people",
            "physical",
            PERSON,
            "room.ambient_c=18..26",
        ),
        (
            "physical, people of one room",
            "physical",
            PERSON,
            "agent.0.person.height_mm=1500..1900",
        ),
        (
            "physical, parts",
            "physical",
            PARTS,
            "room.ambient_c=18..26",
        ),
        ("paper, boxes", "paper", BOX, "agent.0.temperature_c=26..33"),
    ] {
        let frames = frames(model, body, key)?;
        let taken_s = taken_s(&frames)?;
        println!("{name:30} {:8.0}", f64::from(FRAMES) / taken_s);
    }
    Ok(())
}

fn frames(model: &str, body: &str, key: &str) -> Result<Frames, Box<dyn Error>> {
    let room =
        format!("model = \"{model}\"\n[room]\nsize_mm = [4000, 5000, 2700]\nambient_c = 21\n");
    let agents = (0..3).map(|number| {
        let y_mm = 1000 + 1500 * number;
        format!("[[agent]]\nname = \"{number}\"\nposition_mm = [2000, {y_mm}, 0]\n{body}")
    });
    let sensor = "[[sensor]]\nname = \"ceiling\"\npreset = \"grid-eye\"\nposition_mm = [2000, 2500, 2700]\nelevation_deg = 90\nazimuth_deg = 0\nstep_c = 0.25\n";
    let text = format!("{room}{}{sensor}", agents.collect::<String>());
    let mut vary: Vec<String> = (0..3)
        .map(|number| format!("agent.{number}.position=floor"))
        .collect();
    vary.push(key.to_owned());
    subject(text, vary, 1)
}

fn preset(name: &str, clip: u64, more: Option<&str>) -> Result<Frames, Box<dyn Error>> {
    let text = fs::read_to_string(format!("{SCENES}/{name}.toml"))?;
    let vary = more.map(str::to_owned).into_iter().collect();
    subject(text, vary, clip)
}

fn subject(text: String, vary: Vec<String>, clip: u64) -> Result<Frames, Box<dyn Error>> {
    let files = |name: &str| fs::read_to_string(format!("{SCENES}/{name}"));
    let files = Remembered::new(&files);
    let scene = Scene::parse(&text, "room.toml", &files)?.scene;
    let recipe = Recipe::new(&text, "room.toml", &vary)?;
    recipe.check(&files)?;
    let subject = Subject {
        title: "room".to_owned(),
        recipe,
        text,
        files: files.into_texts(),
        is_built_in: false,
        given: Vec::new(),
        vary,
        sensor: "ceiling".to_owned(),
        seed: 1,
        clip,
        in_view: Vec::new(),
        counts_from: CountsFrom::default(),
    };
    Ok(Frames::new(subject, &scene)?)
}

/// Makes one part that is not written.
fn taken_s(frames: &Frames) -> Result<f64, Box<dyn Error>> {
    let manifest = Manifest::new(
        frames,
        "bench",
        FRAMES.into(),
        None,
        &Splits::default(),
        [Table::Npz].into_iter(),
    )?;
    let path = std::env::temp_dir().join(format!("grideye-bench-{}", std::process::id()));
    let folder = Folder::open(&path, &manifest, &Nothing)?;
    let parts = manifest.parts_of(Shard { number: 1, of: 1 }).collect();
    let start_s = cpu_s()?;
    make((frames, &manifest), &folder, parts, 1, &|| {})?;
    let taken_s = cpu_s()? - start_s;
    fs::remove_dir_all(&path)?;
    Ok(taken_s)
}

/// Seconds of CPU time that this process has used so far; Linux counts hundredths.
fn cpu_s() -> Result<f64, Box<dyn Error>> {
    let stat = fs::read_to_string("/proc/self/stat")?;
    let fields = stat.rsplit(')').next().unwrap_or_default();
    let used = fields.split_whitespace().skip(11).take(2);
    let hundredths = used.map(str::parse::<f64>).sum::<Result<f64, _>>()?;
    Ok(hundredths / 100.0)
}

struct Nothing;

impl Output for Nothing {
    fn write(&self, _: &Part, _: Table, _: &str, _: &File) -> Result<(), Cause> {
        Ok(())
    }

    fn features(&self, _: &Part) -> Vec<String> {
        Vec::new()
    }

    fn rename(&self, partial: &Path, path: &Path) -> io::Result<()> {
        fs::rename(partial, path)
    }
}
