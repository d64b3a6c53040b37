//! The HTTP interface through the router, without a socket.

use crate::batches::{account, batch, counted, flat, frame, missing, numbered, part};
use axum::Router;
use axum::body::{Body, Bytes};
use axum::http::{HeaderMap, Method, Request, StatusCode, header};
use grideye_collector::store::StoreLocation;
use grideye_collector::{AppState, Clock, FrameStore, Limits, SqliteStore, app};
use grideye_frame::{NoData, PixelWord, Reading};
use grideye_recording::csv::Reader;
use grideye_recording::wire::{BINARY_TYPE, Batch};
use serde_json::{Value, json};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use tokio_stream::StreamExt;
use tower::ServiceExt;

/// When the tests begin: 2021-07-01 18:07:27 UTC, as the frames' wall clocks say.
const START_UTC_NS: i64 = 1_625_163_247_000_000_000;

/// A clock that stands still until it is told.
#[derive(Default)]
pub(crate) struct HandClock(AtomicU64);

impl HandClock {
    pub(crate) fn pass(&self, time: Duration) {
        let ms = u64::try_from(time.as_millis()).unwrap();
        self.0.fetch_add(ms, Ordering::SeqCst);
    }
}

impl Clock for HandClock {
    fn utc_ns(&self) -> i64 {
        START_UTC_NS + i64::try_from(self.monotonic().as_nanos()).unwrap()
    }

    fn monotonic(&self) -> Duration {
        Duration::from_millis(self.0.load(Ordering::SeqCst))
    }
}

pub(crate) struct Server {
    router: Router,
    clock: Arc<HandClock>,
    store: Arc<SqliteStore>,
}

pub(crate) struct Reply {
    pub(crate) status: StatusCode,
    pub(crate) headers: HeaderMap,
    pub(crate) body: Bytes,
}

impl Reply {
    pub(crate) fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap()
    }

    /// Status, code and field of an error, after making sure that it is whole.
    #[track_caller]
    pub(crate) fn error(&self) -> (u16, String, Option<String>) {
        let json = self.json();
        let error = json["error"].as_object().unwrap();
        let keys: Vec<_> = error.keys().map(String::as_str).collect();
        assert_eq!(keys, ["code", "field", "hint", "message"]);
        let message = error["message"].as_str().unwrap();
        assert!(
            !message.is_empty() && !message.contains("hint: "),
            "{message}"
        );
        let text = |key: &str| error[key].as_str().map(ToOwned::to_owned);
        (self.status.as_u16(), text("code").unwrap(), text("field"))
    }
}

impl Server {
    pub(crate) async fn new() -> Self {
        Self::with(Limits::default()).await
    }

    pub(crate) async fn with(limits: Limits) -> Self {
        let store = Arc::new(SqliteStore::open(&StoreLocation::Memory, &limits).unwrap());
        Self::on(store, limits).await
    }

    pub(crate) async fn on(store: Arc<SqliteStore>, limits: Limits) -> Self {
        let clock = Arc::new(HandClock::default());
        let state = AppState::new(store.clone(), limits, clock.clone())
            .await
            .unwrap();
        Self {
            router: app(state),
            clock,
            store,
        }
    }

    async fn send(&self, request: Request<Body>) -> Reply {
        let response = self.router.clone().oneshot(request).await.unwrap();
        let (parts, body) = response.into_parts();
        let body = axum::body::to_bytes(body, 1 << 26).await.unwrap();
        Reply {
            status: parts.status,
            headers: parts.headers,
            body,
        }
    }

    pub(crate) async fn get(&self, path: &str) -> Reply {
        self.send(request(Method::GET, path, Body::empty())).await
    }

    pub(crate) async fn post(&self, path: &str, body: impl Into<Body>) -> Reply {
        self.send(request(Method::POST, path, body.into())).await
    }

    pub(crate) async fn delete(&self, path: &str) -> Reply {
        self.send(request(Method::DELETE, path, Body::empty()))
            .await
    }

    pub(crate) async fn frames(&self, batch: &Batch) -> Reply {
        self.post("/v1/frames", batch.to_json().unwrap()).await
    }

    /// The only sensor.
    async fn sensor(&self) -> Value {
        self.get("/v1/sensors").await.json()["sensors"][0].clone()
    }

    async fn streams(&self) -> usize {
        self.get("/v1/audit").await.json()["streams"]
            .as_array()
            .unwrap()
            .len()
    }
}

pub(crate) fn request(method: Method, path: &str, body: Body) -> Request<Body> {
    Request::builder()
        .method(method)
        .uri(path)
        .header(header::HOST, "127.0.0.1:8080")
        .header(header::CONTENT_TYPE, "application/json")
        .body(body)
        .unwrap()
}

// Frames.

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
    let few = grideye_recording::wire::Limits {
        frames: 4,
        ..Default::default()
    };
    let server = Server::with(Limits {
        batch: few,
        ..Limits::default()
    })
    .await;
    let (status, code, field) = server.frames(&numbered(0..5)).await.error();
    assert_eq!((status, code.as_str()), (413, "too_many"));
    assert!(field.unwrap().contains("frames"));
    assert_eq!(server.frames(&numbered(0..4)).await.status, StatusCode::OK);
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
async fn sensors_are_limited() {
    let server = Server::with(Limits {
        sensors_max: 2,
        ..Limits::default()
    })
    .await;
    let two = vec![part("s1", vec![frame(0)]), part("s2", vec![frame(0)])];
    assert_eq!(
        server.frames(&batch("pi-1", "b1", two)).await.status,
        StatusCode::OK
    );
    let third = server
        .frames(&batch("pi-2", "b1", vec![part("s1", vec![frame(0)])]))
        .await;
    assert_eq!(third.error(), (507, "too_many_sensors".to_owned(), None));
    assert_eq!(server.streams().await, 2);
    assert_eq!(
        server.frames(&numbered(0..3)).await.status,
        StatusCode::OK,
        "known sensors go on"
    );
}

/// A body that never ends.
fn endless() -> Body {
    Body::from_stream(tokio_stream::pending::<Result<Bytes, std::io::Error>>())
}

/// A body of which so much comes at once, and then nothing.
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
    // Announced ten times what there is, of which next to nothing came.
    for _ in 0..15 {
        open_more(1).await;
    }
    open_more(40_000).await;
    let reply = server.send(post(begun(10_001))).await;
    assert_eq!(reply.error(), (429, "too_much_at_once".to_owned(), None));
    assert_eq!(reply.headers[header::RETRY_AFTER], "1");
    for _ in 0..4 {
        open_more(4096).await;
    }
    let reply = server.send(post(begun(4000))).await;
    assert_eq!(reply.error(), (503, "busy".to_owned(), None));
    assert_eq!(reply.headers[header::RETRY_AFTER], "1");
    open.shutdown().await;
    for first in (0..50).step_by(5) {
        let reply = server.frames(&numbered(first..first + 5)).await;
        assert_eq!(reply.status, StatusCode::OK, "{first}");
    }
}

/// However it is cut into pieces, as when it comes through the net.
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
        handler_time_max: Duration::from_millis(80),
        ..Limits::default()
    };
    let store = Arc::new(SqliteStore::open(&StoreLocation::File(path.clone()), &limits).unwrap());
    let server = Server::on(store, limits).await;
    let other = rusqlite::Connection::open(path).unwrap();
    other.execute_batch("BEGIN IMMEDIATE").unwrap();
    let reply = server.frames(&numbered(0..5)).await;
    assert_eq!(reply.error(), (504, "too_slow".to_owned(), None));
    other.execute_batch("ROLLBACK").unwrap();
    // It was asked for and may have been stored meanwhile: sending it again is right either way.
    let again = server.frames(&numbered(0..5)).await;
    assert_eq!(again.json()["durable_through"], json!({ "s1": 4 }));
    assert_eq!(
        server.get("/v1/audit").await.json()["streams"][0]["stored"],
        5
    );
}

// The present state.

#[tokio::test]
async fn a_sensors_state_tells_age_rate_and_books() {
    let server = Server::new().await;
    let mut sent = counted(0..21, account(24, 3, 21));
    // Sent 50 ms after the last frame was read, by the device's own clock.
    sent.t_sent_boot_ns = Some(frame(20).stamp.t_boot_ns + 50_000_000);
    server.frames(&sent).await;
    server.clock.pass(Duration::from_millis(200));
    let sensor = server.sensor().await;
    assert_eq!(sensor["device"], "pi-1");
    assert_eq!(sensor["age_s"], 0.25);
    assert_eq!(sensor["frame"]["age_basis"], "boot-clock");
    assert_eq!(sensor["frame"]["seq"], 20);
    assert_eq!(sensor["rate_hz"], 10.0);
    assert_eq!(sensor["read"], 24);
    assert_eq!(sensor["stored"], 21);
    assert_eq!(sensor["dropped"], json!({ "spool-full": 3 }));
    assert_eq!(
        (
            &sensor["spooled"],
            &sensor["unaccounted"],
            &sensor["balanced"]
        ),
        (&json!(0), &json!(0), &json!(true))
    );
    assert_eq!(sensor["errors"], json!({ "nack": 2 }));
    server.clock.pass(Duration::from_secs(6));
    let silent = server.sensor().await;
    assert_eq!(
        (&silent["age_s"], &silent["rate_hz"]),
        (&json!(6.25), &Value::Null)
    );
}

#[tokio::test]
async fn a_device_is_told_with_what_its_agent_says_of_itself() {
    let server = Server::new().await;
    let sent = counted(0..21, account(24, 3, 21));
    server.frames(&sent).await;
    let nobody = server.get("/v1/devices").await.json()["devices"][0].clone();
    assert_eq!(
        (&nobody["agent_version"], &nobody["configuration"]),
        (&Value::Null, &Value::Null),
        "curl says nothing of itself"
    );
    let set_up = json!({ "post_every_ms": 500, "ring_frames": 100, "spool": "ram", "sensors": {} });
    let mut again = request(Method::POST, "/v1/frames", sent.to_json().unwrap().into());
    for (name, value) in [
        ("user-agent", "grideye-agent/9.8.7".to_owned()),
        ("grideye-configuration", set_up.to_string()),
    ] {
        again.headers_mut().insert(name, value.parse().unwrap());
    }
    assert_eq!(server.send(again).await.status, 200);
    let devices = server.get("/v1/devices").await.json();
    assert_eq!(devices["devices"].as_array().unwrap().len(), 1);
    let (device, sensor) = (&devices["devices"][0], server.sensor().await);
    assert_eq!(
        (&device["agent_version"], &device["configuration"]),
        (&json!("9.8.7"), &set_up)
    );
    for (key, of) in [
        ("device", "device"),
        ("boot", "boot"),
        ("age_s", "age_s"),
        ("rate_hz", "rate_hz"),
        ("read", "read"),
        ("stored", "stored"),
        ("backlog", "spooled"),
        ("dropped", "dropped"),
        ("errors", "errors"),
    ] {
        assert_eq!(device[key], sensor[of], "{key}");
    }
    assert_eq!(device["clock"], sensor["frame"]["clock"]);
    let name = device["device"].as_str().unwrap();
    let alone = server.get(&format!("/v1/devices/{name}")).await.json();
    assert_eq!(&alone, device, "one of them is as in the list");
    assert_eq!(
        server.get("/v1/devices/pi-none").await.error(),
        (404, "no_such_device".to_owned(), Some("device".to_owned()))
    );
    // A post that was refused says nothing either.
    let mut refused = request(Method::POST, "/v1/frames", "{}".into());
    let other = "grideye-agent/1".parse().unwrap();
    refused.headers_mut().insert("user-agent", other);
    assert_eq!(server.send(refused).await.status, 422);
    let devices = server.get("/v1/devices").await.json();
    assert_eq!(devices["devices"][0]["agent_version"], "9.8.7");
}

#[tokio::test]
async fn the_age_is_told_by_the_best_clock_that_there_is() {
    let server = Server::new().await;
    // A wall clock that was set: the frame's time is START + seq x 0.1 s.
    server.clock.pass(Duration::from_secs(10));
    server.frames(&numbered([0])).await;
    assert_eq!(server.sensor().await["age_s"], 10.0);
    assert_eq!(server.sensor().await["frame"]["age_basis"], "wall-clock");
    // A wall clock that was never set says nothing.
    let mut unset = frame(1);
    unset.stamp.clock = grideye_recording::ClockState::Unsynced;
    server
        .frames(&batch("pi-1", "b1", vec![part("s1", vec![unset])]))
        .await;
    server.clock.pass(Duration::from_secs(2));
    let sensor = server.sensor().await;
    assert_eq!(
        (&sensor["age_s"], &sensor["frame"]["age_basis"]),
        (&json!(2.0), &json!("arrival"))
    );
}

#[tokio::test]
async fn a_backlog_is_kept_and_never_shown_as_new() {
    let server = Server::new().await;
    let sent_at = |mut batch: Batch, after_frame: u64| {
        batch.t_sent_boot_ns = Some(frame(after_frame).stamp.t_boot_ns);
        batch
    };
    server.frames(&sent_at(numbered(100..105), 105)).await;
    server.frames(&sent_at(numbered(0..100), 106)).await;
    let sensor = server.sensor().await;
    assert_eq!(
        (&sensor["frame"]["seq"], &sensor["stored"]),
        (&json!(104), &json!(105))
    );
    // The run before, which ended a while ago, is delivered late.
    let mut before = numbered(0..50);
    before.boot = "b0".to_owned();
    server.frames(&sent_at(before, 107)).await;
    assert_eq!(server.sensor().await["boot"], "b1");
    // A new run takes over.
    let mut after = numbered([0]);
    after.boot = "b2".to_owned();
    server.clock.pass(Duration::from_secs(1));
    server.frames(&sent_at(after, 0)).await;
    let sensor = server.sensor().await;
    assert_eq!(
        (&sensor["boot"], &sensor["frame"]["seq"], &sensor["stored"]),
        (&json!("b2"), &json!(0), &json!(1))
    );
}

#[tokio::test]
async fn a_frame_that_could_not_be_read_is_said_and_the_last_one_keeps_its_age() {
    let server = Server::new().await;
    server.frames(&numbered(0..5)).await;
    server.clock.pass(Duration::from_secs(1));
    server
        .frames(&batch(
            "pi-1",
            "b1",
            vec![part("s1", vec![missing(5, NoData::BusTimeout)])],
        ))
        .await;
    let sensor = server.sensor().await;
    assert_eq!(sensor["no_frame_now"]["missing"], "bus-timeout");
    assert_eq!(sensor["frame"]["seq"], 4);
    assert_eq!(sensor["missing"], 1);
    server.frames(&numbered([6])).await;
    assert_eq!(server.sensor().await["no_frame_now"], Value::Null);
}

#[tokio::test]
async fn a_run_says_when_it_began_where_its_first_record_was_seen() {
    let server = Server::new().await;
    server.frames(&numbered(0..2)).await;
    let sensor = server.sensor().await;
    assert_eq!(sensor["began_boot_ns"], json!(1_000_000_000_u64));
    // Of this run the first records went elsewhere.
    server.clock.pass(Duration::from_secs(1));
    let late = batch("pi-1", "b2", vec![part("s1", vec![frame(3), frame(4)])]);
    server.frames(&late).await;
    let sensor = server.sensor().await;
    assert_eq!(
        (&sensor["boot"], &sensor["began_boot_ns"]),
        (&json!("b2"), &Value::Null)
    );
}

#[tokio::test]
async fn a_restart_shows_what_was_last_stored_with_its_age() {
    let server = Server::new().await;
    server.frames(&counted(0..5, account(5, 0, 5))).await;
    let before = server.sensor().await;
    let again = Server::on(Arc::clone(&server.store), Limits::default()).await;
    let after = again.sensor().await;
    assert_eq!(after["frame"]["pixels_raw"], before["frame"]["pixels_raw"]);
    assert_eq!((&after["stored"], &after["read"]), (&json!(5), &json!(5)));
}

#[tokio::test]
async fn the_audit_says_whether_the_books_balance() {
    let server = Server::new().await;
    server.frames(&counted(0..5, account(5, 0, 5))).await;
    let audit = server.get("/v1/audit").await.json();
    assert_eq!(
        (&audit["balanced"], &audit["streams"][0]["balanced"]),
        (&json!(true), &json!(true))
    );
    server.frames(&counted(6..10, account(10, 0, 4))).await;
    let audit = server.get("/v1/audit").await.json();
    assert_eq!(
        (&audit["balanced"], &audit["streams"][0]["unaccounted"]),
        (&json!(false), &json!(1))
    );
    assert_eq!(audit["streams"][0]["gaps"], json!([{ "from": 5, "to": 5 }]));
}

#[tokio::test]
async fn two_agents_of_one_name_are_told_with_their_runs_and_lose_nothing() {
    let server = Server::new().await;
    let mut client = Client::of(&server).await;
    client.next().await;
    let post = async |turn: u64, boot: &str, ended: bool| {
        let mut batch = counted(turn..turn + 1, account(1, 0, 1));
        batch.boot = boot.to_owned();
        batch.sensors[0].account.as_mut().unwrap().ended = ended;
        assert_eq!(server.frames(&batch).await.status, StatusCode::OK);
        server.clock.pass(Duration::from_secs(1));
    };
    // An agent that is started again, and delivers what the run before has left.
    for turn in 0..8 {
        post(
            turn,
            ["b1", "b2"][usize::from(turn % 2 == 1)],
            turn % 2 == 0,
        )
        .await;
        let (_, told) = client.next().await;
        assert_eq!(told["sensors"][0]["rivals"], Value::Null);
    }
    assert_eq!(server.get("/v1/audit").await.json()["rivals"], json!([]));
    for turn in 8..14 {
        post(turn, ["b1", "b2"][usize::from(turn % 2 == 1)], false).await;
    }
    let rivals = json!(["b1", "b2"]);
    let mut told = Value::Null;
    for _ in 8..14 {
        told = client.next().await.1;
    }
    assert_eq!(told["sensors"][0]["rivals"], rivals);
    assert_eq!(server.sensor().await["rivals"], rivals);
    let audit = server.get("/v1/audit").await.json();
    assert_eq!(
        audit["rivals"],
        json!([{ "device": "pi-1", "boots": rivals }])
    );
    let stored = audit["streams"].as_array().unwrap().iter();
    assert_eq!(
        stored
            .map(|stream| stream["stored"].as_u64().unwrap())
            .sum::<u64>(),
        14
    );
    // One of them falls silent.
    server.clock.pass(Duration::from_secs(60));
    assert_eq!(server.sensor().await["rivals"], Value::Null);
    assert_eq!(server.get("/v1/audit").await.json()["rivals"], json!([]));
}

// Live events.

/// One client of the events.
struct Client {
    body: axum::body::BodyDataStream,
    text: String,
}

impl Client {
    async fn of(server: &Server) -> Self {
        let response = server
            .router
            .clone()
            .oneshot(request(Method::GET, "/v1/live", Body::empty()))
            .await
            .unwrap();
        assert_eq!(response.status(), StatusCode::OK);
        assert_eq!(
            response.headers()[header::CONTENT_TYPE],
            "text/event-stream"
        );
        Self {
            body: response.into_body().into_data_stream(),
            text: String::new(),
        }
    }

    /// The next event's name and data.
    async fn next(&mut self) -> (String, Value) {
        while !self.text.contains("\n\n") {
            let piece = self.body.next().await.unwrap().unwrap();
            self.text.push_str(std::str::from_utf8(&piece).unwrap());
        }
        let whole = std::mem::take(&mut self.text);
        let (event, rest) = whole.split_once("\n\n").unwrap();
        self.text = rest.to_owned();
        let field = |name: &str| {
            event
                .lines()
                .find_map(|line| line.strip_prefix(name))
                .unwrap()
                .trim()
                .to_owned()
        };
        (
            field("event:"),
            serde_json::from_str(&field("data:")).unwrap(),
        )
    }
}

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
    ];
    server
        .frames(&batch("pi-1", "b1", vec![part("s1", records)]))
        .await;
    let (name, event) = client.next().await;
    let sensor = &event["sensors"][0];
    let frames = &sensor["frames"];
    assert_eq!(
        (name.as_str(), &sensor["stored"], &sensor["missing"]),
        ("frames", &json!(4), &json!(1))
    );
    // AMG88 spec §4-11-11 and -12, printed rows: 0x080 is 32 °C, 0xFDC is -9 °C; thermistor 0x190 is 25 °C,
    // 0x8BB is -11.6875 °C (sign and magnitude).
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

    // What was there before is not told again.
    server.frames(&numbered(0..2)).await;
    let (_, event) = client.next().await;
    assert_eq!(event["sensors"][0]["frames"], json!([]));
}

#[tokio::test]
async fn a_client_that_lags_is_told_and_gets_the_state_again() {
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
async fn live_clients_are_limited_and_leave_their_seat() {
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
    // The seat is left when the feed notices.
    for _ in 0..100 {
        tokio::task::yield_now().await;
    }
    Client::of(&server).await.next().await;
}

// Recordings.

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
    // The format keeps the twelve bits that have a meaning.
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

// Everything else.

#[tokio::test]
async fn health_is_that_of_the_store() {
    let server = Server::new().await;
    let well = server.get("/healthz").await;
    assert_eq!(
        (well.status, &well.json()["status"]),
        (StatusCode::OK, &json!("ok"))
    );
    server.store.close().await.unwrap();
    let ill = server.get("/healthz").await;
    assert_eq!(
        (ill.status, &ill.json()["status"]),
        (StatusCode::SERVICE_UNAVAILABLE, &json!("failing"))
    );
    assert_eq!(
        server.frames(&numbered(0..1)).await.error(),
        (503, "stopping".to_owned(), None)
    );
}

#[tokio::test]
async fn a_store_that_takes_nothing_is_said_to_agents_supervisors_and_pages() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frames.sqlite");
    let limits = Limits {
        store_lock_time_max: Duration::from_millis(20),
        live_keep_alive: Duration::from_millis(20),
        ..Limits::default()
    };
    let store = SqliteStore::open(&StoreLocation::File(path.clone()), &limits).unwrap();
    let server = Server::on(Arc::new(store), limits).await;
    let mut client = Client::of(&server).await;
    assert_eq!(client.next().await.0, "snapshot");
    let well = client.next().await;
    assert_eq!(well, ("alive".to_owned(), json!({ "store": null })));
    let other = rusqlite::Connection::open(path).unwrap();
    other.execute_batch("BEGIN IMMEDIATE").unwrap();
    let refused = server.frames(&numbered(0..1)).await;
    assert_eq!(refused.error(), (503, "store_locked".to_owned(), None));
    assert_eq!(refused.headers[header::RETRY_AFTER], "1");
    assert_eq!(server.get("/healthz").await.status, 503);
    let reason = loop {
        let (_, event) = client.next().await;
        if let Some(reason) = event["store"].as_str() {
            break reason.to_owned();
        }
    };
    assert_eq!(reason, "the store's file is locked by another program");
}

#[tokio::test]
async fn only_bodies_of_frames_may_be_large() {
    let server = Server::with(Limits {
        small_body_bytes_max: 100,
        ..Limits::default()
    })
    .await;
    let named = |spaces| format!("{}{}", " ".repeat(spaces), r#"{"name":"x"}"#);
    let large = server.post("/v1/recordings", named(89)).await;
    assert_eq!(large.error(), (413, "body_too_large".to_owned(), None));
    assert!(
        large.json()["error"]["message"]
            .to_string()
            .contains("100 bytes")
    );
    let fits = server.post("/v1/recordings", named(88)).await;
    assert_eq!(fits.status, StatusCode::CREATED);
    assert_eq!(server.frames(&numbered(0..5)).await.status, StatusCode::OK);
}

#[tokio::test]
async fn unknown_paths_and_wrong_methods_are_said_in_json() {
    let server = Server::new().await;
    for path in [
        "/nothing",
        "/v1",
        "/assets/none.js",
        "/assets/..%2fCargo.toml",
        "//",
    ] {
        assert_eq!(server.get(path).await.error().0, 404, "{path}");
    }
    let wrong = server.get("/v1/frames").await;
    assert_eq!(wrong.error(), (405, "wrong_method".to_owned(), None));
    assert_eq!(wrong.headers[header::ALLOW], "POST");
    assert_eq!(server.post("/healthz", "").await.error().0, 405);
}

#[tokio::test]
async fn every_answer_has_the_security_headers() {
    let server = Server::new().await;
    for path in [
        "/",
        "/assets/main.js",
        "/v1/sensors",
        "/nothing",
        "/v1/frames",
        "/v1/recordings/1.csv",
    ] {
        let headers = server.get(path).await.headers;
        let policy = headers[header::CONTENT_SECURITY_POLICY].to_str().unwrap();
        assert_eq!(
            policy,
            "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
        );
        assert_eq!(headers[header::X_CONTENT_TYPE_OPTIONS], "nosniff", "{path}");
        assert_eq!(headers[header::REFERRER_POLICY], "no-referrer", "{path}");
        assert!(headers.contains_key(header::CACHE_CONTROL), "{path}");
        assert!(
            !headers
                .keys()
                .any(|name| name.as_str().starts_with("access-control")),
            "{path}"
        );
    }
}

/// It is for programs, and short: it allows nothing and is kept nowhere. A refusal may be looked at by a person.
#[tokio::test]
async fn an_acknowledgement_has_those_headers_that_bind_what_is_no_page() {
    let server = Server::new().await;
    let good = server
        .post("/v1/frames", numbered(0..5).to_json().unwrap())
        .await;
    let values: Vec<(&str, &str)> = good
        .headers
        .iter()
        .map(|(name, value)| (name.as_str(), value.to_str().unwrap()))
        .collect();
    assert_eq!(
        values,
        [
            ("content-type", "application/json"),
            ("cache-control", "no-store"),
            ("x-content-type-options", "nosniff"),
            (
                "content-security-policy",
                "default-src 'none'; frame-ancestors 'none'"
            ),
            ("content-length", "38"),
        ]
    );
    let refused = server.post("/v1/frames", "[]").await;
    assert_eq!(refused.status, 422);
    assert_eq!(refused.headers[header::X_FRAME_OPTIONS], "DENY");
}

#[tokio::test]
async fn other_names_for_this_host_are_refused() {
    let server = Server::new().await;
    let with_host = |host: Option<&str>| {
        let mut request = request(Method::GET, "/v1/sensors", Body::empty());
        request.headers_mut().remove(header::HOST);
        if let Some(host) = host {
            request
                .headers_mut()
                .insert(header::HOST, host.parse().unwrap());
        }
        request
    };
    assert_eq!(
        server.send(with_host(Some("localhost:8080"))).await.status,
        StatusCode::OK
    );
    let rebound = server.send(with_host(Some("evil.example:8080"))).await;
    assert_eq!(
        rebound.error(),
        (403, "unknown_host".to_owned(), Some("host".to_owned()))
    );
    let hint = rebound.json()["error"]["hint"].to_string();
    assert!(hint.contains("--host-name"), "{hint}");
    assert_eq!(server.send(with_host(None)).await.error().0, 400);
    let mut two = with_host(Some("localhost"));
    two.headers_mut()
        .append(header::HOST, "localhost".parse().unwrap());
    assert_eq!(server.send(two).await.error().0, 400);
    let mut other_target = request(Method::GET, "http://evil.example/v1/sensors", Body::empty());
    other_target
        .headers_mut()
        .insert(header::HOST, "localhost".parse().unwrap());
    assert_eq!(server.send(other_target).await.error().0, 400);
}

#[tokio::test]
async fn pages_of_other_sites_cannot_write() {
    let server = Server::new().await;
    let from = |origin: &str| {
        let mut request = request(
            Method::POST,
            "/v1/recordings",
            Body::from(r#"{"name":"mine"}"#),
        );
        request
            .headers_mut()
            .insert(header::ORIGIN, origin.parse().unwrap());
        request
    };
    for foreign in [
        "http://evil.example",
        "null",
        "http://127.0.0.1:9999",
        "https://127.0.0.1:8080",
    ] {
        let refused = server.send(from(foreign)).await;
        assert_eq!(
            refused.error(),
            (403, "foreign_origin".to_owned(), Some("origin".to_owned())),
            "{foreign}"
        );
    }
    assert_eq!(
        server.send(from("http://127.0.0.1:8080")).await.status,
        StatusCode::CREATED
    );
}

/// Programs on the way may look at the one, and this one at the other.
#[tokio::test]
async fn a_request_that_names_two_origins_is_refused_whichever_they_are() {
    let server = Server::new().await;
    for method in [Method::GET, Method::POST] {
        for second in ["http://127.0.0.1:8080", "http://evil.example"] {
            let body = Body::from(r#"{"name":"mine"}"#);
            let mut two = request(method.clone(), "/v1/recordings", body);
            for origin in ["http://127.0.0.1:8080", second] {
                let origin = origin.parse().unwrap();
                two.headers_mut().append(header::ORIGIN, origin);
            }
            let refused = server.send(two).await.error();
            let expected = (400, "two_origins".to_owned(), Some("origin".to_owned()));
            assert_eq!(refused, expected, "{method} {second}");
        }
    }
}

#[tokio::test]
async fn the_page_is_made_of_its_own_files_alone() {
    let server = Server::new().await;
    let page = server.get("/").await;
    assert_eq!(
        page.headers[header::CONTENT_TYPE],
        "text/html; charset=utf-8"
    );
    let html = std::str::from_utf8(&page.body).unwrap();
    for forbidden in [
        "<style",
        "style=",
        "onclick",
        "onload",
        "http://",
        "https://",
        "javascript:",
    ] {
        assert!(!html.contains(forbidden), "{forbidden}");
    }
    assert_eq!(
        html.matches("<script").count(),
        html.matches("<script type=\"module\" src=\"/assets/")
            .count()
    );
    let mut parts: Vec<String> = html
        .split('"')
        .filter_map(|text| text.strip_prefix("/assets/"))
        .map(ToOwned::to_owned)
        .collect();
    let mut seen = 0;
    while let Some(name) = parts.get(seen).cloned() {
        seen += 1;
        let part = server.get(&format!("/assets/{name}")).await;
        assert_eq!(part.status, StatusCode::OK, "{name}");
        let expected = match name.rsplit_once('.').unwrap().1 {
            "js" => "text/javascript; charset=utf-8",
            "css" => "text/css; charset=utf-8",
            _ => "image/svg+xml",
        };
        assert_eq!(part.headers[header::CONTENT_TYPE], expected, "{name}");
        let text = std::str::from_utf8(&part.body).unwrap();
        let imports = text
            .split("from \"./")
            .skip(1)
            .filter_map(|rest| rest.split('"').next());
        for import in imports {
            if !parts.iter().any(|known| known == import) {
                parts.push(import.to_owned());
            }
        }
    }
    assert!(parts.len() >= 9, "{parts:?}");
}

// The quota.

#[tokio::test]
async fn a_store_that_may_not_grow_says_so_keeps_what_it_has_and_goes_on_when_it_may() {
    let folder = tempfile::tempdir().unwrap();
    let location = StoreLocation::File(folder.path().join("frames.sqlite"));
    let quota = |bytes| Limits {
        store_bytes_max: Some(bytes),
        ..Limits::default()
    };
    let open = |limits: &Limits| Arc::new(SqliteStore::open(&location, limits).unwrap());
    let small = quota(1 << 20);
    let server = Server::on(open(&small), small).await;
    let mut stored = 0;
    let refused = loop {
        let reply = server.frames(&numbered(stored..stored + 200)).await;
        if reply.status != StatusCode::OK {
            break reply;
        }
        stored += 200;
        assert!(stored < 20_000, "the quota is never reached");
    };
    assert!(stored >= 2000, "{stored} frames of 128 bytes in a MiB");
    assert_eq!(refused.error(), (507, "quota_reached".to_owned(), None));
    assert_eq!(refused.headers[header::RETRY_AFTER], "30");
    let health = server.get("/v1/health").await;
    assert_eq!(
        (health.status.as_u16(), &health.json()["status"]),
        (503, &json!("full"))
    );
    let store = &health.json()["store"];
    assert_eq!(store["bytes_max"], 1 << 20);
    assert!(store["bytes"].as_u64().unwrap() <= 1 << 20);
    assert_eq!(server.get("/healthz").await.json()["status"], "full");
    let metrics = server.get("/metrics").await.body;
    let metrics = String::from_utf8(metrics.to_vec()).unwrap();
    assert!(metrics.contains("\ngrideye_store_up 0\n"), "{metrics}");
    let rows = server.sensor().await["stored"].as_u64();
    assert_eq!(
        rows,
        Some(stored),
        "what was acknowledged is there, and nothing else"
    );
    server.store.close().await.unwrap();

    let larger = quota(8 << 20);
    let server = Server::on(open(&larger), larger).await;
    let reply = server.frames(&numbered(stored..stored + 200)).await;
    assert_eq!(reply.status, StatusCode::OK);
    assert_eq!(server.get("/v1/health").await.json()["status"], "ok");
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
        format!(r#"{{"name":{}1{}}}"#, "[".repeat(7), "]".repeat(7)),
        format!(r#"{{"name":{}1{}}}"#, "[".repeat(8), "]".repeat(8)),
    );
    let code = |reply: Reply| (reply.error().0, reply.error().1);
    let fits = code(server.post("/v1/recordings", fits).await);
    assert_eq!(fits, (422, "wrong_value".to_owned()));
    let too_deep = code(server.post("/v1/recordings", too_deep).await);
    assert_eq!(too_deep, (400, "too_deep".to_owned()));
}

/// A post of bytes.
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
    // Nothing but frames may come in bytes.
    let mut recording = request(Method::POST, "/v1/recordings", Body::from(&b"GEB"[..]));
    let kind = header::HeaderValue::from_static(BINARY_TYPE);
    recording.headers_mut().insert(header::CONTENT_TYPE, kind);
    assert_eq!(server.send(recording).await.error().0, 415);
}

// The last minutes.

#[tokio::test]
async fn the_last_minutes_of_a_sensor_come_in_figures_and_missing_frames_as_nulls() {
    let server = Server::with(Limits {
        recent_frames_max: 3,
        ..Limits::default()
    })
    .await;
    // 20 °C, one pixel of 36 °C and one of -4 °C (AMG88 spec §4-11-11): the mean is (62 · 20 + 36 - 4) / 64.
    let mut warm = flat(1, 80, 0x190);
    if let Reading::Frame(raw) = &mut warm.reading {
        raw.pixels[7] = PixelWord(144);
        raw.pixels[63] = PixelWord(0xFF0);
    }
    let frames = vec![
        flat(0, 0, 0x190),
        warm,
        missing(2, NoData::Nack),
        flat(3, 80, 0x190),
    ];
    let at: Vec<u64> = frames.iter().map(|frame| frame.stamp.t_boot_ns).collect();
    server
        .frames(&batch("pi-1", "b1", vec![part("i2c-1:0x69", frames)]))
        .await;
    let recent = server
        .get("/v1/recent?device=pi-1&sensor=i2c-1%3A0x69")
        .await
        .json();
    assert_eq!(recent["boot"], "b1");
    assert_eq!(
        recent["rows"],
        json!([
            [at[1], -4.0, 19.875, 36.0],
            [at[2], null, null, null],
            [at[3], 20.0, 20.0, 20.0]
        ])
    );
    let unknown = server.get("/v1/recent?device=pi-2&sensor=s1").await.json();
    assert_eq!(
        (&unknown["boot"], &unknown["rows"]),
        (&Value::Null, &json!([]))
    );
    for bad in ["", "?device=pi-1", "?device=pi-1&sensor=s1&more=1"] {
        let (status, code, _) = server.get(&format!("/v1/recent{bad}")).await.error();
        assert_eq!((status, &*code), (400, "wrong_query"), "{bad}");
    }
}
