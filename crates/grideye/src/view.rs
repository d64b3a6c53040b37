//! `grideye view`: plays any recording on the live page, without keeping it.

use crate::cli::View;
use crate::exit::{Outcome, bad_input};
use crate::stage::{Stage, open_in_browser};
use crate::{collect, files, progress, recordings};
use anyhow::{Context as _, Result, anyhow};
use grideye_recording::wire::{Batch, SensorBatch};
use grideye_recording::{Record, StreamId};

const FRAMES_PER_POST: usize = 1_000;
/// Longest name of a recording.
const NAME_CHARS_MAX: usize = 64;

pub(crate) fn run(options: &View) -> Result<Outcome> {
    let path = &options.recording;
    let streams = recordings::load_streams(path)?;
    recordings::say_doubt(path, streams.values().flatten());
    let mut records = streams.values().flatten();
    if !records.any(|record| record.reading.frame().is_some()) {
        return Err(bad_input(anyhow!(
            "{} holds no frame to show\nhint: all of its rows say that a frame is missing, or it has no rows",
            path.display()
        )));
    }
    let folder = tempfile::tempdir().context("cannot make a temporary folder")?;
    let annexes = collect::annexes(&options.page.scenes, None)?;
    let stage = Stage::open(
        options.page.listen,
        folder.path().join("view.sqlite"),
        annexes,
        None,
    )?;
    let name: String = files::stem(path).chars().take(NAME_CHARS_MAX).collect();
    let id = stage.client.start_recording(&name)?.id;
    let frames = streams.values().map(Vec::len).sum::<usize>();
    let bar = progress::bar(u64::try_from(frames).unwrap_or(u64::MAX), "opening");
    for (stream, records) in &streams {
        for some in records.chunks(FRAMES_PER_POST) {
            stage.client.deliver(&batch(stream, some))?;
            bar.inc(u64::try_from(some.len()).unwrap_or(u64::MAX));
        }
    }
    bar.finish_and_clear();
    stage.client.stop_recording(id)?;
    let page = format!("{}#recording={id}&play", stage.page());
    progress::say(&format!("page       {page}"));
    if options.page.open {
        open_in_browser(&page);
    }
    progress::say("it stays until Ctrl-C, and nothing is kept");
    stage.wait_for_interrupt();
    Ok(Outcome::Done)
}

fn batch(stream: &StreamId, records: &[Record]) -> Batch {
    Batch {
        device: stream.device.clone(),
        boot: stream.boot.clone(),
        t_sent_boot_ns: None,
        sensors: vec![SensorBatch {
            sensor: stream.sensor.clone(),
            account: None,
            frames: records.to_vec(),
        }],
    }
}
