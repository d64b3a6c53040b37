//! `grideye migrate`: from one machine's file to a database that several collectors share.

use crate::cli::Migrate;
use crate::exit::{Outcome, bad_input};
use crate::output::outln;
use crate::{collect, progress};
use anyhow::{Context as _, Result, anyhow};
use grideye_collector::StoreLocation;
use grideye_collector::store::migrate::{Migrated, migrate};
use serde_json::json;

pub(crate) fn run(options: &Migrate) -> Result<Outcome> {
    let StoreLocation::Postgres(url) = collect::location(&options.url)? else {
        return Err(bad_input(anyhow!(
            "{} is no database\nhint: grideye migrate FILE postgres://USER@HOST/DATABASE",
            options.url
        )));
    };
    if !options.file.is_file() {
        return Err(bad_input(anyhow!(
            "there is no file {}\nhint: the first argument is the SQLite file to move",
            options.file.display()
        )));
    }
    let runtime = progress::runtime().context("cannot start")?;
    let mut bars = progress::Bars::default();
    let migrated = runtime.block_on(migrate(&options.file, &url, |stage, done, total| {
        bars.show(stage.name(), done, total);
    }))?;
    if options.json {
        let counts = json!({
            "frames": migrated.frames,
            "missing": migrated.missing,
            "streams": migrated.streams,
            "recordings": migrated.recordings,
            "resumed_after": migrated.resumed_after,
            "difference": migrated.difference,
        });
        outln!("{}", serde_json::to_string_pretty(&counts)?)?;
    } else {
        let Migrated {
            frames,
            missing,
            streams,
            recordings,
            ..
        } = &migrated;
        outln!(
            "{frames} frames and {missing} missing ones of {streams} streams, {recordings} recordings: copied and held against {}",
            options.file.display()
        )?;
    }
    let Some(difference) = &migrated.difference else {
        return Ok(Outcome::Done);
    };
    progress::say(&format!("the database differs from the file: {difference}"));
    Ok(Outcome::Disagrees)
}
