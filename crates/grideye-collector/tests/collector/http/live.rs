//! `GET /v1/live`: the events for a page.

use crate::batches::{bare, batch, flat, missing, numbered, part};
use crate::http::client::Client;
use crate::server::Server;
use axum::http::StatusCode;
use grideye_collector::Limits;
use grideye_frame::NoData;
use serde_json::json;

#[tokio::test]
async fn a_client_gets_the_state_and_then_every_batch_in_degrees() {
    let server = Server::new().await;
    server.frames(&numbered(0..2)).await;
    let mut client = Client::of(&server).await;
    let (name, snapshot) = client.next().await;
    assert_eq!(
        (name.as_str(), &snapshot["sensors"][0]["frames"][0]["seq"]),
        ("snapshot", &json!(1))
    );

    let records = vec![
        flat(2, 0x80, 0x190),
        missing(3, NoData::Nack),
        flat(4, 0xFDC, 0x8BB),
        bare(flat(5, 0x80, 0)),
    ];
    server
        .frames(&batch("pi-1", "b1", vec![part("s1", records)]))
        .await;
    let (name, event) = client.next().await;
    let sensor = &event["sensors"][0];
    let frames = &sensor["frames"];
    assert_eq!(
        (name.as_str(), &sensor["stored"], &sensor["missing"]),
        ("frames", &json!(5), &json!(1))
    );
    // AMG88 spec §4-11-11 and -12, printed rows: 0x080 is 32 °C, 0xFDC is -9 °C; thermistor 0x190 is 25 °C, 0x8BB is
    // -11.6875 °C (sign and magnitude).
    assert_eq!(
        (
            &frames[0]["pixels_celsius"][0],
            &frames[0]["thermistor_celsius"]
        ),
        (&json!(32.0), &json!(25.0))
    );
    assert_eq!(
        (&frames[1]["seq"], &frames[1]["missing"]),
        (&json!(3), &json!("nack"))
    );
    assert_eq!(
        (
            &frames[2]["pixels_celsius"][63],
            &frames[2]["thermistor_celsius"]
        ),
        (&json!(-9.0), &json!(-11.6875))
    );
    assert_eq!(frames[3]["thermistor_celsius"], json!(null));

    // Repeated frames are not sent again.
    server.frames(&numbered(0..2)).await;
    let (_, event) = client.next().await;
    assert_eq!(event["sensors"][0]["frames"], json!([]));
}

#[tokio::test]
async fn a_lagging_client_gets_a_notice_and_the_state() {
    let server = Server::with(Limits {
        live_lag_max: 4,
        ..Limits::default()
    })
    .await;
    let mut client = Client::of(&server).await;
    assert_eq!(client.next().await.0, "snapshot");
    for seq in 0..40 {
        let reply = server.frames(&numbered([seq])).await;
        assert_eq!(reply.status, StatusCode::OK);
    }
    let mut missed = 0;
    let mut told = 0;
    loop {
        let (name, data) = client.next().await;
        match name.as_str() {
            "frames" => told += 1,
            "lagged" => {
                missed += data["missed"].as_u64().unwrap();
                assert_eq!(client.next().await.0, "snapshot");
            }
            other => panic!("{other}"),
        }
        if told + missed == 40 {
            break;
        }
    }
    assert!(missed >= 30, "{missed}");
}

#[tokio::test]
async fn of_a_long_batch_a_client_gets_the_newest_frames() {
    let server = Server::with(Limits {
        live_frames_max: 3,
        ..Limits::default()
    })
    .await;
    let mut client = Client::of(&server).await;
    client.next().await;
    server.frames(&numbered(0..10)).await;
    let (_, event) = client.next().await;
    let seqs: Vec<_> = event["sensors"][0]["frames"]
        .as_array()
        .unwrap()
        .iter()
        .map(|frame| frame["seq"].clone())
        .collect();
    assert_eq!(seqs, [7, 8, 9]);
}

#[tokio::test(start_paused = true)]
async fn silence_is_filled() {
    let server = Server::new().await;
    let mut client = Client::of(&server).await;
    client.next().await;
    let began = tokio::time::Instant::now();
    assert_eq!(client.next().await.0, "alive");
    assert_eq!(began.elapsed(), Limits::default().live_keep_alive);
}

#[tokio::test]
async fn live_clients_are_limited_and_free_their_place() {
    let server = Server::with(Limits {
        live_clients_max: 1,
        ..Limits::default()
    })
    .await;
    let mut first = Client::of(&server).await;
    first.next().await;
    assert_eq!(
        server.get("/v1/live").await.error(),
        (503, "too_many_live_clients".to_owned(), None)
    );
    drop(first);
    // The place is freed once the feed notices.
    for _ in 0..100 {
        tokio::task::yield_now().await;
    }
    Client::of(&server).await.next().await;
}
