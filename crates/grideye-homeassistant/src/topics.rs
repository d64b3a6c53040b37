//! Names of sensors and topics on the broker.

use sha2::{Digest as _, Sha256};

/// Characters of a device's or a sensor's own name in an identifier.
const NAME_CHARS_MAX: usize = 24;
/// Of the SHA-256 that tells apart what looks alike once written in letters, digits and `_`.
const DISTINCTION_BYTES: usize = 4;

/// Where messages go.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topics {
    /// What Home Assistant listens below, `homeassistant` unless it was set otherwise there.
    pub discovery: String,
    /// What everything else is below.
    pub base: String,
}

/// The six things that a sensor is in Home Assistant: its platform there, and its name within the sensor.
pub(crate) const ENTITIES: [(&str, &str); 6] = [
    ("camera", "image"),
    ("sensor", "min"),
    ("sensor", "max"),
    ("sensor", "mean"),
    ("sensor", "thermistor"),
    ("binary_sensor", "presence"),
];

impl Topics {
    /// Where Home Assistant finds what an entity is.
    pub(crate) fn config(&self, id: &str, (platform, entity): (&str, &str)) -> String {
        format!("{}/{platform}/{id}/{entity}/config", self.discovery)
    }

    /// The configurations of all cameras; that of ours is cleared by whoever removes the sensor.
    pub(crate) fn all_cameras(&self) -> String {
        self.config("+", ENTITIES[0])
    }

    /// Whose camera's configuration this is.
    pub(crate) fn camera_of<'a>(&self, topic: &'a str) -> Option<&'a str> {
        let (platform, entity) = ENTITIES[0];
        let id = topic.strip_prefix(&format!("{}/{platform}/", self.discovery))?;
        let id = id.strip_suffix(&format!("/{entity}/config"))?;
        (!id.contains('/')).then_some(id)
    }

    /// Where Home Assistant says that it has started.
    pub(crate) fn birth(&self) -> String {
        format!("{}/status", self.discovery)
    }

    /// `online` while this program is connected.
    pub(crate) fn bridge(&self) -> String {
        self.availability(BRIDGE)
    }

    /// `online` while the sensor sends frames.
    pub(crate) fn availability(&self, id: &str) -> String {
        format!("{}/{id}/availability", self.base)
    }

    /// Whose availability this is.
    pub(crate) fn available_of<'a>(&self, topic: &'a str) -> Option<&'a str> {
        let id = topic.strip_prefix(&format!("{}/", self.base))?;
        let id = id.strip_suffix("/availability")?;
        (!id.contains('/')).then_some(id)
    }

    /// The temperatures, and whether somebody is there.
    pub(crate) fn state(&self, id: &str) -> String {
        format!("{}/{id}/state", self.base)
    }

    /// The picture.
    pub(crate) fn image(&self, id: &str) -> String {
        format!("{}/{id}/image", self.base)
    }

    /// The same for every start of a bridge to these topics, so that the broker ends the one before it, which may have
    /// lost its network, instead of saying of the new one that it is gone. 23 letters and digits go with every broker.
    pub(crate) fn client_id(&self) -> String {
        let distinction = distinction(&[&self.discovery, &self.base], 8);
        format!("grideye{distinction}")
    }
}

/// The bridge among the sensors; none of these begins so.
pub(crate) const BRIDGE: &str = "bridge";

/// A sensor's identifier: the same permanently, and another for each device and sensor.
pub(crate) fn id(device: &str, sensor: &str) -> String {
    let distinction = distinction(&[device, sensor], DISTINCTION_BYTES);
    let [device, sensor] = [device, sensor].map(letters);
    format!("grideye_{device}_{sensor}_{distinction}")
}

fn letters(name: &str) -> String {
    let plain = |c: char| match c {
        'a'..='z' | '0'..='9' => c,
        'A'..='Z' => c.to_ascii_lowercase(),
        _ => '_',
    };
    name.chars().take(NAME_CHARS_MAX).map(plain).collect()
}

fn distinction(texts: &[&str], bytes: usize) -> String {
    let mut hash = Sha256::new();
    for text in texts {
        hash.update(text.as_bytes());
        hash.update([0]);
    }
    let bytes = hash.finalize().into_iter().take(bytes);
    bytes.map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_identifier_is_stable_and_of_one_sensor_alone() {
        // Entities of Home Assistant hang on it: it must never change.
        assert_eq!(id("pi-1", "i2c-1:0x69"), "grideye_pi_1_i2c_1_0x69_db5ef13c");
        let names = ["a", "A", "a:", "a/", "a_", "ä", ""];
        let of_device = |device| names.map(|sensor| id(device, sensor));
        let all: std::collections::BTreeSet<String> =
            names.into_iter().flat_map(of_device).collect();
        assert_eq!(all.len(), names.len() * names.len());
        let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
        assert!(all.iter().all(|id| id.chars().all(is_plain)), "{all:?}");
        assert!(id(&"x".repeat(500), &"y".repeat(500)).len() < 80);
    }

    #[test]
    fn topics_are_told_apart_again() {
        let [discovery, base] = ["homeassistant", "grideye"].map(str::to_owned);
        let topics = Topics { discovery, base };
        let config = topics.config("grideye_x", ENTITIES[0]);
        assert_eq!(config, "homeassistant/camera/grideye_x/image/config");
        assert_eq!(topics.camera_of(&config), Some("grideye_x"));
        assert_eq!(topics.all_cameras(), "homeassistant/camera/+/image/config");
        let other = topics.config("grideye_x", ENTITIES[1]);
        assert_eq!(topics.camera_of(&other), None);
        let availability = topics.availability("grideye_x");
        assert_eq!(topics.available_of(&availability), Some("grideye_x"));
        assert_eq!(topics.available_of("grideye/a/b/availability"), None);
        assert_eq!(topics.available_of("other/a/availability"), None);
        assert_eq!(topics.client_id().len(), 23);
    }
}
