//! Identifiers of sensors, and topics on the broker.

use sha2::{Digest as _, Sha256};

/// Characters of a device or sensor name in an identifier.
const NAME_CHARS_MAX: usize = 24;
/// Bytes of the SHA-256 that distinguishes names that look alike in letters, digits and `_`.
const DISTINCTION_BYTES: usize = 4;

/// The bridge's topics.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topics {
    /// Home Assistant's discovery prefix, `homeassistant` by default.
    pub discovery: String,
    /// The prefix of all other topics.
    pub base: String,
}

/// A sensor's entities in Home Assistant: platform and name. Without a line, the last two are not announced.
pub(crate) const ENTITIES: [(&str, &str); 9] = [
    ("camera", "image"),
    ("sensor", "min"),
    ("sensor", "max"),
    ("sensor", "mean"),
    ("sensor", "thermistor"),
    ("binary_sensor", "presence"),
    ("sensor", "people"),
    ("sensor", ENTERED),
    ("sensor", LEFT),
];

/// Who crossed the line across the image.
pub(crate) const ENTERED: &str = "entered";
pub(crate) const LEFT: &str = "left";

impl Topics {
    pub(crate) fn config(&self, id: &str, (platform, entity): (&str, &str)) -> String {
        format!("{}/{platform}/{id}/{entity}/config", self.discovery)
    }

    /// A filter for all camera configurations; whoever removes a sensor clears its one.
    pub(crate) fn all_cameras(&self) -> String {
        self.config("+", ENTITIES[0])
    }

    /// The sensor of this camera configuration topic.
    pub(crate) fn camera_of<'a>(&self, topic: &'a str) -> Option<&'a str> {
        let (platform, entity) = ENTITIES[0];
        let id = topic.strip_prefix(&format!("{}/{platform}/", self.discovery))?;
        let id = id.strip_suffix(&format!("/{entity}/config"))?;
        (!id.contains('/')).then_some(id)
    }

    /// The topic where Home Assistant reports its start.
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

    /// The sensor of this availability topic.
    pub(crate) fn available_of<'a>(&self, topic: &'a str) -> Option<&'a str> {
        let id = topic.strip_prefix(&format!("{}/", self.base))?;
        let id = id.strip_suffix("/availability")?;
        (!id.contains('/')).then_some(id)
    }

    /// Temperatures, people and presence.
    pub(crate) fn state(&self, id: &str) -> String {
        format!("{}/{id}/state", self.base)
    }

    pub(crate) fn image(&self, id: &str) -> String {
        format!("{}/{id}/image", self.base)
    }

    /// Filters for what agents and others publish.
    pub(crate) fn all_frames(&self) -> [String; 2] {
        let Self { base, .. } = self;
        [format!("{base}/+/frames"), format!("{base}/+/+/pixels")]
    }

    /// What this topic of frames brings.
    pub(crate) fn published<'a>(&self, topic: &'a str) -> Option<Published<'a>> {
        let place = topic.strip_prefix(&self.base)?.strip_prefix('/')?;
        let mut parts = place.split('/');
        match (parts.next()?, parts.next()?, parts.next(), parts.next()) {
            (device, "frames", None, None) => Some(Published::Post(device)),
            (device, sensor, Some("pixels"), None) => Some(Published::Pixels(device, sensor)),
            _ => None,
        }
    }

    /// The same for every bridge with these topics, so that the broker ends an earlier connection, which may have lost
    /// its network, instead of reporting the new one as gone. Every broker accepts 23 letters and digits.
    pub(crate) fn client_id(&self, role: &str) -> String {
        let distinction = distinction(&[&self.discovery, &self.base, role], 8);
        format!("grideye{distinction}")
    }
}

/// Frames on the broker.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Published<'a> {
    /// The JSON of a post, of this device.
    Post(&'a str),
    /// 64 temperatures of this device's sensor.
    Pixels(&'a str, &'a str),
}

/// The bridge's name among the sensors; no sensor identifier has it.
pub(crate) const BRIDGE: &str = "bridge";

/// A sensor's identifier: it never changes, and differs for each device and sensor.
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
        // Home Assistant identifies entities by it: it must never change.
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
        let [bridge, frames] = ["", "frames"].map(|role| topics.client_id(role));
        assert!(bridge != frames && bridge.len() == 23 && frames.len() == 23);
        let [post, pixels] = ["grideye/pi-1/frames", "grideye/pi-1/s1/pixels"];
        assert_eq!(topics.published(post), Some(Published::Post("pi-1")));
        let expected = Some(Published::Pixels("pi-1", "s1"));
        assert_eq!(topics.published(pixels), expected);
        assert_eq!(topics.published("grideye/pi-1/s1/x/pixels"), None);
        assert_eq!(
            topics.all_frames(),
            ["grideye/+/frames", "grideye/+/+/pixels"]
        );
    }
}
