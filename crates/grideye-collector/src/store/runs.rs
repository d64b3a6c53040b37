//! The numbers received of one stream, as runs without gaps.

use grideye_recording::wire::Gap;
use std::collections::{BTreeMap, BTreeSet};

/// Runs of received numbers, first to last; they neither overlap nor touch.
#[derive(Debug, Default)]
pub(super) struct Runs {
    runs: BTreeMap<u64, u64>,
    /// First numbers of runs that are new or longer since [`Runs::settle`].
    changed: BTreeSet<u64>,
    /// First numbers of runs that were joined to the run before.
    gone: BTreeSet<u64>,
    /// Whether the newest run is longer than its row: an engine may keep its end with the stream.
    is_longer: bool,
}

impl Runs {
    /// Adds a run from the store, which needs no merging.
    pub(super) fn restore(&mut self, first: u64, last: u64) {
        self.runs.insert(first, last);
    }

    /// The newest run goes on to this number: its row is older than the stream's.
    pub(super) fn restore_last(&mut self, seq: u64) {
        if let Some(mut newest) = self.runs.last_entry() {
            self.is_longer = *newest.get() < seq;
            *newest.get_mut() = seq.max(*newest.get());
        }
    }

    /// First numbers of runs that vanished; first and last numbers of runs that are new or longer, without the newest
    /// if it only became longer.
    pub(super) fn changes(&self) -> (Vec<u64>, Vec<(u64, u64)>) {
        let changed = self.changed.iter();
        (
            self.gone.iter().copied().collect(),
            changed
                .filter_map(|first| Some((*first, *self.runs.get(first)?)))
                .collect(),
        )
    }

    /// Counts the newest run among the changes too.
    pub(super) fn note_newest(&mut self) {
        if std::mem::take(&mut self.is_longer) {
            let newest = self.runs.last_key_value();
            self.changed.extend(newest.map(|(first, _)| *first));
        }
    }

    /// The store now has all changes.
    pub(super) fn settle(&mut self) {
        self.changed.clear();
        self.gone.clear();
    }

    pub(super) fn contains(&self, seq: u64) -> bool {
        self.runs
            .range(..=seq)
            .next_back()
            .is_some_and(|(_, last)| *last >= seq)
    }

    /// Adds a number above all others.
    pub(super) fn append(&mut self, seq: u64) {
        match self.runs.last_entry() {
            Some(mut last) if last.get().checked_add(1) == Some(seq) => {
                *last.get_mut() = seq;
                self.is_longer = true;
            }
            _ => self.add(seq),
        }
    }

    /// Adds a number that is not contained: extends a run, joins two, or begins one.
    pub(super) fn add(&mut self, seq: u64) {
        self.note_newest();
        let after = seq.checked_add(1);
        let joined = after.and_then(|next| Some((next, self.runs.remove(&next)?)));
        let last = match joined {
            Some((next, last)) => {
                self.changed.remove(&next);
                self.gone.insert(next);
                last
            }
            None => seq,
        };
        let first = match self.runs.range_mut(..seq).next_back() {
            Some((first, end)) if end.checked_add(1) == Some(seq) => {
                *end = last;
                *first
            }
            _ => {
                self.runs.insert(seq, last);
                self.gone.remove(&seq);
                seq
            }
        };
        self.changed.insert(first);
    }

    #[cfg(test)]
    pub(super) fn iter(&self) -> impl Iterator<Item = (u64, u64)> + '_ {
        self.runs.iter().map(|(first, last)| (*first, *last))
    }

    pub(super) fn len(&self) -> usize {
        self.runs.len()
    }

    pub(super) fn last(&self) -> Option<u64> {
        self.runs.last_key_value().map(|(_, last)| *last)
    }

    /// The newest gaps below the highest number, at most `listed_max`, ascending; needs the newest `listed_max + 1`
    /// runs.
    pub(super) fn gaps(&self, sensor: &str, listed_max: usize) -> Vec<Gap> {
        let mut gaps = Vec::new();
        let mut newest = self.runs.iter().rev().take(listed_max.saturating_add(1));
        let mut upper = newest.next();
        for _ in 0..listed_max {
            let Some((first, _)) = upper else { break };
            let lower = newest.next();
            // There is a gap below the oldest run too, down to 0.
            let from = lower.map_or(0, |(_, last)| last.saturating_add(1));
            if from < *first {
                gaps.push(Gap {
                    sensor: sensor.to_owned(),
                    from,
                    to: first - 1,
                });
            }
            upper = lower;
        }
        gaps.reverse();
        gaps
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tries every order of a few numbers against a plain set.
    #[test]
    fn runs_are_those_of_a_plain_set_in_every_order_of_arrival() {
        let mut order = [0_u64, 1, 2, 4, 5, 7];
        permute(&mut order, 0);
    }

    fn permute(order: &mut [u64; 6], fixed: usize) {
        if fixed == order.len() {
            check(order);
            return;
        }
        for index in fixed..order.len() {
            order.swap(fixed, index);
            permute(order, fixed + 1);
            order.swap(fixed, index);
        }
    }

    fn check(order: &[u64]) {
        let (mut runs, mut set) = (Runs::default(), BTreeSet::new());
        let mut appended = Runs::default();
        let (mut stored, mut behind) = (BTreeMap::new(), BTreeMap::new());
        for seq in order {
            assert!(!runs.contains(*seq), "{order:?}");
            runs.add(*seq);
            if set.last().is_none_or(|last| last < seq) {
                appended.append(*seq);
            } else {
                appended.add(*seq);
            }
            assert!(appended.iter().eq(runs.iter()), "{order:?}");
            set.insert(*seq);
            for asked in 0..9 {
                assert_eq!(runs.contains(asked), set.contains(&asked), "{order:?}");
            }
            let is_first = |seq: &u64| *seq == 0 || !set.contains(&(seq - 1));
            let firsts: Vec<u64> = set.iter().copied().filter(is_first).collect();
            let kept: Vec<u64> = runs.iter().map(|(first, _)| first).collect();
            assert_eq!(kept, firsts, "{order:?}");
            assert_eq!(runs.last(), set.last().copied());
            let gaps = runs.gaps("s", 9);
            let never_came: u64 = gaps.iter().map(|gap| gap.to - gap.from + 1).sum();
            let expected = set.last().unwrap() + 1 - u64::try_from(set.len()).unwrap();
            assert_eq!(never_came, expected, "{order:?}");
            // The changes, applied to a stored copy, give the same runs, where the newest goes on to the last number.
            for (from, stored) in [(&mut runs, &mut stored), (&mut appended, &mut behind)] {
                let (gone, changed) = from.changes();
                for first in gone {
                    stored.remove(&first);
                }
                stored.extend(changed);
                from.settle();
                let mut again = Runs::default();
                for (first, last) in &*stored {
                    again.restore(*first, *last);
                }
                again.restore_last(from.last().unwrap());
                assert!(again.iter().eq(from.iter()), "{order:?}");
                // Read again, it goes on with the same changes.
                if seq % 2 == 0 {
                    *from = again;
                }
            }
            assert!(runs.iter().eq(stored.clone()), "{order:?}");
        }
    }

    #[test]
    fn the_highest_number_has_no_next() {
        let mut runs = Runs::default();
        runs.add(u64::MAX);
        runs.add(u64::MAX - 1);
        assert_eq!(Vec::from_iter(runs.iter()), [(u64::MAX - 1, u64::MAX)]);
    }
}
