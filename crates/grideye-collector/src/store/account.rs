//! An agent's account (its frame counts) as JSON, for the store and the pages.

use crate::store::error::Result;
use crate::store::row::damaged;
use grideye_recording::wire::{Account, LOST_BY_COLLECTOR, LOST_IN_MEMORY};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// How an agent's reasons begin for dropping frames that may come after all: rejected ones, which `grideye-agent resend`
/// sends again, those on a disk that could not be read, and those of a newer store, if that comes back.
const MAY_COME: [&str; 3] = ["refused-", "spool-damaged", LOST_BY_COLLECTOR];

pub(crate) fn to_json(account: &Account) -> Value {
    json!({
        "read": account.read,
        "missing": account.missing,
        "dropped": account.dropped,
        "spooled": account.spooled,
        "errors": account.errors,
        "ended": account.ended,
    })
}

pub(crate) fn to_text(account: &Account) -> String {
    to_json(account).to_string()
}

/// The account of a boot that has ended, after `came` frames of this batch arrived and `stored` frames of the boot are
/// stored.
///
/// Every frame that was read but neither stored, dropped nor still to come was lost in the memory of a killed agent.
/// The number still to come never grows, so a repeated batch changes nothing.
pub(crate) fn of_ended_run(
    known: Option<&Account>,
    sent: Option<&Account>,
    stored: u64,
    came: u64,
) -> Account {
    let mut merged = Account {
        ended: true,
        ..Account::default()
    };
    for account in known.into_iter().chain(sent) {
        merged.read = merged.read.max(account.read);
        merged.missing = merged.missing.max(account.missing);
        raise(&mut merged.dropped, &account.dropped);
        raise(&mut merged.errors, &account.errors);
    }
    merged.dropped.remove(LOST_IN_MEMORY);
    let announced = sent.filter(|sent| sent.ended);
    let left_by_sent = announced.map(|sent| sent.spooled.saturating_sub(came));
    let left_before = known.filter(|known| known.ended).map(|known| known.spooled);
    let left = left_by_sent.into_iter().chain(left_before);
    merged.spooled = left.min().unwrap_or(0);
    take_back(&mut merged, stored, 0);
    let elsewhere = [stored, dropped(&merged), merged.spooled];
    let lost = elsewhere.into_iter().fold(merged.read, u64::saturating_sub);
    if lost > 0 {
        merged.dropped.insert(LOST_IN_MEMORY.to_owned(), lost);
    }
    merged
}

/// Frames that came after all, and are stored now, are no longer dropped. `came` frames of those that the agent
/// counts as spooled have arrived.
pub(super) fn take_back(account: &mut Account, stored: u64, came: u64) {
    if account.dropped.is_empty() {
        return;
    }
    let spooled = account.spooled.saturating_sub(came);
    let elsewhere = [dropped(account), spooled];
    let elsewhere = elsewhere.into_iter().fold(stored, u64::saturating_add);
    let mut surplus = elsewhere.saturating_sub(account.read);
    account.dropped.retain(|reason, count| {
        if MAY_COME.iter().any(|kept| reason.starts_with(kept)) {
            let taken = surplus.min(*count);
            (*count, surplus) = (*count - taken, surplus - taken);
        }
        *count > 0
    });
}

/// Frames that the agent dropped, over all reasons.
pub(super) fn dropped(account: &Account) -> u64 {
    let counts = account.dropped.values().copied();
    counts.fold(0, u64::saturating_add)
}

/// Takes the higher count of each reason: the counts of one boot only grow, and batches can arrive out of order.
fn raise(counts: &mut BTreeMap<String, u64>, with: &BTreeMap<String, u64>) {
    for (reason, count) in with {
        let known = counts.entry(reason.clone()).or_default();
        *known = (*known).max(*count);
    }
}

pub(crate) fn from_json(text: &str) -> Result<Account> {
    let none = || damaged(&format!("an invalid account: {text}"));
    serde_json::from_str(text).map_err(|_no_count| none())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn account(read: u64, dropped: u64, spooled: u64, ended: bool) -> Account {
        let dropped = [("ring-full".to_owned(), dropped)].into_iter();
        Account {
            read,
            dropped: dropped.filter(|(_, count)| *count > 0).collect(),
            spooled,
            ended,
            ..Account::default()
        }
    }

    #[test]
    fn frames_lost_in_a_killed_agent_are_counted_and_the_sum_holds_after_every_batch() {
        // 100 read, 60 stored, 5 dropped; the agent is killed with 35 in memory and on disk, 20 of them on disk.
        let last = account(100, 5, 35, false);
        let first = of_ended_run(Some(&last), Some(&account(80, 5, 20, true)), 70, 10);
        assert_eq!((first.read, first.spooled), (100, 10));
        assert_eq!(first.dropped[LOST_IN_MEMORY], 15);
        let second = of_ended_run(Some(&first), Some(&account(80, 5, 10, true)), 80, 10);
        assert_eq!((second.spooled, second.dropped[LOST_IN_MEMORY]), (0, 15));
        // The first batch again, late: nothing changes.
        let again = of_ended_run(Some(&second), Some(&account(80, 5, 20, true)), 80, 10);
        assert_eq!(again, second);
        // A frame that was in transit when the agent was killed arrives: it was not lost.
        let late = of_ended_run(Some(&second), Some(&last), 81, 1);
        assert_eq!((late.spooled, late.dropped[LOST_IN_MEMORY]), (0, 14));
        assert!(late.ended);
    }

    #[test]
    fn rejected_frames_that_come_after_all_are_no_longer_dropped() {
        let of = |rejected: u64| Account {
            dropped: [("refused-409".to_owned(), rejected)].into(),
            ..account(100, 0, 10, false)
        };
        let taken_back = |rejected, stored, came| {
            let mut account = of(rejected);
            take_back(&mut account, stored, came);
            account.dropped.get("refused-409").copied()
        };
        assert_eq!(taken_back(20, 70, 0), Some(20));
        assert_eq!(taken_back(20, 75, 0), Some(15));
        assert_eq!(taken_back(20, 90, 0), None);
        assert_eq!(taken_back(20, 80, 10), Some(20));
        let ended = of_ended_run(Some(&of(20)), None, 95, 0);
        assert_eq!(
            (ended.dropped, ended.spooled),
            ([("refused-409".to_owned(), 5)].into(), 0)
        );
    }

    #[test]
    fn a_boot_known_only_from_the_disk_has_the_disks_account() {
        let merged = of_ended_run(None, Some(&account(50, 0, 30, true)), 10, 10);
        assert_eq!((merged.read, merged.spooled), (50, 20));
        assert_eq!(merged.dropped[LOST_IN_MEMORY], 20);
    }
}
