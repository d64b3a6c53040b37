//! `grideye distinguish`: which sensors tell situations apart above their noise.

use crate::cli::Distinguish;
use crate::exit::{Outcome, bad_input};
use crate::files;
use crate::output::out;
use anyhow::Result;
use grideye_plan::separation::separation;
use grideye_scene::Scene;

pub(crate) fn run(options: &Distinguish) -> Result<Outcome> {
    let scenes = options
        .scenes
        .iter()
        .map(|path| Ok(files::load_scene(path)?.scene))
        .collect::<Result<Vec<Scene>>>()?;
    let names: Vec<String> = options
        .scenes
        .iter()
        .map(|path| files::stem(path))
        .collect();
    let situations: Vec<(&str, &Scene)> = names.iter().map(String::as_str).zip(&scenes).collect();
    let found = separation(&situations).map_err(bad_input)?;
    if options.json {
        out!("{}", found.json(&names))?;
    } else {
        out!("{}", found.text(&names))?;
    }
    match found.is_complete() {
        true => Ok(Outcome::Done),
        false => Ok(Outcome::Disagrees),
    }
}
