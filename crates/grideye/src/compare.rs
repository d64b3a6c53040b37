//! `grideye compare`: compares a recording with a simulation of its scene.

use crate::cli::Compare;
use crate::exit::{Outcome, bad_input};
use crate::output::answer;
use crate::{files, progress, recordings};
use anyhow::{Context as _, Result, anyhow};
use grideye_validator::report::{self, Context, Input};
use grideye_validator::thresholds::ThresholdSet;
use grideye_validator::{Comparison, KnownUnit, Options, THREADS_MAX, Verdict, compare_scene};
use sha2::{Digest as _, Sha256};
use std::io;
use std::path::Path;

pub(crate) fn run(options: &Compare) -> Result<Outcome> {
    check_is_page(options.report.as_deref())?;
    let sides = &options.sides;
    let loaded = files::load_scene(Some(&sides.scene))?;
    let given = || options.profile.iter().chain(&options.thresholds);
    let inputs = || loaded.files.iter().chain([&sides.recording]).chain(given());
    let outputs = options.report.iter().chain(&options.junit);
    files::keep_apart(inputs(), outputs.chain(&sides.json))?;
    let scene = &loaded.scene;
    let sensor = files::sensor_name(scene, sides.sensor.as_deref())?;
    let thresholds = match &options.thresholds {
        None => ThresholdSet::shipped(),
        Some(path) => {
            let text = files::text(path, "the thresholds", TOML_HINT)?;
            ThresholdSet::parse(&text, &path.display().to_string()).map_err(bad_input)?
        }
    };
    let profile = options.profile.as_deref();
    let profile = profile
        .map(|path| files::load_profile(path, TOML_HINT))
        .transpose()?;
    let recording = recordings::load_thinned(&sides.recording)?;
    let how = Options {
        binning: options.binning,
        start: options.start,
        align: options.align.options().map_err(bad_input)?,
        thresholds: thresholds.thresholds,
        advises: true,
        unit: profile.as_ref().map(KnownUnit::of),
        ..how(options.seed)
    };
    let mut comparison =
        compare_scene(&recording.records, scene, &sensor, &how).map_err(bad_input)?;
    comparison.notes.extend(recording.note());
    let context = Context {
        scene: sides.scene.display().to_string(),
        recording: sides.recording.display().to_string(),
        sensor,
        seeds: vec![("simulation".to_owned(), options.seed)],
        inputs: inputs().map(|path| hashed(path)).collect::<Result<_>>()?,
        assumptions: loaded.warnings,
        experiment: scene.paper_experiment(),
        thresholds: thresholds.lines,
        ..context()
    };
    write(options, &comparison, &context)?;
    Ok(outcome(comparison.judgment.verdict))
}

const TOML_HINT: &str = "name a TOML file";

fn write(options: &Compare, comparison: &Comparison, context: &Context) -> Result<()> {
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

/// All processors, and this seed.
pub(crate) fn how(seed: u64) -> Options {
    Options {
        seed,
        threads: progress::cores().min(THREADS_MAX),
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

pub(crate) fn hashed(path: &Path) -> Result<Input> {
    let name = path.display().to_string();
    let mut hasher = Sha256::new();
    io::copy(&mut files::open(path)?, &mut hasher)
        .with_context(|| format!("cannot read {name}"))?;
    Ok(input(name, hasher))
}

pub(crate) fn hashed_text(name: &str, text: &str) -> Input {
    input(name.to_owned(), Sha256::new_with_prefix(text))
}

fn input(name: String, hasher: Sha256) -> Input {
    let bytes = hasher.finalize();
    let digits: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    let hash = format!("sha256:{digits}");
    Input { name, hash }
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
        "{}{warnings}{}",
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

    #[test]
    fn a_hash_is_the_published_one_of_its_text() {
        // FIPS 180-2, appendix B.1.
        assert_eq!(
            hashed_text("abc", "abc").hash,
            "sha256:ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
        );
    }
}
