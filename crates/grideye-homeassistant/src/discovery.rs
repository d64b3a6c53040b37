//! Home Assistant's discovery messages: one retained configuration per entity of a sensor.
//!
//! One topic per entity instead of one per device, which needs Home Assistant 2024.11: entity topics work with much
//! older versions too (`origin` since 2023.8).

use crate::packet::Message;
use crate::topics::{ENTERED, ENTITIES, LEFT, Topics};
use serde_json::{Value, json};
use std::time::Duration;

const MANUFACTURER: &str = "Panasonic";
const MODEL: &str = "Grid-EYE AMG8833";
/// Payloads of an availability topic.
pub(crate) const ONLINE: &str = "online";
pub(crate) const OFFLINE: &str = "offline";
pub(crate) const PRESENT: &str = "ON";
pub(crate) const ABSENT: &str = "OFF";

/// A sensor's identifier and names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Named {
    pub(crate) id: String,
    pub(crate) device: String,
    pub(crate) sensor: String,
}

/// The configurations; Home Assistant drops a value older than `expires`.
pub(crate) fn configurations(
    topics: &Topics,
    named: &Named,
    expires: Duration,
    has_line: bool,
) -> Vec<Message> {
    let told = |place: (&str, &str)| {
        let mut config = common(topics, named, place.1);
        let own = own(topics, &named.id, place, expires);
        if let (Value::Object(config), Value::Object(own)) = (&mut config, own) {
            config.extend(own);
        }
        Message::retained(topics.config(&named.id, place), config.to_string())
    };
    let is_told = |(_, entity): &(&str, &str)| has_line || ![ENTERED, LEFT].contains(entity);
    ENTITIES.into_iter().filter(is_told).map(told).collect()
}

/// Messages that delete everything the broker retains of a sensor.
pub(crate) fn removal(topics: &Topics, id: &str) -> Vec<Message> {
    let entities = ENTITIES.iter().map(|place| topics.config(id, *place));
    let topics = entities.chain([topics.availability(id)]);
    topics.map(Message::cleared).collect()
}

fn common(topics: &Topics, named: &Named, entity: &str) -> Value {
    json!({
        "unique_id": format!("{}_{entity}", named.id),
        "availability": [
            { "topic": topics.bridge() },
            { "topic": topics.availability(&named.id) },
        ],
        "availability_mode": "all",
        "device": {
            "identifiers": [named.id],
            "name": format!("Grid-EYE {} {}", named.device, named.sensor),
            "manufacturer": MANUFACTURER,
            "model": MODEL,
        },
        "origin": { "name": "grideye-hil", "sw_version": env!("CARGO_PKG_VERSION") },
    })
}

fn own(topics: &Topics, id: &str, (platform, entity): (&str, &str), expires: Duration) -> Value {
    if platform == "camera" {
        return json!({ "name": "Thermal image", "topic": topics.image(id) });
    }
    let mut own = json!({
        "name": name(entity),
        "state_topic": topics.state(id),
        "value_template": format!("{{{{ value_json.{entity} }}}}"),
        "expire_after": expires.as_secs().max(1),
    });
    if platform == "binary_sensor" {
        own["device_class"] = "occupancy".into();
        own["payload_on"] = PRESENT.into();
        own["payload_off"] = ABSENT.into();
    } else if entity == "people" {
        own["state_class"] = "measurement".into();
        own["icon"] = "mdi:account-multiple".into();
    } else if [ENTERED, LEFT].contains(&entity) {
        own["state_class"] = "total_increasing".into();
    } else {
        own["device_class"] = "temperature".into();
        own["unit_of_measurement"] = "°C".into();
        own["state_class"] = "measurement".into();
        own["suggested_display_precision"] = 2.into();
    }
    own
}

/// The entity's name in Home Assistant, shown after the device's name.
fn name(entity: &str) -> &'static str {
    match entity {
        "min" => "Minimum",
        "max" => "Maximum",
        "mean" => "Mean",
        "thermistor" => "Thermistor",
        "people" => "People",
        ENTERED => "Entered",
        LEFT => "Left",
        _ => "Presence",
    }
}
