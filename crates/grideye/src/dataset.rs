//! `grideye dataset`: labeled frames of a scene that differs from frame to frame.

use crate::cli::{Dataset, Preset};
use crate::exit::{Outcome, bad_input};
use crate::output::outln;
use crate::own::{With, own};
use crate::{export, files, progress};
use anyhow::Result;
use grideye_dataset::{
    Cause, Counts, CountsFrom, DatasetError, Folder, Frames, Manifest, Output, Part, Remembered,
    Seen, Subject, Table, make, preview,
};
use grideye_export::dataset as table;
use grideye_frame::{COLUMNS, ROWS};
use grideye_inputs::SceneText;
use grideye_scene::Scene;
use grideye_variation::{Recipe, VariationError};
use std::fs::File;
use std::io;
use std::num::NonZeroUsize;
use std::path::Path;

pub(crate) fn run(options: &Dataset) -> Result<Outcome> {
    if options.print {
        return outln!("{}", scene(options)?.text.trim_end()).map(|()| Outcome::Done);
    }
    let frames = frames(options)?;
    if let Some(file) = &options.preview {
        show(&frames, options, file)?;
    }
    let Some(out) = &options.out else {
        return Ok(Outcome::Done);
    };
    let manifest = Manifest::new(
        &frames,
        concat!("grideye ", env!("CARGO_PKG_VERSION")),
        options.frames.unwrap_or(1),
        options.frames_per_part,
        &options.splits.clone().unwrap_or_default(),
        options.formats.iter().copied(),
    )
    .map_err(told)?;
    let folder = Folder::open(out, &manifest, &Disk).map_err(told)?;
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
    folder.put_card(&frames, &manifest).map_err(told)?;
    report(options, (&manifest, out), [made, there, count])?;
    if made > 0 && !options.json {
        let mut counts = Counts::default();
        for part in manifest.parts_of(options.shard) {
            let found = folder.counts(&manifest, part).map_err(told)?;
            counts.add(&found.unwrap_or_default());
        }
        if counts.conflicts > 0 {
            outln!(
                "draws left out because their values conflict: {}",
                counts.conflicts
            )?;
        }
        let counts = counts.people.iter();
        let counts = counts.map(|(people, frames)| format!("{people} in {frames} frames"));
        outln!("people in view: {}", counts.collect::<Vec<_>>().join(", "))?;
    }
    Ok(Outcome::Done)
}

fn frames(options: &Dataset) -> Result<Frames> {
    let SceneText {
        text,
        origin,
        files: beside,
    } = scene(options)?;
    let read = Remembered::new(&beside);
    let loaded = Scene::parse(&text, &origin, &read).map_err(bad_input)?;
    files::warned(&loaded.warnings);
    let sensor = files::sensor_name(&loaded.scene, options.sensor.as_deref())?;
    let steps = loaded.scene.sensor(&sensor).map_err(bad_input)?;
    if steps.step_c == 0.0 && (steps.columns, steps.rows) == (COLUMNS, ROWS) {
        progress::say(&format!(
            "sensor `{sensor}` has no step_c, so these frames have no steps; a real sensor has steps of 0.25 °C: --vary sensor.{sensor}.step_c=0.25"
        ));
    }
    let own = own(options, &sensor)?;
    let beside = With(&read, &own);
    let remembered = Remembered::new(&beside);
    let asked = |error| asked(error, &options.varied);
    let varied = [own.vary.as_slice(), &options.varied].concat();
    let recipe = Recipe::new(&text, &origin, &varied).map_err(asked)?;
    recipe.check(&remembered).map_err(asked)?;
    let subject = Subject {
        title: files::stem(Path::new(&origin)),
        sensor,
        text: text.clone(),
        files: remembered.into_texts(),
        is_built_in: options.preset.is_some(),
        vary: options.varied.clone(),
        given: own.given.clone(),
        recipe,
        seed: options.seed,
        clip: options.clip,
        counts_from: CountsFrom {
            pixels: options.count_pixels,
            contrast_c: options.count_contrast_c,
        },
        in_view: options.in_view.clone(),
    };
    let frames = Frames::new(subject, &loaded.scene).map_err(told)?;
    let unseen = frames
        .unseen(options.frames.unwrap_or(1).div_ceil(options.clip))
        .map_err(told)?;
    // Of the program's own scenes, nobody wants to know which of the things around are in no frame.
    let told = unseen
        .iter()
        .filter(|one| one.is_doubtful() || options.preset.is_none());
    for one in told {
        let level = if one.is_doubtful() { "warning" } else { "note" };
        progress::say(&format!("{level}: {}", one.warning(&text, &origin)));
    }
    Ok(frames)
}

fn scene(options: &Dataset) -> Result<SceneText> {
    match (&options.scene, options.preset) {
        (Some(path), _) => SceneText::read(path).map_err(bad_input),
        (None, Some(Preset::Falls)) => Ok(SceneText::built_in("falls", FALLS, &[])),
        (None, _) => Ok(SceneText::built_in("counting", COUNTING, &[])),
    }
}

const COUNTING: &str = include_str!("../../../scenes/counting.toml");
const FALLS: &str = include_str!("../../../scenes/falls.toml");

/// Draws some frames by class.
fn show(frames: &Frames, options: &Dataset, file: &Path) -> Result<()> {
    let rows = preview(frames, options.frames.unwrap_or(1)).map_err(told)?;
    let caption = |seen: &Seen| match options.clip {
        1 => format!("{} in view", seen.people),
        _ => seen.doing.unwrap_or("away").to_owned(),
    };
    let tiles = rows.iter().map(|row| {
        let tiles = row.iter().map(|seen| (&*seen.celsius, caption(seen)));
        tiles.collect()
    });
    export::write_rows(&tiles.collect::<Vec<_>>(), frames.size(), file)?;
    progress::say(&format!(
        "wrote {}: °C over each frame's median, from -2 to 4",
        file.display()
    ));
    Ok(())
}

struct Disk;

impl Output for Disk {
    fn write(&self, part: &Part, kind: Table, about: &str, file: &File) -> Result<(), Cause> {
        Ok(files::fill(file, |out| {
            Ok(table::write(part, kind, about, out)?)
        })?)
    }

    fn features(&self, part: &Part) -> Vec<String> {
        table::features(part)
    }

    fn rename(&self, partial: &Path, path: &Path) -> io::Result<()> {
        files::rename(partial, path)
    }
}

/// A table of the scene names its own place.
fn asked(error: VariationError, options: &[String]) -> anyhow::Error {
    let is_option = match &error {
        VariationError::Asked { asked, .. } | VariationError::Value { asked, .. } => {
            options.contains(asked)
        }
        VariationError::Scene(_) => false,
        _ => true,
    };
    let error = anyhow::Error::new(error);
    bad_input(if is_option {
        error.context("--vary")
    } else {
        error
    })
}

fn told(error: DatasetError) -> anyhow::Error {
    match error.is_bad_input() {
        true => bad_input(error),
        false => error.into(),
    }
}

fn report(
    options: &Dataset,
    (manifest, out): (&Manifest, &Path),
    [made, there, frames]: [u64; 3],
) -> Result<()> {
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
        out.display()
    )
}
