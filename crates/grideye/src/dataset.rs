//! `grideye dataset`: labeled frames of a scene that differs from frame to frame.

use crate::cli::{Dataset, Method};
use crate::exit::{Outcome, bad_input};
use crate::files::SceneText;
use crate::output::outln;
use crate::{files, progress};
use anyhow::Result;
use grideye_dataset::{
    Cause, CountsFrom, DatasetError, Folder, Frames, Manifest, Output, Part, Remembered, Subject,
    Table, make,
};
use grideye_export::dataset as export;
use grideye_frame::{COLUMNS, ROWS};
use grideye_scene::Scene;
use grideye_variation::{Recipe, VariationError};
use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

pub(crate) fn run(options: &Dataset) -> Result<Outcome> {
    let frames = frames(options)?;
    let manifest = Manifest::new(
        &frames,
        concat!("grideye ", env!("CARGO_PKG_VERSION")),
        options.frames,
        options.frames_per_part,
        options.formats.iter().copied(),
    )
    .map_err(told)?;
    let disk = Disk {
        first: options.formats.first().copied(),
        in_view: Mutex::default(),
    };
    let folder = Folder::open(&options.out, &manifest, &disk).map_err(told)?;
    let (mut missing, mut there, mut count) = (Vec::new(), 0_u64, 0);
    for part in manifest.parts_of(options.shard) {
        count += manifest.count(part);
        if folder.has(&manifest, part).map_err(told)? {
            there += 1;
        } else {
            missing.push(part);
        }
    }
    let bar = progress::bar(count, "simulating");
    let todo: u64 = missing.iter().map(|part| manifest.count(*part)).sum();
    bar.inc(count - todo);
    bar.reset_eta();
    let made = u64::try_from(missing.len())?;
    let tick = || bar.inc(1);
    let threads = options
        .threads
        .map_or_else(progress::cores, NonZeroUsize::get);
    make((&frames, &manifest), &folder, missing, threads, &tick).map_err(told)?;
    bar.finish_and_clear();
    folder.put_card(&manifest).map_err(told)?;
    report(options, &manifest, [made, there, count])?;
    if made > 0 && !options.json {
        outln!("people in view: {}", disk.in_view())?;
    }
    Ok(Outcome::Done)
}

fn frames(options: &Dataset) -> Result<Frames> {
    let SceneText {
        text,
        origin,
        files: beside,
    } = files::read_scene(&options.scene)?;
    let remembered = Remembered::new(&beside);
    let loaded = Scene::parse(&text, &origin, &remembered).map_err(bad_input)?;
    files::warned(&loaded.warnings);
    let sensor = files::sensor_name(&loaded.scene, options.sensor.as_deref())?;
    let steps = loaded.scene.sensor(&sensor).map_err(bad_input)?;
    if steps.step_c == 0.0 && (steps.columns, steps.rows) == (COLUMNS, ROWS) {
        progress::say(&format!(
            "sensor `{sensor}` has no step_c, so these frames have no steps; a real sensor has steps of 0.25 °C: --vary sensor.{sensor}.step_c=0.25"
        ));
    }
    let recipe = Recipe::new(&text, &origin, &options.varied).map_err(asked)?;
    recipe.check(&remembered).map_err(asked)?;
    let subject = Subject {
        title: files::stem(&options.scene),
        sensor,
        text,
        files: remembered.into_texts(),
        vary: options.varied.clone(),
        recipe,
        without_grid: options.method == Method::Area,
        seed: options.seed,
        clip: options.clip,
        counts_from: CountsFrom {
            pixels: options.count_pixels,
            contrast_c: options.count_contrast_c,
        },
    };
    Frames::new(subject, &loaded.scene).map_err(told)
}

struct Disk {
    /// A part is counted as its first file is written.
    first: Option<Table>,
    /// How many frames have how many people in view.
    in_view: Mutex<BTreeMap<u64, u64>>,
}

impl Disk {
    fn count(&self, part: &Part) {
        let mut in_view = self.in_view.lock().unwrap_or_else(PoisonError::into_inner);
        for people in &part.people {
            *in_view.entry(*people).or_default() += 1;
        }
    }

    /// `0 in 31 frames, 1 in 169 frames`
    fn in_view(&self) -> String {
        let in_view = self.in_view.lock().unwrap_or_else(PoisonError::into_inner);
        let counts = in_view.iter();
        let counts = counts.map(|(people, frames)| format!("{people} in {frames} frames"));
        counts.collect::<Vec<_>>().join(", ")
    }
}

impl Output for Disk {
    fn write(&self, part: &Part, table: Table, about: &str, file: &File) -> Result<(), Cause> {
        if self.first == Some(table) {
            self.count(part);
        }
        Ok(files::fill(file, |out| {
            Ok(export::write(part, table, about, out)?)
        })?)
    }

    fn rename(&self, partial: &Path, path: &Path) -> io::Result<()> {
        files::rename(partial, path)
    }
}

fn asked(error: VariationError) -> anyhow::Error {
    bad_input(anyhow::Error::new(error).context("--vary"))
}

fn told(error: DatasetError) -> anyhow::Error {
    match error.is_bad_input() {
        true => bad_input(error),
        false => error.into(),
    }
}

fn report(options: &Dataset, manifest: &Manifest, [made, there, frames]: [u64; 3]) -> Result<()> {
    let shard = options.shard;
    if options.json {
        let answer = serde_json::json!({
            "shard": shard.number,
            "shards": shard.of,
            "parts_made": made,
            "parts_there": there,
            "frames": frames,
            "parts_of_dataset": manifest.parts(),
            "frames_of_dataset": manifest.frames(),
            "fingerprint": manifest.fingerprint(),
        });
        return outln!("{answer}");
    }
    outln!(
        "shard {} of {}: {frames} of {} frames in {}; parts: {made} made, {there} there before",
        shard.number,
        shard.of,
        manifest.frames(),
        options.out.display()
    )
}
