//! Sensors and devices as shown, and the audit.

use crate::batches::{account, batch, counted, flat, frame, missing, numbered, part};
use crate::http::client::Client;
use crate::server::{Server, request};
use axum::http::{Method, StatusCode};
use grideye_collector::Limits;
use grideye_frame::{NoData, PixelWord, Reading};
use grideye_recording::wire::Batch;
use serde_json::{Value, json};
use std::sync::Arc;
use std::time::Duration;

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
async fn a_device_is_shown_with_its_agents_configuration() {
    let server = Server::new().await;
    let sent = counted(0..21, account(24, 3, 21));
    server.frames(&sent).await;
    let nobody = server.get("/v1/devices").await.json()["devices"][0].clone();
    assert_eq!(
        (&nobody["agent_version"], &nobody["configuration"]),
        (&Value::Null, &Value::Null),
        "curl sends no configuration"
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
    assert_eq!(&alone, device, "the same as in the list");
    assert_eq!(
        server.get("/v1/devices/pi-none").await.error(),
        (404, "no_such_device".to_owned(), Some("device".to_owned()))
    );
    // A rejected batch is ignored too.
    let mut refused = request(Method::POST, "/v1/frames", "{}".into());
    let other = "grideye-agent/1".parse().unwrap();
    refused.headers_mut().insert("user-agent", other);
    assert_eq!(server.send(refused).await.status, 422);
    let devices = server.get("/v1/devices").await.json();
    assert_eq!(devices["devices"][0]["agent_version"], "9.8.7");
}

#[tokio::test]
async fn what_a_killed_agent_without_a_disk_held_is_lost_once_it_is_silent_and_has_begun_another_boot()
 {
    let server = Server::new().await;
    let of_boot = |boot: &str, batch: Batch| Batch {
        boot: boot.to_owned(),
        ..batch
    };
    let post = async |batch: Batch, spool: &str| {
        let set_up =
            json!({ "post_every_ms": 500, "ring_frames": 100, "spool": spool, "sensors": {} });
        let body = batch.to_json().unwrap().into();
        let mut post = request(Method::POST, "/v1/frames", body);
        let set_up = set_up.to_string().parse().unwrap();
        post.headers_mut().insert("grideye-configuration", set_up);
        assert_eq!(server.send(post).await.status, 200);
    };
    let first = async || {
        // What follows an answer runs beside it.
        tokio::time::sleep(Duration::from_millis(100)).await;
        server.get("/v1/audit").await.json()["streams"][0].clone()
    };
    server.clock.pass(Duration::from_secs(1000));
    post(of_boot("b1", counted(0..10, account(15, 0, 15))), "ram").await;
    server.clock.pass(Duration::from_secs(5));
    post(of_boot("b2", counted(0..1, account(1, 0, 1))), "ram").await;
    assert_eq!(
        first().await["spooled"],
        5,
        "its last frames may be on the way"
    );
    server.clock.pass(Duration::from_secs(60));
    post(of_boot("b2", counted(1..2, account(2, 0, 1))), "outage").await;
    assert_eq!(
        first().await["spooled"],
        5,
        "an agent with a disk reports itself"
    );
    post(of_boot("b2", counted(2..3, account(3, 0, 1))), "ram").await;
    let settled = first().await;
    assert_eq!(
        (
            &settled["spooled"],
            &settled["dropped"],
            &settled["balanced"]
        ),
        (&json!(0), &json!({ "lost-in-memory": 5 }), &json!(true)),
        "{settled}"
    );
    let second = server.get("/v1/audit").await.json()["streams"][1].clone();
    assert_eq!(
        (&second["boot"], &second["dropped"]),
        (&json!("b2"), &json!({}))
    );
}

#[tokio::test]
async fn the_age_comes_from_the_best_available_clock() {
    let server = Server::new().await;
    // A wall clock that was set: the frame's time is START + seq x 0.1 s.
    server.clock.pass(Duration::from_secs(10));
    server.frames(&numbered([0])).await;
    assert_eq!(server.sensor().await["age_s"], 10.0);
    assert_eq!(server.sensor().await["frame"]["age_basis"], "wall-clock");
    // A wall clock that was never set is ignored.
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
    // The boot before, which ended a while ago, is delivered late.
    let mut before = numbered(0..50);
    before.boot = "b0".to_owned();
    server.frames(&sent_at(before, 107)).await;
    assert_eq!(server.sensor().await["boot"], "b1");
    // A new boot takes over.
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
async fn a_missing_frame_is_shown_and_the_last_one_keeps_its_age() {
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
async fn a_boot_shows_its_start_if_its_first_record_was_seen() {
    let server = Server::new().await;
    server.frames(&numbered(0..2)).await;
    let sensor = server.sensor().await;
    assert_eq!(sensor["began_boot_ns"], json!(1_000_000_000_u64));
    // The first records of this boot went elsewhere.
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
async fn the_audit_says_how_long_ago_frames_came_also_after_a_restart() {
    let server = Server::new().await;
    server.frames(&counted(0..5, account(5, 0, 0))).await;
    server.clock.pass(Duration::from_millis(25_900));
    // A report without frames is none of them.
    server.frames(&counted(5..5, account(5, 0, 0))).await;
    let last = async |server: &Server| {
        let audit = server.get("/v1/audit").await.json();
        audit["streams"][0]["last_report_s"].clone()
    };
    assert_eq!(last(&server).await, 25);
}

#[tokio::test]
async fn two_agents_with_one_name_are_shown_with_their_boots_and_lose_nothing() {
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
    // A restarted agent that delivers what the boot before left.
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
