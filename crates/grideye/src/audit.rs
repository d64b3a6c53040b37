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
    let is_whole = rows.iter().all(Account::is_whole);
    if !is_whole {
        say(&loss(&rows));
    }
    Ok(Outcome::told(is_whole))
}

/// Why the exit code is 3.
fn loss(rows: &[Account]) -> String {
    let missing: u64 = rows.iter().map(|row| row.missing).sum();
    let dropped: u64 = rows.iter().map(Account::dropped_total).sum();
    let uneven = match rows.iter().any(|row| row.balanced == Some(false)) {
        true => ", others unaccounted for (≠)",
        false => "",
    };
    format!(
        "exit code 3: missing {missing} (never read from the sensor), dropped {dropped} (after reading){uneven}"
    )
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
