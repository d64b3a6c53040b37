//! The spool's `state` file: where the needed segments start, and the boots that are not yet fully reported to the
//! collector, or were lately.
//!
//! One line with version and checksum, then JSON that people can read. The file is replaced as a whole. The line has
//! the same form in every version.

use super::segment::crc32c;
use crate::ranges::Ranges;
use grideye_recording::wire::Account;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

pub(super) const STATE: &str = "state";
/// Maximum size of a readable state in bytes.
pub(super) const STATE_BYTES_MAX: usize = 16 << 20;

/// The version of the state written, and the only one read.
pub(super) const STATE_VERSION: u32 = 1;
const BEGINNING: &str = "grideye-spool-state ";

/// Where the needed segments start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Cursor {
    /// Earlier segments are not needed.
    pub(super) segment: u64,
    /// Earlier bytes of that segment are not needed.
    pub(super) offset: u64,
}

/// One boot of the agent.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Run {
    pub(super) device: String,
    pub(super) boot: String,
    pub(super) sensors: BTreeMap<String, Count>,
    /// The collector knows all of it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub(super) is_told: bool,
}

/// An account as stored.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Count {
    pub(super) read: u64,
    pub(super) missing: u64,
    pub(super) dropped: BTreeMap<String, u64>,
    pub(super) errors: BTreeMap<String, u64>,
    /// The frames that the collector acknowledged, as far as they are known.
    #[serde(default, skip_serializing_if = "Ranges::is_empty")]
    pub(super) acknowledged: Ranges,
}

impl Count {
    /// The account of an ended boot with this many frames still to come.
    pub(super) fn of_ended(&self, spooled: u64) -> Account {
        Account {
            read: self.read,
            missing: self.missing,
            dropped: self.dropped.clone(),
            spooled,
            errors: self.errors.clone(),
            ended: true,
        }
    }

    /// Takes the boot's own later count.
    pub(super) fn renew(&mut self, account: &Account) {
        if account.read >= self.read {
            self.read = account.read;
            self.missing = account.missing;
            self.dropped = account.dropped.clone();
            self.errors = account.errors.clone();
        }
    }

    /// Merges a count found on the disk with the frames of that boot dropped since it ended.
    pub(super) fn take_in(&mut self, found: &Account) {
        let dropped = std::mem::take(&mut self.dropped);
        self.dropped = found.dropped.clone();
        for (reason, count) in dropped {
            let known = self.dropped.entry(reason).or_default();
            *known = (*known).max(count);
        }
        if found.read >= self.read {
            self.read = found.read;
            self.missing = found.missing;
            self.errors = found.errors.clone();
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct State {
    pub(super) cursor: Cursor,
    pub(super) runs: Vec<Run>,
}

impl State {
    pub(super) fn to_bytes(&self) -> Vec<u8> {
        // Strings and numbers only: this cannot fail.
        let json = serde_json::to_string_pretty(self).unwrap_or_default();
        let crc = crc32c(&[json.as_bytes()]);
        format!("{BEGINNING}{STATE_VERSION} crc32c {crc:08x}\n{json}").into_bytes()
    }

    /// `None` unless this version wrote it and it is complete.
    pub(super) fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (version, json) = whole(bytes)?;
        if version != STATE_VERSION {
            return None;
        }
        serde_json::from_str(json).ok()
    }

    /// The version of a complete state.
    pub(super) fn version(bytes: &[u8]) -> Option<u32> {
        whole(bytes).map(|(version, _)| version)
    }
}

/// Version and content of a state with the right checksum.
fn whole(bytes: &[u8]) -> Option<(u32, &str)> {
    let text = std::str::from_utf8(bytes).ok()?;
    let (version, rest) = text.strip_prefix(BEGINNING)?.split_once(" crc32c ")?;
    let (crc, content) = rest.split_once('\n')?;
    let is_whole = u32::from_str_radix(crc, 16).ok()? == crc32c(&[content.as_bytes()]);
    is_whole.then_some((version.parse().ok()?, content))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn specimen() -> State {
        State {
            cursor: Cursor {
                segment: 12,
                offset: 345,
            },
            runs: vec![Run {
                device: "pi-1".to_owned(),
                boot: "5f0c".to_owned(),
                sensors: BTreeMap::from([("i2c-1:0x69".to_owned(), Count::default())]),
                is_told: true,
            }],
        }
    }

    #[test]
    fn a_state_round_trips_and_every_flipped_bit_is_rejected() {
        let bytes = specimen().to_bytes();
        assert_eq!(State::from_bytes(&bytes), Some(specimen()));
        for place in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[place] ^= 1;
            assert_eq!(State::from_bytes(&damaged), None, "byte {place}");
            assert_eq!(State::from_bytes(&bytes[..place]), None, "cut at {place}");
        }
    }

    #[test]
    fn the_later_of_two_counts_is_kept() {
        let mut count = Count::default();
        let account = |read, missing| Account {
            read,
            missing,
            ..Account::default()
        };
        count.renew(&account(9, 2));
        count.renew(&account(5, 1));
        assert_eq!((count.read, count.missing), (9, 2));
        count.dropped.insert("spool-full".to_owned(), 4);
        count.take_in(&account(12, 3));
        assert_eq!((count.read, count.dropped["spool-full"]), (12, 4));
        assert_eq!(count.of_ended(3).spooled, 3);
        assert!(count.of_ended(3).ended);
    }
}
