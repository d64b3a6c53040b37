//! The frames of one stream that came since the store was last told.

use grideye_recording::Record;
use std::collections::BTreeMap;

pub(super) type Arrived = (Record, i64);

/// Rows that are kept room for when all are let go: some more than ten seconds bring.
const ROOM_KEPT: usize = 128;

/// Each number once. They come in order as a rule; what comes late lies apart, so that no order is slow.
#[derive(Debug, Default)]
pub(super) struct Fresh {
    in_order: Vec<Arrived>,
    late: BTreeMap<u64, Arrived>,
}

impl Fresh {
    /// Takes a frame whose number is not here.
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
        // What came late lies below the last that came in order.
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
    use std::collections::BTreeSet;

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

    /// Every order in which six frames with five numbers may come, held against a plain set.
    #[test]
    fn it_holds_what_came_in_the_order_of_the_numbers() {
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
