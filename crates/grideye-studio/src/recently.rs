//! A cache of the entries used last.

use std::sync::{Mutex, PoisonError};

/// A few entries, for many threads; the least recently used one makes room.
pub(crate) struct Recently<K, V> {
    /// The newest last.
    entries: Mutex<Vec<(K, V)>>,
    entries_max: usize,
}

impl<K: PartialEq, V: Clone> Recently<K, V> {
    pub(crate) const fn new(entries_max: usize) -> Self {
        Self {
            entries: Mutex::new(Vec::new()),
            entries_max,
        }
    }

    /// The entry, made if it is not there. Others wait meanwhile, so `make` must be quick.
    pub(crate) fn get_or(&self, key: K, make: impl FnOnce(&K) -> V) -> V {
        let mut entries = self.entries.lock().unwrap_or_else(PoisonError::into_inner);
        let entry = match entries.iter().position(|(known, _)| *known == key) {
            Some(place) => entries.remove(place),
            None => {
                let value = make(&key);
                (key, value)
            }
        };
        let value = entry.1.clone();
        entries.push(entry);
        let more = entries.len().saturating_sub(self.entries_max);
        entries.drain(..more);
        value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_recently_used_entry_makes_room() {
        let recently = Recently::new(2);
        let made = |key, value| recently.get_or(key, |_| value);
        assert_eq!([made("a", 1), made("b", 2)], [1, 2]);
        assert_eq!(made("a", 0), 1, "used again");
        assert_eq!(made("c", 3), 3);
        assert_eq!(made("b", 4), 4, "it had made room");
        assert_eq!([made("b", 0), made("c", 0)], [4, 3]);
    }
}
