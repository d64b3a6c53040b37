//! Which faults are recent: an agent counts from its start, so a fault is recent if its count grew lately.

use grideye_recording::wire::Account;
use std::collections::BTreeMap;
use std::time::Duration;

/// A fault is recent for this long after its count grew.
pub(crate) const RECENT_WITHIN: Duration = Duration::from_secs(300);

#[derive(Debug, Default)]
pub(super) struct Faults(BTreeMap<String, Fault>);

#[derive(Debug)]
struct Fault {
    count: u64,
    /// On the collector's monotonic clock; `None` if it was counted before this collector started.
    grew_at: Option<Duration>,
}

impl Faults {
    /// Takes the counts of an account: as many kinds as the wire allows.
    pub(super) fn count(&mut self, account: Option<&Account>, grew_at: Option<Duration>) {
        let counts = account
            .into_iter()
            .flat_map(|account| account.dropped.iter().chain(&account.errors));
        for (kind, count) in counts {
            if *count > self.0.get(kind).map_or(0, |fault| fault.count) {
                let count = *count;
                self.0.insert(kind.clone(), Fault { count, grew_at });
            }
        }
    }

    /// The recent faults, in alphabetical order.
    pub(super) fn recent(&self, now: Duration) -> Vec<&str> {
        let is_recent = |fault: &Fault| {
            fault
                .grew_at
                .is_some_and(|at| now.saturating_sub(at) <= RECENT_WITHIN)
        };
        let recent = self.0.iter().filter(|(_, fault)| is_recent(fault));
        recent.map(|(kind, _)| kind.as_str()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn account(nack: u64, ring_full: u64) -> Account {
        Account {
            errors: [("nack".to_owned(), nack)].into(),
            dropped: [("ring-full".to_owned(), ring_full)].into(),
            ..Account::default()
        }
    }

    fn after(seconds: u64) -> Duration {
        Duration::from_secs(seconds)
    }

    fn count(faults: &mut Faults, nack: u64, ring_full: u64, at_s: Option<u64>) {
        faults.count(Some(&account(nack, ring_full)), at_s.map(after));
    }

    #[test]
    fn a_fault_is_recent_for_five_minutes() {
        let mut faults = Faults::default();
        count(&mut faults, 1, 0, Some(10));
        assert_eq!(faults.recent(after(310)), ["nack"]);
        count(&mut faults, 1, 3, Some(311));
        assert_eq!(faults.recent(after(311)), ["ring-full"]);
        // The fault occurs again, and an account that came late changes nothing.
        count(&mut faults, 2, 3, Some(400));
        count(&mut faults, 1, 1, Some(600));
        assert_eq!(faults.recent(after(600)), ["nack", "ring-full"]);
        assert_eq!(faults.recent(after(700)), ["nack"]);
        assert!(faults.recent(after(701)).is_empty());
    }

    #[test]
    fn faults_counted_before_the_start_are_not_recent() {
        let mut faults = Faults::default();
        count(&mut faults, 7, 0, None);
        assert!(faults.recent(after(0)).is_empty());
        count(&mut faults, 7, 0, Some(1));
        assert!(faults.recent(after(1)).is_empty());
        count(&mut faults, 8, 0, Some(2));
        assert_eq!(faults.recent(after(2)), ["nack"]);
    }
}
