//! What the route answers, over a store in memory.

use super::*;
use grideye_collector::store::{RecordingId, StoreLocation};
use grideye_collector::{Limits, SqliteStore};
use grideye_recording::wire::Batch;
use std::time::{Duration, Instant};

async fn exports(written_max: usize) -> Exports {
    let store = SqliteStore::open(&StoreLocation::Memory, &Limits::default()).unwrap();
    store.start_recording("r".to_owned(), 1).await.unwrap();
    Exports {
        store: Arc::new(store),
        room: Arc::new(Semaphore::new(written_max)),
        drawn_rows_max: 3,
        scratch: tempfile::tempfile,
    }
}

async fn answer(exports: &Exports, file: &str, asked: Asked) -> Response {
    let file = Path(file.to_owned());
    export(State(exports.clone()), file, Query(asked))
        .await
        .into_response()
}

async fn status(exports: &Exports, file: &str) -> u16 {
    answer(exports, file, Asked::default())
        .await
        .status()
        .as_u16()
}

/// Stores frames of a sensor in a boot.
async fn keep(exports: &Exports, sensor: &str, boot: &str, frames: u64) {
    let frames: Vec<serde_json::Value> = (0..frames)
        .map(|seq| {
            serde_json::json!({
                "seq": seq, "t_boot_ns": seq * 100_000_000, "t_utc_ns": 5, "clock": "unsynced",
                "pixels_raw": vec![80 + seq; 64], "thermistor_raw": 402
            })
        })
        .collect();
    let json = serde_json::json!({
        "device": "pi-1", "boot": boot, "sensors": [{ "sensor": sensor, "frames": frames }]
    });
    let json = serde_json::to_vec(&json).unwrap();
    let batch = Batch::from_json(&json).unwrap();
    exports.store.append(Arc::new(batch), 2).await.unwrap();
}

fn of(sensor: &str, boot: Option<&str>) -> Asked {
    Asked {
        sensor: Some(sensor.to_owned()),
        boot: boot.map(str::to_owned),
        count: false,
    }
}

/// The status, code and hint of an error response.
async fn refused(exports: &Exports, file: &str, asked: Asked) -> (u16, String, String) {
    let answer = answer(exports, file, asked).await;
    let status = answer.status().as_u16();
    let bytes = axum::body::to_bytes(answer.into_body(), 10_000)
        .await
        .unwrap();
    let json: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
    let said = |key: &str| json["error"][key].as_str().unwrap_or_default().to_owned();
    (status, said("code"), said("hint"))
}

#[tokio::test]
async fn an_image_shows_one_boot_of_one_sensor_within_its_row_limit() {
    let exports = exports(1).await;
    keep(&exports, "s1", "b1", 3).await;
    assert_eq!(status(&exports, "1.png").await, 200);
    keep(&exports, "s2", "b1", 4).await;
    keep(&exports, "s2", "b2", 2).await;
    assert_eq!(status(&exports, "1.npz").await, 200);
    for (asked, wanted) in [
        (of("s1", None), 200),
        (of("pi-1/s1", Some("b1")), 200),
        (of("s2", Some("b2")), 200),
        (of("pi-2/s1", None), 404),
        (of("s1", Some("b2")), 404),
        (of("s2", None), 422),
    ] {
        let said = format!("{asked:?}");
        let answer = answer(&exports, "1.gif", asked).await;
        assert_eq!(answer.status(), wanted, "{said}");
    }
    let (status, code, hint) = refused(&exports, "1.png", Asked::default()).await;
    assert_eq!((status, code.as_str()), (422, "several_streams"));
    assert!(hint.contains("?sensor=pi-1/s2&boot=b2"), "{hint}");
    // Its fourth row exceeds this test's limit.
    let long = of("s2", Some("b1"));
    let (status, code, hint) = refused(&exports, "1.png", long).await;
    assert_eq!((status, code.as_str()), (422, "cannot_be_written"));
    assert!(
        hint.contains("`grideye convert --sensor pi-1/s2` draws it"),
        "{hint}"
    );
}

#[tokio::test]
async fn people_are_counted_in_a_column_of_their_own() {
    let exports = exports(1).await;
    keep(&exports, "s1", "b1", 3).await;
    let column = |count| {
        let exports = exports.clone();
        async move {
            let asked = Asked {
                count,
                ..Asked::default()
            };
            let answer = answer(&exports, "1.npz", asked).await;
            let bytes = axum::body::to_bytes(answer.into_body(), 100_000).await;
            let bytes = io::Cursor::new(bytes.unwrap());
            let mut archive = zip::ZipArchive::new(bytes).unwrap();
            let mut array = Vec::new();
            let file = archive.by_name("labels.npy");
            io::copy(&mut file.ok()?, &mut array).unwrap();
            // One character of 32 bits for each row, at the end of the file.
            Some(array.split_off(array.len() - 12))
        }
    };
    let nobody = b"0\0\0\0".repeat(3);
    assert_eq!(column(true).await, Some(nobody));
    assert_eq!(column(false).await, None);
}

#[tokio::test]
async fn a_recording_without_frames_gives_an_error_not_an_image() {
    let exports = exports(1).await;
    let (status, code, hint) = refused(&exports, "1.png", Asked::default()).await;
    assert_eq!((status, code.as_str()), (422, "cannot_be_written"));
    assert!(hint.contains("it has no rows"), "{hint}");
}

#[tokio::test]
async fn what_is_not_there_is_not_found() {
    let exports = exports(1).await;
    assert_eq!(status(&exports, "1.npz").await, 200);
    for none in ["1.jpg", "1.csv", "1", "", ".npz", "x.npz", "2.npz"] {
        assert_eq!(status(&exports, none).await, 404, "{none}");
    }
}

#[tokio::test]
async fn exports_at_once_are_limited() {
    let exports = exports(1).await;
    let room = Arc::clone(&exports.room).try_acquire_owned().unwrap();
    assert_eq!(status(&exports, "1.mcap").await, 503);
    drop(room);
    assert_eq!(status(&exports, "1.mcap").await, 200);
}

/// Works for 20 s, unless it may not write or read on.
fn endless(rows: Rows<'_>, out: &mut dyn recording::Out) -> Result<String, ExportError> {
    let until = Instant::now() + Duration::from_secs(20);
    for row in rows {
        row?;
        std::thread::sleep(Duration::from_millis(20));
    }
    while Instant::now() < until {
        out.write_all(b"x")?;
        out.rewind()?;
    }
    Ok(String::new())
}

#[tokio::test]
async fn a_file_that_nobody_waits_for_is_not_written_on() {
    let exports = exports(1).await;
    keep(&exports, "s1", "b1", 1).await;
    keep(&exports, "s2", "b1", 1_000).await;
    for spans in [0..1, 1..2] {
        let id = RecordingId(1);
        let mut members = exports.store.members(id).await.unwrap();
        members.spans = members.spans[spans].to_vec();
        let rows = Pages::new(Arc::clone(&exports.store), members, None);
        let room = Arc::clone(&exports.room).acquire_owned().await.unwrap();
        let written = write(rows, endless, (room, exports.scratch));
        let dropped = tokio::time::timeout(Duration::from_millis(100), written).await;
        assert!(dropped.is_err());
        let free = tokio::time::timeout(Duration::from_secs(5), exports.room.acquire()).await;
        assert!(free.is_ok());
    }
}

/// The empty room is told from all pages before the first row is.
#[tokio::test]
async fn nothing_is_read_to_count_for_a_dropped_request() {
    let exports = exports(1).await;
    keep(&exports, "s1", "b1", 1).await;
    let members = exports.store.members(RecordingId(1)).await.unwrap();
    let span = members.spans[0].clone();
    let mut rows = Pages::new(Arc::clone(&exports.store), members, None);
    let asking = Arc::new(());
    rows.request = Arc::downgrade(&asking);
    let read = tokio::task::spawn_blocking(move || {
        let asked = rows.counter_of(&span).is_ok();
        drop(asking);
        (asked, rows.counter_of(&span).is_ok())
    });
    assert_eq!(read.await.unwrap(), (true, false));
}

#[test]
fn a_recording_that_takes_too_long_is_refused() {
    let mut recording = Recording {
        id: RecordingId(1),
        name: "long".to_owned(),
        note: String::new(),
        t_start_ns: 1,
        t_stop_ns: None,
        frames: ROWS_MAX - 1,
        missing: 1,
        sensors: 1,
    };
    check_length(&recording).unwrap();
    recording.missing = 2;
    let refused = check_length(&recording).unwrap_err().into_response();
    assert_eq!(refused.status(), 422);
}
