//! `grideye demo`: the whole loop on one computer.
//!
//! Everything but the sensor and the bus is the real thing: the agent that runs on a Raspberry Pi, HTTP on a loopback
//! address, the collector with its store and page, the comparison and its report.

mod show;
mod stage;

use crate::cli::Demo;
use crate::exit::Outcome;
use crate::output::outln;
use crate::{compare, files, progress, recordings};
use anyhow::Result;
use grideye_recording::{Record, Row};
use grideye_rig::Replayed;
use grideye_validator::report::{self, Context};
use grideye_validator::thresholds::ThresholdSet;
use show::Show;
use stage::{Delivered, STORE, Stage};
use std::path::Path;

pub(crate) fn run(options: &Demo) -> Result<Outcome> {
    files::writable_folder(&options.out)?;
    let show = Show::prepare(options)?;
    keep_apart(options, &show)?;
    let stage = Stage::open(options)?;
    progress::say(&format!("live page  {}", stage.page()));
    let (delivered, agent) = stage.perform(options, &show)?;
    let Some(delivered) = delivered else {
        progress::say("interrupted before the recording was complete");
        return Ok(Outcome::NoAnswer);
    };
    let outcome = conclude(options, &show, &stage, &delivered)?;
    if options.once {
        return Ok(outcome);
    }
    progress::say("the live page stays until Ctrl-C");
    stage.wait_for_interrupt();
    drop(agent);
    Ok(Outcome::Done)
}

const RECORDING: &str = "recording.csv";
const PAGE: &str = "report.html";
const JSON: &str = "report.json";

/// What is shown may lie in the folder, but not under a name that is written there.
fn keep_apart(options: &Demo, show: &Show) -> Result<()> {
    let written = [RECORDING, PAGE, JSON, STORE].map(|name| options.out.join(name));
    files::keep_apart(show.files().iter().chain(&options.replay), &written)
}

/// Fetches the recording, judges it, and prints the three lines.
fn conclude(options: &Demo, show: &Show, stage: &Stage, delivered: &Delivered) -> Result<Outcome> {
    let path = options.out.join(RECORDING);
    files::write_whole(&path, |out| {
        stage.client.download_csv(delivered.recording, out)
    })?;
    let rows = recordings::load(&path)?;
    let (line, outcome, result) = match show {
        Show::Scene(scene) => judge_scene(options, scene, &path, &rows)?,
        Show::Replay(frames) => {
            let replayed = Replayed::new(frames, &rows);
            let outcome = match replayed.is_equal() {
                true => Outcome::Done,
                false => Outcome::Disagrees,
            };
            let result = format!("recording {}", path.display());
            (format!("replay    {replayed}"), outcome, result)
        }
    };
    let audit = stage.audit(delivered)?;
    let is_whole = audit.balanced == Some(true) && crate::audit::is_whole(&audit);
    outln!("delivery  {}", crate::audit::equation(&audit))?;
    outln!("{line}")?;
    let closed = if options.once { " (closed now)" } else { "" };
    outln!("page      {}{closed}   {result}", stage.page())?;
    Ok(if is_whole || outcome == Outcome::Disagrees {
        outcome
    } else {
        Outcome::NoAnswer
    })
}

type Judged = (String, Outcome, String);

fn judge_scene(
    options: &Demo,
    shown: &show::SceneShow,
    recording: &Path,
    rows: &[Row],
) -> Result<Judged> {
    let records: Vec<Record> = rows.iter().map(|row| row.record).collect();
    let seed = options.seed.wrapping_add(1);
    let comparison = compare::compare(&records, &shown.scene, &shown.sensor, seed)?;
    let context = Context {
        scene: shown.name.clone(),
        recording: recording.display().to_string(),
        sensor: shown.sensor.clone(),
        seeds: vec![("emulated sensor".to_owned(), options.seed), ("simulation".to_owned(), seed)],
        inputs: [shown.inputs.clone(), vec![compare::hashed(recording)?]].concat(),
        assumptions: [shown.warnings.clone(), vec![
            "The recording comes from an emulated sensor in the same scene, not from a real one: the scores show that the loop is whole, not that the simulator is right.".to_owned(),
        ]].concat(),
        experiment: shown.experiment,
        thresholds: ThresholdSet::shipped().lines,
        ..compare::context()
    };
    let page = options.out.join(PAGE);
    files::write_text(&page, &report::html(&comparison, &context))?;
    let json = options.out.join(JSON);
    files::write_text(&json, &report::json(&comparison, &context))?;
    let line = format!(
        "scores    {}: {}",
        comparison.judgement.verdict.name(),
        report::scores_line(&comparison, shown.experiment)
    );
    Ok((
        line,
        compare::outcome(comparison.judgement.verdict),
        format!("report {}", page.display()),
    ))
}
