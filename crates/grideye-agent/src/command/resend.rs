//! `grideye-agent resend`: posts again the records in quarantine that a collector rejected.

use super::common::{BadUsage, FAILED, post, read_config, with_joined, with_spool_folder};
use anyhow::Context as _;
use grideye_agent::agent::StartError;
use grideye_agent::cli::ResendArgs;
use grideye_agent::config::Config;
use grideye_agent::output;
use grideye_agent::spool::{QUARANTINE, REFUSED};
use grideye_recording::wire::Batch;
use rustix::fs::{FlockOperation, flock};
use std::fs::{self, File, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// The end of a file's name while its records are posted: a running agent may begin another meanwhile.
const SENDING: &str = ".sending";

pub(crate) fn run(args: &ResendArgs) -> anyhow::Result<ExitCode> {
    let config = with_joined(read_config(&args.config)?, &args.config)?;
    let config = with_spool_folder(config, &args.config)?;
    let folder = config.spool.folder.clone();
    let folder = folder.ok_or_else(|| BadUsage(StartError::NoSpoolFolder.to_string()))?;
    let quarantine = folder.join(QUARANTINE);
    let alone = File::open(&quarantine)
        .with_context(|| format!("{}\nhint: spool.folder in the configuration names its parent; only root or the service's user may read it", quarantine.display()))?;
    // Two at once would put back twice what they could not send.
    if flock(&alone, FlockOperation::NonBlockingLockExclusive).is_err() {
        anyhow::bail!(
            "another grideye-agent resend is at work in {}\nhint: wait for it; nothing was sent",
            quarantine.display()
        );
    }
    let (mut taken, mut left) = (0, 0);
    for file in rejected(&quarantine)? {
        let counts = resend(&config, &file)?;
        (taken, left) = (taken + counts.0, left + counts.1);
    }
    output::result(format_args!(
        "{taken} records sent again and taken, {left} left in {}\n",
        quarantine.display()
    ))?;
    Ok(ExitCode::from(if left == 0 { 0 } else { FAILED }))
}

/// The files of rejected records, in the order of their names; before each the one that a killed run left of it, which it would
/// else be renamed over.
fn rejected(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let names = fs::read_dir(folder)?.map(|entry| Ok(entry?.path()));
    let mut files = names.collect::<anyhow::Result<Vec<PathBuf>>>()?;
    files.retain(|file| {
        let name = file.file_name().and_then(|name| name.to_str());
        name.is_some_and(|name| name.starts_with(REFUSED))
    });
    files.sort_by_key(|file| {
        let name = file.display().to_string();
        let home = name.strip_suffix(SENDING).map(str::to_owned);
        (home.is_none(), home.unwrap_or(name))
    });
    Ok(files)
}

/// Posts each line of a file; returns how many were taken, and how many stay in it.
fn resend(config: &Config, file: &Path) -> anyhow::Result<(u64, u64)> {
    let collector = config.collector.as_deref();
    let collector = collector.ok_or_else(|| BadUsage(StartError::NoCollector.to_string()))?;
    let name = file.display().to_string();
    let home = name.strip_suffix(SENDING).unwrap_or(&name);
    let sending = format!("{home}{SENDING}");
    fs::rename(file, &sending).context(name.clone())?;
    let text = fs::read_to_string(&sending).context(sending.clone())?;
    let (mut taken, mut left, mut failure) = (0, Vec::new(), None);
    for line in text.lines() {
        let posted = match (&failure, Batch::from_json(line.as_bytes())) {
            (None, Ok(batch)) => post(collector, &config.credentials, &batch),
            // A line that was cut short by a power cut, or all after a failure.
            _ => Ok((0, serde_json::Value::Null)),
        };
        match posted {
            Ok((200, answer)) if answer["durable_through"].is_object() => taken += 1,
            Ok((0, _)) => left.push(line),
            Ok((status, answer)) => {
                let why = answer["error"]["message"]
                    .as_str()
                    .unwrap_or("no collector says this");
                output::say(&format_args!("{home}: status {status}: {why}"));
                left.push(line);
            }
            Err(error) => {
                failure = Some(error);
                left.push(line);
            }
        }
    }
    // A running agent may have added to the file while it was renamed.
    let now = fs::read_to_string(&sending)?;
    left.extend(now.get(text.len()..).unwrap_or_default().lines());
    if !left.is_empty() {
        let mut kept = OpenOptions::new().create(true).append(true).open(home)?;
        kept.write_all((left.join("\n") + "\n").as_bytes())?;
        kept.sync_data()?;
    }
    fs::remove_file(&sending)?;
    let count = u64::try_from(left.len()).unwrap_or(u64::MAX);
    failure.map_or(Ok((taken, count)), Err)
}
