//! A set of positions as ranges.

use std::collections::BTreeMap;

/// By start, each with its exclusive end; no two touch.
#[derive(Debug, Default)]
pub(super) struct Ranges(BTreeMap<u64, u64>);

impl Ranges {
    pub(super) fn insert(&mut self, position: u64) {
        let end = self.0.remove(&(position + 1)).unwrap_or(position + 1);
        match self.0.range_mut(..=position).next_back() {
            Some((_, before)) if *before >= position => *before = end.max(*before),
            _ => {
                self.0.insert(position, end);
            }
        }
    }

    pub(super) fn contains(&self, position: u64) -> bool {
        let before = self.0.range(..=position).next_back();
        before.is_some_and(|(_, end)| position < *end)
    }

    /// Removes everything below a position that is not in the set.
    pub(super) fn forget_below(&mut self, position: u64) {
        self.0 = self.0.split_off(&position);
    }

    /// The number of ranges.
    pub(super) fn len(&self) -> usize {
        self.0.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    proptest! {
        #[test]
        fn it_is_a_set_with_as_few_ranges_as_there_are_runs(positions in prop::collection::vec(0..40_u64, 0..60), below in 0..41_u64) {
            let mut ranges = Ranges::default();
            let mut set = BTreeSet::new();
            for position in positions {
                ranges.insert(position);
                set.insert(position);
            }
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
