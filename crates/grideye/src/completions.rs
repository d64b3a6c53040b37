//! `grideye completions`: what a shell needs to know to complete either program.

use crate::cli::Completions;
use crate::exit::Outcome;
use crate::output::out;
use anyhow::{Context as _, Result};
use clap_complete::generate;

pub(crate) fn run(options: &Completions) -> Result<Outcome> {
    let mut command = (options.program)();
    let name = command.get_name().to_owned();
    let mut script = Vec::new();
    generate(options.shell, &mut command, name, &mut script);
    let script = String::from_utf8(script).context("a completion script is text")?;
    out!("{script}")?;
    Ok(Outcome::Done)
}
