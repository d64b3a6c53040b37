//! `grideye audit`: every frame that was read, accounted for.

use crate::cli::Audit;
use crate::client::Client;
use crate::exit::Outcome;
use crate::output::outln;
use crate::progress::say;
use anyhow::Result;
use grideye_collector::{Account, Rivals};
use grideye_recording::printable;

pub(crate) fn run(options: &Audit) -> Result<Outcome> {
    let audit = Client::of(&options.collector)?.audit()?;
    for rivals in &audit.rivals {
        say(&warning(rivals));
    }
    if audit.unlisted > 0 {
        say(&format!("{} older boots are not listed", audit.unlisted));
    }
    let rows = audit.streams;
    if options.json {
        outln!("{}", serde_json::to_string_pretty(&rows)?)?;
    } else if rows.is_empty() {
        outln!("no stream yet")?;
    } else {
        for row in &rows {
            let (device, sensor, boot) = (&row.device, &row.sensor, &row.boot);
            outln!("{}", printable(&format!("{device} {sensor} {boot}  {row}")))?;
        }
    }
    Ok(Outcome::told(rows.iter().all(Account::is_whole)))
}

/// Two machines, or a copied card: nothing is lost, but the frames of both are mixed.
fn warning(rivals: &Rivals) -> String {
    format!(
        "warning: {} agents send as {}: boots {}\nhint: give each its own `device` in its configuration",
        rivals.boots.len(),
        printable(&rivals.device),
        printable(&rivals.boots.join(", "))
    )
}
