//! A map with one value per sensor, looked up by the names in a batch.

use std::collections::BTreeMap;

/// One value per sensor, in the order of device and sensor.
#[derive(Debug)]
pub(super) struct BySensor<T>(BTreeMap<String, BTreeMap<String, T>>);

impl<T> Default for BySensor<T> {
    fn default() -> Self {
        Self(BTreeMap::new())
    }
}

impl<T> BySensor<T> {
    pub(super) fn len(&self) -> usize {
        self.0.values().map(BTreeMap::len).sum()
    }

    pub(super) fn get(&self, device: &str, sensor: &str) -> Option<&T> {
        self.0.get(device)?.get(sensor)
    }

    pub(super) fn get_mut(&mut self, device: &str, sensor: &str) -> Option<&mut T> {
        self.0.get_mut(device)?.get_mut(sensor)
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

    /// If the sensor is unknown and `len_max` are known, removes the value of the lowest rank.
    pub(super) fn make_room<R: Ord>(
        &mut self,
        device: &str,
        sensor: &str,
        len_max: usize,
        rank: impl Fn(&T) -> R,
    ) {
        if self.get(device, sensor).is_none() && self.len() >= len_max {
            let lowest = self.iter().min_by_key(|(_, _, value)| rank(value));
            let lowest = lowest.map(|(device, sensor, _)| (device.to_owned(), sensor.to_owned()));
            if let Some((device, sensor)) = lowest {
                self.remove(&device, &sensor);
            }
        }
    }

    pub(super) fn insert(&mut self, device: &str, sensor: &str, value: T) {
        let of_device = self.0.entry(device.to_owned()).or_default();
        of_device.insert(sensor.to_owned(), value);
    }

    fn remove(&mut self, device: &str, sensor: &str) {
        if let Some(of_device) = self.0.get_mut(device) {
            of_device.remove(sensor);
            if of_device.is_empty() {
                self.0.remove(device);
            }
        }
    }

    pub(super) fn values(&self) -> impl Iterator<Item = &T> {
        self.0.values().flat_map(BTreeMap::values)
    }

    fn iter(&self) -> impl Iterator<Item = (&str, &str, &T)> {
        let all = self.0.iter();
        all.flat_map(|(device, sensors)| {
            sensors
                .iter()
                .map(|(sensor, value)| (device.as_str(), sensor.as_str(), value))
        })
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
