//! What a store deletes for age or size, and what no clock can make it delete.

use crate::batches::{account, batch, frame, numbered, part};
use crate::clocks::{BEGIN_NS, Clocks};
use crate::postgres;
use crate::server::{Server, request};
use axum::body::Body;
use axum::http::Method;
use grideye_collector::auth::AccessFolder;
use grideye_collector::store::{self, StreamSummary};
use grideye_collector::{
    AppState, Clock as _, FrameStore, Limits, Log, LogEvent, SqliteStore, StoreError,
    StoreLocation, app,
};
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tower::ServiceExt as _;

const SECOND: Duration = Duration::from_secs(1);
const MINUTE: Duration = Duration::from_secs(60);
const HOUR: Duration = Duration::from_secs(3600);
const DAY: Duration = Duration::from_secs(86_400);
const DAY_NS: i64 = 86_400_000_000_000;

fn file(folder: &Path) -> StoreLocation {
    StoreLocation::File(folder.join("frames.sqlite"))
}

fn keep_for(time: Duration) -> Limits {
    Limits {
        keep_for: Some(time),
        ..Limits::default()
    }
}

/// The log.
#[derive(Clone, Default)]
struct Lines(Arc<Mutex<Vec<LogEvent>>>);

impl Lines {
    fn log(&self) -> Log {
        let lines = Arc::clone(&self.0);
        Log::new(move |event| lines.lock().unwrap().push(event.clone()))
    }

    /// The events of one kind.
    fn of(&self, event: &str) -> Vec<LogEvent> {
        let lines = self.0.lock().unwrap();
        let of_kind = lines.iter().filter(|line| line.event == event);
        of_kind.cloned().collect()
    }
}

fn field(event: &LogEvent, name: &str) -> String {
    let found = event.fields.iter().find(|(known, _)| *known == name);
    found.unwrap().1.clone()
}

fn number(event: &LogEvent, name: &str) -> u64 {
    field(event, name).parse().unwrap()
}

fn tended(
    location: &StoreLocation,
    limits: &Limits,
    clocks: &Arc<Clocks>,
    log: &Log,
) -> SqliteStore {
    SqliteStore::open_tended(location, limits, &clocks.handed(), log).unwrap()
}

async fn append(store: &dyn FrameStore, seqs: std::ops::Range<u64>, clocks: &Clocks) {
    let batch = Arc::new(numbered(seqs));
    store.append(batch, clocks.utc_ns()).await.unwrap();
}

/// Lets time pass with only an agent's empty batches.
async fn wait(store: &dyn FrameStore, clocks: &Clocks, times: u32, each: Duration) {
    for _ in 0..times {
        clocks.pass(each);
        append(store, 0..0, clocks).await;
    }
}

async fn stream(store: &dyn FrameStore) -> StreamSummary {
    store.streams().await.unwrap().remove(0)
}

/// Checks that the frames before this number are stored and none was deleted.
async fn audit(what: &str, store: &dyn FrameStore, frames: u64, readable: impl Fn() -> String) {
    let books = stream(store).await;
    assert_eq!((books.stored, books.expired), (frames, 0), "{what}");
    assert_eq!((books.never_came, &books.gaps[..]), (0, &[][..]), "{what}");
    assert_eq!(readable(), frames.to_string(), "{what}");
}

/// Sets the wall clock while the collector runs, and while it does not: all frames stay and are readable.
async fn set_the_wall_clock(location: &StoreLocation, readable: impl Fn() -> String) {
    let limits = Limits {
        seal_after: MINUTE,
        ..keep_for(12 * HOUR)
    };
    let log = Log::silent();
    let mut clocks = Clocks::started_at(BEGIN_NS);
    let opened = store::open(location, &limits, &clocks.handed(), &log).await;
    let mut store = opened.unwrap();
    let mut frames = 0;
    for (what, utc_ns) in [
        ("a good clock", BEGIN_NS),
        ("a day ahead", BEGIN_NS + DAY_NS),
        ("ten years ahead", BEGIN_NS + 3653 * DAY_NS),
        ("back", BEGIN_NS),
        ("a day behind", BEGIN_NS - DAY_NS),
        ("1970", 0),
        ("back again", BEGIN_NS),
    ] {
        for is_restarted in [false, true] {
            clocks.set_wall(utc_ns);
            if is_restarted {
                store.close().await.unwrap();
                clocks = Clocks::started_at(utc_ns);
                let opened = store::open(location, &limits, &clocks.handed(), &log).await;
                store = opened.unwrap();
            }
            for _ in 0..10 {
                clocks.pass(15 * SECOND);
                append(&*store, frames..frames + 5, &clocks).await;
                frames += 5;
            }
            let what = format!("{what}, restarted: {is_restarted}");
            audit(&what, &*store, frames, &readable).await;
            // Storing all of them again changes nothing.
            append(&*store, 0..frames, &clocks).await;
            audit(&what, &*store, frames, &readable).await;
        }
    }
    // Each frame is readable: the same number with other content is rejected.
    for seq in 0..frames {
        let mut other = numbered([seq]);
        other.sensors[0].frames[0] = frame(seq + 1);
        other.sensors[0].frames[0].seq = seq;
        let refused = store.append(Arc::new(other), clocks.utc_ns()).await;
        let is_refused = matches!(refused, Err(StoreError::Conflict { seq: of, .. }) if of == seq);
        assert!(is_refused, "frame {seq} cannot be read");
    }
    store.close().await.unwrap();
}

#[tokio::test]
async fn no_step_of_the_wall_clock_deletes_a_frame_from_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frames.sqlite");
    let readable = || {
        let connection = rusqlite::Connection::open(&path).unwrap();
        let sql = "SELECT sum(frames) FROM chunks";
        let frames: i64 = connection.query_row(sql, [], |row| row.get(0)).unwrap();
        frames.to_string()
    };
    set_the_wall_clock(&file(folder.path()), readable).await;
}

#[tokio::test]
async fn no_step_of_the_wall_clock_deletes_a_frame_from_postgres() {
    let Some(cluster) = postgres::shared("steps of the clock, with PostgreSQL") else {
        return;
    };
    let url = cluster.database();
    let readable = || postgres::sql(&url, "SELECT count(*) FROM grideye.frames");
    set_the_wall_clock(&url.parse().unwrap(), readable).await;
}

#[tokio::test]
async fn frames_grow_old_while_a_collector_runs_and_not_while_none_does() {
    let folder = tempfile::tempdir().unwrap();
    let (location, limits) = (file(folder.path()), keep_for(DAY));
    let log = Log::silent();
    let clocks = Clocks::started_at(BEGIN_NS);
    let store = tended(&location, &limits, &clocks, &log);
    append(&store, 0..200, &clocks).await;
    wait(&store, &clocks, 1, 10 * SECOND).await;
    wait(&store, &clocks, 20, HOUR).await;
    store.close().await.unwrap();
    // A month later by the wall clock.
    let clocks = Clocks::started_at(BEGIN_NS + 30 * DAY_NS);
    let store = tended(&location, &limits, &clocks, &log);
    wait(&store, &clocks, 24, 10 * MINUTE).await;
    assert_eq!(stream(&store).await.expired, 0, "a day old, and no older");
    // Deletion waits for another hundredth of the time, 14.4 minutes.
    wait(&store, &clocks, 2, 10 * MINUTE).await;
    assert_eq!(stream(&store).await.expired, 200);
    // After a kill it continues from the last round: possibly late, never early.
    append(&store, 200..400, &clocks).await;
    wait(&store, &clocks, 1, 10 * SECOND).await;
    wait(&store, &clocks, 12, HOUR).await;
    drop(store);
    let clocks = Clocks::started_at(0);
    let store = tended(&location, &limits, &clocks, &log);
    wait(&store, &clocks, 12, HOUR - SECOND).await;
    assert_eq!(stream(&store).await.expired, 200);
    // The time since the last stored round is lost: an hour at most.
    wait(&store, &clocks, 8, 10 * MINUTE).await;
    assert_eq!(stream(&store).await.expired, 400);
}

/// Nothing is sealed, so a chunk is five frames.
fn unsealed() -> Limits {
    Limits {
        seal_after: 100 * DAY,
        ..Limits::default()
    }
}

/// Five frames every half hour, for ten days.
async fn ten_days(location: &StoreLocation, clocks: &Arc<Clocks>) {
    let store = tended(location, &unsealed(), clocks, &Log::silent());
    for post in 0..480 {
        append(&store, 5 * post..5 * post + 5, clocks).await;
        clocks.pass(30 * MINUTE);
    }
    store.close().await.unwrap();
}

/// The number of frames left, at the start and every two minutes.
async fn left(store: &SqliteStore, clocks: &Clocks, times: usize) -> Vec<u64> {
    let mut left = vec![2400];
    for _ in 0..times {
        wait(store, clocks, 1, 2 * MINUTE).await;
        left.push(2400 - stream(store).await.expired);
    }
    left
}

/// `--keep-bytes 2G` where 200 was meant.
#[tokio::test]
async fn no_more_than_a_share_is_deleted_in_an_hour_for_want_of_room() {
    let folder = tempfile::tempdir().unwrap();
    let location = file(folder.path());
    let clocks = Clocks::started_at(BEGIN_NS);
    ten_days(&location, &clocks).await;
    let limits = Limits {
        keep_bytes: Some(1),
        ..unsealed()
    };
    let lines = Lines::default();
    let store = tended(&location, &limits, &clocks, &lines.log());
    let left = left(&store, &clocks, 120).await;
    for window in left.windows(31) {
        assert!(window[0] - window[30] <= window[0] / 10 + 5, "{window:?}");
    }
    // A twentieth per hour: after four hours exp(-4/20) is left.
    assert!((1950..1980).contains(&left[120]), "{left:?}");
    let events = lines.of("frames_deleted");
    let logged: u64 = events.iter().map(|event| number(event, "frames")).sum();
    assert_eq!(logged, 2400 - left[120]);
    assert!(events.iter().all(|event| field(event, "reason") == "size"));
}

/// `--keep-days 1` where 100 was meant, on a store of ten days: there is time to notice.
#[tokio::test]
async fn no_more_than_a_share_is_deleted_in_a_time_and_every_frame_of_it_is_logged_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    let location = file(folder.path());
    let clocks = Clocks::started_at(BEGIN_NS);
    ten_days(&location, &clocks).await;
    let lines = Lines::default();
    let limits = Limits {
        keep_for: Some(DAY),
        ..unsealed()
    };
    let store = tended(&location, &limits, &clocks, &lines.log());
    let left = left(&store, &clocks, 240).await;
    // A tenth in a fortieth of the time, 36 minutes; chunks are deleted whole.
    for window in left.windows(19) {
        assert!(window[0] - window[18] <= window[0] / 10 + 5, "{window:?}");
    }
    // At twice the pace of aging: after eight hours exp(-2/3) is left.
    assert!((1200..1260).contains(&left[240]), "{left:?}");
    let events = lines.of("frames_deleted");
    let mut next_seq = 0;
    for event in &events {
        let names = ["reason", "device", "sensor", "boot"].map(|name| field(event, name));
        assert_eq!(names, ["age", "pi-1", "s1", "b1"]);
        assert_eq!(number(event, "first_seq"), next_seq, "oldest first");
        next_seq = number(event, "last_seq") + 1;
        assert_eq!(number(event, "frames") % 5, 0);
    }
    assert!(events.len() <= 240, "more lines than rounds");
    let logged: u64 = events.iter().map(|event| number(event, "frames")).sum();
    let deleted = 2400 - left[240];
    assert_eq!((logged, next_seq), (deleted, deleted));
    let usage = store.usage().await.unwrap();
    assert_eq!((usage.deleted_by_age, usage.deleted_by_size), (deleted, 0));
    let server = Server::on(Arc::new(store), limits).await;
    let metrics = server.get("/metrics").await.body;
    let metrics = String::from_utf8(metrics.to_vec()).unwrap();
    for (reason, count) in [("age", deleted), ("size", 0)] {
        let line = format!("\ngrideye_frames_deleted_total{{reason=\"{reason}\"}} {count}\n");
        assert!(metrics.contains(&line), "{metrics}");
    }
}

#[tokio::test]
async fn what_comes_evenly_is_deleted_as_fast_as_it_comes() {
    let clocks = Clocks::started_at(BEGIN_NS);
    let store = tended(
        &StoreLocation::Memory,
        &keep_for(DAY),
        &clocks,
        &Log::silent(),
    );
    for post in 0..2 * 288 {
        append(&store, 5 * post..5 * post + 5, &clocks).await;
        clocks.pass(5 * MINUTE);
        if post > 288 + 6 && post % 12 == 0 {
            let books = stream(&store).await;
            let left = books.stored - books.expired;
            assert!(
                (1440..=1440 + 40).contains(&left),
                "{left} after post {post}"
            );
        }
    }
}

#[tokio::test]
async fn a_step_of_the_wall_clock_is_logged_once_with_its_size() {
    let folder = tempfile::tempdir().unwrap();
    let clocks = Clocks::started_at(BEGIN_NS);
    let limits = Limits::default();
    let store = SqliteStore::open(&StoreLocation::Memory, &limits).unwrap();
    let lines = Lines::default();
    let access = AccessFolder::new(folder.path().join("access"));
    let state = AppState::with_tokens(
        Arc::new(store),
        limits,
        clocks.handed(),
        access,
        lines.log(),
    );
    let router = app(state.await.unwrap());
    for seq in 0..12 {
        clocks.pass(10 * SECOND);
        match seq {
            3 => clocks.set_wall(clocks.utc_ns() + DAY_NS),
            6 => clocks.set_wall(clocks.utc_ns() - 3 * DAY_NS),
            // Like a slewed clock.
            9 => clocks.set_wall(clocks.utc_ns() + 5_000_000),
            _ => {}
        }
        let body = Body::from(numbered([seq]).to_json().unwrap());
        let sent = request(Method::POST, "/v1/frames", body);
        let reply = router.clone().oneshot(sent).await.unwrap();
        assert_eq!(reply.status(), 200);
    }
    let steps = lines.of("clock_stepped");
    let by_s: Vec<String> = steps.iter().map(|event| field(event, "by_s")).collect();
    assert_eq!(by_s, ["86400", "-259200"]);
}

/// The SQL for deleting from a database: by named days, without a clock, and never from a recording.
#[tokio::test]
async fn the_documented_sql_deletes_the_named_days_of_no_recording_and_counts_them() {
    let Some(cluster) = postgres::shared("deletion by SQL") else {
        return;
    };
    let page = include_str!("../../README.md");
    for name in ["days", "delete-days", "delete-boots"] {
        assert!(page.contains(&format!("-f crates/grideye-collector/sql/{name}.sql\n")));
    }
    let look = include_str!("../../sql/days.sql");
    let delete = include_str!("../../sql/delete-days.sql");
    let forget = include_str!("../../sql/delete-boots.sql");
    let url = cluster.database();
    let (location, limits) = (url.parse().unwrap(), Limits::default());
    let store = store::PostgresStore::open(&location, &limits)
        .await
        .unwrap();
    // BEGIN_NS is on 2023-11-14; the recording holds the middle of that day's frames.
    let clocks = Clocks::started_at(BEGIN_NS);
    append(&store, 0..20, &clocks).await;
    let recording = store.start_recording("r".to_owned(), 1).await.unwrap();
    append(&store, 20..30, &clocks).await;
    store.stop_recording(recording.id, 2).await.unwrap();
    append(&store, 30..45, &clocks).await;
    for (day, seqs) in [(BEGIN_NS + DAY_NS, 45..50), (0, 50..60)] {
        clocks.set_wall(day);
        append(&store, seqs, &clocks).await;
    }
    let days = ["1970-01-01|10", "2023-11-14|45", "2023-11-15|5"];
    assert_eq!(postgres::sql(&url, look), days.join("\n"));
    let named = delete
        .replace(":'first'", "'2023-11-14'")
        .replace(":'before'", "'2023-11-15'");
    let _ = postgres::sql(&url, &named);
    let days = ["1970-01-01|10", "2023-11-14|10", "2023-11-15|5"];
    assert_eq!(postgres::sql(&url, look), days.join("\n"));
    let books = stream(&store).await;
    assert_eq!((books.stored, books.expired, books.never_came), (60, 35, 0));
    // Deleted frames stay known.
    append(&store, 0..60, &clocks).await;
    assert_eq!(stream(&store).await.stored, 60);
    // A boot without frames goes, and a collector that knew it takes it again.
    let earlier = || {
        let part = part("s1", (0..5).map(frame).collect());
        Arc::new(batch("pi-1", "b0", vec![part]))
    };
    store.append(earlier(), BEGIN_NS).await.unwrap();
    append(&store, 60..61, &clocks).await;
    for boot in ["b2", "b3", "b4", "b5", "b6", "b7", "b8"] {
        let later = batch("pi-1", boot, vec![part("s1", vec![frame(0)])]);
        store.append(Arc::new(later), BEGIN_NS).await.unwrap();
    }
    assert_eq!(store.streams().await.unwrap().len(), 9);
    let _ = postgres::sql(&url, &named);
    let _ = postgres::sql(&url, forget);
    let left = store.streams().await.unwrap();
    assert_eq!((&*left[0].id.boot, left[0].stored), ("b1", 61));
    assert_eq!(left.len(), 8);
    let again = store.append(earlier(), BEGIN_NS).await.unwrap();
    assert_eq!(
        (again.sensors[0].is_new, again.sensors[0].fresh.len()),
        (true, 5)
    );
}

/// What `--keep-days` and `--keep-bytes` may not delete is said, and goes once the recording is deleted.
#[tokio::test]
async fn frames_that_only_a_recording_keeps_are_counted_in_log_metric_and_health() {
    for limits in [
        keep_for(DAY),
        Limits {
            keep_bytes: Some(1),
            ..Limits::default()
        },
    ] {
        let is_by_age = limits.keep_for.is_some();
        let folder = tempfile::tempdir().unwrap();
        let clocks = Clocks::started_at(BEGIN_NS);
        let lines = Lines::default();
        let store = tended(&file(folder.path()), &limits, &clocks, &lines.log());
        let recording = store.start_recording("forgotten".to_owned(), 1).await;
        let id = recording.unwrap().id;
        for post in 0..100 {
            append(&store, 5 * post..5 * post + 5, &clocks).await;
            clocks.pass(15 * SECOND);
        }
        store.stop_recording(id, 2).await.unwrap();
        wait(&store, &clocks, 3 * 24, HOUR).await;
        assert_eq!(stream(&store).await.expired, 0);
        let store = Arc::new(store);
        let server = Server::on(store.clone(), limits).await;
        let said = async |count: u64| {
            let line = format!("\ngrideye_frames_held {count}\n");
            let metrics = server.get("/metrics").await.body;
            assert!(String::from_utf8_lossy(&metrics).contains(&line), "{line}");
            let health = server.get("/v1/health").await.json();
            assert_eq!(health["store"]["held_by_recordings"], count);
            let warnings = server.get("/healthz").await.json()["warnings"].to_string();
            assert_eq!(warnings.contains("belong to recordings"), count > 0);
        };
        assert_eq!(
            store.usage().await.unwrap().held,
            500,
            "by age: {is_by_age}"
        );
        said(500).await;
        let events = lines.of("frames_held");
        assert!((1..10).contains(&events.len()), "{events:?}");
        assert!(number(events.last().unwrap(), "frames") > 250);
        store.delete_recording(id).await.unwrap();
        wait(&*store, &clocks, 3 * 24, HOUR).await;
        said(0).await;
        assert!(stream(&*store).await.expired > 0, "by age: {is_by_age}");
    }
}

/// A boot whose frames were all deleted is forgotten, unless it is among its sensor's last, or its agent holds more of it.
#[tokio::test]
async fn boots_without_frames_go_with_their_frames() {
    let folder = tempfile::tempdir().unwrap();
    let clocks = Clocks::started_at(BEGIN_NS);
    let lines = Lines::default();
    let store = tended(&file(folder.path()), &keep_for(DAY), &clocks, &lines.log());
    let post = async |boot: &str, spooled: Option<u64>| {
        let mut part = part("s1", (0..5).map(frame).collect());
        part.account = spooled.map(|spooled| account(10, 0, spooled));
        let batch = Arc::new(batch("pi-1", boot, vec![part]));
        store.append(batch, clocks.utc_ns()).await.unwrap();
        clocks.pass(MINUTE);
    };
    post("first", None).await;
    post("delivered", Some(5)).await;
    post("not-delivered", Some(7)).await;
    let recording = store.start_recording("kept".to_owned(), 1).await;
    post("recorded", None).await;
    let id = recording.unwrap().id;
    store.stop_recording(id, 2).await.unwrap();
    // The batches of `wait` bring no frames, so that their boot has none to delete.
    wait(&store, &clocks, 5 * 24, HOUR).await;
    let last = ["0", "1", "2", "3", "4", "5", "6", "7"];
    for boot in last {
        post(boot, None).await;
    }
    wait(&store, &clocks, 5 * 24, HOUR).await;
    let left = store.streams().await.unwrap();
    let left: Vec<_> = left.iter().map(|stream| &*stream.id.boot).collect();
    let others = ["b1", "not-delivered", "recorded"];
    assert_eq!(left, [&last[..], &others].concat());
    let deleted = lines.of("boot_deleted");
    let deleted: Vec<_> = deleted.iter().map(|event| field(event, "boot")).collect();
    assert_eq!(deleted, ["first", "delivered"]);
    // What comes after all is taken as new, and then "0" is no longer among the last.
    post("first", None).await;
    wait(&store, &clocks, 2, HOUR).await;
    let left = store.streams().await.unwrap();
    let left: Vec<_> = left.iter().map(|stream| &*stream.id.boot).collect();
    let others = ["b1", "first", "not-delivered", "recorded"];
    assert_eq!(left, [&last[1..], &others].concat());
    assert_eq!(store.members(id).await.unwrap().recording.frames, 5);
}
