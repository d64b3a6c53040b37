//! Tests with the real Home Assistant: its core and its MQTT integration, without its web server.

use crate::feed::{Feed, collector, varied};
use grideye_tests::broker::Broker;
use grideye_tests::patience::wait_for;
use grideye_tests::python::home_assistant;
use serde_json::Value;
use std::io::{BufRead as _, BufReader, Write as _};
use std::process::{Child, ChildStdin, Stdio};
use std::sync::{Arc, Mutex};

/// A running Home Assistant, which ends when its input closes.
struct Home {
    child: Child,
    input: Option<ChildStdin>,
    shown: Arc<Mutex<Value>>,
}

impl Home {
    fn start(broker: &Broker, what: &str) -> Option<Self> {
        let mut command = home_assistant(&[&broker.port().to_string()], what)?;
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let input = child.stdin.take();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let shown = Arc::<Mutex<Value>>::default();
        let shows = Arc::clone(&shown);
        std::thread::spawn(move || {
            for line in lines.map_while(Result::ok) {
                *shows.lock().unwrap() = serde_json::from_str(&line).unwrap();
            }
        });
        Some(Self {
            child,
            input,
            shown,
        })
    }

    /// The displayed entity of the sensor.
    fn entity(&self, platform: &str, entity: &str) -> Value {
        let shown = self.shown.lock().unwrap();
        shown["states"][format!("{platform}.grid_eye_pi_1_s1_{entity}")].clone()
    }

    fn wait_for(
        &self,
        what: &str,
        platform: &str,
        entity: &str,
        is_right: impl Fn(&Value) -> bool,
    ) -> Value {
        wait_for(&format!("{what} in Home Assistant"), || {
            let shown = self.entity(platform, entity);
            is_right(&shown).then_some(shown)
        })
    }

    fn entities(&self) -> usize {
        let shown = self.shown.lock().unwrap();
        shown["states"].as_object().map_or(0, serde_json::Map::len)
    }
}

impl Drop for Home {
    fn drop(&mut self) {
        drop(self.input.take());
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The warmest pixel in all frames of the feed.
fn is_highest(shown: &Value) -> bool {
    shown["state"] == "29.75"
}

fn is_unavailable(shown: &Value) -> bool {
    shown["state"] == "unavailable"
}

#[test]
fn the_real_home_assistant_shows_the_sensor_and_removes_it() {
    let what = "the_real_home_assistant_shows_the_sensor_and_removes_it";
    let Some(mut broker) = Broker::start(what) else {
        return;
    };
    let Some(mut home) = Home::start(&broker, what) else {
        return;
    };
    let at = tempfile::tempdir().unwrap();
    let mut first = collector(at.path(), &broker.url(), &[]);
    let feed = Feed::start(&first, 0, vec![varied()]);
    // The minimum and maximum are the same in all frames.
    let lowest = home.wait_for("the minimum", "sensor", "minimum", |shown| {
        shown["state"]
            .as_str()
            .is_some_and(|text| text.parse::<f64>().is_ok())
    });
    assert_eq!(lowest["state"], "20.0");
    let attributes = &lowest["attributes"];
    assert_eq!(attributes["device_class"], "temperature");
    assert_eq!(attributes["unit_of_measurement"], "°C");
    assert_eq!(attributes["friendly_name"], "Grid-EYE pi-1 s1 Minimum");
    home.wait_for("the maximum", "sensor", "maximum", is_highest);
    // The empty room is known after half a minute.
    home.wait_for("presence", "binary_sensor", "presence", |shown| {
        shown["state"] == "unknown" || shown["state"] == "off"
    });
    let picture = home.wait_for("the picture", "camera", "thermal_image", |shown| {
        shown["image"].is_string()
    });
    // A PNG's first eight bytes in base 64.
    assert!(
        picture["image"]
            .as_str()
            .unwrap()
            .starts_with("iVBORw0KGgo")
    );
    wait_for("all entities", || (home.entities() == 7).then_some(()));

    first.kill();
    home.wait_for("the last will", "sensor", "maximum", is_unavailable);
    let seq = feed.stop();
    let second = collector(at.path(), &broker.url(), &[]);
    let feed = Feed::start(&second, seq, vec![varied()]);
    home.wait_for("the next collector", "sensor", "maximum", is_highest);
    broker.kill();
    home.wait_for("the broker's end", "sensor", "maximum", is_unavailable);
    assert!(broker.resume(), "mosquitto does not start again");
    home.wait_for("the broker's return", "sensor", "maximum", is_highest);

    // Presses the delete button of Home Assistant's page; the agent keeps sending.
    let input = home.input.as_mut().unwrap();
    input.write_all(b"remove Grid-EYE pi-1 s1\n").unwrap();
    wait_for("the removal", || (home.entities() == 0).then_some(()));
    crate::kept::wait_until_kept(&broker, None);
    let shown = home.shown.lock().unwrap();
    assert_eq!(shown["states"], serde_json::json!({}));
    drop(shown);
    drop(feed);
}
