//! `grideye record`: name what arrives at a running collector, and fetch it.

use crate::cli::Record;
use crate::client::Client;
use crate::exit::{Outcome, bad_input};
use crate::output::outln;
use crate::{files, progress};
use anyhow::{Context as _, Result, anyhow};
use std::time::Duration;

/// The collector ends a recording that is not renewed for 5 minutes.
const RENEW_EVERY: Duration = Duration::from_secs(20);

pub(crate) fn run(options: &Record) -> Result<Outcome> {
    let (token, authority) = (&options.collector.token_file, &options.collector.authority);
    files::keep_apart(token.iter().chain(authority), &options.out)?;
    if options.name.trim().is_empty() {
        return Err(bad_input(anyhow!(
            "a recording needs a name\nhint: for example evening"
        )));
    }
    let client = Client::of(&options.collector)?;
    if options.delete {
        return delete(&client, options.name.trim());
    }
    let recording = client.start_recording(&options.name)?;
    progress::say(&format!("recording {:?}", recording.name));
    let (renewing, id) = (client.clone(), recording.id);
    // Ends with this program. If a renewal fails, a later one may not; an older collector knows none.
    std::thread::spawn(move || {
        loop {
            let _ = renewing.renew_recording(id);
            std::thread::sleep(RENEW_EVERY);
        }
    });
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

fn delete(client: &Client, name: &str) -> Result<Outcome> {
    let recordings = client.recordings()?;
    let named = recordings.iter().find(|recording| recording.name == name);
    let recording = named.ok_or_else(|| {
        bad_input(anyhow!(
            "there is no recording named {name:?}\nhint: the collector's page lists them"
        ))
    })?;
    client.delete_recording(recording.id)?;
    outln!("deleted the recording {name:?}; its frames stay until they are too old")?;
    Ok(Outcome::Done)
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
