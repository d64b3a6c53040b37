//! Tests what is published when, with a controlled clock.

use super::*;
use grideye_count::{Count, Places};
use grideye_frame::{PixelWord, Reading, RecordedFrame, ThermistorWord};
use grideye_recording::{ClockState, Record, Stamp};
use serde_json::Value;

fn telling() -> Telling {
    Telling {
        topics: Topics {
            discovery: "homeassistant".to_owned(),
            base: "grideye".to_owned(),
        },
        state_every: seconds(5),
        images: Some(Images {
            every: seconds(1),
            draw: |_, seq| Some(seq.to_string().into_bytes()),
        }),
        silent_after: seconds(15),
        forget_after: Some(seconds(86_400)),
        has_line: false,
    }
}

fn seconds(seconds: u64) -> Duration {
    Duration::from_secs(seconds)
}

/// A frame of 20 °C with `warm` pixels of 25 °C.
fn frame(boot: &str, seq: u64, warm: usize, age: Duration) -> NewestFrame {
    let mut pixels = [PixelWord(80); 64];
    pixels[..warm].fill(PixelWord(100));
    let stamp = Stamp {
        t_boot_ns: 0,
        t_utc_ns: 0,
        clock: ClockState::Synced,
    };
    NewestFrame {
        stream: StreamId {
            device: "pi-1".into(),
            sensor: "s1".into(),
            boot: boot.into(),
        },
        record: Record {
            seq,
            stamp,
            reading: Reading::Frame(RecordedFrame {
                pixels,
                thermistor: Some(ThermistorWord(0x1A1)),
            }),
        },
        age,
        people: Some(people(u8::from(warm > 0))),
    }
}

fn people(people: u8) -> People {
    let count = Count {
        people,
        chances: [0.25; 4],
        alone: [0.25; 4],
        places: Places::default(),
        pixels: 0,
        excess: [0.0; 64],
    };
    People {
        count: Some(count),
        crossed: None,
    }
}

/// The last level of each topic, in order of publication.
fn said(messages: &[Message]) -> Vec<&str> {
    let topics = messages.iter().map(|message| &message.topic);
    topics
        .map(|topic| topic.rsplit('/').next().unwrap())
        .collect()
}

fn sensor() -> Sensor {
    Sensor::new(&frame("b1", 0, 0, Duration::ZERO).stream)
}

fn first(sensor: &mut Sensor) -> Vec<Message> {
    look(sensor, &frame("b1", 0, 0, Duration::ZERO), 100)
}

fn look(sensor: &mut Sensor, newest: &NewestFrame, now_s: u64) -> Vec<Message> {
    sensor.look(newest, &telling(), seconds(now_s))
}

fn new() -> Vec<&'static str> {
    [&["config"; 7][..], &["availability", "state", "image"]].concat()
}

#[test]
fn a_sensor_is_announced_with_its_first_new_frame_then_published_at_its_intervals() {
    let mut sensor = sensor();
    let old = frame("b1", 0, 0, seconds(16));
    assert_eq!(look(&mut sensor, &old, 1), []);
    assert!(!sensor.is_announced());
    let told = first(&mut sensor);
    assert_eq!(said(&told), new());
    assert!(told[..8].iter().all(|message| message.retain));
    assert!(told[8..].iter().all(|message| !message.retain));
    assert!(sensor.is_announced());
    // Polls are half a second apart.
    let mut images = 0;
    let mut states = 0;
    for look in 1..=40_u32 {
        let new = frame("b1", look.into(), 0, Duration::ZERO);
        let told = sensor.look(&new, &telling(), seconds(100) + look * seconds(1) / 2);
        images += said(&told).iter().filter(|last| **last == "image").count();
        states += said(&told).iter().filter(|last| **last == "state").count();
        assert!(told.iter().all(|message| !message.retain));
    }
    assert_eq!((states, images), (4, 20));
}

#[test]
fn the_state_is_the_frame_in_degrees() {
    let mut sensor = sensor();
    let warm = frame("b1", 7, 3, Duration::ZERO);
    let told = look(&mut sensor, &warm, 100);
    let state: Value = serde_json::from_slice(&told[8].payload).unwrap();
    // Three pixels of 25 °C and 61 of 20 °C; 0x1A1 is 26.0625 °C (AMG88 spec §4-11-10).
    let expected = json!({ "min": 20.0, "max": 25.0, "mean": 20.23, "thermistor": 26.0625, "people": 1, "presence": "ON", "entered": null, "left": null, "seq": 7 });
    assert_eq!(state, expected);
}

#[test]
fn a_change_of_people_is_published_at_once_and_an_old_frame_only_once() {
    let mut sensor = sensor();
    first(&mut sensor);
    let now = seconds(100) + seconds(1) / 2;
    let warm = frame("b1", 5, 3, Duration::ZERO);
    let told = sensor.look(&warm, &telling(), now);
    assert_eq!(said(&told), ["state"]);
    assert!(String::from_utf8_lossy(&told[0].payload).contains("\"ON\""));
    for later in 1..14 {
        let same = frame("b1", 5, 3, seconds(later));
        let told = sensor.look(&same, &telling(), now + seconds(later));
        // Its image became due a moment later.
        let expected: &[&str] = if later == 1 { &["image"] } else { &[] };
        assert_eq!(said(&told), expected, "{later} s later");
    }
}

#[test]
fn silence_makes_it_unavailable_and_a_day_of_it_removes_it() {
    let mut sensor = sensor();
    first(&mut sensor);
    let silent = |age: u64| frame("b1", 0, 0, seconds(age));
    assert_eq!(look(&mut sensor, &silent(15), 115), []);
    let told = look(&mut sensor, &silent(16), 116);
    let topic = telling().topics.availability(&sensor.named.id);
    assert_eq!(told, [Message::retained(topic.clone(), "offline")]);
    assert_eq!(look(&mut sensor, &silent(17), 117), []);
    let told = look(&mut sensor, &silent(86_401), 86_501);
    assert_eq!(told.len(), 10);
    let is_cleared = |message: &Message| message.retain && message.payload.is_empty();
    assert!(told.iter().all(is_cleared));
    assert_eq!(told[9].topic, topic);
    assert!(!sensor.is_announced());
    assert_eq!(look(&mut sensor, &silent(86_402), 86_502), []);
    // It returns as a new one.
    let back = frame("b2", 0, 0, Duration::ZERO);
    assert_eq!(said(&look(&mut sensor, &back, 90_000)), new());
}

#[test]
fn everything_is_published_again_after_a_reconnect() {
    let mut sensor = sensor();
    first(&mut sensor);
    sensor.say_again();
    let same = frame("b1", 0, 0, seconds(1));
    assert_eq!(said(&look(&mut sensor, &same, 101)), new());
    // A silent one too, but not its old values.
    sensor.say_again();
    let silent = frame("b1", 0, 0, seconds(20));
    let told = look(&mut sensor, &silent, 120);
    assert_eq!(said(&told), new()[..8]);
    assert_eq!(told[7].payload, b"offline");
}

#[test]
fn a_removed_sensor_stays_removed_until_its_agent_restarts() {
    let mut sensor = sensor();
    first(&mut sensor);
    assert_eq!(sensor.remove(&telling()).len(), 10);
    let next = frame("b1", 9, 0, Duration::ZERO);
    assert_eq!(look(&mut sensor, &next, 102), []);
    sensor.say_again();
    assert_eq!(look(&mut sensor, &next, 103), []);
    let restarted = frame("b2", 0, 0, Duration::ZERO);
    assert_eq!(said(&look(&mut sensor, &restarted, 104)), new());
}

#[test]
fn pictures_can_be_left_out() {
    let mut sensor = sensor();
    let telling = Telling {
        images: None,
        ..telling()
    };
    let newest = frame("b1", 0, 0, Duration::ZERO);
    let told = sensor.look(&newest, &telling, seconds(100));
    assert_eq!(said(&told), new()[..9]);
}

#[test]
fn who_crosses_a_line_is_told_and_a_room_that_is_not_known_yet_has_no_presence() {
    let telling = Telling {
        has_line: true,
        ..telling()
    };
    let mut newest = frame("b1", 0, 0, Duration::ZERO);
    let mut people = people(0);
    people.crossed = Some([3, 1]);
    newest.people = Some(people);
    let mut sensor = sensor();
    let told = sensor.look(&newest, &telling, seconds(100));
    let entered = told
        .iter()
        .find(|message| message.topic.ends_with("entered/config"));
    assert!(String::from_utf8_lossy(&entered.unwrap().payload).contains("total_increasing"));
    let state = |told: &[Message]| {
        let state = told
            .iter()
            .find(|message| message.topic.ends_with("/state"));
        serde_json::from_slice::<Value>(&state.unwrap().payload).unwrap()
    };
    let known = state(&told);
    assert_eq!(
        (&known["entered"], &known["left"], &known["presence"]),
        (&json!(3), &json!(1), &json!("OFF"))
    );
    people.count = None;
    newest.people = Some(people);
    newest.record.seq = 1;
    let unknown = state(&sensor.look(&newest, &telling, seconds(101)));
    assert_eq!(
        (&unknown["people"], &unknown["presence"]),
        (&Value::Null, &Value::Null)
    );
}
