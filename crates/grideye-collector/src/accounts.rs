//! The answer of `/v1/audit`, as a client reads it.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;

/// The counts of the streams added to last, and the device names that several agents use.
#[derive(Debug, Clone, Deserialize)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Accounts {
    pub streams: Vec<Account>,
    #[serde(default)]
    pub rivals: Vec<Rivals>,
    /// Further streams that were added to longer ago.
    #[serde(default)]
    pub unlisted: u64,
}

/// The counts of one stream. The agent's own are `None` if its frames came without them.
///
/// Prints `read 100 = stored 97 + dropped 3 (ring-full 3) + spooled 0, missing 0; last report 25 s ago`.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Account {
    pub device: String,
    pub sensor: String,
    pub boot: String,
    pub read: Option<u64>,
    pub stored: u64,
    /// How many of the stored frames were deleted since, by age or to save space.
    #[serde(default)]
    pub expired: u64,
    pub missing: u64,
    pub dropped: Option<BTreeMap<String, u64>>,
    pub spooled: Option<u64>,
    pub balanced: Option<bool>,
    /// How long ago its frames last came, in seconds.
    pub last_report_s: Option<u64>,
}

/// An older last report is named: a sensor that sends has a newer one.
const RECENT_S: u64 = 5;

/// Several agents that send under one device name.
#[derive(Debug, Clone, Deserialize)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Rivals {
    pub device: String,
    pub boots: Vec<String>,
}

impl Account {
    /// Whether no frame is missing, dropped or unaccounted for.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.balanced != Some(false) && self.dropped_total() == 0 && self.missing == 0
    }

    /// Frames that the agent dropped, over all reasons.
    #[must_use]
    pub fn dropped_total(&self) -> u64 {
        self.dropped.iter().flat_map(BTreeMap::values).sum()
    }
}

impl fmt::Display for Account {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let stored = match self.expired {
            0 => self.stored.to_string(),
            expired => format!("{} ({expired} of them deleted since)", self.stored),
        };
        let missing = self.missing;
        let (Some(read), Some(spooled)) = (self.read, self.spooled) else {
            let without = "the agent sent no count";
            return write!(formatter, "stored {stored}, missing {missing}; {without}");
        };
        let equals = match self.balanced {
            Some(false) => "≠",
            _ => "=",
        };
        let reasons = self.dropped.iter().flatten();
        let reasons = reasons.map(|(reason, count)| format!("{reason} {count}"));
        let reasons = match reasons.collect::<Vec<_>>().join(", ") {
            none if none.is_empty() => none,
            named => format!(" ({named})"),
        };
        write!(
            formatter,
            "read {read} {equals} stored {stored} + dropped {}{reasons} + spooled {spooled}, missing {missing}",
            self.dropped_total()
        )?;
        match self.last_report_s.filter(|since_s| *since_s > RECENT_S) {
            None => Ok(()),
            Some(s @ 0..600) => write!(formatter, "; last report {s} s ago"),
            Some(s @ 0..36_000) => write!(formatter, "; last report {} min ago", s / 60),
            Some(s @ 0..360_000) => write!(formatter, "; last report {} h ago", s / 3600),
            Some(s) => write!(formatter, "; last report {} days ago", s / 86_400),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_old_report_is_named_as_such() {
        let shown = |last_report_s: Option<u64>| {
            let account = Account {
                device: "pi-1".to_owned(),
                sensor: "s".to_owned(),
                boot: "b".to_owned(),
                read: Some(10),
                stored: 10,
                expired: 0,
                missing: 0,
                dropped: Some(BTreeMap::new()),
                spooled: Some(0),
                balanced: Some(true),
                last_report_s,
            };
            account.to_string()
        };
        let recent = "read 10 = stored 10 + dropped 0 + spooled 0, missing 0";
        for (last_report_s, said) in [
            (None, ""),
            (Some(5), ""),
            (Some(25), "; last report 25 s ago"),
            (Some(3_599), "; last report 59 min ago"),
            (Some(36_000), "; last report 10 h ago"),
            (Some(864_000), "; last report 10 days ago"),
        ] {
            assert_eq!(shown(last_report_s), format!("{recent}{said}"));
        }
    }
}
