//! `grideye characterize`: the sensor itself, measured from a recording.

use crate::cli::Characterize;
use crate::exit::{Outcome, bad_input};
use crate::{files, recordings};
use anyhow::{Context as _, Result, anyhow};
use grideye_recording::StreamId;
use grideye_validator::characterize::{Characterization, CharacterizeError, Characterizer};
use std::io::Write as _;
use std::path::Path;

/// Measures, prints the table, and writes what was asked for.
pub(crate) fn run(options: &Characterize) -> Result<Outcome> {
    let found = match characterize(&options.recording)? {
        Ok(found) => found,
        Err(error) => {
            eprintln!("error: {}: {error}", options.recording.display());
            return Ok(Outcome::NoAnswer);
        }
    };
    if let Some(path) = &options.profile {
        write_text(path, &profile(&found, &options.recording, path))?;
    }
    match &options.json {
        Some(path) if path.as_os_str() == "-" => print!("{}", found.to_json()),
        Some(path) => {
            write_text(path, &found.to_json())?;
            print!("{}", found.text());
        }
        None => print!("{}", found.text()),
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

/// The profile, with a head that says where it came from.
fn profile(found: &Characterization, recording: &Path, out: &Path) -> String {
    let name = recording
        .file_stem()
        .map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    format!(
        "# Measured from {} frames by\n#   grideye characterize {} --profile {}\n# scenes/profiles/README.md describes every key.\n{}",
        found.frames,
        recording.display(),
        out.display(),
        found.profile(&name).to_toml()
    )
}

fn write_text(path: &Path, text: &str) -> Result<()> {
    files::write_whole(path, |out| {
        out.write_all(text.as_bytes())
            .with_context(|| format!("cannot write {}", path.display()))
    })
}
