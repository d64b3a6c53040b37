//! `grideye calibrate`: a scene's unknowns, found from a recording.

use crate::cli::Calibrate;
use crate::compare::command_line;
use crate::exit::{Outcome, bad_input};
use crate::output::answer;
use crate::{files, progress, recordings};
use anyhow::Result;
use grideye_inputs::SceneText;
use grideye_recording::Record;
use grideye_scene::profile::Profile;
use grideye_validator::background::put_shown_into;
use grideye_validator::calibrate::{Calibration, Options, Progress, calibrate};
use grideye_validator::characterize::characterize;
use std::fs;
use std::path::Path;

pub(crate) fn run(options: &Calibrate) -> Result<Outcome> {
    let sides = &options.sides;
    let scene = SceneText::read(&sides.scene).map_err(bad_input)?;
    let loaded = files::load_scene(&sides.scene)?;
    let outputs = options.out.iter().chain(&options.write_profile);
    files::keep_apart(
        loaded
            .files
            .iter()
            .chain([&sides.recording])
            .chain(&options.profile),
        outputs.chain(&sides.json),
    )?;
    let sensor = files::sensor_name(&loaded.scene, sides.sensor.as_deref())?;
    let records = recordings::load_stream(&sides.recording)?;
    recordings::say_doubt(&sides.recording, &records);
    let hint = "`grideye characterize` makes one; scenes/profiles/ holds some";
    let profile = options.profile.as_deref();
    let settings = Options {
        seed: options.seed,
        starts: options.starts,
        frames: options.frames,
        half: options.half,
        profile: profile
            .map(|path| files::load_profile(path, hint))
            .transpose()?,
    };
    let bar = progress::bar(0, "calibrating");
    let found = calibrate(
        &records,
        (&scene.text, &scene.origin),
        &scene.files,
        &sensor,
        &settings,
        &mut |Progress { done, total }| {
            bar.set_length(total);
            bar.set_position(done);
        },
    );
    bar.finish_and_clear();
    let found = found.map_err(bad_input)?;
    if let Some(path) = &options.out {
        check_folder(path, &sides.scene);
        files::write_text(path, &found.scene)?;
    }
    if let Some(path) = &options.write_profile {
        write_profile(path, &found, &records, settings.profile.as_ref())?;
    }
    answer(sides.json.as_ref(), || found.to_json(), || found.text())?;
    let is_told = found.found.iter().any(|found| found.uncertainty.is_some());
    Ok(Outcome::told(is_told))
}

/// A scene's trajectories are relative to its folder: in another folder, the new scene would find other files or none.
fn check_folder(out: &Path, scene: &Path) {
    let folder = |path: &Path| fs::canonicalize(files::folder_of(path)).ok();
    if folder(out) != folder(scene) {
        progress::say(&format!(
            "note: {} lies in another folder than {}; trajectories and OBJ files are looked for beside it",
            out.display(),
            scene.display()
        ));
    }
}

/// The sensor's noise and common mode from the recording, and what the scene does not explain.
fn write_profile(
    path: &Path,
    found: &Calibration,
    records: &[Record],
    known: Option<&Profile>,
) -> Result<()> {
    let sensor = characterize(records.iter().copied()).map_err(bad_input)?;
    let mut profile = sensor.profile("calibrated");
    let known = known.map(Profile::in_its_room_c);
    let shown = |pixel: usize| found.pattern_c[pixel] + known.map_or(0.0, |known| known[pixel]);
    put_shown_into(&mut profile, &std::array::from_fn(shown));
    let head = format!(
        "# Measured from {} frames by\n#   {}\n# Pattern and background are what the calibrated scene leaves over. scenes/profiles/README.md describes every key.\n",
        found.frames,
        command_line()
    );
    files::write_text(path, &format!("{head}{}", profile.to_toml()))
}
