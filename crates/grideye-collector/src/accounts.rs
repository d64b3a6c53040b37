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
/// Prints `read 100 = stored 97 + dropped 3 (ring-full 3) + spooled 0, missing 0`.
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
}

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

    fn dropped_total(&self) -> u64 {
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
        )
    }
}
