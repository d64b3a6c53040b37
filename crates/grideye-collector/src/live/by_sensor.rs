//! Something of every sensor, found by the names as they stand in a batch.

use std::collections::BTreeMap;

/// In the order of device and sensor.
#[derive(Debug)]
pub(super) struct BySensor<T> {
    devices: BTreeMap<String, BTreeMap<String, T>>,
    len: usize,
}

impl<T> Default for BySensor<T> {
    fn default() -> Self {
        Self {
            devices: BTreeMap::new(),
            len: 0,
        }
    }
}

impl<T> BySensor<T> {
    pub(super) const fn len(&self) -> usize {
        self.len
    }

    pub(super) fn get(&self, device: &str, sensor: &str) -> Option<&T> {
        self.devices.get(device)?.get(sensor)
    }

    pub(super) fn get_mut(&mut self, device: &str, sensor: &str) -> Option<&mut T> {
        self.devices.get_mut(device)?.get_mut(sensor)
    }

    /// What is there of the sensor, or what is made for it; `None` where there is nothing and `len_max` sensors are known.
    pub(super) fn get_or_make(
        &mut self,
        device: &str,
        sensor: &str,
        len_max: usize,
        make: impl FnOnce() -> T,
    ) -> Option<&mut T> {
        if self.get(device, sensor).is_none() {
            if self.len >= len_max {
                return None;
            }
            self.insert(device, sensor, make());
        }
        self.get_mut(device, sensor)
    }

    pub(super) fn insert(&mut self, device: &str, sensor: &str, value: T) {
        let sensors = self.devices.entry(device.to_owned()).or_default();
        let before = sensors.insert(sensor.to_owned(), value);
        self.len += usize::from(before.is_none());
    }

    pub(super) fn remove(&mut self, device: &str, sensor: &str) {
        let Some(sensors) = self.devices.get_mut(device) else {
            return;
        };
        let was_there = sensors.remove(sensor).is_some();
        self.len -= usize::from(was_there);
        if sensors.is_empty() {
            self.devices.remove(device);
        }
    }

    pub(super) fn values(&self) -> impl Iterator<Item = &T> {
        self.devices.values().flat_map(BTreeMap::values)
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (&str, &str, &T)> {
        self.devices.iter().flat_map(|(device, sensors)| {
            let sensors = sensors.iter();
            sensors.map(|(sensor, value)| (device.as_str(), sensor.as_str(), value))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_holds_what_a_plain_map_holds_and_no_more_than_it_may() {
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
