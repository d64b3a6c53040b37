//! Recordings over HTTP: start, list, stop, read.

use crate::batches::{batch, frame, missing, numbered, part};
use crate::server::{Reply, START_UTC_NS, Server};
use axum::http::{StatusCode, header};
use grideye_collector::Limits;
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
