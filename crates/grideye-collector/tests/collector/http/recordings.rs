//! Recordings over HTTP: start, list, stop, read.

use crate::batches::{batch, frame, missing, numbered, part};
use crate::server::{Reply, START_UTC_NS, Server};
use axum::http::{StatusCode, header};
use grideye_collector::{FrameStore as _, Limits};
use grideye_frame::NoData;
use grideye_recording::csv::Reader;
use serde_json::json;
use std::time::Duration;

async fn start(server: &Server, name: &str) -> Reply {
    server
        .post("/v1/recordings", json!({ "name": name }).to_string())
        .await
}

#[tokio::test]
async fn a_recording_is_started_listed_stopped_and_read() {
    let server = Server::with(Limits {
        page_rows: 3,
        ..Limits::default()
    })
    .await;
    server.frames(&numbered(0..2)).await;
    let reply = start(&server, " kitchen, evening é ").await;
    assert_eq!(reply.status, StatusCode::CREATED);
    assert_eq!(reply.headers[header::LOCATION], "/v1/recordings/1");
    let recording = reply.json();
    assert_eq!(
        (&recording["name"], &recording["running"]),
        (&json!("kitchen, evening é"), &json!(true))
    );
    let mut records: Vec<_> = (2..12).map(frame).collect();
    records[4] = missing(6, NoData::HostStalled);
    server
        .frames(&batch("pi-1", "b1", vec![part("s1", records.clone())]))
        .await;
    server.clock.pass(Duration::from_secs(3));
    let stopped = server.post("/v1/recordings/1/stop", "").await.json();
    assert_eq!(
        (&stopped["frames"], &stopped["missing"], &stopped["sensors"]),
        (&json!(9), &json!(1), &json!(1))
    );
    assert_eq!(
        stopped["t_stop_ns"].as_i64().unwrap() - stopped["t_start_ns"].as_i64().unwrap(),
        3_000_000_000
    );
    server.frames(&numbered(12..14)).await;
    assert_eq!(
        server.get("/v1/recordings").await.json(),
        json!({ "recordings": [stopped] })
    );
    assert_eq!(server.get("/v1/recordings/1").await.json(), stopped);

    let csv = server.get("/v1/recordings/1.csv").await;
    assert_eq!(
        csv.headers[header::CONTENT_TYPE],
        "text/csv; charset=utf-8; header=present"
    );
    assert_eq!(
        csv.headers[header::CONTENT_DISPOSITION],
        "attachment; filename=\"kitchen, evening _.csv\"; filename*=UTF-8''kitchen%2C%20evening%20%C3%A9.csv"
    );
    let rows: Vec<_> = Reader::new(&csv.body[..])
        .unwrap()
        .collect::<Result<_, _>>()
        .unwrap();
    // The format keeps the twelve meaningful bits.
    let seqs: Vec<_> = rows.iter().map(|row| row.record.seq).collect();
    assert_eq!(seqs, Vec::from_iter(2..12));
    assert_eq!(rows[4].record, records[4]);
    assert_eq!(rows[0].record.stamp, records[0].stamp);
    assert_eq!(rows[0].t_arrival_ns, Some(START_UTC_NS));
}

#[tokio::test]
async fn an_empty_recording_is_a_file_with_a_header() {
    let server = Server::new().await;
    start(&server, "empty").await;
    let csv = server.get("/v1/recordings/1.csv").await;
    assert_eq!(Reader::new(&csv.body[..]).unwrap().count(), 0);
}

#[tokio::test]
async fn names_that_cannot_be_are_refused_with_what_to_do() {
    let server = Server::new().await;
    start(&server, "kitchen").await;
    let taken = start(&server, "kitchen").await;
    assert_eq!(
        taken.error(),
        (409, "name_taken".to_owned(), Some("name".to_owned()))
    );
    assert!(
        taken.json()["error"]["hint"]
            .as_str()
            .unwrap()
            .contains("choose another name")
    );
    for bad in [
        "",
        "  ",
        ".hidden",
        "../up",
        "a/b",
        "a\\b",
        "line\nbreak",
        "evil\u{202e}vsc.exe",
        "a\u{2066}b",
        "a\u{200f}b",
        "a\u{2028}b",
        "a\u{9b}b",
        "a\"b",
        &"x".repeat(65),
    ] {
        assert_eq!(start(&server, bad).await.error().0, 422, "{bad:?}");
    }
    assert_eq!(
        start(&server, &"é".repeat(64)).await.status,
        StatusCode::CREATED
    );
    let cases = [
        ("{}", 422),
        ("[]", 422),
        (r#"{"name":1}"#, 422),
        (r#"{"name":"a","id":1}"#, 422),
        ("", 400),
        ("{", 400),
    ];
    for (body, status) in cases {
        assert_eq!(
            server.post("/v1/recordings", body).await.error().0,
            status,
            "{body}"
        );
    }
}

#[tokio::test]
async fn recordings_that_are_not_there_cannot_be_stopped_or_read() {
    let server = Server::new().await;
    for path in [
        "/v1/recordings/1",
        "/v1/recordings/1.csv",
        "/v1/recordings/x.csv",
        "/v1/recordings/-1",
        "/v1/recordings/..%2f",
    ] {
        assert_eq!(server.get(path).await.error().0, 404, "{path}");
    }
    assert_eq!(
        server.post("/v1/recordings/1/stop", "").await.error().0,
        404
    );
    start(&server, "once").await;
    server.post("/v1/recordings/1/stop", "").await;
    assert_eq!(
        server.post("/v1/recordings/1/stop", "").await.error(),
        (409, "not_running".to_owned(), None)
    );
}

#[tokio::test]
async fn a_recording_is_deleted_once_and_its_frames_stay() {
    let server = Server::new().await;
    start(&server, "kitchen").await;
    server.frames(&numbered(0..3)).await;
    let deleted = server.delete("/v1/recordings/1").await;
    assert_eq!((deleted.status.as_u16(), deleted.body.len()), (204, 0));
    let file = server.post("/v1/recordings/1.csv", "").await;
    assert_eq!(file.headers[header::ALLOW], "GET,HEAD");
    let itself = server.post("/v1/recordings/1", "").await;
    assert_eq!(itself.headers[header::ALLOW], "GET,HEAD,DELETE");
    for path in ["/v1/recordings/1", "/v1/recordings/1.csv"] {
        assert_eq!(server.get(path).await.error().0, 404, "{path}");
        assert_eq!(server.delete(path).await.error().0, 404, "{path}");
    }
    let stored = &server.get("/v1/audit").await.json()["streams"][0]["stored"];
    assert_eq!(stored, 3);
    // Its name is free, its number is not.
    assert_eq!(start(&server, "kitchen").await.json()["id"], 2);
}

/// Whether recording 1 runs, after the collector has had time to look.
async fn runs(server: &Server) -> bool {
    tokio::time::sleep(Duration::from_millis(4500)).await;
    let recording = server.get("/v1/recordings/1").await.json();
    recording["running"].as_bool().unwrap()
}

#[tokio::test]
async fn a_recording_that_nobody_renews_any_more_ends_and_one_without_a_lease_goes_on() {
    let server = Server::new().await;
    for name in ["by a program", "by a person"] {
        assert_eq!(start(&server, name).await.status, StatusCode::CREATED);
    }
    let renew = async || server.post("/v1/recordings/1/renew", "").await;
    let lease_s = renew().await.json()["lease_s"].as_u64().unwrap();
    let lease = Duration::from_secs(lease_s);
    assert!(runs(&server).await);
    server.clock.pass(lease - Duration::from_secs(1));
    assert_eq!(renew().await.status, StatusCode::OK);
    assert!(runs(&server).await);
    server.clock.pass(lease - Duration::from_secs(1));
    assert!(runs(&server).await);
    server.clock.pass(Duration::from_secs(1));
    assert!(!runs(&server).await);
    assert_eq!(renew().await.error().1, "not_running");
    let other = server.get("/v1/recordings/2").await.json();
    assert_eq!(other["running"], true);
}

#[tokio::test]
async fn the_last_recording_is_announced_long_before_and_makes_room_by_a_deletion() {
    let server = Server::new().await;
    let most = Limits::default().recordings_max;
    let warns = async || {
        let said = server.get("/healthz").await.json()["warnings"].to_string();
        said.contains("recordings: ")
    };
    for number in 1..=most {
        let name = format!("r{number}");
        server.store.start_recording(name, 1).await.unwrap();
        if number == most / 5 * 4 - 1 {
            assert!(!warns().await);
        }
    }
    assert!(warns().await);
    let metrics = server.get("/metrics").await.body;
    let line = format!("grideye_limit_used{{limit=\"recordings\"}} {most}\n");
    assert!(String::from_utf8_lossy(&metrics).contains(&line));
    let refused = start(&server, "one more").await;
    assert_eq!(refused.error().1, "too_many_recordings");
    let hint = refused.json()["error"]["hint"].to_string();
    assert!(hint.contains("grideye record NAME --delete"), "{hint}");
    assert_eq!(server.delete("/v1/recordings/17").await.status, 204);
    assert_eq!(start(&server, "one more").await.status, StatusCode::CREATED);
}
