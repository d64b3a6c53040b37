//! A set of numbers as ranges.

use grideye_recording::wire::Acknowledgement;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::Range;

/// By start, each with its exclusive end; no two touch.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub(crate) struct Ranges(BTreeMap<u64, u64>);

impl Ranges {
    pub(crate) fn insert(&mut self, position: u64) {
        let end = self.0.remove(&(position + 1)).unwrap_or(position + 1);
        match self.0.range_mut(..=position).next_back() {
            Some((_, before)) if *before >= position => *before = end.max(*before),
            _ => {
                self.0.insert(position, end);
            }
        }
    }

    pub(crate) fn contains(&self, position: u64) -> bool {
        let before = self.0.range(..=position).next_back();
        before.is_some_and(|(_, end)| position < *end)
    }

    /// Removes everything below a position that is not in the set.
    pub(crate) fn forget_below(&mut self, position: u64) {
        self.0 = self.0.split_off(&position);
    }

    /// The number of ranges.
    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// How many numbers it has.
    pub(crate) fn count(&self) -> u64 {
        self.0.iter().map(|(start, end)| end - start).sum()
    }

    /// Keeps the highest ranges, at most so many.
    pub(crate) fn keep_highest(&mut self, ranges_max: usize) {
        while self.0.len() > ranges_max {
            self.0.pop_first();
        }
    }

    /// Removes what is in these bounds, and returns it.
    pub(crate) fn take(&mut self, bounds: &Range<u64>) -> Self {
        let last = self.0.range(..bounds.end).rev();
        let within = last.take_while(|(_, end)| **end > bounds.start);
        let within = Vec::from_iter(within.map(|(start, end)| (*start, *end)));
        let mut taken = BTreeMap::new();
        for (start, end) in within {
            self.0.remove(&start);
            if start < bounds.start {
                self.0.insert(start, bounds.start);
            }
            if end > bounds.end {
                self.0.insert(bounds.end, end);
            }
            taken.insert(start.max(bounds.start), end.min(bounds.end));
        }
        Self(taken)
    }

    /// Removes what another set has.
    pub(crate) fn remove(&mut self, other: &Self) {
        for (start, end) in &other.0 {
            self.take(&(*start..*end));
        }
    }

    /// Those of these acknowledged numbers that the collector, by its answer, does not have.
    pub(crate) fn lost(&self, answer: &Acknowledgement, sensor: &str) -> Self {
        let through = answer.durable_through.get(sensor);
        let above = through.map_or(0, |through| through + 1)..u64::MAX;
        let gaps = answer.gaps.iter().filter(|gap| gap.sensor == sensor);
        let absent = gaps.map(|gap| gap.from..gap.to + 1).chain([above]);
        let mut left = self.clone();
        Self(absent.flat_map(|bounds| left.take(&bounds).0).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    proptest! {
        #[test]
        fn it_is_a_set_with_as_few_ranges_as_there_are_runs(positions in prop::collection::vec(0..40_u64, 0..60), bounds in (0..41_u64).prop_flat_map(|from| from..42).prop_map(|to| to / 2..to), below in 0..41_u64) {
            let mut ranges = Ranges::default();
            let mut set = BTreeSet::new();
            for position in positions {
                ranges.insert(position);
                set.insert(position);
            }
            let taken = ranges.take(&bounds);
            let is_within = |position: &u64| bounds.contains(position);
            prop_assert_eq!(taken.count(), u64::try_from(set.iter().filter(|it| is_within(it)).count()).unwrap());
            prop_assert!(set.iter().all(|position| taken.contains(*position) == is_within(position)));
            set.retain(|position| !is_within(position));
            if !set.contains(&below) {
                ranges.forget_below(below);
                set.retain(|position| *position >= below);
            }
            for position in 0..42 {
                prop_assert_eq!(ranges.contains(position), set.contains(&position));
            }
            let starts = set.iter().filter(|position| **position == 0 || !set.contains(&(**position - 1)));
            prop_assert_eq!(ranges.len(), starts.count());
        }
    }
}
