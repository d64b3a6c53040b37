//! The numbers received of one stream, as runs without gaps; and the frames not yet written to the tables.

use grideye_recording::Record;
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
}

impl Runs {
    /// Adds a run from the store, which needs no merging.
    pub(super) fn restore(&mut self, first: u64, last: u64) {
        self.runs.insert(first, last);
    }

    /// First numbers of runs that vanished; first and last numbers of runs that are new or longer.
    pub(super) fn changes(&self) -> (Vec<u64>, Vec<(u64, u64)>) {
        let changed = self.changed.iter();
        (
            self.gone.iter().copied().collect(),
            changed
                .filter_map(|first| Some((*first, *self.runs.get(first)?)))
                .collect(),
        )
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
                let first = *last.key();
                if self.changed.last() != Some(&first) {
                    self.changed.insert(first);
                }
            }
            _ => self.add(seq),
        }
    }

    /// Adds a number that is not contained: extends a run, joins two, or begins one.
    pub(super) fn add(&mut self, seq: u64) {
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

pub(super) type Arrived = (Record, i64);

/// Rows of capacity kept after clearing: a little more than ten seconds bring.
const ROOM_KEPT: usize = 128;

/// Each number once. Numbers usually come in order; late ones are kept apart, so that no order is slow.
#[derive(Debug, Default)]
pub(super) struct Fresh {
    in_order: Vec<Arrived>,
    late: BTreeMap<u64, Arrived>,
}

impl Fresh {
    pub(super) fn add(&mut self, record: Record, t_arrival_ns: i64) {
        let last = self.in_order.last().map(|(last, _)| last.seq);
        if last.is_none_or(|last| last < record.seq) {
            self.in_order.push((record, t_arrival_ns));
        } else {
            self.late.insert(record.seq, (record, t_arrival_ns));
        }
    }

    pub(super) fn get(&self, seq: u64) -> Option<&Record> {
        let place = self
            .in_order
            .binary_search_by_key(&seq, |(record, _)| record.seq);
        let found = place.ok().and_then(|place| self.in_order.get(place));
        found
            .or_else(|| self.late.get(&seq))
            .map(|(record, _)| record)
    }

    pub(super) fn len(&self) -> usize {
        self.in_order.len() + self.late.len()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.in_order.is_empty()
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &Arrived> {
        let mut in_order = self.in_order.iter().peekable();
        let mut late = self.late.values().peekable();
        std::iter::from_fn(move || {
            let is_late = match (in_order.peek(), late.peek()) {
                (Some((first, _)), Some((late, _))) => late.seq < first.seq,
                (None, Some(_)) => true,
                (_, None) => false,
            };
            if is_late {
                late.next()
            } else {
                in_order.next()
            }
        })
    }

    pub(super) fn ends(&self) -> Option<(u64, u64)> {
        let first = self.iter().next()?;
        // Late numbers are below the last in-order one.
        let last = self.in_order.last()?;
        Some((first.0.seq, last.0.seq))
    }

    pub(super) fn clear(&mut self) {
        self.in_order.clear();
        self.in_order.shrink_to(ROOM_KEPT);
        self.late.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use grideye_frame::{NoData, Reading};
    use grideye_recording::{ClockState, Stamp};

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
        let mut stored = BTreeMap::new();
        for seq in order {
            assert!(!runs.contains(*seq), "{order:?}");
            runs.add(*seq);
            if set.last().is_none_or(|last| last < seq) {
                appended.append(*seq);
            } else {
                appended.add(*seq);
            }
            assert!(appended.iter().eq(runs.iter()), "{order:?}");
            assert_eq!(appended.changes(), runs.changes(), "{order:?}");
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
            // The changes, applied to a stored copy, give the same runs.
            let (gone, changed) = runs.changes();
            for first in gone {
                stored.remove(&first);
            }
            stored.extend(changed);
            runs.settle();
            appended.settle();
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

    fn record(seq: u64) -> Record {
        let stamp = Stamp {
            t_boot_ns: seq,
            t_utc_ns: 0,
            clock: ClockState::Synced,
        };
        Record {
            seq,
            stamp,
            reading: Reading::NoData(NoData::Nack),
        }
    }

    /// Tries every sequence of six frames with five numbers against a plain set.
    #[test]
    fn it_iterates_in_the_order_of_the_numbers() {
        for code in 0..5_u64.pow(6) {
            let came = (0..6).map(|place| code / 5_u64.pow(place) % 5);
            let (mut fresh, mut set) = (Fresh::default(), BTreeSet::new());
            for seq in came {
                assert_eq!(fresh.get(seq).is_some(), set.contains(&seq));
                if set.insert(seq) {
                    fresh.add(record(seq), 7);
                }
            }
            let held: Vec<u64> = fresh.iter().map(|(record, _)| record.seq).collect();
            assert_eq!(held, set.iter().copied().collect::<Vec<_>>());
            let is_there = |seq: &u64| fresh.get(*seq) == Some(&record(*seq));
            assert!(held.iter().all(is_there));
            assert_eq!((fresh.len(), fresh.is_empty()), (set.len(), false));
            assert_eq!(fresh.ends(), set.first().copied().zip(set.last().copied()));
            fresh.clear();
            assert!(fresh.is_empty() && fresh.ends().is_none() && fresh.get(0).is_none());
        }
    }
}
