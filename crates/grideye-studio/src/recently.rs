//! A cache of the entries used last.

/// A map of a few entries; the least recently used one makes room.
pub(crate) struct Recently<K, V> {
    /// The newest last.
    entries: Vec<(K, V)>,
    entries_max: usize,
}

impl<K: PartialEq, V: Clone> Recently<K, V> {
    pub(crate) const fn new(entries_max: usize) -> Self {
        Self {
            entries: Vec::new(),
            entries_max,
        }
    }

    pub(crate) fn get(&mut self, key: &K) -> Option<V> {
        let place = self.entries.iter().position(|(known, _)| known == key)?;
        let entry = self.entries.remove(place);
        let value = entry.1.clone();
        self.entries.push(entry);
        Some(value)
    }

    pub(crate) fn put(&mut self, key: K, value: V) {
        self.entries.retain(|(known, _)| *known != key);
        let more = (self.entries.len() + 1).saturating_sub(self.entries_max);
        self.entries.drain(..more);
        self.entries.push((key, value));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_recently_used_entry_makes_room() {
        let mut recently = Recently::new(2);
        recently.put("a", 1);
        recently.put("b", 2);
        assert_eq!(recently.get(&"a"), Some(1));
        recently.put("c", 3);
        assert_eq!(recently.get(&"b"), None);
        recently.put("a", 4);
        assert_eq!((recently.get(&"a"), recently.get(&"c")), (Some(4), Some(3)));
    }
}
