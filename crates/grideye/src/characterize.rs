//! `grideye characterize`: the sensor itself, measured from a recording.

use crate::cli::{Characterize, Nobody};
use crate::compare::{check_is_page, command_line};
use crate::exit::{Outcome, bad_input};
use crate::output::out;
use crate::{files, progress, recordings};
use anyhow::{Context as _, Result, anyhow};
use grideye_frame::PIXELS;
use grideye_recording::StreamId;
use grideye_validator::background::{Background, background};
use grideye_validator::characterize::{
    Characterization, CharacterizeError, Characterizer, Presence,
};
use std::io::Write as _;
use std::path::Path;
use std::time::Duration;

/// Measures, prints the table, and writes what was asked for.
pub(crate) fn run(options: &Characterize) -> Result<Outcome> {
    check_is_page(options.report.as_deref())?;
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
    let room = room(options, &found)?;
    let outcome = match &options.profile {
        Some(path) => write_profile(path, &found, options, &room)?,
        None => Outcome::Done,
    };
    if let Some(path) = &options.report {
        let recording = options.recording.display().to_string();
        write_text(path, &found.to_html(&recording, &command_line()))?;
    }
    match &options.json {
        Some(path) if path.as_os_str() == "-" => out!("{}", found.to_json())?,
        Some(path) => {
            write_text(path, &found.to_json())?;
            out!("{}", found.text())?;
        }
        None => out!("{}", found.text())?,
    }
    Ok(outcome)
}

/// What the recording shows of the room.
enum Room {
    /// The background of the room without anybody.
    Empty(Box<Background>),
    /// Nothing that can be told from the people in it, and why.
    Occupied(String),
    /// One or the other, and what leaves it open.
    Open(String),
}

/// What was asked for, or else what the recording itself shows.
fn room(options: &Characterize, found: &Characterization) -> Result<Room> {
    let whole =
        || {
            Background::whole(found).map(Box::new).map(Room::Empty).ok_or_else(|| {
            bad_input(anyhow!(
                "{} has no hundred frames in a row\nhint: record the empty room for a minute",
                options.recording.display()
            ))
        })
        };
    match &options.empty {
        Some(Nobody::Throughout) => whole(),
        Some(Nobody::Nowhere) if options.scene.is_some() => Err(bad_input(anyhow!(
            "--scene needs an empty room to take the scene's off\nhint: say where nobody is with --empty yes, auto or FROM..TO, or leave out --scene"
        ))),
        Some(Nobody::Nowhere) => Ok(Room::Occupied("--empty no".to_owned())),
        Some(Nobody::In(empty)) => {
            let records = recordings::load_stream(&options.recording)?;
            background(&records, empty)
                .map(Box::new)
                .map(Room::Empty)
                .map_err(|error| bad_input(anyhow!("{}: {error}", options.recording.display())))
        }
        None => match found.presence {
            Presence::Nobody => whole(),
            Presence::Somebody(spot) => Ok(Room::Occupied(format!(
                "somebody is in view ({spot} change by {:.2} °C)",
                spot.celsius
            ))),
            Presence::Still(spot) => Ok(Room::Open(format!(
                "{spot} stay {:.2} °C warmer than the room, by a warm object or by somebody who keeps still",
                spot.celsius
            ))),
            Presence::TooShort => Ok(Room::Open(
                "half a minute without a gap is needed".to_owned(),
            )),
        },
    }
}

/// Writes the profile, or asks for what it depends on.
fn write_profile(
    path: &Path,
    found: &Characterization,
    options: &Characterize,
    room: &Room,
) -> Result<Outcome> {
    let (background, kept) = match room {
        Room::Empty(background) => {
            let stretches: Vec<String> = background
                .stretches
                .iter()
                .map(ToString::to_string)
                .collect();
            let kept = format!(
                "empty room: {} frames, {}; the pattern is its whole background",
                background.frames,
                stretches.join(", ")
            );
            (Some(background.as_ref()), kept)
        }
        Room::Occupied(why) => {
            let kept = format!(
                "no empty room: {why}; the pattern is only what is not smooth in the background"
            );
            (None, kept)
        }
        Room::Open(why) => {
            eprintln!(
                "error: {}: cannot tell whether the room is empty: {why}\nhint: say --empty yes if nobody is in view, --empty no if somebody may be; {} was not written",
                options.recording.display(),
                path.display()
            );
            return Ok(Outcome::NoAnswer);
        }
    };
    write_text(path, &profile(found, options, background, &kept)?)?;
    progress::say(&kept);
    if let (Room::Occupied(_), None) = (room, &options.empty) {
        progress::say(
            "hint: --empty auto takes the whole background from the stretches in which nobody is; --empty yes, if nobody is in view at all",
        );
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
fn profile(
    found: &Characterization,
    options: &Characterize,
    background: Option<&Background>,
    kept: &str,
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
        "# Measured from {} frames by\n#   {}\n# {kept}.\n# scenes/profiles/README.md describes every key.\n{}",
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
