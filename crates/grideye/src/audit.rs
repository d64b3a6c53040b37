//! `grideye audit`: every frame that was read, accounted for.

use crate::cli::Audit;
use crate::client::{AuditRow, Client, Rivals};
use crate::exit::Outcome;
use crate::output::outln;
use anyhow::Result;

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
            let (device, sensor, boot) = (&row.device, &row.sensor, &row.boot);
            outln!("{device} {sensor} {boot}  {}", equation(row))?;
        }
    }
    Ok(Outcome::told(rows.iter().all(is_whole)))
}

pub(crate) fn is_whole(row: &AuditRow) -> bool {
    row.balanced != Some(false) && row.dropped_total() == 0 && row.missing == 0
}

/// `read 100 = stored 97 + dropped 3 (ring-full 3) + spooled 0, missing 0`; of frames that came without the agent's
/// count, what is known.
pub(crate) fn equation(row: &AuditRow) -> String {
    // Of those, some may have been let go since, where a limit of age or room was reached.
    let stored = match row.expired {
        0 => row.stored.to_string(),
        expired => format!("{} ({expired} of them let go since)", row.stored),
    };
    let missing = row.missing;
    let (Some(read), Some(spooled)) = (row.read, row.spooled) else {
        return format!("stored {stored}, missing {missing}; the agent sent no count");
    };
    let equals = if row.balanced == Some(false) {
        "≠"
    } else {
        "="
    };
    let reasons = row.dropped.iter().flatten();
    let reasons: Vec<String> = reasons
        .map(|(reason, count)| format!("{reason} {count}"))
        .collect();
    let reasons = match reasons.as_slice() {
        [] => String::new(),
        named => format!(" ({})", named.join(", ")),
    };
    format!(
        "read {read} {equals} stored {stored} + dropped {}{reasons} + spooled {spooled}, missing {missing}",
        row.dropped_total()
    )
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_equation_says_when_it_does_not_hold() {
        let mut row: AuditRow = serde_json::from_value(serde_json::json!({
            "device": "pi-1", "sensor": "i2c-1:0x69", "boot": "b", "read": 12, "stored": 9, "missing": 1,
            "dropped": { "ring-full": 1, "spool-full": 1 }, "spooled": 1, "balanced": true
        }))
        .unwrap();
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
