//! `grideye audit`: every frame that was read, accounted for.

use crate::cli::Audit;
use crate::client::{AuditRow, Client};
use crate::exit::Outcome;
use anyhow::Result;

/// Prints the count of every stream, and fails with 3 if a frame was lost or is unaccounted for.
pub(crate) fn run(options: &Audit) -> Result<Outcome> {
    let rows = Client::new(&options.collector.url).audit()?;
    if options.json {
        println!("{}", serde_json::to_string_pretty(&rows)?);
    } else if rows.is_empty() {
        println!("no stream yet");
    } else {
        for row in &rows {
            println!(
                "{} {} {}  {}",
                row.device,
                row.sensor,
                row.boot,
                equation(row)
            );
        }
    }
    let is_whole = rows
        .iter()
        .all(|row| row.balanced && row.dropped_total() == 0 && row.missing == 0);
    Ok(if is_whole {
        Outcome::Done
    } else {
        Outcome::NoAnswer
    })
}

/// `read 100 = stored 100 + dropped 0 + spooled 0, missing 0`.
pub(crate) fn equation(row: &AuditRow) -> String {
    format!(
        "read {} {} stored {} + dropped {} + spooled {}, missing {}",
        row.read,
        if row.balanced { "=" } else { "≠" },
        row.stored,
        row.dropped_total(),
        row.spooled,
        row.missing
    )
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
            read: 12,
            stored: 9,
            missing: 1,
            dropped: BTreeMap::from([("ring-full".into(), 2)]),
            spooled: 1,
            balanced: true,
        };
        assert_eq!(
            equation(&row),
            "read 12 = stored 9 + dropped 2 + spooled 1, missing 1"
        );
        row.balanced = false;
        assert!(equation(&row).contains("read 12 ≠ stored 9"));
    }
}
