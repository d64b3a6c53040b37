//! What a dataset takes from somebody's own sensor: its profile, or all that a recording of it shows.

use crate::cli::Dataset;
use crate::exit::bad_input;
use crate::{files, recordings};
use anyhow::{Result, anyhow};
use grideye_frame::{PIXELS, word};
use grideye_recording::Record;
use grideye_scene::Files;
use grideye_scene::profile::Profile;
use grideye_validator::background::{Empty, background};
use grideye_validator::characterize::{Characterization, characterize};
use std::io;

/// The name of the profile for the scene's sensor.
const NAME: &str = "own/profile.toml";
/// How far the room's temperature may be from the recording's, °C.
const LEVEL_C: f64 = 1.0;
/// Ticks of a profile's noise a second.
const TICKS_HZ: f64 = 10.0;

/// What replaces the scene's sensor.
#[derive(Debug, Default)]
pub(crate) struct Own {
    /// The option that asked for it.
    pub(crate) given: Vec<String>,
    /// What the scene's keys become.
    pub(crate) vary: Vec<String>,
    profile: Option<String>,
}

/// By `--profile` or `--like`; keys that `--vary` names stay the user's.
pub(crate) fn own(options: &Dataset, sensor: &str) -> Result<Own> {
    let (option, path) = match (&options.profile, &options.like) {
        (Some(path), _) => ("--profile", path),
        (None, Some(path)) => ("--like", path),
        (None, None) => return Ok(Own::default()),
    };
    let mut vary = vec![format!("sensor.{sensor}.profile=\"{NAME}\"")];
    let text = match options.profile {
        Some(_) => {
            let hint = "`grideye characterize` makes one; scenes/profiles/ holds some";
            files::load_profile(path, hint)?.to_toml()
        }
        None => {
            let records = recordings::load_stream(path)?;
            let refused = |error| bad_input(anyhow!("{}: {error}", path.display()));
            let found = characterize(records.iter().copied())
                .map_err(|error| refused(error.to_string()))?;
            let empty = background(&records, &Empty::Find);
            let empty = empty.map_or_else(|_| middles(&records), |found| found.celsius);
            let level_c = middle(&mut empty.clone());
            vary.push(format!(
                "room.ambient_c={:.2}..{:.2}",
                level_c - LEVEL_C,
                level_c + LEVEL_C
            ));
            let rate_hz = found.timing.rate_hz;
            if rate_hz > 0.0 {
                vary.push(format!("sensor.{sensor}.sampling_hz={rate_hz:.2}"));
            }
            let shown_c = empty.map(|celsius| celsius - level_c);
            profile(&found, shown_c, &files::stem(path)).to_toml()
        }
    };
    let is_free = |asked: &String| {
        let key = |asked: &str| asked.split('=').next().map(|key| key.trim().to_owned());
        options
            .varied
            .iter()
            .all(|option| key(option) != key(asked))
    };
    vary.retain(is_free);
    Ok(Own {
        given: vec![option.to_owned(), path.display().to_string()],
        vary,
        profile: Some(text),
    })
}

/// Noise and drift as measured; the room's background joins the unit's pattern, as both are in every frame.
fn profile(found: &Characterization, shown_c: [f64; PIXELS], name: &str) -> Profile {
    let mut profile = found.profile(name);
    profile.fixed_pattern.offset_c = shown_c;
    // A slower sensor's frame is the mean of several ticks.
    let ticks = (TICKS_HZ / found.timing.rate_hz)
        .round()
        .clamp(1.0, TICKS_HZ);
    for sigma_c in &mut profile.noise_sigma_c {
        *sigma_c *= ticks.sqrt();
    }
    profile
}

/// Each pixel's median: without an empty stretch, people who do not stay are not in it.
fn middles(records: &[Record]) -> [f64; PIXELS] {
    let frames = records.iter().filter_map(|record| record.reading.frame());
    let frames: Vec<_> = frames.map(|frame| word::pixels(&frame.pixels)).collect();
    std::array::from_fn(|pixel| {
        let values = frames.iter().map(|frame| f64::from(frame[pixel].get()));
        middle(&mut values.collect::<Vec<_>>())
    })
}

fn middle(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}

/// The scene's files, with the own profile among them.
pub(crate) struct With<'a>(pub(crate) &'a dyn Files, pub(crate) &'a Own);

impl Files for With<'_> {
    fn read(&self, relative: &str) -> io::Result<String> {
        match &self.1.profile {
            Some(profile) if relative == NAME => Ok(profile.clone()),
            _ => self.0.read(relative),
        }
    }
}
