//! A map with one value per sensor, looked up by the names in a batch.

use hashbrown::{Equivalent, HashMap};

#[derive(Debug, PartialEq, Eq, Hash)]
struct Place {
    device: String,
    sensor: String,
}

/// A borrowed [`Place`]; it can look up the map.
#[derive(Hash)]
struct Named<'n> {
    // In the order of `Place`, so that both hash alike.
    device: &'n str,
    sensor: &'n str,
}

impl Equivalent<Place> for Named<'_> {
    fn equivalent(&self, place: &Place) -> bool {
        self.device == place.device && self.sensor == place.sensor
    }
}

/// One value per sensor.
#[derive(Debug)]
pub(super) struct BySensor<T>(HashMap<Place, T>);

impl<T> Default for BySensor<T> {
    fn default() -> Self {
        Self(HashMap::new())
    }
}

impl<T> BySensor<T> {
    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    pub(super) fn get(&self, device: &str, sensor: &str) -> Option<&T> {
        self.0.get(&Named { device, sensor })
    }

    pub(super) fn get_mut(&mut self, device: &str, sensor: &str) -> Option<&mut T> {
        self.0.get_mut(&Named { device, sensor })
    }

    /// The sensor's value, or a new one; `None` if it has none and `len_max` sensors are known.
    pub(super) fn get_or_make(
        &mut self,
        device: &str,
        sensor: &str,
        len_max: usize,
        make: impl FnOnce() -> T,
    ) -> Option<&mut T> {
        if self.get(device, sensor).is_none() {
            if self.len() >= len_max {
                return None;
            }
            self.insert(device, sensor, make());
        }
        self.get_mut(device, sensor)
    }

    pub(super) fn insert(&mut self, device: &str, sensor: &str, value: T) {
        let place = Place {
            device: device.to_owned(),
            sensor: sensor.to_owned(),
        };
        self.0.insert(place, value);
    }

    pub(super) fn remove(&mut self, device: &str, sensor: &str) {
        self.0.remove(&Named { device, sensor });
    }

    /// By device and sensor.
    pub(super) fn values(&self) -> impl Iterator<Item = &T> {
        self.iter().map(|(_, _, value)| value)
    }

    /// By device and sensor.
    pub(super) fn iter(&self) -> impl Iterator<Item = (&str, &str, &T)> {
        let all = self.0.iter();
        let all = all.map(|(place, value)| (place.device.as_str(), place.sensor.as_str(), value));
        let mut all: Vec<_> = all.collect();
        all.sort_unstable_by_key(|(device, sensor, _)| (*device, *sensor));
        all.into_iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn it_equals_a_plain_map_up_to_its_limit() {
        let (mut by_sensor, mut plain) = (BySensor::default(), BTreeMap::new());
        let names = ["a", "b", "c"];
        for code in 0..2000_usize {
            let (device, sensor) = (names[code / 7 % 3], names[code / 3 % 3]);
            if code % 5 == 0 {
                by_sensor.remove(device, sensor);
                plain.remove(&(device, sensor));
            } else if plain.contains_key(&(device, sensor)) || plain.len() < 6 {
                let held = by_sensor.get_or_make(device, sensor, 6, || code);
                assert_eq!(held, Some(plain.entry((device, sensor)).or_insert(code)));
            } else {
                assert_eq!(by_sensor.get_or_make(device, sensor, 6, || code), None);
            }
            let held: Vec<_> = by_sensor.iter().map(|(d, s, v)| ((d, s), *v)).collect();
            let expected: Vec<_> = plain.iter().map(|(key, value)| (*key, *value)).collect();
            assert_eq!(held, expected);
            assert_eq!(by_sensor.len(), plain.len());
            assert!(by_sensor.values().eq(plain.values()));
            assert_eq!(by_sensor.get(device, sensor), plain.get(&(device, sensor)));
        }
    }
}
