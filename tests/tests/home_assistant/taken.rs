//! Frames that others publish on the broker.

use crate::feed::{collector, varied};
use grideye_recording::Row;
use grideye_recording::csv::Reader;
use grideye_tests::broker::Broker;
use grideye_tests::live_page::batch;
use grideye_tests::patience::wait_for;
use grideye_tests::programs::RunningCollector;

const POSTS: &str = "grideye/pi-1/frames";

fn stored(collector: &RunningCollector) -> u64 {
    let sensors = collector.json("/v1/sensors");
    let sensors = sensors["sensors"].as_array().unwrap();
    let stored = sensors.iter().map(|sensor| sensor["stored"].as_u64());
    stored.map(Option::unwrap).sum()
}

fn wait_for_stored(collector: &RunningCollector, count: u64) {
    wait_for("as many frames as were published", || {
        (stored(collector) >= count).then_some(())
    });
    assert_eq!(stored(collector), count);
}

fn wait_for_subscription(collector: &RunningCollector) {
    wait_for("a connection for frames", || {
        (collector.json("/v1/mqtt")["frames"]["connected"] == true).then_some(())
    });
}

/// The rows of a recording that ends now.
fn rows(collector: &RunningCollector, recording: u64) -> Vec<Row> {
    let csv = collector.recording_csv(recording);
    let rows = Reader::new(csv.as_bytes()).unwrap();
    rows.map(Result::unwrap).collect()
}

#[test]
fn posts_are_stored_once_and_wait_while_the_collector_is_away() {
    let Some(broker) = Broker::start("posts_are_stored_once_and_wait_while_the_collector_is_away")
    else {
        return;
    };
    let at = tempfile::tempdir().unwrap();
    let mut away = collector(at.path(), &broker.url(), &[]);
    wait_for_subscription(&away);
    let frames = varied();
    let posts = [0, 5, 10, 15].map(|seq| {
        let from = usize::try_from(seq).unwrap();
        batch("s1", seq, &frames[from..from + 5]).to_string()
    });
    let post = |index: usize| broker.publish(POSTS, posts[index].as_bytes(), false);
    // The second is the first again, as a broker may deliver it.
    [0, 0, 1].into_iter().for_each(&post);
    wait_for_stored(&away, 10);
    wait_for("three messages", || {
        (away.json("/v1/mqtt")["frames"]["taken"] == 3).then_some(())
    });
    // What the store does not take waits at the broker, like what comes while nobody listens.
    let [store, moved] = ["store.sqlite", "moved"].map(|name| at.path().join(name));
    std::fs::rename(&store, &moved).unwrap();
    post(2);
    wait_for("a store that is gone", || {
        let fault = &away.json("/v1/mqtt")["frames"]["fault"]["message"];
        let waits = "frames wait at the broker: the store's file was moved away";
        fault.as_str()?.starts_with(waits).then_some(())
    });
    away.kill();
    std::fs::rename(&moved, &store).unwrap();
    [3].into_iter().for_each(&post);
    let back = collector(at.path(), &broker.url(), &[]);
    wait_for_stored(&back, 20);
    let audit = back.json("/v1/audit");
    assert!(!audit.to_string().contains("unnumbered"), "{audit}");
    assert_eq!(back.stop().code, 0);
}

#[test]
fn pixels_without_a_number_are_numbered_and_stamped_on_arrival() {
    let Some(broker) = Broker::start("pixels_without_a_number_are_numbered_and_stamped_on_arrival")
    else {
        return;
    };
    let at = tempfile::tempdir().unwrap();
    let collector = collector(at.path(), &broker.url(), &[]);
    wait_for_subscription(&collector);
    let recording = collector.start_recording("mqtt");
    // Table of the datasheet: 0.25 °C a step, negative ones in two's complement of twelve bits.
    let mut celsius = vec!["20.0"; 64];
    celsius[0] = "21.25";
    celsius[1] = "-0.25";
    celsius[63] = "125.1";
    let text = celsius.join(", ");
    for payload in [text.clone(), format!("[{text}]")] {
        broker.publish("grideye/esp-1/lounge/pixels", payload.as_bytes(), false);
    }
    wait_for_stored(&collector, 2);
    let rows = rows(&collector, recording);
    assert_eq!(rows.len(), 2);
    for (row, seq) in rows.iter().zip(0..) {
        assert_eq!(
            (row.stream.device.as_str(), row.stream.sensor.as_str()),
            ("esp-1", "lounge")
        );
        assert!(row.stream.boot.starts_with("unnumbered-"), "{row:?}");
        assert_eq!(row.record.seq, seq);
        let frame = row.record.reading.frame().unwrap();
        assert!(frame.thermistor.is_none());
        let words = [0, 1, 2, 63].map(|pixel| frame.pixels[pixel].0);
        assert_eq!(words, [0x055, 0xFFF, 0x050, 0x1F4]);
    }
    assert!(rows[0].record.stamp.t_boot_ns < rows[1].record.stamp.t_boot_ns);
    assert_eq!(collector.stop().code, 0);
}

#[test]
fn what_is_no_frame_is_refused_once_by_its_topic_and_stops_nothing() {
    let Some(broker) =
        Broker::start("what_is_no_frame_is_refused_once_by_its_topic_and_stops_nothing")
    else {
        return;
    };
    let frames = varied();
    let post = batch("s1", 0, &frames[..5]).to_string();
    let pixels = vec!["20"; 64].join(",");
    let short = vec!["20"; 63].join(",");
    let hot = format!("600,{short}");
    // Longer than a post may be.
    let long = " ".repeat(3 << 20);
    let refused: [(&str, &str, bool, &str); 7] = [
        (
            "grideye/other/frames",
            &post,
            false,
            "a post of the device pi-1 came under the topic of other",
        ),
        (
            "grideye/pi-2/frames",
            "{}",
            false,
            "device: expected a value, found none",
        ),
        ("grideye/pi-3/frames", &long, false, "a message may have 2"),
        (
            "grideye/a/s/pixels",
            &short,
            false,
            "expected 64 pixels, found 63",
        ),
        (
            "grideye/b/s/pixels",
            &hot,
            false,
            "pixel 1: temperature out of range",
        ),
        (
            "grideye/c/s/pixels",
            &pixels,
            true,
            "a retained frame is an old one",
        ),
        (
            "grideye/d/s 1/pixels",
            &pixels,
            false,
            "expected a name of 1 to 64 characters",
        ),
    ];
    let kept = refused.iter().filter(|(_, _, retain, _)| *retain);
    kept.for_each(|(topic, payload, ..)| broker.publish(topic, payload.as_bytes(), true));
    let at = tempfile::tempdir().unwrap();
    let collector = collector(at.path(), &broker.url(), &[]);
    wait_for_subscription(&collector);
    let others = refused.iter().filter(|(_, _, retain, _)| !*retain);
    others.cycle().take(12).for_each(|(topic, payload, ..)| {
        broker.publish(topic, payload.as_bytes(), false);
    });
    broker.publish(POSTS, post.as_bytes(), false);
    wait_for_stored(&collector, 5);
    assert_eq!(collector.json("/v1/mqtt")["frames"]["refused"], 13);
    let log = collector.stop().stderr;
    for (topic, _payload, _retain, what) in refused {
        let told: Vec<&str> = log.lines().filter(|line| line.contains(topic)).collect();
        assert!(
            told.len() == 1 && told[0].contains(what),
            "{topic}: {told:?} in {log}"
        );
    }
}
