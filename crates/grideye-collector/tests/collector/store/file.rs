//! Checks for a store in a file: restarts, foreign files, a full queue, locks.

use crate::batches::{account, counted, numbered};
use crate::store::helpers::{append, limits, open, open_in};
use grideye_collector::{FrameStore, Limits, SqliteStore, StoreError, StoreLocation};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

#[tokio::test]
async fn acknowledged_frames_survive_a_restart() {
    let folder = tempfile::tempdir().unwrap();
    let store = open_in(folder.path());
    let recording = store.start_recording("before".to_owned(), 1).await.unwrap();
    append(&store, counted(0..5, account(6, 0, 6))).await;
    let before = (
        store.streams().await.unwrap(),
        store.newest().await.unwrap(),
    );
    // Dropped without closing, as if killed: everything acknowledged must be there.
    drop(store);
    let store = open_in(folder.path());
    assert_eq!(
        (
            store.streams().await.unwrap(),
            store.newest().await.unwrap()
        ),
        before
    );
    append(&store, numbered(0..7)).await;
    let stopped = store.stop_recording(recording.id, 9).await.unwrap();
    assert_eq!(stopped.frames, 7);
}

#[tokio::test]
async fn a_file_of_a_version_without_notes_and_labels_takes_them() {
    let folder = tempfile::tempdir().unwrap();
    let store = open_in(folder.path());
    let recording = store.start_recording("before".to_owned(), 1).await.unwrap();
    store.close().await.unwrap();
    rusqlite::Connection::open(folder.path().join("frames.sqlite"))
        .unwrap()
        .execute_batch("DROP TABLE notes; DROP TABLE labels")
        .unwrap();
    let store = open_in(folder.path());
    let noted = store.note_recording(recording.id, "now".to_owned()).await;
    assert_eq!(noted.unwrap().note, "now");
    assert_eq!(store.labels(recording.id).await.unwrap(), []);
}

#[tokio::test]
async fn a_file_that_only_this_user_can_read() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let store = open_in(folder.path());
    append(&store, numbered(0..5)).await;
    for entry in std::fs::read_dir(folder.path()).unwrap() {
        let entry = entry.unwrap();
        let mode = entry.metadata().unwrap().permissions().mode();
        assert_eq!(mode & 0o077, 0, "{}", entry.path().display());
    }
}

fn refusal(path: &Path) -> String {
    let error = SqliteStore::open(&StoreLocation::File(path.to_owned()), &limits()).unwrap_err();
    error.to_string()
}

#[test]
fn a_foreign_file_is_rejected_and_unchanged() {
    let folder = tempfile::tempdir().unwrap();
    let text = folder.path().join("notes.txt");
    std::fs::write(
        &text,
        "nothing like a database, and long enough to be looked at\n".repeat(40),
    )
    .unwrap();
    assert!(
        refusal(&text).contains("not a database\nhint: "),
        "{}",
        refusal(&text)
    );
    assert!(
        std::fs::read_to_string(&text)
            .unwrap()
            .starts_with("nothing like")
    );

    let foreign = folder.path().join("foreign.sqlite");
    rusqlite::Connection::open(&foreign)
        .unwrap()
        .execute_batch("CREATE TABLE mine (x)")
        .unwrap();
    let before = std::fs::read(&foreign).unwrap();
    assert!(
        refusal(&foreign).contains("another program\nhint: "),
        "{}",
        refusal(&foreign)
    );
    assert!(
        std::fs::read(&foreign).unwrap() == before,
        "a file of another program was written to"
    );

    let newer = folder.path().join("newer.sqlite");
    drop(open(&StoreLocation::File(newer.clone())));
    rusqlite::Connection::open(&newer)
        .unwrap()
        .pragma_update(None, "user_version", 5)
        .unwrap();
    assert!(refusal(&newer).contains("layout 5"), "{}", refusal(&newer));

    assert!(
        refusal(folder.path()).contains("hint: "),
        "{}",
        refusal(folder.path())
    );
    let nowhere = refusal(&folder.path().join("no/such/folder.sqlite"));
    assert!(
        nowhere.contains("No such file") && nowhere.contains("hint: the folder must exist"),
        "{nowhere}"
    );
}

/// A store with its file locked by another connection, so that nothing is written.
fn held(folder: &Path, limits: &Limits) -> (SqliteStore, rusqlite::Connection) {
    let path = folder.join("frames.sqlite");
    let store = SqliteStore::open(&StoreLocation::File(path.clone()), limits).unwrap();
    let other = rusqlite::Connection::open(path).unwrap();
    other.execute_batch("BEGIN IMMEDIATE").unwrap();
    (store, other)
}

#[tokio::test]
async fn a_full_queue_refuses_and_loses_nothing_that_it_took() {
    let folder = tempfile::tempdir().unwrap();
    let limits = Limits {
        writer_queue_max: 4,
        commit_group_max: 2,
        ..limits()
    };
    let (store, other) = held(folder.path(), &limits);
    // The writer holds at most one group, and the queue four more.
    let posts: Vec<_> = (0..12)
        .map(|seq| store.append(Arc::new(numbered([seq])), 1))
        .collect();
    other.execute_batch("ROLLBACK").unwrap();
    let mut kept = 0;
    for post in posts {
        match post.await {
            Ok(_) => kept += 1,
            Err(error) => assert!(matches!(error, StoreError::Busy(4)), "{error}"),
        }
    }
    assert!((4..=6).contains(&kept), "{kept} were taken");
    assert_eq!(store.streams().await.unwrap()[0].stored, kept);
}

#[tokio::test]
async fn a_file_that_another_program_holds_is_waited_for_and_then_given_up() {
    let folder = tempfile::tempdir().unwrap();
    let limits = Limits {
        store_lock_time_max: Duration::from_millis(50),
        ..limits()
    };
    let (store, other) = held(folder.path(), &limits);
    let error = store.append(Arc::new(numbered([0])), 1).await.unwrap_err();
    assert!(matches!(error, StoreError::Locked), "{error}");
    assert!(error.to_string().contains("\nhint: close"), "{error}");
    other.execute_batch("ROLLBACK").unwrap();
    append(&store, numbered([0])).await;
}

#[tokio::test]
async fn a_store_that_cannot_write_is_ill_until_it_writes_again() {
    let folder = tempfile::tempdir().unwrap();
    let limits = Limits {
        store_lock_time_max: Duration::from_millis(50),
        ..limits()
    };
    let (store, other) = held(folder.path(), &limits);
    store.ping().await.unwrap();
    store.append(Arc::new(numbered([0])), 1).await.unwrap_err();
    assert!(matches!(store.ping().await, Err(StoreError::Locked)));
    other.execute_batch("ROLLBACK").unwrap();
    append(&store, numbered([0])).await;
    store.ping().await.unwrap();
    // A batch rejected for its content is not an error of the store.
    let mut other_content = numbered([0]);
    other_content.sensors[0].frames[0].stamp.t_boot_ns += 1;
    let other_content = Arc::new(other_content);
    let refused = store.append(Arc::clone(&other_content), 1).await;
    assert!(matches!(refused, Err(StoreError::Conflict { .. })));
    store.ping().await.unwrap();
    // Nor does it show that the store can write again.
    other.execute_batch("BEGIN IMMEDIATE").unwrap();
    store.append(Arc::new(numbered([1])), 1).await.unwrap_err();
    other.execute_batch("ROLLBACK").unwrap();
    store.append(other_content, 1).await.unwrap_err();
    assert!(matches!(store.ping().await, Err(StoreError::Locked)));
}

#[tokio::test]
async fn a_write_that_fails_undoes_its_whole_commit_and_says_so_to_all_in_it() {
    let folder = tempfile::tempdir().unwrap();
    let store = open_in(folder.path());
    append(&store, numbered(0..5)).await;
    // Rolls back the whole transaction, as SQLite does when a disk is full.
    let other = rusqlite::Connection::open(folder.path().join("frames.sqlite")).unwrap();
    let fault =
        "CREATE TRIGGER fault BEFORE INSERT ON arrivals WHEN 8 BETWEEN new.first_seq AND new.last_seq
                 BEGIN SELECT RAISE(ROLLBACK, 'full'); END; BEGIN IMMEDIATE";
    other.execute_batch(fault).unwrap();
    // While the file is locked, the first goes alone, and the others wait and share the next commit.
    let alone = store.append(Arc::new(numbered([20])), 1);
    let shared: Vec<_> = [5, 8, 9]
        .map(|seq| store.append(Arc::new(numbered([seq])), 1))
        .into();
    other.execute_batch("COMMIT").unwrap();
    let mut failed = usize::from(alone.await.is_err());
    for post in shared {
        failed += usize::from(post.await.is_err());
    }
    let kept = store.streams().await.unwrap()[0].stored;
    assert!(failed >= 1);
    assert_eq!(
        kept,
        5 + 4 - u64::try_from(failed).unwrap(),
        "nothing is stored exactly if the answer is an error"
    );
    other.execute_batch("DROP TRIGGER fault").unwrap();
    append(&store, numbered([5, 8, 9, 20])).await;
    assert_eq!(store.streams().await.unwrap()[0].stored, 9);
}

#[test]
fn a_full_disk_is_distinguished_from_other_errors() {
    for (code, expected) in [
        (
            rusqlite::ffi::SQLITE_FULL,
            "the disk that holds the store is full",
        ),
        (rusqlite::ffi::SQLITE_IOERR, "the store failed: "),
        (
            rusqlite::ffi::SQLITE_READONLY,
            "attempt to write a readonly database\nhint: ",
        ),
    ] {
        let error = rusqlite::Error::SqliteFailure(rusqlite::ffi::Error::new(code), None);
        let told = StoreError::from(error).to_string();
        assert!(told.contains(expected), "{told}");
    }
}
