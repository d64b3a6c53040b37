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
use grideye_frame::RawFrame;
use grideye_recording::{Record, Row};
use grideye_validator::report::{self, Context};
use grideye_validator::thresholds::ThresholdSet;
use show::Show;
use stage::{Delivered, STORE, Stage};
use std::path::Path;

/// Runs the loop once; then serves the page until Ctrl-C, unless `--once` asked for the exit code.
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
    let shown = options.scene.iter().chain(&options.replay);
    files::keep_apart(shown.chain(show.files()), &written)
}

/// Fetches the recording, judges it, and prints the three lines.
fn conclude(options: &Demo, show: &Show, stage: &Stage, delivered: &Delivered) -> Result<Outcome> {
    let path = options.out.join(RECORDING);
    files::write_whole(&path, |out| {
        stage
            .client()
            .download_csv(delivered.recording, out)
            .map(drop)
    })?;
    let rows = recordings::load(&path)?;
    let (line, outcome, result) = match show {
        Show::Scene(scene) => judge_scene(options, scene, &path, &rows)?,
        Show::Replay(replay) => judge_replay(&replay.frames, &rows, &path),
    };
    let audit = stage.audit(delivered)?;
    let is_whole = audit.balanced == Some(true) && audit.missing == 0 && audit.dropped_total() == 0;
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
        command: compare::command_line(),
        program: compare::program(),
        created: String::new(),
        seeds: vec![("emulated sensor".to_owned(), options.seed), ("simulation".to_owned(), seed)],
        inputs: [shown.inputs.clone(), vec![compare::hashed(recording)?]].concat(),
        assumptions: [shown.warnings.clone(), vec![
            "The recording comes from an emulated sensor in the same scene, not from a real one: the scores show that the loop is whole, not that the simulator is right.".to_owned(),
        ]].concat(),
        experiment: shown.experiment,
        thresholds: ThresholdSet::shipped().lines,
    };
    let page = options.out.join(PAGE);
    let json = options.out.join(JSON);
    for (path, text) in [
        (&page, report::html(&comparison, &context)),
        (&json, report::json(&comparison, &context)),
    ] {
        files::write_text(path, &text)?;
    }
    let line = format!(
        "scores    {}: {}",
        comparison.judgement.verdict.name(),
        compare::scores_line(&comparison, shown.experiment)
    );
    Ok((
        line,
        compare::outcome(comparison.judgement.verdict),
        format!("report {}", page.display()),
    ))
}

/// Counts what came out against what went in: every word of every frame.
fn judge_replay(source: &[RawFrame], rows: &[Row], recording: &Path) -> Judged {
    let read: Vec<&RawFrame> = rows
        .iter()
        .filter_map(|row| row.record.reading.frame())
        .collect();
    let missing = rows.len() - read.len();
    let (pixels, thermistors) =
        source
            .iter()
            .zip(&read)
            .fold((0, 0), |(pixels, thermistors), (sent, got)| {
                let differing = sent
                    .pixels
                    .iter()
                    .zip(got.pixels)
                    .filter(|(sent, got)| **sent != *got)
                    .count();
                (
                    pixels + differing,
                    thermistors + usize::from(sent.thermistor != got.thermistor),
                )
            });
    let is_equal = read.len() == source.len() && missing == 0 && pixels == 0 && thermistors == 0;
    let line = format!(
        "replay    {} frames in, {} out, {missing} missing; compared one by one in order: {pixels} of {} pixels and {thermistors} of {} thermistor values differ",
        source.len(),
        read.len(),
        source.len() * grideye_frame::PIXELS,
        source.len(),
    );
    let outcome = if is_equal {
        Outcome::Done
    } else {
        Outcome::Disagrees
    };
    (line, outcome, format!("recording {}", recording.display()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use grideye_frame::{NoData, PIXELS, PixelWord, Reading, ThermistorWord};
    use grideye_recording::{ClockState, Stamp, StreamId};

    fn frame(first: u16) -> RawFrame {
        let mut pixels = [PixelWord(80); PIXELS];
        pixels[0] = PixelWord(first);
        RawFrame {
            thermistor: ThermistorWord(400),
            pixels,
        }
    }

    fn rows(readings: impl IntoIterator<Item = Reading<RawFrame>>) -> Vec<Row> {
        let stream = StreamId {
            device: "demo".into(),
            sensor: "s".into(),
            boot: "b".into(),
        };
        let stamp = Stamp {
            t_boot_ns: 0,
            t_utc_ns: 0,
            clock: ClockState::Synced,
        };
        (0..)
            .zip(readings)
            .map(|(seq, reading)| Row {
                stream: stream.clone(),
                record: Record {
                    seq,
                    stamp,
                    reading,
                },
                t_arrival_ns: None,
            })
            .collect()
    }

    #[test]
    fn a_replay_is_equal_only_if_every_word_of_every_frame_is() {
        let source = [frame(1), frame(2), frame(3)];
        let judge = |readings: &[Reading<RawFrame>]| {
            judge_replay(&source, &rows(readings.iter().copied()), Path::new("r.csv"))
        };
        let whole: Vec<_> = source.iter().copied().map(Reading::Frame).collect();
        assert_eq!(judge(&whole).1, Outcome::Done);

        assert_eq!(judge(&whole[..2]).1, Outcome::Disagrees, "one frame short");
        let swapped = [whole[1], whole[0], whole[2]];
        assert!(
            judge(&swapped).0.contains("2 of 192 pixels"),
            "out of order"
        );
        let twice = [whole[0], whole[1], whole[1], whole[2]];
        assert_eq!(judge(&twice).1, Outcome::Disagrees, "one twice");
        let gap = [whole[0], Reading::NoData(NoData::Nack), whole[1], whole[2]];
        assert_eq!(judge(&gap).1, Outcome::Disagrees, "a missing row");
    }
}
