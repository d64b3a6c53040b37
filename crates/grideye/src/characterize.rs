//! `grideye characterize`: the sensor itself, measured from a recording.

use crate::cli::{Characterize, Nobody};
use crate::compare::command_line;
use crate::exit::{Outcome, bad_input};
use crate::output::out;
use crate::{files, progress, recordings};
use anyhow::{Context as _, Result, anyhow};
use grideye_frame::PIXELS;
use grideye_recording::StreamId;
use grideye_validator::background::{Background, background};
use grideye_validator::characterize::{Characterization, CharacterizeError, Characterizer};
use std::io::Write as _;
use std::path::Path;
use std::time::Duration;

/// Measures, prints the table, and writes what was asked for.
pub(crate) fn run(options: &Characterize) -> Result<Outcome> {
    files::keep_apart(
        options.scene.iter().chain([&options.recording]),
        options
            .profile
            .iter()
            .chain(&options.report)
            .chain(&options.json),
    )?;
    let found = match characterize(&options.recording)? {
        Ok(found) => found,
        Err(error) => {
            eprintln!("error: {}: {error}", options.recording.display());
            return Ok(Outcome::NoAnswer);
        }
    };
    let background = learned(options)?;
    if let Some(path) = &options.profile {
        let profile = profile(&found, options, background.as_ref())?;
        write_text(path, &profile)?;
    }
    if let Some(path) = &options.report {
        let recording = options.recording.display().to_string();
        write_text(path, &found.to_html(&recording, &command_line()))?;
    }
    if let Some(background) = &background {
        let stretches: Vec<String> = background
            .stretches
            .iter()
            .map(ToString::to_string)
            .collect();
        progress::say(&format!(
            "empty room: {} frames, {}",
            background.frames,
            stretches.join(", ")
        ));
    }
    match &options.json {
        Some(path) if path.as_os_str() == "-" => out!("{}", found.to_json())?,
        Some(path) => {
            write_text(path, &found.to_json())?;
            out!("{}", found.text())?;
        }
        None => out!("{}", found.text())?,
    }
    Ok(Outcome::Done)
}

/// Row by row, however long the recording is; the inner error is that too little is there to say anything.
fn characterize(path: &Path) -> Result<Result<Characterization, CharacterizeError>> {
    let shown = path.display();
    let mut characterizer = Characterizer::new();
    let mut stream: Option<StreamId> = None;
    for row in recordings::open(path)? {
        let row = row?;
        let first = stream.get_or_insert_with(|| row.stream.clone());
        if *first != row.stream {
            return Err(bad_input(anyhow!(
                "{shown} holds several streams, and one sensor is measured at a time\nhint: keep the rows of one device, sensor and boot"
            )));
        }
        characterizer
            .push(&row.record)
            .map_err(|error| bad_input(anyhow!("{shown}: {error}")))?;
    }
    Ok(characterizer.finish())
}

/// The background of the empty room, if it is asked for.
fn learned(options: &Characterize) -> Result<Option<Background>> {
    let Some(Nobody(empty)) = &options.empty else {
        return Ok(None);
    };
    let records = recordings::load_stream(&options.recording)?;
    background(&records, empty)
        .map(Some)
        .map_err(|error| bad_input(anyhow!("{}: {error}", options.recording.display())))
}

/// The profile, with a head that says where it came from.
fn profile(
    found: &Characterization,
    options: &Characterize,
    background: Option<&Background>,
) -> Result<String> {
    let name = options
        .recording
        .file_stem()
        .map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let mut profile = found.profile(&name);
    if let Some(background) = background {
        background.put_into(&mut profile, empty_room(options)?.as_deref());
    }
    Ok(format!(
        "# Measured from {} frames by\n#   {}\n# scenes/profiles/README.md describes every key.\n{}",
        found.frames,
        command_line(),
        profile.to_toml()
    ))
}

/// What the scene's sensor would see of the room at the start, if nobody were there and nothing had noise.
fn empty_room(options: &Characterize) -> Result<Option<Vec<f64>>> {
    let Some(path) = &options.scene else {
        return Ok(None);
    };
    let scene = files::load_scene(Some(path))?.scene.without_agents();
    let simulator = files::simulator(&scene, options.sensor.as_deref())?;
    let image = simulator.image(Duration::ZERO);
    if image.celsius.len() != PIXELS {
        return Err(bad_input(anyhow!(
            "sensor `{}` of {} has {} x {} pixels, and recordings have 8 x 8\nhint: choose another with --sensor",
            simulator.sensor().name,
            path.display(),
            image.columns,
            image.rows
        )));
    }
    Ok(Some(image.celsius))
}

fn write_text(path: &Path, text: &str) -> Result<()> {
    files::write_whole(path, |out| {
        out.write_all(text.as_bytes())
            .with_context(|| format!("cannot write {}", path.display()))
    })
}
