//! A broker that is absent, or accepts nothing.

use crate::feed::{collector, varied};
use grideye_tests::broker::Broker;
use grideye_tests::live_page::batch;
use grideye_tests::patience::wait_for;
use grideye_tests::programs::RunningCollector;
use std::io::{Read as _, Write as _};
use std::net::TcpListener;

/// Devices of a site, and sensors per device: as many as one batch may hold.
const DEVICES: u64 = 13;
const SENSORS: u64 = 32;
/// If the bridge queued, it would hold 416 images of 2 kB for each poll in half a minute: 50 MB.
const GROWTH_KIB_MAX: u64 = 24 * 1024;
/// Sensors that the bridge publishes.
const TOLD_MAX: u64 = 512;

/// Posts a frame of each sensor of `devices` devices; every batch must be stored.
fn post(collector: &RunningCollector, devices: u64, seq: u64) {
    let url = format!("{}/v1/frames", collector.url());
    let frames = varied();
    let index = usize::try_from(seq).unwrap() % frames.len();
    let mut crowd = batch("s0", seq, &frames[index..=index]);
    let first = crowd["sensors"][0].clone();
    let sensors = (0..SENSORS).map(|number| {
        let mut sensor = first.clone();
        sensor["sensor"] = format!("s{number}").into();
        sensor
    });
    crowd["sensors"] = sensors.collect();
    for device in 0..devices {
        crowd["device"] = format!("pi-{device}").into();
        let answer = ureq::post(&url).send_json(&crowd).unwrap();
        assert_eq!(answer.status(), 200);
    }
}

/// Nobody listens on this port, which is reserved for tcpmux, an obsolete service.
const ABSENT: &str = "mqtt://127.0.0.1:1";

/// A broker that accepts connections and then reads nothing more.
fn stalled_broker() -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    std::thread::spawn(move || {
        let mut held = Vec::new();
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            // It reads only the start of the greeting and nothing after it.
            let _ = stream.read(&mut [0; 64]);
            let _ = stream.write_all(&[0x20, 2, 0, 0]);
            held.push(stream);
        }
    });
    format!("mqtt://{address}")
}

#[test]
fn a_broker_that_takes_nothing_or_is_not_there_costs_no_frame_and_no_memory() {
    for (url, message) in [
        (stalled_broker(), "the broker did not answer within"),
        (ABSENT.to_owned(), "cannot reach the broker: "),
    ] {
        let at = tempfile::tempdir().unwrap();
        let collector = collector(at.path(), &url, &[]);
        let mut seq = 0;
        wait_for(message, || {
            post(&collector, DEVICES, seq);
            seq += 1;
            let status = collector.json("/v1/mqtt");
            let fault = status["fault"]["message"].as_str();
            fault
                .is_some_and(|text| text.starts_with(message))
                .then_some(())
        });
        let before_kib = collector.peak_kib();
        for _ in 0..60 {
            post(&collector, DEVICES, seq);
            seq += 1;
        }
        // The kernel counts in portions of a processor: what it says of a peak may be a little less later.
        let grown_kib = collector.peak_kib().saturating_sub(before_kib);
        println!("{url}: {before_kib} KiB at the peak, {grown_kib} KiB more after {seq} rounds");
        assert!(grown_kib < GROWTH_KIB_MAX, "{url}: {grown_kib} KiB more");
        let sensors = collector.json("/v1/sensors");
        let sensors = sensors["sensors"].as_array().unwrap();
        assert_eq!(u64::try_from(sensors.len()).unwrap(), DEVICES * SENSORS);
        assert!(sensors.iter().all(|sensor| sensor["stored"] == seq));
        assert_eq!(collector.stop().code, 0);
    }
}

#[test]
fn too_many_sensors_are_logged_once_and_the_rest_are_published() {
    let what = "too_many_sensors_are_logged_once_and_the_rest_are_published";
    let Some(broker) = Broker::start(what) else {
        return;
    };
    let at = tempfile::tempdir().unwrap();
    let collector = collector(at.path(), &broker.url(), &[]);
    let devices = TOLD_MAX / SENSORS + 1;
    let mut seq = 0;
    wait_for("as many sensors as are told of", || {
        post(&collector, devices, seq);
        seq += 1;
        (collector.json("/v1/mqtt")["sensors"] == TOLD_MAX).then_some(())
    });
    let cameras = broker.kept();
    let cameras = cameras
        .iter()
        .filter(|kept| kept.topic.ends_with("/image/config"));
    assert_eq!(u64::try_from(cameras.count()).unwrap(), TOLD_MAX);
    let log = collector.stop().stderr;
    assert_eq!(log.matches("mqtt_too_many_sensors").count(), 1, "{log}");
}
