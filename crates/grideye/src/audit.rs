//! `grideye audit`: every frame that was read, accounted for.

use crate::cli::Audit;
use crate::client::{AuditRow, Client, Rivals};
use crate::exit::Outcome;
use crate::output::outln;
use anyhow::Result;

/// Prints the count of every stream, and fails with 3 if a frame was lost or is unaccounted for.
pub(crate) fn run(options: &Audit) -> Result<Outcome> {
    let audit = Client::of(&options.collector)?.audit()?;
    for rivals in &audit.rivals {
        eprintln!("{}", warning(rivals));
    }
    let rows = audit.streams;
    if options.json {
        outln!("{}", serde_json::to_string_pretty(&rows)?)?;
    } else if rows.is_empty() {
        outln!("no stream yet")?;
    } else {
        for row in &rows {
            outln!(
                "{} {} {}  {}",
                row.device,
                row.sensor,
                row.boot,
                equation(row)
            )?;
        }
    }
    let is_whole = rows
        .iter()
        .all(|row| row.balanced != Some(false) && row.dropped_total() == 0 && row.missing == 0);
    Ok(if is_whole {
        Outcome::Done
    } else {
        Outcome::NoAnswer
    })
}

/// `read 100 = stored 97 + dropped 3 (ring-full 3) + spooled 0, missing 0`; of frames that came without the agent's
/// count, what is known.
pub(crate) fn equation(row: &AuditRow) -> String {
    let (Some(read), Some(spooled)) = (row.read, row.spooled) else {
        return format!(
            "stored {}, missing {}; the agent sent no count",
            stored(row),
            row.missing
        );
    };
    format!(
        "read {read} {} stored {} + dropped {}{} + spooled {spooled}, missing {}",
        if row.balanced == Some(false) {
            "≠"
        } else {
            "="
        },
        stored(row),
        row.dropped_total(),
        reasons(row),
        row.missing
    )
}

/// `97`, or `97 (40 of them let go since)` where a limit of age or room was reached.
fn stored(row: &AuditRow) -> String {
    match row.expired {
        0 => row.stored.to_string(),
        expired => format!("{} ({expired} of them let go since)", row.stored),
    }
}

/// Two machines, or one card copied to another: nothing is lost, but nobody can tell whose frames are whose.
fn warning(rivals: &Rivals) -> String {
    format!(
        "warning: {} agents send as {}: runs {}\nhint: give each its own `device` in its configuration",
        rivals.boots.len(),
        rivals.device,
        rivals.boots.join(", ")
    )
}

/// ` (ring-full 2, spool-full 7)`, or nothing where nothing was dropped.
fn reasons(row: &AuditRow) -> String {
    let counts = row.dropped.iter().flatten();
    let named: Vec<String> = counts
        .map(|(reason, count)| format!("{reason} {count}"))
        .collect();
    match named.as_slice() {
        [] => String::new(),
        named => format!(" ({})", named.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn the_equation_says_when_it_does_not_hold() {
        let mut row = AuditRow {
            device: "pi-1".into(),
            sensor: "i2c-1:0x69".into(),
            boot: "b".into(),
            read: Some(12),
            stored: 9,
            expired: 0,
            missing: 1,
            dropped: Some(BTreeMap::from([
                ("ring-full".into(), 1),
                ("spool-full".into(), 1),
            ])),
            spooled: Some(1),
            balanced: Some(true),
        };
        assert_eq!(
            equation(&row),
            "read 12 = stored 9 + dropped 2 (ring-full 1, spool-full 1) + spooled 1, missing 1"
        );
        row.expired = 4;
        assert!(equation(&row).contains("= stored 9 (4 of them let go since) + dropped 2"));
        row.expired = 0;
        row.balanced = Some(false);
        assert!(equation(&row).contains("read 12 ≠ stored 9"));
        row.read = None;
        assert_eq!(
            equation(&row),
            "stored 9, missing 1; the agent sent no count"
        );
    }
}
