//! `grideye compare`: compares a recording with a simulation of its scene.

use crate::cli::Compare;
use crate::exit::{Outcome, bad_input};
use crate::output::answer;
use crate::{files, progress, recordings};
use anyhow::{Result, anyhow};
use grideye_inputs::{Compared, Sides, compare};
use grideye_validator::report::{self, Context};
use grideye_validator::{Comparison, Options, Verdict};
use std::path::Path;

pub(crate) fn run(options: &Compare) -> Result<Outcome> {
    check_is_page(options.report.as_deref())?;
    let sides = &options.sides;
    let mut loaded = files::load_scene(&sides.scene)?;
    let given = options.profile.iter().chain(&options.thresholds);
    let inputs = loaded.files.iter().chain([&sides.recording]).chain(given);
    let outputs = options.report.iter().chain(&options.junit);
    files::keep_apart(inputs, outputs.chain(&sides.json))?;
    let recording = recordings::load_thinned(&sides.recording)?;
    let unseen = files::say_unseen(&loaded, sides.sensor.as_deref());
    loaded.warnings.extend(unseen);
    let scene = sides.scene.display().to_string();
    let named = Sides {
        held: None,
        loaded: &loaded,
        scene: &scene,
        sensor: sides.sensor.as_deref(),
        recording: &sides.recording,
        profile: options.profile.as_deref(),
        thresholds: options.thresholds.as_deref(),
    };
    let how = Options {
        start_s: options.start,
        align: options.align.options().map_err(bad_input)?,
        advises: true,
        ..how(options.seed)
    };
    let compared = compare(&named, &recording, how, context()).map_err(bad_input)?;
    write(options, &compared)?;
    Ok(outcome(compared.comparison.judgment.verdict))
}

fn write(options: &Compare, compared: &Compared) -> Result<()> {
    let (comparison, context) = (&compared.comparison, &compared.context);
    if let Some(path) = &options.report {
        write_text(path, &report::html(comparison, context))?;
    }
    if let Some(path) = &options.junit {
        write_text(path, &report::junit(comparison, context))?;
    }
    let json = || report::json(comparison, context);
    answer(options.sides.json.as_ref(), json, || {
        words(comparison, context.experiment)
    })?;
    match &options.sides.json {
        Some(path) if path.as_os_str() != "-" => told(path),
        _ => {}
    }
    Ok(())
}

/// Rejects a report named `*.pdf`: a browser can print the page as PDF.
pub(crate) fn check_is_page(report: Option<&Path>) -> Result<()> {
    match report {
        Some(path) if path.extension().is_some_and(|end| end == "pdf") => Err(bad_input(anyhow!(
            "a report is a page, and {} is the name of a PDF\nhint: write --report {} and print it from a browser",
            path.display(),
            path.with_extension("html").display()
        ))),
        _ => Ok(()),
    }
}

/// With this seed.
pub(crate) fn how(seed: u64) -> Options {
    Options {
        seed,
        ..Options::default()
    }
}

pub(crate) fn outcome(verdict: Verdict) -> Outcome {
    match verdict {
        Verdict::Agrees => Outcome::Done,
        Verdict::Disagrees => Outcome::Disagrees,
        Verdict::CannotTell => Outcome::NoAnswer,
    }
}

/// The report's command and program.
pub(crate) fn context() -> Context {
    Context {
        command: command_line(),
        program: concat!("grideye ", env!("CARGO_PKG_VERSION")).to_owned(),
        ..Context::default()
    }
}

/// The given command with `grideye` in place of the program's path, which helps nobody else.
pub(crate) fn command_line() -> String {
    let arguments = std::env::args().skip(1).map(|argument| quoted(&argument));
    std::iter::once("grideye".to_owned())
        .chain(arguments)
        .collect::<Vec<_>>()
        .join(" ")
}

fn quoted(argument: &str) -> String {
    let is_plain =
        |character: char| character.is_ascii_alphanumeric() || "-_./:=,+%@".contains(character);
    if !argument.is_empty() && argument.chars().all(is_plain) {
        return argument.to_owned();
    }
    format!("'{}'", argument.replace('\'', r"'\''"))
}

fn write_text(path: &Path, text: &str) -> Result<()> {
    files::write_text(path, text)?;
    told(path);
    Ok(())
}

fn told(path: &Path) {
    progress::say(&format!("wrote {}", path.display()));
}

fn words(comparison: &Comparison, experiment: Option<u8>) -> String {
    let warnings = comparison
        .warnings
        .iter()
        .map(|warning| format!("warning: {warning}\n"));
    let warnings: String = warnings.collect();
    format!(
        "{warnings}{}{}",
        comparison.judgment,
        report::table(comparison, experiment)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_are_quoted_for_a_shell() {
        assert_eq!(
            quoted("scenes/experiment-1.toml"),
            "scenes/experiment-1.toml"
        );
        assert_eq!(quoted("my room's.toml"), r"'my room'\''s.toml'");
        assert_eq!(quoted(""), "''");
    }
}
