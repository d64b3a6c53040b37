//! What the health pages show, and which requests get them.

use super::status::{Look, SensorLook};
use super::*;
use crate::queue::{Delivery, Ring, Seen, Shared};
use grideye_frame::{NoData, PIXELS, PixelWord, Reading, RecordedFrame, ThermistorWord};
use grideye_recording::wire::Account;
use grideye_recording::{ClockState, Record, Stamp};
use serde_json::{Value, json};
use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::time::{Duration, Instant};

const NAMES: [&str; 2] = ["i2c-1:0x68", "i2c-1:0x69"];

fn health() -> Health {
    let names = NAMES.map(str::to_owned).to_vec();
    let ring = Ring::new(100, "pi-1", "b", names.clone());
    let identity = Identity {
        device: "pi-1".to_owned(),
        boot: "b".to_owned(),
        collector: "https://pc:8833".to_owned(),
        spool_mode: "ram",
        sensors: names,
    };
    Health::new(Arc::new(Shared::new(ring, None)), identity)
}

fn record(seq: u64, missing: Option<NoData>) -> Record {
    let frame = RecordedFrame {
        thermistor: Some(ThermistorWord(402)),
        pixels: [PixelWord(80); PIXELS],
    };
    Record {
        seq,
        stamp: Stamp {
            t_boot_ns: seq,
            t_utc_ns: 0,
            clock: ClockState::Stepped,
        },
        reading: missing.map_or(Reading::Frame(frame), Reading::NoData),
    }
}

fn push(health: &Health, stream: usize, record: Record) {
    let now = health.shared.now();
    health.shared.notes().saw(stream, &record, now);
    let shared = &health.shared;
    shared.with_ring(|ring| ring.push(stream, record, now));
}

#[test]
fn the_status_is_degraded_from_a_failed_post_to_the_next_accepted_one() {
    let health = health();
    assert_eq!(health.to_json()["status"], "ok");
    let notes = || health.shared.notes();
    notes().failed("status 503: busy\nhint: wait");
    notes().failed("status 503: busy\nhint: wait");
    let json = health.to_json();
    assert_eq!(json["status"], "degraded");
    assert_eq!(json["why"], json!(["delivery: status 503: busy"]));
    assert_eq!(json["delivery"]["failures_in_a_row"], 2);
    assert!(health.to_prometheus().contains("\ngrideye_agent_up 0\n"));
    notes().accepted(health.shared.now());
    let json = health.to_json();
    assert_eq!(json["status"], "ok");
    assert_eq!(json["delivery"]["posts_failed"], 2);
    assert_eq!(json["delivery"]["posts_accepted"], 1);
    assert_eq!(json["delivery"]["failures_in_a_row"], 0);
    assert!(health.to_prometheus().contains("\ngrideye_agent_up 1\n"));
}

#[test]
fn a_sensor_with_missing_frames_only_is_silent_and_the_other_is_not() {
    let look = |silent_s: u64, other_s: u64| {
        let sensor = |name: &str, at_s: u64| SensorLook {
            name: name.to_owned(),
            account: Account::default(),
            acknowledged: 0,
            seen: Some(Seen {
                seq: 1,
                frame_at: Duration::from_secs(100 - at_s),
                clock: ClockState::Synced,
                missing: None,
            }),
        };
        Look {
            now: Duration::from_secs(100),
            delivery: Delivery::default(),
            held: 0,
            spool: None,
            sensors: vec![sensor("a", silent_s), sensor("b", other_s)],
        }
    };
    assert_eq!(look(11, 10).faults(), ["a: no frame for 11 s"]);
    assert!(look(10, 0).faults().is_empty());

    let health = health();
    let notes = || health.shared.notes();
    notes().saw(0, &record(1, None), Duration::from_secs(3));
    notes().saw(0, &record(2, Some(NoData::Nack)), Duration::from_secs(9));
    let seen = notes().seen[&0];
    assert_eq!((seen.seq, seen.frame_at), (2, Duration::from_secs(3)));
    assert_eq!(seen.missing, Some(NoData::Nack));
    assert!(!notes().seen.contains_key(&1));
}

#[test]
fn json_and_metrics_agree_about_each_sensor() {
    let health = health();
    push(&health, 0, record(1, None));
    push(&health, 1, record(1, None));
    push(&health, 1, record(2, Some(NoData::Nack)));
    health.shared.with_ring(|ring| ring.count_fault(1, "nack"));
    let json = health.to_json();
    assert_eq!(json["records_in_memory"], 3);
    for (index, key, expected) in [
        (0, "sensor", json!(NAMES[0])),
        (0, "read", json!(1)),
        (0, "missing_now", json!(null)),
        (1, "read", json!(1)),
        (1, "missing", json!(1)),
        (1, "spooled", json!(1)),
        (1, "missing_now", json!("nack")),
        (1, "clock", json!("stepped")),
    ] {
        assert_eq!(json["sensors"][index][key], expected, "{key} of {index}");
    }
    let text = health.to_prometheus();
    for line in [
        "grideye_agent_sensor_read_total{sensor=\"i2c-1:0x68\"} 1",
        "grideye_agent_sensor_missing_total{sensor=\"i2c-1:0x69\"} 1",
        "grideye_agent_sensor_spooled{sensor=\"i2c-1:0x69\"} 1",
        "grideye_agent_sensor_errors_total{sensor=\"i2c-1:0x69\",reason=\"nack\"} 1",
        "grideye_agent_sensor_clock{sensor=\"i2c-1:0x69\",state=\"stepped\"} 1",
        "grideye_agent_sensor_clock{sensor=\"i2c-1:0x69\",state=\"synced\"} 0",
        "grideye_agent_memory_records 3",
    ] {
        assert!(text.lines().any(|found| found == line), "{line}\n{text}");
    }
}

fn served(health: Health) -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    // The thread ends with the test process.
    std::thread::spawn(move || serve(&listener, &health));
    address
}

/// The answer to these bytes, or the part that came before a reset if the server did not read all of them.
fn ask(address: SocketAddr, request: &[u8]) -> String {
    let mut stream = TcpStream::connect(address).unwrap();
    let _ = stream.write_all(request);
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    String::from_utf8(answer).unwrap()
}

#[test]
fn only_two_pages_are_served_and_only_to_this_machine() {
    let address = served(health());
    let get = |path: &str| {
        let request = format!("GET {path} HTTP/1.1\r\nhost: {address}\r\n\r\n");
        ask(address, request.as_bytes())
    };
    let health = get("/health");
    assert!(health.starts_with("HTTP/1.1 200 OK\r\n"), "{health}");
    let body = health.split_once("\r\n\r\n").unwrap().1;
    let body: Value = serde_json::from_str(body).unwrap();
    assert_eq!(body["device"], "pi-1");
    assert!(get("/metrics").contains("# TYPE grideye_agent_posts_total counter\n"));
    let (local, ours) = ("host: localhost\r\n", "/health HTTP/1.1\r\n");
    for (request, status) in [
        (format!("GET /../etc/passwd HTTP/1.1\r\n{local}"), "404"),
        (format!("POST {ours}{local}"), "405"),
        (format!("GET {ours}host: evil.example\r\n"), "403"),
        (format!("GET {ours}{local}{local}"), "403"),
        ("GET /health HTTP/1.0\r\n".to_owned(), "403"),
        ("\r\n".to_owned(), "403"),
    ] {
        let answer = ask(address, format!("{request}\r\n").as_bytes());
        let expected = format!("HTTP/1.1 {status}");
        assert!(answer.starts_with(&expected), "{request:?}: {answer}");
    }
}

#[test]
fn a_slow_or_long_request_is_cut_off_and_the_next_gets_an_answer() {
    let address = served(health());
    let long = vec![b'x'; REQUEST_BYTES_MAX + 1];
    let answer = ask(address, &long);
    let is_cut = answer.is_empty() || answer.starts_with("HTTP/1.1 431");
    assert!(is_cut, "{answer}");
    let begun = Instant::now();
    let _silent = TcpStream::connect(address).unwrap();
    let answer = ask(address, b"GET /health HTTP/1.1\r\nhost: localhost\r\n\r\n");
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    let waited = begun.elapsed();
    assert!(
        waited >= REQUEST_TIME_MAX,
        "the first request did not get its full time"
    );
}
