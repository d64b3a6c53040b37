//! `grideye compare`: a recording beside a simulation of its scene.

use crate::cli::Compare;
use crate::exit::{Outcome, bad_input};
use crate::output::{out, outln};
use crate::{files, progress, recordings};
use anyhow::{Context as _, Result, anyhow};
use grideye_recording::Record;
use grideye_scene::Scene;
use grideye_scene::profile::Profile;
use grideye_validator::report::{self, Context, Input};
use grideye_validator::thresholds::ThresholdSet;
use grideye_validator::{
    Comparison, KnownUnit, Measure, Options, THREADS_MAX, Verdict, compare_scene, paper,
};
use sha2::{Digest as _, Sha256};
use std::fmt::Write as _;
use std::io::Write as _;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// Compares, prints the verdict with its scores, and writes the reports that were asked for.
pub(crate) fn run(options: &Compare) -> Result<Outcome> {
    check_is_page(options.report.as_deref())?;
    let loaded = files::load_scene(Some(&options.sides.scene))?;
    files::keep_apart(
        [&options.sides.scene, &options.sides.recording]
            .into_iter()
            .chain(&loaded.trajectories)
            .chain(&options.profile)
            .chain(&options.thresholds),
        options
            .report
            .iter()
            .chain(&options.junit)
            .chain(&options.sides.json),
    )?;
    let scene = &loaded.scene;
    let sensor = files::sensor_name(scene, options.sides.sensor.as_deref())?;
    let given = Given::read(options)?;
    let recording = recordings::load_thinned(&options.sides.recording)?;
    let how = Options {
        binning: options.binning,
        start: options.start,
        align: options.align.options().map_err(bad_input)?,
        thresholds: given.thresholds.thresholds,
        unit: given.unit,
        ..how(options.seed)
    };
    let mut comparison =
        compare_scene(&recording.records, scene, &sensor, &how).map_err(bad_input)?;
    comparison.notes.extend(recording.note());
    let context = Context {
        scene: options.sides.scene.display().to_string(),
        recording: options.sides.recording.display().to_string(),
        sensor,
        command: command_line(),
        program: program(),
        created: String::new(),
        seeds: vec![("simulation".to_owned(), options.seed)],
        inputs: hashed_all(
            [&options.sides.scene]
                .into_iter()
                .chain(&loaded.trajectories)
                .chain([&options.sides.recording])
                .chain(&options.profile)
                .chain(&options.thresholds),
        )?,
        assumptions: loaded.warnings,
        experiment: scene.paper_experiment(),
        thresholds: given.thresholds.lines,
    };
    write(options, &comparison, &context)?;
    Ok(outcome(comparison.judgement.verdict))
}

const TOML_HINT: &str = "name a TOML file";

/// The files beside scene and recording.
struct Given {
    thresholds: ThresholdSet,
    unit: Option<KnownUnit>,
}

impl Given {
    fn read(options: &Compare) -> Result<Self> {
        let thresholds = match &options.thresholds {
            None => ThresholdSet::shipped(),
            Some(path) => {
                let text = files::text(path, "the thresholds", TOML_HINT)?;
                ThresholdSet::parse(&text, &path.display().to_string()).map_err(bad_input)?
            }
        };
        let unit = match &options.profile {
            None => None,
            Some(path) => {
                let text = files::text(path, "the profile", TOML_HINT)?;
                let profile =
                    Profile::parse(&text, &path.display().to_string()).map_err(bad_input)?;
                Some(KnownUnit::of(&profile))
            }
        };
        Ok(Self { thresholds, unit })
    }
}

/// Every file that was asked for, then the verdict; where JSON goes to standard output, nothing else does.
fn write(options: &Compare, comparison: &Comparison, context: &Context) -> Result<()> {
    if let Some(path) = &options.report {
        write_text(path, &report::html(comparison, context))?;
    }
    if let Some(path) = &options.junit {
        write_text(path, &report::junit(comparison, context))?;
    }
    match &options.sides.json {
        Some(path) if path.as_os_str() == "-" => out!("{}", report::json(comparison, context)),
        Some(path) => {
            write_text(path, &report::json(comparison, context))?;
            print(comparison, context.experiment)
        }
        None => print(comparison, context.experiment),
    }
}

/// Refuses a page under the name of a PDF: a browser prints one from the page.
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

/// Compares one stream with what the scene's sensor would see.
pub(crate) fn compare(
    records: &[Record],
    scene: &Scene,
    sensor: &str,
    seed: u64,
) -> Result<Comparison> {
    compare_scene(records, scene, sensor, &how(seed)).map_err(bad_input)
}

/// With that seed, on all processors.
fn how(seed: u64) -> Options {
    let processors = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    Options {
        seed,
        threads: processors.min(THREADS_MAX),
        ..Options::default()
    }
}

/// The exit code that a verdict deserves.
pub(crate) fn outcome(verdict: Verdict) -> Outcome {
    match verdict {
        Verdict::Agrees => Outcome::Done,
        Verdict::Disagrees => Outcome::Disagrees,
        Verdict::CannotTell => Outcome::NoAnswer,
    }
}

/// Name and version of this program.
pub(crate) fn program() -> String {
    concat!(env!("CARGO_PKG_NAME"), " ", env!("CARGO_PKG_VERSION")).to_owned()
}

/// The command that was given, for the report; the program's own path is of no use to others.
pub(crate) fn command_line() -> String {
    let arguments = std::env::args().skip(1).map(|argument| quoted(&argument));
    std::iter::once("grideye".to_owned())
        .chain(arguments)
        .collect::<Vec<_>>()
        .join(" ")
}

/// As a shell takes it.
fn quoted(argument: &str) -> String {
    let is_plain =
        |character: char| character.is_ascii_alphanumeric() || "-_./:=,+%@".contains(character);
    if !argument.is_empty() && argument.chars().all(is_plain) {
        return argument.to_owned();
    }
    format!("'{}'", argument.replace('\'', r"'\''"))
}

/// Each file with its SHA-256.
pub(crate) fn hashed_all<'a>(paths: impl IntoIterator<Item = &'a PathBuf>) -> Result<Vec<Input>> {
    paths.into_iter().map(|path| hashed(path)).collect()
}

/// A file with its SHA-256.
pub(crate) fn hashed(path: &Path) -> Result<Input> {
    let mut file = files::open(path)?;
    let mut hasher = Sha256::new();
    std::io::copy(&mut file, &mut hasher)
        .with_context(|| format!("cannot read {}", path.display()))?;
    Ok(Input {
        name: path.display().to_string(),
        hash: sha256_text(hasher),
    })
}

/// A text that came with the program, with its SHA-256.
pub(crate) fn hashed_text(name: &str, text: &str) -> Input {
    Input {
        name: name.to_owned(),
        hash: sha256_text(Sha256::new_with_prefix(text)),
    }
}

fn sha256_text(hasher: Sha256) -> String {
    let mut text = "sha256:".to_owned();
    for byte in hasher.finalize() {
        // Writing into a string does not fail.
        let _ = write!(text, "{byte:02x}");
    }
    text
}

fn write_text(path: &Path, text: &str) -> Result<()> {
    files::write_whole(path, |out| Ok(out.write_all(text.as_bytes())?))?;
    progress::say(&format!("wrote {}", path.display()));
    Ok(())
}

/// Verdict, reasons and the scores with what they are worth.
pub(crate) fn print(comparison: &Comparison, experiment: Option<u8>) -> Result<()> {
    outln!("{}", comparison.judgement.headline)?;
    for warning in &comparison.warnings {
        outln!("warning: {warning}")?;
    }
    for reason in &comparison.judgement.reasons {
        outln!("  {reason}")?;
    }
    outln!(
        "  What would change it: {}",
        comparison.judgement.would_change
    )?;
    out!("{}", report::table(comparison, experiment))
}

/// The paper's three scores in one line, each with its blank frame, shuffled pixels and repeat, and the paper's own.
pub(crate) fn scores_line(comparison: &Comparison, experiment: Option<u8>) -> String {
    let published = paper::EXPERIMENTS
        .iter()
        .find(|published| Some(published.number) == experiment);
    let scores = [
        Shown {
            title: "C",
            measure: Measure::Correlation,
            digits: 2,
            scale: 1.0,
            unit: "",
        },
        Shown {
            title: "MI",
            measure: Measure::MutualInformationGrey,
            digits: 1,
            scale: 1.0,
            unit: " bit",
        },
        Shown {
            title: "IS",
            measure: Measure::ImageSimilarity,
            digits: 0,
            scale: 100.0,
            unit: " %",
        },
    ];
    let pieces: Vec<String> = scores
        .iter()
        .map(|shown| {
            shown.text(
                comparison,
                published.and_then(|published| published.figure(shown.measure)),
            )
        })
        .collect();
    pieces.join("; ")
}

/// How a score is printed.
struct Shown {
    title: &'static str,
    measure: Measure,
    digits: usize,
    scale: f64,
    unit: &'static str,
}

impl Shown {
    /// `C 0.97 (shuffled 0.01, repeat 0.98; the paper's 0.79)`.
    fn text(&self, comparison: &Comparison, published: Option<f64>) -> String {
        let score = comparison.score(self.measure);
        let value = score
            .value
            .map_or_else(|| "none".to_owned(), |value| self.number(value));
        let beside: Vec<String> = [
            ("blank frame", score.blank),
            ("shuffled", score.shuffled.map(|shuffled| shuffled.mean)),
            ("repeat", score.ceiling),
            ("the paper's", published),
        ]
        .into_iter()
        .filter_map(|(name, value)| Some(format!("{name} {}", self.number(value?))))
        .collect();
        format!("{} {value} ({})", self.title, beside.join(", "))
    }

    fn number(&self, value: f64) -> String {
        // Without the zero, a shuffled mean of -0.001 would read "-0.00".
        let rounded = format!("{:.*}", self.digits, value * self.scale);
        let is_zero = rounded
            .trim_start_matches('-')
            .chars()
            .all(|digit| digit == '0' || digit == '.');
        format!(
            "{}{}",
            if is_zero {
                rounded.trim_start_matches('-')
            } else {
                &rounded
            },
            self.unit
        )
    }
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
