//! `POST /v1/frames`: what is stored, what is rejected, and its limits.

use crate::batches::{account, batch, counted, flat, frame, numbered, part};
use crate::server::{Reply, START_UTC_NS, Server, request};
use axum::body::{Body, Bytes};
use axum::http::{Method, StatusCode, header};
use grideye_collector::store::StoreLocation;
use grideye_collector::{FrameStore, Limits, SqliteStore};
use grideye_recording::wire::{BINARY_TYPE, Batch, FRAMES_MAX};
use serde_json::{Value, json};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio_stream::StreamExt;
use tower::ServiceExt;

#[tokio::test]
async fn frames_are_answered_with_what_is_durable() {
    let server = Server::new().await;
    let reply = server.frames(&numbered(0..5)).await;
    assert_eq!(reply.status, StatusCode::OK);
    assert_eq!(reply.headers[header::CONTENT_TYPE], "application/json");
    assert_eq!(
        reply.json(),
        json!({ "durable_through": { "s1": 4 }, "gaps": [] })
    );
    let reply = server.frames(&numbered([7, 9])).await;
    let gaps =
        json!([{ "sensor": "s1", "from": 5, "to": 6 }, { "sensor": "s1", "from": 8, "to": 8 }]);
    assert_eq!(
        reply.json(),
        json!({ "durable_through": { "s1": 9 }, "gaps": gaps })
    );
    let nothing = server.frames(&batch("pi-1", "b1", vec![])).await;
    assert_eq!(nothing.json(), json!({ "durable_through": {}, "gaps": [] }));
}

#[tokio::test]
async fn the_body_that_the_design_shows_is_taken() {
    let server = Server::new().await;
    let pixels = vec!["80"; 64].join(",");
    let body = format!(
        r#"{{"device":"pi-1","boot":"b","sensors":[{{"sensor":"i2c-1:0x69","frames":[{{"seq":17,"t_boot_ns":5,"t_utc_ns":6,"clock":"synced","thermistor_raw":402,"pixels_raw":[{pixels}]}}]}}]}}"#
    );
    let reply = server.post("/v1/frames", body).await;
    assert_eq!(reply.json()["durable_through"], json!({ "i2c-1:0x69": 17 }));
    let frame = server.sensor().await["frame"].clone();
    // AMG88 spec §4-11-11 and -12: 80 steps of 0.25 °C and 402 of 0.0625 °C.
    assert_eq!(
        (&frame["pixels_celsius"][0], &frame["thermistor_celsius"]),
        (&json!(20.0), &json!(25.125))
    );
    assert_eq!(
        (&frame["pixels_raw"][63], &frame["thermistor_raw"]),
        (&json!(80), &json!(402))
    );
}

#[tokio::test]
async fn malformed_bodies_are_refused_by_the_name_of_the_field_and_nothing_is_stored() {
    let server = Server::new().await;
    let good: Value = serde_json::from_slice(&numbered(0..2).to_json().unwrap()).unwrap();
    let changed = |path: &str, value: Value| {
        let mut body = good.clone();
        *body.pointer_mut(path).unwrap() = value;
        body.to_string()
    };
    let second = "/sensors/0/frames/1";
    let mut short = good.clone();
    short["sensors"][0]["frames"][1]["pixels_raw"]
        .as_array_mut()
        .unwrap()
        .pop();
    let cases = [
        (
            changed(&format!("{second}/seq"), json!(-1)),
            422,
            "sensors[0].frames[1].seq",
        ),
        (
            changed(&format!("{second}/clock"), json!("late")),
            422,
            "sensors[0].frames[1].clock",
        ),
        (
            changed(&format!("{second}/pixels_raw/63"), json!(70000)),
            422,
            "sensors[0].frames[1].pixels_raw[63]",
        ),
        (
            changed(&format!("{second}/pixels_raw/0"), json!(20.5)),
            422,
            "sensors[0].frames[1].pixels_raw[0]",
        ),
        (short.to_string(), 422, "sensors[0].frames[1].pixels_raw"),
        (changed("/device", json!("=cmd()")), 422, "device"),
        (changed("/boot", json!(null)), 422, "boot"),
        (
            r#"{"device":"pi-1","boot":"b1","sensors":[],"extra":1}"#.to_owned(),
            422,
            "extra",
        ),
        (r#"{"device":"pi-1","sensors":[]}"#.to_owned(), 422, "boot"),
        (good.to_string()[..200].to_owned(), 400, ""),
        ("NaN".to_owned(), 400, ""),
        (String::new(), 400, ""),
    ];
    for (body, status, field) in cases {
        let reply = server.post("/v1/frames", body.clone()).await;
        let (found, code, at) = reply.error();
        assert_eq!(found, status, "{code} for {body}");
        assert!(at.unwrap().contains(field), "{body}: {}", reply.json());
    }
    assert_eq!(server.streams().await, 0);
}

#[tokio::test]
async fn the_same_key_with_other_content_is_a_conflict_that_names_it() {
    let server = Server::new().await;
    server.frames(&numbered(0..3)).await;
    let forged = batch(
        "pi-1",
        "b1",
        vec![part("s1", vec![flat(2, 80, 400), frame(3)])],
    );
    let reply = server.frames(&forged).await;
    assert_eq!(
        reply.error(),
        (409, "conflict".to_owned(), Some("seq".to_owned()))
    );
    let message = reply.json()["error"]["message"]
        .as_str()
        .unwrap()
        .to_owned();
    assert!(
        message.contains("sensor s1") && message.contains("seq 2"),
        "{message}"
    );
    assert_eq!(server.sensor().await["durable_through"], 2);
}

#[tokio::test]
async fn a_body_may_not_be_larger_than_allowed_announced_or_not() {
    let server = Server::with(Limits {
        body_bytes_max: 3000,
        ..Limits::default()
    })
    .await;
    let fits = numbered(0..5).to_json().unwrap();
    assert!(fits.len() < 3000);
    assert_eq!(server.post("/v1/frames", fits).await.status, StatusCode::OK);
    let pieces = || (0..40).map(|_| Ok::<_, std::io::Error>(Bytes::from(vec![b' '; 100])));
    let unannounced = Body::from_stream(tokio_stream::iter(pieces()));
    assert_eq!(server.post("/v1/frames", unannounced).await.error().0, 413);
    let mut announced = request(Method::POST, "/v1/frames", Body::from(vec![b' '; 3001]));
    announced
        .headers_mut()
        .insert(header::CONTENT_LENGTH, 3001.into());
    let reply = server.send(announced).await;
    assert_eq!(reply.error(), (413, "body_too_large".to_owned(), None));
}

#[tokio::test]
async fn a_batch_may_not_hold_more_than_allowed() {
    let server = Server::new().await;
    let most = u64::try_from(FRAMES_MAX).unwrap();
    let (status, code, field) = server.frames(&numbered(0..most + 1)).await.error();
    assert_eq!((status, code.as_str()), (413, "too_many"));
    assert!(field.unwrap().contains("frames"));
    assert_eq!(
        server.frames(&numbered(0..most)).await.status,
        StatusCode::OK
    );
}

#[tokio::test]
async fn another_type_than_json_is_not_guessed_at() {
    let server = Server::new().await;
    let mut form = request(Method::POST, "/v1/frames", Body::from("{}"));
    form.headers_mut().insert(
        header::CONTENT_TYPE,
        "application/x-www-form-urlencoded".parse().unwrap(),
    );
    assert_eq!(
        server.send(form).await.error(),
        (415, "not_json".to_owned(), Some("content-type".to_owned()))
    );
    let mut charset = request(
        Method::POST,
        "/v1/frames",
        numbered(0..1).to_json().unwrap().into(),
    );
    charset.headers_mut().insert(
        header::CONTENT_TYPE,
        "Application/JSON; charset=utf-8".parse().unwrap(),
    );
    assert_eq!(server.send(charset).await.status, StatusCode::OK);
}

#[tokio::test]
async fn a_sensor_more_than_are_shown_displaces_the_one_that_was_silent_longest() {
    let server = Server::with(Limits {
        sensors_max: 2,
        ..Limits::default()
    })
    .await;
    for (device, sensor) in [("pi-1", "s1"), ("pi-1", "s2"), ("pi-2", "s1")] {
        let one = batch(device, "b1", vec![part(sensor, vec![frame(0)])]);
        assert_eq!(server.frames(&one).await.status, StatusCode::OK);
        server.clock.pass(Duration::from_secs(1));
    }
    let shown = server.get("/v1/sensors").await.json();
    let names = ["s2", "s1"].map(|name| json!(name));
    let found = shown["sensors"].as_array().unwrap().iter();
    assert!(found.map(|sensor| &sensor["sensor"]).eq(&names), "{shown}");
    assert_eq!(server.streams().await, 3);
}

/// New boots of 32 sensors, one later than the other.
fn new_boot(device: &str, boot: usize) -> Batch {
    let seq = u64::try_from(boot).unwrap();
    let sensors = (0..32).map(|sensor| part(&format!("s{sensor}"), vec![frame(seq)]));
    batch(device, &format!("b{boot}"), sensors.collect())
}

#[tokio::test]
async fn a_store_with_20_000_boots_takes_the_next_one_and_lists_the_newest() {
    let server = Server::new().await;
    let most = Limits::default().streams_listed_max;
    for boot in 0..most / 32 {
        let batch = Arc::new(new_boot("pi-1", boot));
        server.store.append(batch, START_UTC_NS).await.unwrap();
    }
    assert_eq!(server.streams().await, most);
    let next = server.frames(&new_boot("pi-1", most)).await;
    assert_eq!(next.status, StatusCode::OK);
    let audit = server.get("/v1/audit").await.json();
    assert_eq!(audit["unlisted"], 32);
    let streams = audit["streams"].as_array().unwrap();
    assert_eq!(streams.len(), most);
    let newest = format!("b{most}");
    assert!(streams.iter().any(|stream| stream["boot"] == *newest));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn forty_readers_of_the_largest_audit_keep_no_post_waiting() {
    let server = Arc::new(Server::new().await);
    for boot in 0..Limits::default().streams_listed_max / 32 {
        let batch = Arc::new(new_boot("pi-1", boot));
        server.store.append(batch, START_UTC_NS).await.unwrap();
    }
    let mut readers = tokio::task::JoinSet::new();
    for _ in 0..40 {
        let server = Arc::clone(&server);
        readers.spawn(async move { server.get("/v1/audit").await.status.as_u16() });
    }
    let began = Instant::now();
    for first in (0..50).step_by(5) {
        let reply = server.frames(&numbered(first..first + 5)).await;
        assert_eq!(reply.status, StatusCode::OK);
    }
    let took = began.elapsed();
    let read = readers.join_all().await;
    let of = |wanted: u16| read.iter().filter(|status| **status == wanted).count();
    println!(
        "10 posts in {took:?}; {} audits, {} refused",
        of(200),
        of(503)
    );
    assert!(
        of(200) >= 1 && of(503) >= 1 && of(200) + of(503) == 40,
        "{read:?}"
    );
}

#[tokio::test]
async fn a_sender_of_too_many_boots_waits_and_its_known_boots_go_on() {
    let server = Server::new().await;
    let warned = async || server.get("/healthz").await.json()["warnings"].to_string();
    let mut taken = 0;
    let refused = loop {
        let reply = server.frames(&new_boot("pi-1", taken)).await;
        if reply.status != StatusCode::OK {
            break reply;
        }
        taken += 1;
        assert!(taken <= 200);
        // The next one is newer.
        server.clock.pass(Duration::from_millis(1));
        // At four fifths of the limit.
        assert_eq!(
            warned().await.contains("new_boots"),
            5 * 32 * taken >= 4 * 4096,
            "{taken}"
        );
    };
    assert_eq!(taken, 128);
    assert_eq!(refused.error().1, "too_many_boots");
    assert_eq!(refused.headers[header::RETRY_AFTER], "1");
    let mut known = new_boot("pi-1", taken - 1);
    for part in &mut known.sensors {
        part.frames = vec![frame(1000)];
    }
    assert_eq!(server.frames(&known).await.status, StatusCode::OK);
    server.clock.pass(Duration::from_secs(1));
    let later = server.frames(&new_boot("pi-1", taken)).await;
    assert_eq!(later.status, StatusCode::OK);
}

/// A body that never ends.
fn endless() -> Body {
    Body::from_stream(tokio_stream::pending::<Result<Bytes, std::io::Error>>())
}

/// A body with `bytes` at once, and then nothing.
fn begun(bytes: usize) -> Body {
    let first = tokio_stream::once(Ok::<_, std::io::Error>(Bytes::from(vec![b' '; bytes])));
    Body::from_stream(first.chain(tokio_stream::pending()))
}

#[tokio::test]
async fn the_memory_for_bodies_goes_by_what_arrived_is_shared_out_and_is_given_back() {
    let limits = Limits {
        body_bytes_max: 40_000,
        bodies_bytes_max: 60_000,
        bodies_bytes_per_sender_max: 50_000,
        ..Limits::default()
    };
    let server = Server::with(limits).await;
    let post = |body| request(Method::POST, "/v1/frames", body);
    let mut open = tokio::task::JoinSet::new();
    let mut open_more = async |bytes: usize| {
        let mut begun = post(begun(bytes));
        begun
            .headers_mut()
            .insert(header::CONTENT_LENGTH, 40_000.into());
        open.spawn(server.router.clone().oneshot(begun));
        tokio::task::yield_now().await;
    };
    // Announces ten times the limit, but almost nothing arrives.
    for _ in 0..15 {
        open_more(1).await;
    }
    open_more(40_000).await;
    let reply = server.send(post(begun(10_001))).await;
    assert_eq!(reply.error(), (429, "too_much_at_once".to_owned(), None));
    assert_eq!(reply.headers[header::RETRY_AFTER], "1");
    open.shutdown().await;
    for first in (0..50).step_by(5) {
        let reply = server.frames(&numbered(first..first + 5)).await;
        assert_eq!(reply.status, StatusCode::OK, "{first}");
    }
}

/// In any pieces, as from a network.
#[tokio::test]
async fn a_body_in_pieces_is_the_same_body() {
    let server = Server::new().await;
    let whole = numbered(0..5).to_json().unwrap();
    for size in [1, 7, whole.len() / 2] {
        let pieces: Vec<_> = whole
            .chunks(size)
            .map(|piece| Ok::<_, std::io::Error>(Bytes::copy_from_slice(piece)))
            .collect();
        let body = Body::from_stream(tokio_stream::iter(pieces));
        let reply = server.post("/v1/frames", body).await;
        assert_eq!(
            reply.json()["durable_through"],
            json!({ "s1": 4 }),
            "{size}"
        );
    }
}

#[tokio::test(start_paused = true)]
async fn a_body_that_does_not_come_is_given_up() {
    let server = Server::new().await;
    let began = tokio::time::Instant::now();
    let reply = server.post("/v1/frames", endless()).await;
    assert_eq!(reply.error(), (408, "body_too_slow".to_owned(), None));
    assert_eq!(began.elapsed(), Limits::default().body_time_max);
}

#[tokio::test]
async fn a_request_that_is_not_done_in_time_is_answered_all_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frames.sqlite");
    let limits = Limits {
        handler_time_max: Duration::from_millis(500),
        ..Limits::default()
    };
    let store = Arc::new(SqliteStore::open(&StoreLocation::File(path.clone()), &limits).unwrap());
    let server = Server::on(store, limits).await;
    let other = rusqlite::Connection::open(path).unwrap();
    other.execute_batch("BEGIN IMMEDIATE").unwrap();
    let reply = server.frames(&numbered(0..5)).await;
    assert_eq!(reply.error(), (504, "too_slow".to_owned(), None));
    other.execute_batch("ROLLBACK").unwrap();
    // It may have been stored meanwhile: sending it again is right either way.
    let again = server.frames(&numbered(0..5)).await;
    assert_eq!(again.json()["durable_through"], json!({ "s1": 4 }));
    assert_eq!(
        server.get("/v1/audit").await.json()["streams"][0]["stored"],
        5
    );
}

#[tokio::test]
async fn a_body_that_nests_too_deep_is_refused_wherever_it_does() {
    let server = Server::new().await;
    let deep = "[".repeat(100_000);
    let objects = r#"{"a":"#.repeat(100_000);
    for inner in [&deep, &objects] {
        for body in [
            inner.clone(),
            format!(r#"{{"device":{inner}"#),
            format!(r#"{{"device":"pi-1","boot":"b","sensors":{inner}"#),
            format!(
                r#"{{"device":"pi-1","boot":"b","sensors":[{{"sensor":"s","frames":[{{"pixels_raw":{inner}"#
            ),
            format!(
                r#"{{"device":"pi-1","boot":"b","sensors":[{{"sensor":"s","account":{{"dropped":{inner}"#
            ),
            format!(r#"{{"x":{inner}"#),
        ] {
            let reply = server.post("/v1/frames", body).await;
            assert!(
                [400, 413, 422].contains(&reply.error().0),
                "{:?}",
                reply.error()
            );
        }
    }
    let (fits, too_deep) = (
        format!(r#"{{"name":{}1{}}}"#, "[".repeat(8), "]".repeat(8)),
        format!(r#"{{"name":{}1{}}}"#, "[".repeat(128), "]".repeat(128)),
    );
    let code = |reply: Reply| (reply.error().0, reply.error().1);
    let fits = code(server.post("/v1/recordings", fits).await);
    assert_eq!(fits, (422, "wrong_value".to_owned()));
    let too_deep = code(server.post("/v1/recordings", too_deep).await);
    assert_eq!(too_deep, (400, "not_json".to_owned()));
}

/// Posts a binary body.
async fn post_bytes(server: &Server, body: Vec<u8>) -> Reply {
    let mut request = request(Method::POST, "/v1/frames", Body::from(body));
    let kind = header::HeaderValue::from_static(BINARY_TYPE);
    request.headers_mut().insert(header::CONTENT_TYPE, kind);
    server.send(request).await
}

#[tokio::test]
async fn a_batch_in_bytes_is_kept_and_refused_as_the_same_batch_in_json() {
    let server = Server::new().await;
    let sent = counted(0..5, account(5, 0, 5));
    let kept = post_bytes(&server, sent.to_binary().unwrap()).await;
    assert_eq!(
        (kept.status, kept.json()["durable_through"]["s1"].as_u64()),
        (StatusCode::OK, Some(4))
    );
    // The same frames in the other form are the same frames.
    let again = server.frames(&sent).await;
    assert_eq!(again.body, kept.body);
    assert_eq!(server.store.streams().await.unwrap()[0].stored, 5);

    let mut forged = sent.clone();
    forged.sensors[0].frames[2].stamp.t_boot_ns += 1;
    let conflict = post_bytes(&server, forged.to_binary().unwrap()).await;
    assert_eq!(conflict.error().0, 409);
    let mut cut = sent.to_binary().unwrap();
    cut.truncate(100);
    let (status, code, field) = post_bytes(&server, cut).await.error();
    assert_eq!((status, code.as_str()), (400, "malformed"));
    assert_eq!(field.as_deref(), Some("sensors[0].frames[0].pixels_raw"));
    let as_json = server.post("/v1/frames", sent.to_binary().unwrap()).await;
    assert_eq!(as_json.error().1, "not_json");
    // Only frames may come in binary.
    let mut recording = request(Method::POST, "/v1/recordings", Body::from(&b"GEB"[..]));
    let kind = header::HeaderValue::from_static(BINARY_TYPE);
    recording.headers_mut().insert(header::CONTENT_TYPE, kind);
    assert_eq!(server.send(recording).await.error().0, 415);
}
