//! Recordings over HTTP: notes, and frames for the page.

use crate::batches::{bare, batch, flat, missing, numbered, part};
use crate::server::{Reply, Server};
use axum::http::header;
use grideye_collector::Limits;
use grideye_frame::NoData;
use serde_json::{Value, json};

async fn start(server: &Server, name: &str) {
    let body = json!({ "name": name }).to_string();
    assert_eq!(server.post("/v1/recordings", body).await.status, 201);
}

async fn note(server: &Server, note: &Value) -> Reply {
    let body = json!({ "note": note }).to_string();
    server.post("/v1/recordings/1/note", body).await
}

#[tokio::test]
async fn a_note_is_written_replaced_and_taken_away() {
    let server = Server::new().await;
    start(&server, "kitchen").await;
    assert_eq!(server.get("/v1/recordings/1").await.json()["note"], "");
    for (sent, kept) in [
        (" two people, é ", "two people, é"),
        ("one person", "one person"),
        ("", ""),
    ] {
        let noted = note(&server, &json!(sent)).await;
        assert_eq!(
            (noted.status.as_u16(), &noted.json()["note"]),
            (200, &json!(kept))
        );
        let listed = server.get("/v1/recordings").await.json();
        assert_eq!(listed["recordings"][0], noted.json());
    }
}

#[tokio::test]
async fn a_note_that_cannot_be_is_refused_and_the_old_one_stays() {
    let limits = Limits {
        recording_note_chars_max: 20,
        ..Limits::default()
    };
    let server = Server::with(limits).await;
    assert_eq!(note(&server, &json!("nothing there")).await.error().0, 404);
    start(&server, "kitchen").await;
    let twenty = "é".repeat(20);
    assert_eq!(note(&server, &json!(twenty)).await.status, 200);
    for bad in [json!("é".repeat(21)), json!("a\nb"), json!(1), Value::Null] {
        let (status, code, field) = note(&server, &bad).await.error();
        assert_eq!(
            (status, code.as_str(), field.as_deref()),
            (422, "wrong_value", Some("note")),
            "{bad}"
        );
    }
    let unknown = server
        .post("/v1/recordings/1/note", r#"{"note":"a","name":"b"}"#)
        .await;
    assert_eq!(unknown.error().0, 422);
    assert_eq!(server.get("/v1/recordings/1").await.json()["note"], *twenty);
}

fn number<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    bytes[at..at + N].try_into().unwrap()
}

/// The head, and the rows.
fn parts(body: &[u8]) -> (Value, Vec<&[u8]>) {
    assert_eq!(&body[..4], b"GEF1");
    let length = usize::try_from(u32::from_le_bytes(number(body, 4))).unwrap();
    assert_eq!(length % 8, 0);
    let head: Value = serde_json::from_slice(&body[8..8 + length]).unwrap();
    let row_bytes = usize::try_from(head["row_bytes"].as_u64().unwrap()).unwrap();
    let rows = body[8 + length..].chunks(row_bytes).collect();
    (head, rows)
}

/// Stream, number, kind, thermistor and the single value of all pixels.
fn reading_of(row: &[u8]) -> (u16, u64, u8, i16, i16) {
    let words: Vec<i16> = row[40..]
        .chunks(2)
        .map(|pair| i16::from_le_bytes(number(pair, 0)))
        .collect();
    assert!(words.iter().all(|word| *word == words[0]) && words.len() == 64);
    (
        u16::from_le_bytes(number(row, 32)),
        u64::from_le_bytes(number(row, 0)),
        row[34],
        i16::from_le_bytes(number(row, 36)),
        words[0],
    )
}

#[tokio::test]
async fn the_frames_of_a_recording_come_as_rows_of_one_length_in_steps_of_degrees() {
    // More than one page.
    let limits = Limits {
        page_rows: 2,
        ..Limits::default()
    };
    let server = Server::with(limits).await;
    start(&server, "kitchen").await;
    // 0xFFF is -0.25 °C (AMG88 spec §4-11-11) and 0xBBB -59.6875 °C (§4-11-9); upper bits have no meaning.
    let frames = vec![
        flat(3, 0x064, 0x190),
        missing(4, NoData::BusTimeout),
        flat(9, 0xFFFF, 0x0BBB),
    ];
    let sensors = vec![part("s1", frames), part("s2", vec![bare(flat(0, 0, 0))])];
    server.frames(&batch("pi-1", "b1", sensors)).await;
    let reply = server.get("/v1/recordings/1.frames").await;
    assert_eq!(
        reply.headers[header::CONTENT_TYPE],
        "application/octet-stream"
    );
    let (head, rows) = parts(&reply.body);
    assert_eq!((&head["rows"], rows.len()), (&json!(4), 4));
    assert_eq!(
        head["streams"],
        json!([
            { "device": "pi-1", "sensor": "s1", "boot": "b1" },
            { "device": "pi-1", "sensor": "s2", "boot": "b1" }
        ])
    );
    assert_eq!(head["clocks"], json!(["unsynced", "synced", "stepped"]));
    assert_eq!(head["pixel_step_celsius"], 0.25);
    assert_eq!(head["thermistor_step_celsius"], 0.0625);
    let seen: Vec<_> = rows.iter().copied().map(reading_of).collect();
    let reasons: Vec<&str> = head["reasons"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(Value::as_str)
        .collect();
    let timeout = reasons.iter().position(|name| *name == "bus-timeout");
    let timeout = u8::try_from(timeout.unwrap() + 1).unwrap();
    assert_eq!(
        seen,
        [
            (0, 3, 0, 400, 100),
            (0, 4, timeout, 0, 0),
            (0, 9, 0, -955, -1),
            (1, 0, 0, -32_768, 0)
        ]
    );
    // 2021-07-01 18:07:27 UTC and 0.3 s, as in the batches; the device's clock is set.
    let stamps = |row: &[u8]| {
        let boot = u64::from_le_bytes(number(row, 8));
        let wall = i64::from_le_bytes(number(row, 16));
        (boot, wall, i64::from_le_bytes(number(row, 24)), row[35])
    };
    assert_eq!(
        stamps(rows[0]),
        (
            1_300_000_000,
            1_625_163_247_300_000_000,
            1_625_163_247_000_000_000,
            1
        )
    );
}

#[tokio::test]
async fn a_recording_too_long_for_a_browser_is_refused_with_where_to_have_it() {
    let limits = Limits {
        playback_rows_max: 3,
        ..Limits::default()
    };
    let server = Server::with(limits).await;
    start(&server, "kitchen").await;
    server.frames(&numbered(0..3)).await;
    assert_eq!(server.get("/v1/recordings/1.frames").await.status, 200);
    server.frames(&numbered(3..4)).await;
    let refused = server.get("/v1/recordings/1.frames").await;
    assert_eq!(refused.error(), (422, "too_long_to_play".to_owned(), None));
    let hint = refused.json()["error"]["hint"].to_string();
    assert!(hint.contains("GET /v1/recordings/1.csv"), "{hint}");
    for none in ["/v1/recordings/2.frames", "/v1/recordings/x.frames"] {
        assert_eq!(server.get(none).await.error().0, 404, "{none}");
    }
}

#[tokio::test]
async fn an_empty_recording_has_no_rows() {
    let server = Server::new().await;
    start(&server, "empty").await;
    let reply = server.get("/v1/recordings/1.frames").await;
    let (head, rows) = parts(&reply.body);
    assert_eq!((&head["rows"], rows.len()), (&json!(0), 0));
}

fn label(name: &str, spans: &[(&str, u64, u64)]) -> String {
    let span = |(sensor, first, last): &(&str, u64, u64)| json!({ "device": "pi-1", "sensor": sensor, "boot": "b1", "first_seq": first, "last_seq": last });
    let spans: Vec<Value> = spans.iter().map(span).collect();
    json!({ "name": name, "spans": spans }).to_string()
}

/// A recording of frames 0 to 9 of one sensor and 5 to 9 of another.
async fn labeled() -> Server {
    let server = Server::new().await;
    start(&server, "kitchen, é").await;
    let sensor = |name, from| part(name, (from..10).map(crate::batches::frame).collect());
    let sensors = vec![sensor("s1", 0), sensor("s2", 5)];
    server.frames(&batch("pi-1", "b1", sensors)).await;
    server
}

#[tokio::test]
async fn labels_are_added_listed_downloaded_and_taken_away() {
    let server = labeled().await;
    let (all, one) = (
        label(" two people, \"é\" ", &[("s1", 2, 7), ("s2", 5, 7)]),
        label("nobody", &[("s1", 9, 9)]),
    );
    let added = server.post("/v1/recordings/1/labels", all.clone()).await;
    assert_eq!(added.status, 201);
    assert_eq!(added.headers[header::LOCATION], "/v1/recordings/1/labels/1");
    assert_eq!(added.json()["name"], "two people, \"é\"");
    let sent: Value = serde_json::from_str(&all).unwrap();
    assert_eq!(added.json()["spans"], sent["spans"]);
    server.post("/v1/recordings/1/labels", one).await;
    let listed = server.get("/v1/recordings/1/labels").await.json();
    assert_eq!(listed["labels"][0], added.json());
    let numbers: Vec<_> = listed["labels"]
        .as_array()
        .unwrap()
        .iter()
        .map(|label| &label["number"])
        .collect();
    assert_eq!(numbers, [1, 2]);
    let file = server.get("/v1/recordings/1/labels.csv").await;
    let disposition = file.headers[header::CONTENT_DISPOSITION].to_str().unwrap();
    assert!(
        disposition.contains("kitchen, _.labels.csv"),
        "{disposition}"
    );
    // Quotes as in RFC 4180, section 2.
    assert_eq!(
        String::from_utf8(file.body.to_vec()).unwrap(),
        "number,label,device,sensor,boot,first_seq,last_seq\n\
         1,\"two people, \"\"é\"\"\",pi-1,s1,b1,2,7\n\
         1,\"two people, \"\"é\"\"\",pi-1,s2,b1,5,7\n\
         2,nobody,pi-1,s1,b1,9,9\n"
    );
    assert_eq!(server.delete("/v1/recordings/1/labels/1").await.status, 204);
    let left = server.get("/v1/recordings/1/labels").await.json();
    assert_eq!(left["labels"].as_array().unwrap().len(), 1);
    let (status, code, _) = server.delete("/v1/recordings/1/labels/1").await.error();
    assert_eq!((status, &*code), (404, "no_such_label"));
}

#[tokio::test]
async fn a_label_of_frames_that_are_not_there_is_refused_with_the_place() {
    let server = labeled().await;
    let nameless = label("", &[("s1", 2, 7)]);
    let spans = |spans: Value| json!({ "name": "x", "spans": spans }).to_string();
    for (bad, field) in [
        (nameless, "name"),
        (label(&"é".repeat(65), &[("s1", 2, 7)]), "name"),
        (label("a\u{7}", &[("s1", 2, 7)]), "name"),
        (label("a\u{202e}b", &[("s1", 2, 7)]), "name"),
        (label("x", &[]), "spans"),
        (label("x", &[("s1", 2, 7); 65]), "spans"),
        (spans(json!({})), "spans"),
        (spans(json!([3])), "spans[0]"),
        (label("x", &[("s1", 2, 7), ("s1", 7, 2)]), "spans[1]"),
        (label("x", &[("s3", 2, 7)]), "spans[0]"),
        (label("x", &[("s2", 4, 7)]), "spans[0]"),
        (label("x", &[("s1", 2, 10)]), "spans[0]"),
        (label("x", &[("s1", 0, u64::MAX)]), "spans[0]"),
    ] {
        let (status, code, at) = server
            .post("/v1/recordings/1/labels", bad.clone())
            .await
            .error();
        assert_eq!(
            (status, &*code, at.as_deref()),
            (422, "wrong_value", Some(field)),
            "{bad}"
        );
    }
    let good = label("x", &[("s1", 2, 7)]);
    for path in ["/v1/recordings/2/labels", "/v1/recordings/x/labels"] {
        assert_eq!(server.post(path, good.clone()).await.error().0, 404);
    }
    let none = server.get("/v1/recordings/1/labels").await.json();
    assert_eq!(none, json!({ "labels": [] }));
}
