//! `grideye backup`, which copies a store in a file while a collector may be writing to it, and `grideye restore`.

use crate::cli::{Backup, Restore};
use crate::exit::{Outcome, bad_input};
use crate::output::outln;
use crate::{collect, progress};
use anyhow::{Result, anyhow};
use grideye_collector::StoreLocation;
use grideye_collector::store::{
    BackedUp, BackupError, RestoreError, StreamSummary, backup, restore,
};
use serde_json::{Value, json};
use std::path::PathBuf;

pub(crate) fn run(options: &Backup) -> Result<Outcome> {
    let out = options.out.display();
    let file: PathBuf = match collect::location(&options.store)? {
        StoreLocation::Postgres(url) => {
            return Err(bad_input(anyhow!(
                "{url} is a database, which PostgreSQL's own program backs up\nhint: pg_dump --format=custom --schema=grideye --file={out} {url}\n      pg_restore --no-owner --dbname=postgres://USER@HOST/NEW {out}"
            )));
        }
        location => location.to_string().into(),
    };
    let mut bars = progress::Bars::default();
    let backed_up = backup(&file, &options.out, |stage, done, all| {
        bars.show(stage.name(), done, all);
    })
    .map_err(told)?;
    report(&backed_up, &format!("copied to {out}"), options.json)
}

pub(crate) fn restore_to(options: &Restore) -> Result<Outcome> {
    let StoreLocation::File(file) = collect::location(&options.store)? else {
        return Err(bad_input(anyhow!(
            "{} is a database\nhint: `pg_restore` restores one: see \"Backups\" in crates/grideye-collector/README.md",
            options.store
        )));
    };
    let mut bars = progress::Bars::default();
    let restored = restore(&options.backup, &file, |stage, done, all| {
        bars.show(stage.name(), done, all);
    });
    let restored = restored.map_err(|error| match error {
        RestoreError::Copy(error) => told(error),
        RestoreError::InUse(_) => bad_input(error),
        other @ RestoreError::Rename { .. } => other.into(),
    })?;
    if let Some(replaced) = &restored.replaced {
        progress::say(&format!("the store before is {}", replaced.display()));
    }
    let done = format!("restored to {}", file.display());
    report(&restored.copied, &done, options.json)
}

fn report(backed_up: &BackedUp, done: &str, json: bool) -> Result<Outcome> {
    let counts = counts(backed_up);
    if json {
        outln!("{}", serde_json::to_string_pretty(&counts)?)?;
        return Ok(Outcome::Done);
    }
    let balance = match backed_up
        .streams
        .iter()
        .filter(|stream| is_unbalanced(stream))
        .count()
    {
        0 => "the counts balance".to_owned(),
        some => format!("the counts of {some} streams do not balance"),
    };
    outln!(
        "{} frames and {} missing ones of {} streams, {} recordings: {done} and checked; {balance}, agents dropped {}",
        counts["frames"],
        counts["missing"],
        backed_up.streams.len(),
        backed_up.recordings,
        counts["dropped"]
    )?;
    Ok(Outcome::Done)
}

/// A wrong file is bad input; a full disk or a damaged store is a failure.
fn told(error: BackupError) -> anyhow::Error {
    match error {
        BackupError::Missing { .. }
        | BackupError::Source { .. }
        | BackupError::Itself { .. }
        | BackupError::Exists { .. } => bad_input(error),
        other => other.into(),
    }
}

fn is_unbalanced(stream: &StreamSummary) -> bool {
    stream.unaccounted().is_some_and(|frames| frames != 0)
}

fn counts(backed_up: &BackedUp) -> Value {
    let sum = |count: fn(&StreamSummary) -> u64| backed_up.streams.iter().map(count).sum::<u64>();
    let stream = |stream: &StreamSummary| {
        json!({
            "device": stream.id.device,
            "sensor": stream.id.sensor,
            "boot": stream.id.boot,
            "stored": stream.stored,
            "expired": stream.expired,
            "missing": stream.missing,
            "dropped": stream.dropped(),
            "unaccounted": stream.unaccounted().and_then(|frames| i64::try_from(frames).ok()),
        })
    };
    json!({
        "frames": sum(|stream| stream.stored.saturating_sub(stream.expired)),
        "missing": sum(|stream| stream.missing),
        "dropped": sum(|stream| stream.dropped().unwrap_or(0)),
        "balanced": !backed_up.streams.iter().any(is_unbalanced),
        "recordings": backed_up.recordings,
        "bytes": backed_up.bytes,
        "streams": backed_up.streams.iter().map(stream).collect::<Vec<Value>>(),
    })
}
