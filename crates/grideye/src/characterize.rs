//! `grideye characterize`: the sensor itself, measured from a recording.

use crate::cli::{Characterize, Nobody};
use crate::compare::{check_is_page, command_line};
use crate::exit::{Outcome, bad_input};
use crate::output::answer;
use crate::{files, progress, recordings};
use anyhow::{Result, anyhow};
use grideye_frame::PIXELS;
use grideye_validator::background::{Background, Empty, background};
use grideye_validator::characterize::{
    Characterization, CharacterizeError, Characterizer, Presence, Spot,
};
use std::path::Path;
use std::time::Duration;

pub(crate) fn run(options: &Characterize) -> Result<Outcome> {
    check_is_page(options.report.as_deref())?;
    let outputs = options.profile.iter().chain(&options.report);
    files::keep_apart(
        options.scene.iter().chain([&options.recording]),
        outputs.chain(&options.json),
    )?;
    let empty_room = empty_room(options)?;
    let mut found = match characterize(&options.recording)? {
        Ok(found) => found,
        Err(error) => {
            progress::say(&format_args!(
                "error: {}: {error}",
                options.recording.display()
            ));
            return Ok(Outcome::NoAnswer);
        }
    };
    if let Some(room) = &empty_room {
        found.presence = found.presence_in(room);
    }
    let empty_room = empty_room.as_deref();
    let room = room(options, &found, empty_room)?;
    let outcome = match &options.profile {
        Some(path) => write_profile(path, &found, options, (&room, empty_room))?,
        None => Outcome::Done,
    };
    if let Some(path) = &options.report {
        let recording = options.recording.display().to_string();
        files::write_text(path, &found.to_html(&recording, &command_line()))?;
    }
    answer(options.json.as_ref(), || found.to_json(), || found.text())?;
    Ok(outcome)
}

enum Room {
    /// The background of the empty room.
    Empty(Box<Background>),
    /// Occupied, and why.
    Occupied(String),
    /// Undecided: why, and what would help first.
    Open(String, &'static str),
}

fn room(
    options: &Characterize,
    found: &Characterization,
    empty_room: Option<&[f64]>,
) -> Result<Room> {
    let shown = options.recording.display();
    let whole = || {
        Background::whole(found).map(Box::new).map(Room::Empty).ok_or_else(|| {
            bad_input(anyhow!(
                "{shown} has no hundred frames in a row\nhint: record the empty room for a minute"
            ))
        })
    };
    Ok(match (&options.empty, found.presence) {
        (Some(Nobody::Throughout), _) | (None, Presence::Nobody) => whole()?,
        (Some(Nobody::Nowhere), _) if options.scene.is_some() => {
            return Err(bad_input(anyhow!(
                "--scene needs an empty room to take the scene's off\nhint: say where nobody is with --empty yes, auto or FROM..TO, or leave out --scene"
            )));
        }
        (Some(Nobody::Nowhere), _) => Room::Occupied("--empty no".to_owned()),
        (Some(Nobody::In(stretches)), _) => {
            let found = background(&recordings::load_stream(&options.recording)?, stretches);
            Room::Empty(Box::new(
                found.map_err(|error| bad_input(anyhow!("{shown}: {error}")))?,
            ))
        }
        (None, Presence::Somebody(spot)) => {
            let records = recordings::load_thinned(&options.recording)?.records;
            match background(&records, &Empty::Find) {
                Ok(found) if found.is_certain(empty_room) => Room::Empty(Box::new(found)),
                _ => Room::Occupied(format!(
                    "somebody is in view ({spot} change by {:.2} °C)",
                    spot.celsius
                )),
            }
        }
        (None, Presence::Still(spot)) => still(spot, options, found),
        (None, Presence::TooShort) => {
            Room::Open("half a minute without a gap is needed".to_owned(), "")
        }
    })
}

/// Nothing moves, and something is warm.
fn still(spot: Spot, options: &Characterize, found: &Characterization) -> Room {
    let over_s = found.timing.span_s;
    let taken_for = taken_for(spot);
    let (than, first) = match options.scene {
        Some(_) => (
            ", and more than the scene has there",
            "add to the scene what is warm there; or ",
        ),
        None => (
            "",
            "name the scene that has it, with --scene FILE, which takes it off the background; or ",
        ),
    };
    let why = format!(
        "{taken_for}{than}, because it does not change in {over_s:.0} s, but somebody who keeps still looks the same"
    );
    Room::Open(why, first)
}

fn taken_for(spot: Spot) -> String {
    let Spot { celsius, .. } = spot;
    format!(
        "what is {celsius:.2} °C warmer than the room in {spot}, taken for a warm object such as a radiator"
    )
}

fn write_profile(
    path: &Path,
    found: &Characterization,
    options: &Characterize,
    (room, empty_room): (&Room, Option<&[f64]>),
) -> Result<Outcome> {
    let mut profile = found.profile(&files::stem(&options.recording));
    let kept = match room {
        Room::Empty(background) => {
            background.put_into(&mut profile, empty_room);
            let stretches = background.stretches.iter().map(ToString::to_string);
            format!(
                "empty room: {} frames, {}; its background is in the profile, for compare and calibrate",
                background.frames,
                stretches.collect::<Vec<_>>().join(", ")
            )
        }
        Room::Occupied(why) => format!(
            "no empty room: {why}; the profile has no background, and its pattern is what is not smooth over the pixels"
        ),
        Room::Open(why, first) => {
            progress::say(&format_args!(
                "error: {}: cannot tell whether the room is empty: {why}\nhint: {first}say --empty yes if nobody is in view, --empty no if somebody may be; {} was not written",
                options.recording.display(),
                path.display()
            ));
            return Ok(Outcome::NoAnswer);
        }
    };
    let text = format!(
        "# Measured from {} frames by\n#   {}\n# {kept}.\n# scenes/profiles/README.md describes every key.\n{}",
        found.frames,
        command_line(),
        profile.to_toml()
    );
    files::write_text(path, &text)?;
    progress::say(&kept);
    if let (Room::Empty(_), Presence::Still(spot), None) = (room, found.presence, empty_room) {
        progress::say(&format!(
            "note: {} is kept as background; `grideye compare` counts once what the scene has too, and --scene FILE takes it off here",
            taken_for(spot)
        ));
    }
    if let (Room::Occupied(_), None) = (room, &options.empty) {
        progress::say(
            "hint: record the empty room for a minute, or name an empty stretch with --empty FROM..TO; with --empty yes or auto, whatever stays warm is the room's",
        );
    }
    Ok(Outcome::Done)
}

/// Rows by which the level of a recording is doubted.
const DOUBTED_BY: usize = 1_000;

/// Row by row, so that any length fits in memory; the inner error means too few frames.
fn characterize(path: &Path) -> Result<Result<Characterization, CharacterizeError>> {
    let mut characterizer = Characterizer::new();
    let mut first_records = Vec::new();
    recordings::one_stream(path, |record| {
        if first_records.len() < DOUBTED_BY {
            first_records.push(record);
        }
        let pushed = characterizer.push(&record);
        pushed.map_err(|error| bad_input(anyhow!("{}: {error}", path.display())))
    })?;
    recordings::say_doubt(path, &first_records);
    Ok(characterizer.finish())
}

/// The scene's empty room at the start, without noise.
fn empty_room(options: &Characterize) -> Result<Option<Vec<f64>>> {
    let Some(path) = &options.scene else {
        return Ok(None);
    };
    let scene = files::load_scene(path)?.scene.without_agents();
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
