//! Configurations, values, images and presence.

use crate::feed::{Feed, ID, collector, simulated, varied};
use crate::kept::{state_topic, wait_for_availability, wait_until_kept};
use grideye_tests::broker::{Broker, Heard};
use grideye_tests::emulated::{pixel_c, thermistor_c};
use serde_json::{Value, json};

#[test]
fn a_sensor_is_discovered_with_its_values_and_its_picture() {
    let what = "a_sensor_is_discovered_with_its_values_and_its_picture";
    let Some(broker) = Broker::start(what) else {
        return;
    };
    let at = tempfile::tempdir().unwrap();
    let subscriber = broker.subscribe();
    let collector = collector(at.path(), &broker.url(), &[]);
    let feed = Feed::start(&collector, 0, vec![varied()]);
    wait_for_availability(&subscriber, "bridge", "online");
    wait_for_availability(&subscriber, ID, "online");
    wait_until_kept(&broker, Some("online"));
    for kept in broker.kept() {
        if kept.topic.ends_with("/config") {
            assert_config(&kept);
        }
    }
    let state = subscriber.wait_for("the state", |heard| heard.topic == state_topic());
    assert_state(&state, &feed);
    let image = format!("grideye/{ID}/image");
    let image = subscriber.wait_for("the picture", |heard| heard.topic == image);
    assert!(!state.retained && !image.retained);
    assert_picture(&image, &feed);
    // The store has the same frame under that number.
    let sensors = collector.json("/v1/sensors");
    assert_eq!(sensors["sensors"][0]["sensor"], "s1");
    let status = collector.json("/v1/mqtt");
    assert_eq!(
        (&status["connected"], &status["sensors"]),
        (&true.into(), &1.into())
    );
}

/// Checks the keys that Home Assistant's documentation requires.
fn assert_config(kept: &Heard) {
    let config = kept.json();
    let mut levels = kept.topic.split('/').skip(1);
    let (platform, entity) = (levels.next().unwrap(), levels.nth(1).unwrap());
    assert_eq!(config["unique_id"], format!("{ID}_{entity}"));
    assert_eq!(config["device"]["identifiers"], json!([ID]));
    assert_eq!(config["device"]["name"], "Grid-EYE pi-1 s1");
    assert_eq!(config["availability_mode"], "all");
    let topics: Vec<&Value> = config["availability"]
        .as_array()
        .unwrap()
        .iter()
        .map(|availability| &availability["topic"])
        .collect();
    let sensor = format!("grideye/{ID}/availability");
    assert_eq!(
        topics,
        [&json!("grideye/bridge/availability"), &json!(sensor)]
    );
    assert_eq!(config["origin"]["name"], "grideye-hil");
    if platform == "camera" {
        assert_eq!(config["topic"], format!("grideye/{ID}/image"));
        return;
    }
    assert_eq!(config["state_topic"], state_topic());
    assert_eq!(
        config["value_template"],
        format!("{{{{ value_json.{entity} }}}}")
    );
    assert_eq!(config["expire_after"], 16);
    let class = (
        &config["device_class"],
        &config["unit_of_measurement"],
        &config["state_class"],
    );
    if entity == "people" {
        assert_eq!(class, (&Value::Null, &Value::Null, &json!("measurement")));
    } else if platform == "sensor" {
        assert_eq!(
            class,
            (&json!("temperature"), &json!("°C"), &json!("measurement"))
        );
    } else {
        assert_eq!(class, (&json!("occupancy"), &Value::Null, &Value::Null));
        assert_eq!(
            (&config["payload_on"], &config["payload_off"]),
            (&json!("ON"), &json!("OFF"))
        );
    }
}

/// Checks the values, computed here from the datasheet.
fn assert_state(state: &Heard, feed: &Feed) {
    let state = state.json();
    let (pixels, thermistor) = feed.posted(state["seq"].as_u64().unwrap());
    let celsius: Vec<f64> = pixels.iter().map(|word| pixel_c(*word)).collect();
    let number = |name: &str| state[name].as_f64().unwrap();
    assert_eq!(
        number("min"),
        celsius.iter().copied().fold(f64::INFINITY, f64::min)
    );
    assert_eq!(
        number("max"),
        celsius.iter().copied().fold(f64::NEG_INFINITY, f64::max)
    );
    assert_eq!(number("thermistor"), thermistor_c(thermistor));
    let mean = celsius.iter().sum::<f64>() / 64.0;
    assert!(
        (number("mean") - mean).abs() <= 0.005 + 1e-9,
        "{state} {mean}"
    );
}

/// Checks that each cell's color matches the pixel's temperature on the image's own scale.
fn assert_picture(heard: &Heard, feed: &Feed) {
    let mut decoder = png::Decoder::new(std::io::Cursor::new(&heard.payload));
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().unwrap();
    let mut dots = vec![0; reader.output_buffer_size().unwrap()];
    let picture = reader.next_frame(&mut dots).unwrap();
    let width = usize::try_from(picture.width).unwrap();
    let dot = |x: usize, y: usize| -> [u8; 3] {
        let at = 3 * (y * width + x);
        dots[at..at + 3].try_into().unwrap()
    };
    let texts = &reader.info().uncompressed_latin1_text;
    let number = |name: &str| -> f64 {
        let text = texts.iter().find(|text| text.keyword == name).unwrap();
        text.text.parse().unwrap()
    };
    let (low, high) = (number("low_celsius"), number("high_celsius"));
    #[expect(
        clippy::as_conversions,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a whole number that is not negative"
    )]
    let (pixels, _thermistor) = feed.posted(number("seq") as u64);
    // Cells of 40 dots from (12, 12); the scale is to their right and ends where the image is white.
    let bar: Vec<[u8; 3]> = (12..picture.height)
        .map(|y| dot(350, usize::try_from(y).unwrap()))
        .take_while(|color| *color != [255; 3])
        .collect();
    assert!(bar.len() > 200, "{}", bar.len());
    for (pixel, word) in pixels.iter().enumerate() {
        let color = dot(12 + 40 * (pixel % 8) + 20, 12 + 40 * (pixel / 8) + 20);
        let far = |other: &[u8; 3]| -> u32 {
            (0..3)
                .map(|channel| u32::from(color[channel].abs_diff(other[channel])))
                .sum()
        };
        let (row, _) = bar
            .iter()
            .enumerate()
            .min_by_key(|(_, other)| far(other))
            .unwrap();
        let place = (f64::from(u32::try_from(row).unwrap()) + 0.5)
            / f64::from(u32::try_from(bar.len()).unwrap());
        let read = high - place * (high - low);
        let expected = pixel_c(*word);
        // One dot of the scale and one color step.
        let step = (high - low) / 100.0;
        assert!(
            (read - expected).abs() <= step,
            "pixel {}: {read} °C on the scale, {expected} °C",
            pixel + 1
        );
    }
}

#[test]
fn presence_comes_with_an_emulated_person_and_goes_with_them() {
    let what = "presence_comes_with_an_emulated_person_and_goes_with_them";
    let Some(broker) = Broker::start(what) else {
        return;
    };
    let at = tempfile::tempdir().unwrap();
    let scenes = vec![
        simulated(at.path(), EMPTY),
        simulated(at.path(), &format!("{EMPTY}{ANA}")),
    ];
    let subscriber = broker.subscribe();
    let collector = collector(at.path(), &broker.url(), &[]);
    let feed = Feed::start(&collector, 0, scenes);
    let says = |word: &'static str| {
        move |heard: &Heard| {
            let people = if word == "ON" { 1 } else { 0 };
            let is_state = heard.topic == state_topic();
            is_state && heard.json()["presence"] == word && heard.json()["people"] == people
        }
    };
    // The empty room is known after half a minute.
    subscriber.wait_for("an empty room", says("OFF"));
    assert_eq!(subscriber.find(says("ON")), None);
    feed.show(1);
    subscriber.wait_for_next("the person", says("ON"));
    feed.show(0);
    subscriber.wait_for_next("the person's leaving", says("OFF"));
}

const EMPTY: &str = "[room]
size_mm = [4000, 4000, 2700]
ambient_c = 20
[[sensor]]
name = \"ceiling\"
preset = \"grid-eye\"
position_mm = [2000, 2000, 2700]
elevation_deg = 90
azimuth_deg = 0
";
const ANA: &str = "[[agent]]
name = \"ana\"
size_mm = [300, 500, 1700]
temperature_c = 30
position_mm = [1800, 2200, 0]
";
