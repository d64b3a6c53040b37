//! Aging rows in a file: sealed rows read as before, deleted rows are counted.

use crate::batches::{account, batch, counted, frame, missing, numbered, part};
use crate::clocks::{BEGIN_NS, Clocks, SECOND_NS};
use grideye_collector::store::{Members, StoredRecord, StreamSummary};
use grideye_collector::{
    Clock as _, FrameStore, Limits, Log, SqliteStore, StoreError, StoreLocation,
};
use grideye_frame::{NoData, Reading};
use grideye_recording::Record;
use grideye_recording::wire::Batch;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

/// A store and its clocks.
struct Tended {
    store: SqliteStore,
    clocks: Arc<Clocks>,
}

impl std::ops::Deref for Tended {
    type Target = SqliteStore;

    fn deref(&self) -> &SqliteStore {
        &self.store
    }
}

fn open(folder: &Path, limits: &Limits) -> Tended {
    let location = StoreLocation::File(folder.join("frames.sqlite"));
    let clocks = Clocks::started_at(BEGIN_NS);
    let store = SqliteStore::open_tended(&location, limits, &clocks.handed(), &Log::silent());
    Tended {
        store: store.unwrap(),
        clocks,
    }
}

/// Advances the clocks to this time, then appends.
async fn append(store: &Tended, batch: Batch, t_arrival_ns: i64) {
    let passed = t_arrival_ns.saturating_sub(store.clocks.utc_ns());
    let passed = u64::try_from(passed).unwrap_or(0);
    store.clocks.pass(Duration::from_nanos(passed));
    store.append(Arc::new(batch), t_arrival_ns).await.unwrap();
}

/// Lets seconds pass with only an agent's empty batches.
async fn wait(store: &Tended, from_ns: i64, seconds: i64) {
    wait_in_steps(store, from_ns, seconds, 1).await;
}

async fn wait_in_steps(store: &Tended, from_ns: i64, seconds: i64, each: usize) {
    for second in (0..seconds).step_by(each) {
        append(store, numbered([]), from_ns + second * SECOND_NS).await;
    }
}

fn sql(folder: &Path, query: &str) -> i64 {
    let connection = rusqlite::Connection::open(folder.join("frames.sqlite")).unwrap();
    connection.query_row(query, [], |row| row.get(0)).unwrap()
}

async fn everything(store: &SqliteStore, members: &Members, rows: usize) -> Vec<StoredRecord> {
    let mut records = Vec::new();
    for span in &members.spans {
        let mut after = None;
        loop {
            let page = store.page(span.clone(), after, rows).await.unwrap();
            assert!(page.len() <= rows);
            let Some(last) = page.last() else { break };
            after = Some(last.record.seq);
            records.extend(page);
        }
    }
    records
}

/// Two sensors for ten minutes: batches of five, some missing frames, a gap that is filled late and one that stays.
async fn ten_minutes(store: &Tended) -> Vec<(Members, Vec<StoredRecord>)> {
    let record = |seq: u64| match seq % 97 {
        13 => missing(
            seq,
            NoData::ALL[usize::try_from(seq / 97).unwrap() % NoData::ALL.len()],
        ),
        _ => frame(seq),
    };
    let whole = store.start_recording("whole".to_owned(), 1).await.unwrap();
    let mut middle = None;
    for post in 0..1200_u64 {
        let seqs = (5 * post..5 * post + 5).filter(|seq| !(400..403).contains(seq) && *seq != 4001);
        let rows: Vec<Record> = seqs.map(record).collect();
        let parts = vec![part("s1", rows.clone()), part("s2", rows)];
        let now_ns = BEGIN_NS + i64::try_from(post).unwrap() * SECOND_NS / 2;
        append(store, batch("pi-1", "b1", parts), now_ns).await;
        match post {
            300 => middle = Some(store.start_recording("middle".to_owned(), 2).await.unwrap()),
            700 => {
                let id = middle.as_ref().unwrap().id;
                middle = Some(store.stop_recording(id, 3).await.unwrap());
            }
            900 => append(store, numbered(400..403), now_ns).await,
            _ => {}
        }
    }
    wait(store, BEGIN_NS + 600 * SECOND_NS, 400).await;
    let mut read = Vec::new();
    for id in [whole.id, middle.unwrap().id] {
        for rows in [7, 512, 10_000] {
            let members = store.members(id).await.unwrap();
            let records = everything(store, &members, rows).await;
            read.push((members, records));
        }
    }
    read
}

#[tokio::test]
async fn sealed_rows_read_as_they_did_before() {
    let (sealed, plain) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let soon = Limits {
        seal_after: Duration::from_secs(30),
        ..Limits::default()
    };
    let never = Limits {
        seal_after: Duration::from_secs(1 << 30),
        ..Limits::default()
    };
    let (one, other) = (open(sealed.path(), &soon), open(plain.path(), &never));
    let (read_sealed, read_plain) = (ten_minutes(&one).await, ten_minutes(&other).await);
    let rows = "SELECT coalesce(sum(last_seq - first_seq + 1), 0) FROM chunks WHERE is_sealed";
    assert!(sql(sealed.path(), rows) > 11_000, "little was sealed");
    assert_eq!(sql(plain.path(), rows), 0);
    assert_eq!(read_sealed[0].1.len(), 2 * 5999 - 3);
    assert!(read_sealed == read_plain, "a reader sees a difference");
    for store in [&one, &other] {
        assert_eq!(store.streams().await.unwrap()[0].never_came, 1);
    }
    assert_eq!(one.streams().await.unwrap(), other.streams().await.unwrap());
    assert_eq!(one.newest().await.unwrap(), other.newest().await.unwrap());
    // Repeated frames are known, and other content is rejected.
    let now_ns = BEGIN_NS + 2000 * SECOND_NS;
    let before = one.streams().await.unwrap();
    append(&one, numbered([0, 1, 1500, 4000, 4003]), now_ns).await;
    assert_eq!(one.streams().await.unwrap(), before);
    let mut changed = numbered([1500]);
    if let Reading::Frame(raw) = &mut changed.sensors[0].frames[0].reading {
        raw.pixels[63].0 ^= 1;
    }
    let error = one.append(Arc::new(changed), now_ns).await.unwrap_err();
    assert!(matches!(error, StoreError::Conflict { seq: 1500, .. }));
}

async fn stream(store: &SqliteStore) -> StreamSummary {
    store.streams().await.unwrap().remove(0)
}

#[tokio::test]
async fn frames_that_are_too_old_are_deleted_and_counted_unless_they_are_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let limits = Limits {
        seal_after: Duration::from_secs(60),
        keep_for: Some(Duration::from_secs(3600)),
        ..Limits::default()
    };
    let store = open(folder.path(), &limits);
    let mut recording = None;
    for post in 0..400_u64 {
        match post {
            100 => recording = Some(store.start_recording("r".to_owned(), 1).await.unwrap()),
            200 => drop(
                store
                    .stop_recording(recording.as_ref().unwrap().id, 2)
                    .await
                    .unwrap(),
            ),
            _ => {}
        }
        let all = counted(5 * post..5 * post + 5, account(5 * post + 5, 0, 5));
        let now_ns = BEGIN_NS + i64::try_from(post).unwrap() * SECOND_NS / 2;
        append(&store, all, now_ns).await;
    }
    // Before an hour plus the delay, all are there; later, as soon as the limits allow, only those of the recording.
    wait(&store, BEGIN_NS + 3500 * SECOND_NS, 60).await;
    let rows = "SELECT sum(last_seq - first_seq + 1) FROM chunks";
    assert_eq!(sql(folder.path(), rows), 2000);
    wait_in_steps(&store, BEGIN_NS + 3900 * SECOND_NS, 4000, 10).await;
    assert_eq!(sql(folder.path(), rows), 500);
    let books = stream(&store).await;
    assert_eq!(
        (books.stored, books.expired, books.never_came),
        (2000, 1500, 0)
    );
    assert_eq!(books.unaccounted(), Some(0));
    let members = store.members(recording.unwrap().id).await.unwrap();
    let kept = everything(&store, &members, 512).await;
    let seqs: Vec<u64> = kept.iter().map(|stored| stored.record.seq).collect();
    assert!(seqs == (500..1000).collect::<Vec<_>>());
    // A deleted number stays known.
    append(&store, numbered(0..10), BEGIN_NS + 8000 * SECOND_NS).await;
    assert_eq!(sql(folder.path(), rows), 500);
    assert_eq!(stream(&store).await.stored, 2000);
    // Also after reopening the file.
    store.close().await.unwrap();
    let again = open(folder.path(), &limits);
    assert_eq!(stream(&again).await.expired, 1500);
}

#[tokio::test]
async fn the_oldest_frames_of_a_file_without_room_are_deleted() {
    const ROOM: i64 = 1_500_000;
    let folder = tempfile::tempdir().unwrap();
    let limits = Limits {
        seal_after: Duration::from_secs(1 << 30),
        keep_bytes: Some(ROOM.unsigned_abs()),
        ..Limits::default()
    };
    let store = open(folder.path(), &limits);
    for post in 0..4000_u64 {
        let now_ns = BEGIN_NS + i64::try_from(post).unwrap() * SECOND_NS;
        append(&store, numbered(5 * post..5 * post + 5), now_ns).await;
    }
    let pages = "SELECT (SELECT page_count FROM pragma_page_count) - (SELECT freelist_count FROM pragma_freelist_count)";
    let used = 4096 * sql(folder.path(), pages);
    assert!((ROOM / 2..ROOM * 5 / 4).contains(&used), "{used}");
    let books = stream(&store).await;
    assert_eq!(books.stored, 20_000);
    assert!(books.expired > 5000, "{}", books.expired);
    let usage = store.usage().await.unwrap();
    assert_eq!(
        (usage.deleted_by_age, usage.deleted_by_size),
        (0, books.expired)
    );
    // The newest are there.
    let kept = sql(
        folder.path(),
        "SELECT sum(last_seq - first_seq + 1) FROM chunks",
    );
    assert_eq!(kept + i64::try_from(books.expired).unwrap(), 20_000);
    let first = "SELECT first_seq FROM chunks ORDER BY first_seq LIMIT 1";
    assert_eq!(
        sql(folder.path(), first),
        i64::try_from(books.expired).unwrap()
    );
}

/// The figure holds for the whole file: pages, keys, runs, recordings.
#[tokio::test]
async fn a_real_session_takes_at_most_32_bytes_a_frame_in_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let limits = Limits {
        seal_after: Duration::from_secs(30),
        ..Limits::default()
    };
    let store = open(folder.path(), &limits);
    let name = "Session2_2021-07-01_RoomB_v2.csv";
    let file = std::fs::File::open(format!(
        "{}/../../recordings/linaige/{name}",
        env!("CARGO_MANIFEST_DIR")
    ));
    let rows = grideye_import::open(file.unwrap(), name, &grideye_import::Options::default());
    let session: Vec<Record> = rows.unwrap().map(|row| row.unwrap().record).collect();
    // Fourteen devices, so that the file's empty tables weigh little; no segment has a frame twice.
    let recording = store.start_recording("all".to_owned(), 1).await.unwrap();
    let mut post = 0;
    for device in 0..14 {
        for rows in session.chunks(5) {
            let t_arrival_ns = BEGIN_NS + post * SECOND_NS / 2 + post * 7_919_537 % 8_000_000;
            let parts = vec![part("i2c-1:0x69", rows.to_vec())];
            append(
                &store,
                batch(&format!("pi-{device}"), "5f0c1d2e", parts),
                t_arrival_ns,
            )
            .await;
            post += 1;
        }
    }
    wait(&store, BEGIN_NS + (post / 2 + 1) * SECOND_NS, 400).await;
    let members = store.members(recording.id).await.unwrap();
    let back = everything(&store, &members, 512).await;
    let sent = || (0..14).flat_map(|_| session.iter());
    assert!(back.iter().map(|stored| &stored.record).eq(sent()));
    let pages = "SELECT (SELECT page_count FROM pragma_page_count) - (SELECT freelist_count FROM pragma_freelist_count)";
    let used = u32::try_from(4096 * sql(folder.path(), pages)).unwrap();
    let each = f64::from(used) / f64::from(u32::try_from(back.len()).unwrap());
    println!("{each:.2} bytes a frame in the file, {} frames", back.len());
    assert!(each <= 32.0, "{each:.2}");
}
