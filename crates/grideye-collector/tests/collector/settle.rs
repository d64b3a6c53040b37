//! Acknowledged frames in a file, moved into its chunks or not: after a crash, beside another program, after an error.

use crate::batches::{account, batch, counted, frame, missing, numbered, part};
use grideye_collector::store::{StoredRecord, StreamSummary};
use grideye_collector::{FrameStore, Limits, SqliteStore, StoreLocation};
use grideye_frame::NoData;
use grideye_recording::wire::Batch;
use std::path::Path;
use std::sync::Arc;

const SECOND_NS: i64 = 1_000_000_000;

fn open(folder: &Path) -> SqliteStore {
    let location = StoreLocation::File(folder.join("frames.sqlite"));
    SqliteStore::open(&location, &Limits::default()).unwrap()
}

fn sql(folder: &Path, query: &str) -> i64 {
    let connection = rusqlite::Connection::open(folder.join("frames.sqlite")).unwrap();
    connection.query_row(query, [], |row| row.get(0)).unwrap()
}

/// A few seconds of two devices: late, repeated and reordered batches, accounts, an end, a second boot.
fn posts() -> Vec<(Batch, i64)> {
    let other = |seqs: std::ops::Range<u64>| {
        let record = |seq| match seq % 4 {
            1 => missing(seq, NoData::HostStalled),
            _ => frame(seq),
        };
        let frames: Vec<_> = seqs.map(record).collect();
        batch(
            "pi-2",
            "b9",
            vec![part("s1", frames.clone()), part("s2", frames)],
        )
    };
    let mut ended = counted(40..45, account(50, 5, 0));
    if let Some(account) = &mut ended.sensors[0].account {
        account.ended = true;
    }
    let posts = [
        counted(0..5, account(5, 0, 0)),
        other(0..4),
        counted(10..15, account(15, 0, 5)),
        counted(5..10, account(10, 0, 0)),
        counted(10..15, account(15, 0, 5)),
        other(4..8),
        counted(15..20, account(20, 0, 0)),
        other(2..9),
        counted(20..40, account(40, 0, 0)),
        ended,
        batch("pi-1", "b2", vec![part("s1", vec![frame(0)])]),
        counted(30..42, account(41, 0, 0)),
        other(20..24),
    ];
    let times = (0_i64..).map(|post| 1_700_000_000 * SECOND_NS + post * 1_300_000_000);
    posts.into_iter().zip(times).collect()
}

/// Everything a reader can see.
async fn seen(store: &SqliteStore) -> (Vec<StreamSummary>, Vec<StoredRecord>, Vec<StoredRecord>) {
    let streams = store.streams().await.unwrap();
    let recordings = store.recordings().await.unwrap();
    let mut rows = Vec::new();
    for recording in recordings {
        for span in store.members(recording.id).await.unwrap().spans {
            rows.extend(store.page(span, None, 10_000).await.unwrap());
        }
    }
    (streams, store.newest().await.unwrap(), rows)
}

/// The file as left by a power cut.
fn copy_as_it_is(from: &Path, to: &Path) {
    for name in ["frames.sqlite", "frames.sqlite-wal"] {
        std::fs::copy(from.join(name), to.join(name)).unwrap();
    }
}

#[tokio::test]
async fn after_a_crash_at_any_batch_every_acknowledged_frame_exists_once() {
    let posts = posts();
    let mut waiting_at_most = 0;
    for crash_after in 1..=posts.len() {
        let (folder, crashed) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let store = open(folder.path());
        // Moved after each batch: the file must end like this.
        let reference = SqliteStore::open(&StoreLocation::Memory, &Limits::default()).unwrap();
        for store in [&store, &reference] {
            store.start_recording("all".to_owned(), 1).await.unwrap();
        }
        for (batch, t_arrival_ns) in &posts[..crash_after] {
            let batch = Arc::new(batch.clone());
            let one = store.append(Arc::clone(&batch), *t_arrival_ns);
            let one = one.await.unwrap();
            let other = reference.append(batch, *t_arrival_ns).await.unwrap();
            assert_eq!(one, other);
            reference.streams().await.unwrap();
        }
        copy_as_it_is(folder.path(), crashed.path());
        let waiting = sql(crashed.path(), "SELECT count(*) FROM arrivals");
        waiting_at_most = waiting_at_most.max(waiting);
        let again = open(crashed.path());
        // The next batch finds the streams unchanged, and its repeated frames are known.
        let (repeated, t_arrival_ns) = &posts[crash_after - 1];
        for store in [&again, &reference] {
            let repeated = Arc::new(repeated.clone());
            store.append(repeated, *t_arrival_ns).await.unwrap();
        }
        assert_eq!(seen(&again).await, seen(&reference).await, "{crash_after}");
        assert_eq!(sql(crashed.path(), "SELECT count(*) FROM arrivals"), 0);
    }
    assert!(waiting_at_most >= 4, "nothing waited: {waiting_at_most}");
    assert!(waiting_at_most < 10, "nothing moved in between");
}

#[tokio::test]
async fn two_programs_on_one_file_see_what_the_other_stored() {
    let folder = tempfile::tempdir().unwrap();
    let stores = [open(folder.path()), open(folder.path())];
    for seq in 0..40 {
        let store = &stores[usize::try_from(seq % 3 % 2).unwrap()];
        store.append(Arc::new(numbered([seq])), 1).await.unwrap();
        // One or the other stored it, once.
        let again = Arc::new(numbered([seq / 2]));
        let appended = stores[1].append(again, 1).await.unwrap();
        assert_eq!(appended.sensors[0].stream.stored, seq + 1);
    }
    assert_eq!(seen(&stores[0]).await, seen(&stores[1]).await);
    assert_eq!(stores[0].streams().await.unwrap()[0].stored, 40);
    assert_eq!(
        sql(
            folder.path(),
            "SELECT sum(last_seq - first_seq + 1) FROM chunks"
        ),
        40
    );
}

#[tokio::test]
async fn a_table_that_cannot_be_written_refuses_the_batch_whole_until_it_can() {
    let folder = tempfile::tempdir().unwrap();
    let store = open(folder.path());
    let before = store.append(Arc::new(numbered(0..5)), 1).await.unwrap();
    let other = rusqlite::Connection::open(folder.path().join("frames.sqlite")).unwrap();
    for (statement, table) in [
        ("INSERT", "arrivals"),
        ("INSERT", "runs"),
        ("UPDATE", "streams"),
        ("UPDATE", "counters"),
    ] {
        let fault = format!(
            "CREATE TRIGGER fault BEFORE {statement} ON {table} BEGIN SELECT RAISE(ABORT, 'no'); END"
        );
        other.execute_batch(&fault).unwrap();
        // The numbers leave a gap, so that every table has a new row.
        let late = counted(10..15, account(15, 0, 0));
        store.append(Arc::new(late), 2).await.unwrap_err();
        let streams = store.streams().await.unwrap();
        assert_eq!(streams[..], [before.sensors[0].stream.clone()], "{table}");
        other.execute_batch("DROP TRIGGER fault").unwrap();
    }
    let late = counted(10..15, account(15, 0, 0));
    let appended = store.append(Arc::new(late), 2).await.unwrap();
    assert_eq!(appended.sensors[0].fresh, [10, 11, 12, 13, 14]);
    assert_eq!(store.streams().await.unwrap()[0].stored, 10);
}

#[tokio::test]
async fn arrivals_that_cannot_move_hold_nothing_up_and_move_later() {
    let folder = tempfile::tempdir().unwrap();
    let store = open(folder.path());
    store.append(Arc::new(numbered(0..5)), 1).await.unwrap();
    store.newest().await.unwrap();
    let other = rusqlite::Connection::open(folder.path().join("frames.sqlite")).unwrap();
    let fault = "CREATE TRIGGER fault BEFORE INSERT ON chunks BEGIN SELECT RAISE(ABORT, 'no'); END";
    other.execute_batch(fault).unwrap();
    for seq in 5..10 {
        let appended = store.append(Arc::new(numbered([seq])), 1).await.unwrap();
        assert_eq!(appended.sensors[0].stream.durable_through, Some(seq));
        assert_eq!(store.streams().await.unwrap()[0].stored, seq + 1);
        // A reader of frames gets those that have moved.
        assert_eq!(store.newest().await.unwrap()[0].record.seq, 4);
    }
    other.execute_batch("DROP TRIGGER fault").unwrap();
    assert_eq!(store.newest().await.unwrap()[0].record.seq, 9);
    assert_eq!(sql(folder.path(), "SELECT count(*) FROM arrivals"), 0);
}
