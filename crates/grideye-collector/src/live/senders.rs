//! Detects two agents with one device name: a restarted agent never returns to an earlier boot, but two agents
//! alternate.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

pub(crate) const BOOTS_MAX: usize = 8;
/// Returns to an earlier boot within [`RETURNS_WITHIN`] that mean two agents. A late batch of one agent makes two
/// returns.
pub(crate) const RETURNS_MIN: usize = 4;
pub(crate) const RETURNS_WITHIN: Duration = Duration::from_secs(60);

#[derive(Debug, Default)]
pub(super) struct Senders(BTreeMap<String, Sender>);

#[derive(Debug, Default)]
struct Sender {
    /// The boots that have sent, the latest last.
    boots: VecDeque<String>,
    /// When a boot sent again after another one, and which.
    returns: VecDeque<(Duration, String)>,
}

impl Senders {
    /// Notes that `boot` of `device`, which has not ended, sent at `now`. Beyond `devices_max` devices nothing is
    /// noted.
    pub(super) fn heard(&mut self, device: &str, boot: &str, now: Duration, devices_max: usize) {
        if !self.0.contains_key(device) && self.0.len() >= devices_max {
            return;
        }
        let sender = self.0.entry(device.to_owned()).or_default();
        if sender.boots.back().is_some_and(|last| last == boot) {
            return;
        }
        if let Some(place) = sender.boots.iter().position(|known| known == boot) {
            sender.boots.remove(place);
            sender.returns.push_back((now, boot.to_owned()));
            if sender.returns.len() > RETURNS_MIN {
                sender.returns.pop_front();
            }
        }
        sender.boots.push_back(boot.to_owned());
        if sender.boots.len() > BOOTS_MAX {
            sender.boots.pop_front();
        }
    }

    /// The boots that alternate as `device` at `now`, in alphabetical order; empty if one agent alone sends.
    pub(super) fn rivals(&self, device: &str, now: Duration) -> Vec<&str> {
        let Some(sender) = self.0.get(device) else {
            return Vec::new();
        };
        let is_recent = |(at, _): &&(Duration, String)| now.saturating_sub(*at) <= RETURNS_WITHIN;
        let recent: Vec<_> = sender.returns.iter().filter(is_recent).collect();
        if recent.len() < RETURNS_MIN {
            return Vec::new();
        }
        let boots: BTreeSet<&str> = recent.iter().map(|(_, boot)| boot.as_str()).collect();
        boots.into_iter().collect()
    }

    pub(super) fn all_rivals(&self, now: Duration) -> BTreeMap<&str, Vec<&str>> {
        let devices = self
            .0
            .keys()
            .map(|device| (device.as_str(), self.rivals(device, now)));
        devices.filter(|(_, boots)| !boots.is_empty()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(seconds: u64) -> Duration {
        Duration::from_secs(seconds)
    }

    fn heard(boots: &[&str]) -> Senders {
        let mut senders = Senders::default();
        for (second, boot) in (0..).zip(boots) {
            senders.heard("pi", boot, after(second), 10);
        }
        senders
    }

    #[test]
    fn an_agent_that_restarts_repeatedly_counts_as_one() {
        let boots: Vec<String> = (0..100).map(|run| format!("b{}", run / 2)).collect();
        let boots: Vec<&str> = boots.iter().map(String::as_str).collect();
        assert!(heard(&boots).rivals("pi", after(100)).is_empty());
        // Also if its last batch came late, after the next boot's first one.
        let late = heard(&["b1", "b2", "b1", "b2", "b2", "b3"]);
        assert!(late.rivals("pi", after(6)).is_empty());
    }

    #[test]
    fn two_agents_with_one_name_are_reported_until_one_is_silent() {
        let senders = heard(&["a", "b", "a", "b", "a", "b", "c"]);
        assert_eq!(senders.rivals("pi", after(6)), ["a", "b"]);
        assert_eq!(
            senders.all_rivals(after(6)),
            [("pi", vec!["a", "b"])].into()
        );
        // The first of the last four returns came in second 2.
        assert_eq!(senders.rivals("pi", after(62)), ["a", "b"]);
        assert!(senders.rivals("pi", after(63)).is_empty());
        assert!(senders.all_rivals(after(63)).is_empty());
        assert!(senders.rivals("other", after(6)).is_empty());
    }

    #[test]
    fn the_memory_of_senders_is_bounded() {
        let mut senders = Senders::default();
        for device in 0..20 {
            for boot in 0..100 {
                let now = after(boot);
                senders.heard(&format!("pi-{device}"), &boot.to_string(), now, 10);
            }
            for turn in 0..100_u64 {
                let boot = (98 + turn % 2).to_string();
                senders.heard(&format!("pi-{device}"), &boot, after(100 + turn), 10);
            }
        }
        assert_eq!(senders.0.len(), 10);
        for sender in senders.0.values() {
            assert_eq!(sender.boots.len(), BOOTS_MAX);
            assert_eq!(sender.returns.len(), RETURNS_MIN);
        }
    }
}
