//! `grideye record`: name what arrives at a running collector, and fetch it.

use crate::cli::Record;
use crate::client::Client;
use crate::exit::{Outcome, bad_input};
use crate::output::outln;
use crate::{files, progress};
use anyhow::{Context as _, Result, anyhow};

pub(crate) fn run(options: &Record) -> Result<Outcome> {
    let (token, authority) = (&options.collector.token_file, &options.collector.authority);
    files::keep_apart(token.iter().chain(authority), &options.out)?;
    if options.name.trim().is_empty() {
        return Err(bad_input(anyhow!(
            "a recording needs a name\nhint: for example evening"
        )));
    }
    let client = Client::of(&options.collector)?;
    let recording = client.start_recording(&options.name)?;
    progress::say(&format!("recording {:?}", recording.name));
    wait(options.seconds)?;
    let recording = client.stop_recording(recording.id)?;
    if let Some(out) = &options.out {
        files::write_whole(out, |file| client.download_csv(recording.id, file))?;
    }
    let (frames, missing, name) = (recording.frames, recording.missing, &recording.name);
    outln!("recorded {frames} frames as {name:?}; {missing} missing")?;
    if recording.frames == 0 {
        progress::say("no frame arrived\nhint: look at the collector's page; is an agent running?");
    }
    Ok(Outcome::told(recording.frames > 0))
}

fn wait(seconds: Option<u64>) -> Result<()> {
    let runtime = progress::runtime().context("cannot start the timer")?;
    runtime.block_on(async {
        let interrupted = tokio::signal::ctrl_c();
        match seconds {
            Some(seconds) => tokio::select! {
                () = progress::wait(seconds, "recording") => Ok(()),
                result = interrupted => result,
            },
            None => interrupted.await,
        }
    })?;
    Ok(())
}
