//! Checks of retained messages and availability.

use crate::feed::ID;
use grideye_tests::broker::{Broker, Heard, Subscriber};
use grideye_tests::patience::wait_for;

pub(crate) fn state_topic() -> String {
    format!("grideye/{ID}/state")
}

pub(crate) fn is_availability(heard: &Heard, whose: &str, word: &str) -> bool {
    heard.topic == format!("grideye/{whose}/availability") && heard.text() == word
}

pub(crate) fn wait_for_availability(subscriber: &Subscriber, whose: &str, word: &str) -> Heard {
    let what = format!("{whose} to be {word}");
    subscriber.wait_for(&what, |heard| is_availability(heard, whose, word))
}

/// The topics of a sensor's configurations.
pub(crate) fn config_topics() -> Vec<String> {
    let mut topics: Vec<String> = [
        "camera/ID/image",
        "sensor/ID/min",
        "sensor/ID/max",
        "sensor/ID/mean",
        "sensor/ID/thermistor",
        "binary_sensor/ID/presence",
        "sensor/ID/people",
    ]
    .map(|entity| format!("homeassistant/{}/config", entity.replace("ID", ID)))
    .to_vec();
    topics.sort();
    topics
}

/// Waits until the broker retains exactly the bridge and, if given, the sensor with this word.
pub(crate) fn wait_until_kept(broker: &Broker, sensor: Option<&str>) {
    let mut expected = vec!["grideye/bridge/availability".to_owned()];
    if sensor.is_some() {
        expected.push(format!("grideye/{ID}/availability"));
        expected.extend(config_topics());
    }
    wait_for(&format!("the broker to keep {expected:?}"), || {
        let kept = broker.kept();
        let topics: Vec<&str> = kept.iter().map(|heard| heard.topic.as_str()).collect();
        let is_told = |word| kept.iter().any(|heard| is_availability(heard, ID, word));
        let mut sorted: Vec<&str> = topics.clone();
        sorted.sort_unstable();
        (sorted == expected && sensor.is_none_or(is_told)).then_some(())
    });
}
