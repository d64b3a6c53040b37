//! Backups of a store in a file: what they contain, what they reject, and what they leave behind.

use crate::batches::{account, batch, counted, flat, frame, missing, numbered, part};
use grideye_collector::store::{BackedUp, BackupError, Stage, backup};
use grideye_collector::{FrameStore as _, Limits, SqliteStore, StoreLocation};
use grideye_frame::NoData;
use rusqlite::Connection;
use std::fs::{self, File};
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

fn open(path: &Path) -> SqliteStore {
    let location = StoreLocation::File(path.to_owned());
    SqliteStore::open(&location, &Limits::default()).unwrap()
}

fn back_up(file: &Path, out: &Path) -> Result<BackedUp, BackupError> {
    backup(file, out, |_, _, _| {})
}

#[track_caller]
fn refused(file: &Path, out: &Path, expected: &str) {
    let error = back_up(file, out).unwrap_err().to_string();
    assert!(error.contains(expected), "{error}");
    assert!(error.contains("\nhint: "), "{error}");
    assert!(!partial(out).exists(), "{error}");
}

fn partial(out: &Path) -> PathBuf {
    PathBuf::from(format!("{}.partial", out.display()))
}

/// A store with plain, sealed and missing frames, and arrivals that have not yet moved.
async fn specimen(path: &Path) -> SqliteStore {
    let limits = Limits {
        seal_after: std::time::Duration::ZERO,
        ..Limits::default()
    };
    let store = SqliteStore::open(&StoreLocation::File(path.to_owned()), &limits).unwrap();
    store.start_recording("all".to_owned(), 1).await.unwrap();
    for first in (0..200).step_by(50) {
        let seqs = first..first + 50;
        let sent = counted(seqs, account(first + 50, 0, 50));
        let t_arrival_ns = i64::try_from(first).unwrap() * 1_000_000_000;
        store.append(Arc::new(sent), t_arrival_ns).await.unwrap();
    }
    store.streams().await.unwrap();
    let gaps = vec![frame(3), missing(4, NoData::Nack), flat(9, 1, 2)];
    let late = batch(
        "pi-2",
        "b2",
        vec![part("s1", gaps), part("s2", vec![frame(0)])],
    );
    store.append(Arc::new(late), 200_000_000_000).await.unwrap();
    let sent = counted(200..210, account(212, 2, 10));
    store.append(Arc::new(sent), 200_000_000_001).await.unwrap();
    store
}

#[tokio::test]
async fn a_backup_of_a_store_in_use_is_whole() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("s"), folder.path().join("a b%?#\u{e9}"));
    let store = specimen(&file).await;
    // A leftover of a killed backup.
    fs::write(partial(&out), vec![7; 1 << 20]).unwrap();
    let mut heard = Vec::new();
    let backed_up = backup(&file, &out, |stage, done, all| {
        heard.push((stage, done, all));
    })
    .unwrap();
    assert_eq!(heard.first().unwrap().0, Stage::Copying);
    let frames = 210 + 2 + 1;
    assert_eq!(*heard.last().unwrap(), (Stage::Comparing, frames, frames));
    let mode = fs::metadata(&out).unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o600);
    assert_eq!(fs::metadata(&out).unwrap().len(), backed_up.bytes);
    let mut names: Vec<_> = fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| !name.starts_with("s-"))
        .collect();
    names.sort();
    assert_eq!(names, ["a b%?#\u{e9}", "s"], "nothing else is left");

    let restored = open(&out);
    let (before, after) = (
        store.streams().await.unwrap(),
        restored.streams().await.unwrap(),
    );
    assert_eq!(before, after);
    assert_eq!(before, backed_up.streams);
    assert_eq!(after[0].unaccounted(), Some(0));
    assert_eq!(backed_up.recordings, 1);
    let recordings = restored.recordings().await.unwrap();
    assert_eq!(store.recordings().await.unwrap(), recordings);
    let (kept, copied) = (
        store.members(recordings[0].id).await.unwrap(),
        restored.members(recordings[0].id).await.unwrap(),
    );
    assert_eq!(kept.spans.len(), 3);
    for (kept, copied) in kept.spans.into_iter().zip(copied.spans) {
        let kept = store.page(kept, None, 1000).await.unwrap();
        assert!(!kept.is_empty());
        assert_eq!(kept, restored.page(copied, None, 1000).await.unwrap());
    }
    // The same frames again, and new ones: the copy is a normal store.
    let again = restored.append(Arc::new(numbered(205..215)), 9).await;
    assert_eq!(again.unwrap().sensors[0].fresh, [210, 211, 212, 213, 214]);
}

#[tokio::test]
async fn a_backup_replaces_no_file_and_is_of_a_store_alone() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let store = specimen(&at("store")).await;
    store.close().await.unwrap();
    fs::write(at("taken"), "mine").unwrap();
    refused(&at("store"), &at("taken"), "exists already");
    assert_eq!(fs::read_to_string(at("taken")).unwrap(), "mine");
    std::os::unix::fs::symlink(at("nowhere"), at("dangling")).unwrap();
    refused(&at("store"), &at("dangling"), "exists already");
    fs::hard_link(at("store"), at("link")).unwrap();
    for itself in ["store", "link"] {
        refused(&at("store"), &at(itself), "is the store itself");
    }
    refused(&at("none"), &at("out"), "there is no store");
    refused(&at("taken"), &at("out"), "not a database");
    refused(&at("store"), &at("no/folder/out"), "cannot write");
    File::create(at("empty")).unwrap();
    refused(&at("empty"), &at("out"), "another program");
    let newer = Connection::open(at("store")).unwrap();
    newer.pragma_update(None, "user_version", 1000).unwrap();
    drop(newer);
    refused(&at("store"), &at("out"), "layout 1000");
    assert!(!at("out").exists());
}

#[tokio::test]
async fn a_backup_that_is_not_the_store_is_not_kept() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("store"), folder.path().join("out"));
    specimen(&file).await.close().await.unwrap();
    // One frame less than counted.
    let store = Connection::open(&file).unwrap();
    let sql = "UPDATE streams SET stored = stored + 1 WHERE device = 'pi-2' AND sensor = 's2'";
    assert_eq!(store.execute(sql, []).unwrap(), 1);
    drop(store);
    refused(&file, &out, "not whole: StreamId");
    // A chunk that cannot be decoded.
    let store = Connection::open(&file).unwrap();
    store
        .execute(
            "UPDATE streams SET stored = stored - 1 WHERE sensor = 's2'",
            [],
        )
        .unwrap();
    store
        .execute("UPDATE chunks SET rows = x'00' WHERE first_seq = 0", [])
        .unwrap();
    drop(store);
    refused(&file, &out, "not whole: ");
    assert!(!out.exists());
}

#[tokio::test]
async fn two_backups_to_one_file_do_not_mix() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("store"), folder.path().join("out"));
    let _store = specimen(&file).await;
    let mut second = None;
    backup(&file, &out, |stage, _, _| {
        if stage == Stage::Comparing && second.is_none() {
            second = Some(back_up(&file, &out).unwrap_err().to_string());
        }
    })
    .unwrap();
    let second = second.unwrap();
    assert!(
        second.starts_with("another backup is being written"),
        "{second}"
    );
    assert!(matches!(
        back_up(&file, &out),
        Err(BackupError::Exists { .. })
    ));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_store_that_is_written_meanwhile_is_backed_up_as_it_was_at_the_beginning() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("store"), folder.path().join("out"));
    let store = specimen(&file).await;
    let before = store.streams().await.unwrap();
    let mut steps = 0;
    let mut seq = 1000;
    let runtime = tokio::runtime::Handle::current();
    let backed_up = tokio::task::block_in_place(|| {
        backup(&file, &out, |_, _, _| {
            steps += 1;
            seq += 1;
            let posted = runtime.block_on(store.append(Arc::new(numbered([seq])), 7));
            assert!(posted.is_ok(), "{posted:?}");
        })
    });
    assert_eq!(backed_up.unwrap().streams, before);
    let restored = open(&out);
    assert_eq!(restored.streams().await.unwrap(), before);
    let now = store.streams().await.unwrap();
    assert_eq!(now[0].stored, before[0].stored + steps);
}
