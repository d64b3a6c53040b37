//! A store whose file or log another program overwrites or cuts short, and one that is restored: every frame that was
//! acknowledged is there, or somebody is told.

use crate::batches::numbered;
use crate::clocks::{BEGIN_NS, Clocks};
use grideye_collector::store::{RestoreError, backup, restore};
use grideye_collector::{
    FrameStore as _, Limits, Log, LogEvent, SqliteStore, StoreError, StoreLocation,
};
use rusqlite::Connection;
use std::fs::{self, File, OpenOptions};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Arc, Mutex};

type Events = Arc<Mutex<Vec<LogEvent>>>;

fn try_open(path: &Path) -> (Result<SqliteStore, StoreError>, Events) {
    let events = Events::default();
    let sink = Arc::clone(&events);
    let log = Log::new(move |event| sink.lock().unwrap().push(event.clone()));
    let clocks = Clocks::started_at(BEGIN_NS);
    let location = StoreLocation::File(path.to_owned());
    let store = SqliteStore::open_tended(&location, &Limits::default(), &clocks.handed(), &log);
    (store, events)
}

fn open(path: &Path) -> (SqliteStore, Events) {
    let (store, events) = try_open(path);
    (store.unwrap(), events)
}

fn names(events: &Events) -> Vec<&'static str> {
    events
        .lock()
        .unwrap()
        .iter()
        .map(|event| event.event)
        .collect()
}

async fn post(store: &SqliteStore, seqs: Range<u64>) -> Result<u64, StoreError> {
    let appended = store.append(Arc::new(numbered(seqs)), 7).await?;
    Ok(appended.sensors[0].stream.stored)
}

async fn stored(store: &SqliteStore) -> u64 {
    let streams = store.streams().await.unwrap();
    streams.iter().map(|stream| stream.stored).sum()
}

/// Copies by another program: closing a file here would release SQLite's locks on it.
fn cp(from: &Path, to: &Path) {
    let done = Command::new("cp").arg(from).arg(to).status().unwrap();
    assert!(done.success());
}

fn log_of(path: &Path) -> PathBuf {
    PathBuf::from(format!("{}-wal", path.display()))
}

/// The store as `kill -9` of its collector leaves it.
fn killed(path: &Path, to: &Path) {
    cp(path, to);
    cp(&log_of(path), &log_of(to));
}

#[track_caller]
fn assert_is_whole(path: &Path) {
    let file = Connection::open(path).unwrap();
    let found: String = file
        .query_row("PRAGMA integrity_check", [], |row| row.get(0))
        .unwrap();
    assert_eq!(found, "ok");
}

struct Site {
    folder: tempfile::TempDir,
    store: SqliteStore,
    events: Events,
}

impl Site {
    /// A store with 300 frames, a backup of the first 100, and another store.
    async fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let (other, _) = open(&folder.path().join("other"));
        post(&other, 0..900).await.unwrap();
        other.close().await.unwrap();
        let (store, events) = open(&folder.path().join("frames.sqlite"));
        let site = Self {
            folder,
            store,
            events,
        };
        post(&site.store, 0..100).await.unwrap();
        backup(&site.path(), &site.at("backup"), |_, _, _| {}).unwrap();
        for first in (100..300).step_by(20) {
            post(&site.store, first..first + 20).await.unwrap();
        }
        site
    }

    fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn path(&self) -> PathBuf {
        self.at("frames.sqlite")
    }

    /// Nothing more is acknowledged, and everybody who asks is told why, also when the collector ends.
    async fn takes_nothing(&self, part: &str) {
        let health = self.store.ping().await.unwrap_err().to_string();
        assert!(
            health.contains(&format!("{part} was overwritten"))
                && health.contains("grideye restore"),
            "{health}"
        );
        for _ in 0..3 {
            let refused = post(&self.store, 300..310).await;
            assert!(
                matches!(refused, Err(StoreError::Overwritten(found)) if found == part),
                "{refused:?}"
            );
        }
        assert_eq!(names(&self.events), ["store_gone"], "once");
        let ended = self.store.close().await;
        assert!(
            matches!(ended, Err(StoreError::Overwritten(_))),
            "{ended:?}"
        );
    }
}

#[tokio::test]
async fn a_backup_copied_over_the_store_of_a_killed_collector_is_not_mixed_with_its_log() {
    let site = Site::new().await;
    for (copied, frames) in [("backup", 100), ("other", 900)] {
        let path = site.at(&format!("killed-{copied}"));
        killed(&site.path(), &path);
        cp(&site.at(copied), &path);
        let (store, events) = open(&path);
        assert_eq!(names(&events), ["store_log_set_aside"]);
        assert_eq!(stored(&store).await, frames);
        assert_eq!(post(&store, 1000..1010).await.unwrap(), frames + 10);
        store.ping().await.unwrap();
        store.close().await.unwrap();
        assert_is_whole(&path);
        let aside = PathBuf::from(format!("{}.set-aside-1", log_of(&path).display()));
        assert_eq!(
            fs::read(aside).unwrap(),
            fs::read(log_of(&site.path())).unwrap()
        );
    }
}

#[tokio::test]
async fn the_log_of_a_killed_collector_is_its_own_however_often_it_began_anew() {
    let site = Site::new().await;
    let mut next = 300;
    let clean = site.at("clean");
    for round in 0..2 {
        let path = site.at(&format!("killed-{round}"));
        killed(&site.path(), &path);
        let (store, events) = open(&path);
        assert_eq!(
            (names(&events), stored(&store).await),
            (vec![], next),
            "round {round}"
        );
        killed(&path, &clean);
        let (again, events) = open(&clean);
        assert_eq!(
            (names(&events), stored(&again).await),
            (vec![], next),
            "round {round}"
        );
        again.close().await.unwrap();
        store.close().await.unwrap();
        let (again, events) = open(&clean);
        assert_eq!(
            (names(&events), stored(&again).await),
            (vec![], next),
            "round {round}"
        );
        again.close().await.unwrap();
        // Until the log has gone into the file, and a little further.
        let before = fs::metadata(site.path()).unwrap().len();
        while fs::metadata(site.path()).unwrap().len() == before {
            post(&site.store, next..next + 1000).await.unwrap();
            next += 1000;
        }
        post(&site.store, next..next + 1000).await.unwrap();
        next += 1000;
        site.store.ping().await.unwrap();
    }
    assert!(names(&site.events).is_empty());
}

#[tokio::test]
async fn a_file_overwritten_in_place_takes_no_batch_and_stays_as_it_is() {
    for copied in ["backup", "other", "older"] {
        let site = Site::new().await;
        if copied == "older" {
            // A copy of the file alone, as it was before the log last began again.
            cp(&site.path(), &site.at("older"));
            let (mut next, before) = (300, fs::metadata(site.path()).unwrap().len());
            while fs::metadata(site.path()).unwrap().len() == before {
                post(&site.store, next..next + 1000).await.unwrap();
                next += 1000;
            }
        }
        cp(&site.at(copied), &site.path());
        site.takes_nothing("file").await;
        assert_eq!(
            fs::read(site.path()).unwrap(),
            fs::read(site.at(copied)).unwrap()
        );
        if copied != "older" {
            let (store, events) = open(&site.path());
            assert_eq!(names(&events), ["store_log_set_aside"]);
            store.close().await.unwrap();
            assert_is_whole(&site.path());
        }
    }
}

#[tokio::test]
async fn a_file_or_log_cut_short_takes_no_batch() {
    for (part, bytes) in [("file", 0), ("file", 4096), ("log", 0), ("log", 20_000)] {
        let site = Site::new().await;
        let cut = match part {
            "file" => site.path(),
            _ => log_of(&site.path()),
        };
        let done = Command::new("truncate")
            .arg(format!("--size={bytes}"))
            .arg(&cut)
            .status();
        assert!(done.unwrap().success());
        site.takes_nothing(part).await;
        assert_eq!(
            fs::metadata(&cut).unwrap().len(),
            bytes,
            "nothing was written there"
        );
    }
}

#[tokio::test]
async fn a_log_that_another_wrote_over_takes_no_batch() {
    let site = Site::new().await;
    let (other, _) = open(&site.at("third"));
    for first in (0..400).step_by(20) {
        post(&other, first..first + 20).await.unwrap();
    }
    cp(&log_of(&site.at("third")), &log_of(&site.path()));
    site.takes_nothing("log").await;
}

#[tokio::test]
async fn a_start_tells_a_missing_log_and_refuses_a_file_cut_short() {
    let site = Site::new().await;
    let path = site.at("alone");
    cp(&site.path(), &path);
    let (store, events) = open(&path);
    assert_eq!(names(&events), ["store_log_missing"]);
    store.close().await.unwrap();
    // Told once; and a store that was closed needs no log.
    let (store, events) = open(&path);
    assert!(names(&events).is_empty());
    store.close().await.unwrap();
    let bytes = fs::metadata(&path).unwrap().len();
    let file = OpenOptions::new().write(true).open(&path).unwrap();
    file.set_len(bytes - 4096).unwrap();
    let (refused, _) = try_open(&path);
    let refused = refused.unwrap_err().to_string();
    let cut_short = "the store's file was cut short: it ends before its last page\nhint: restore";
    assert!(refused.starts_with(cut_short), "{refused}");
    assert_eq!(fs::metadata(&path).unwrap().len(), bytes - 4096);
}

#[tokio::test]
async fn another_program_may_change_the_tables_and_merge_the_log() {
    let site = Site::new().await;
    let file = Connection::open(site.path()).unwrap();
    file.execute_batch(
        "CREATE INDEX mine ON streams (device); CREATE TABLE more (x); PRAGMA wal_checkpoint(TRUNCATE)",
    )
    .unwrap();
    assert_eq!(post(&site.store, 300..310).await.unwrap(), 310);
    site.store.ping().await.unwrap();
    file.execute_batch("DROP INDEX mine; VACUUM; PRAGMA wal_checkpoint(TRUNCATE)")
        .unwrap();
    assert_eq!(post(&site.store, 310..320).await.unwrap(), 320);
    drop(file);
    site.store.ping().await.unwrap();
    site.store.close().await.unwrap();
    assert!(names(&site.events).is_empty());
    assert_is_whole(&site.path());
}

#[tokio::test]
async fn a_restore_waits_for_no_collector_and_keeps_the_store_that_it_replaces() {
    let site = Site::new().await;
    let put = || restore(&site.at("backup"), &site.path(), |_, _, _| {});
    let refused = put();
    assert!(
        matches!(refused, Err(RestoreError::InUse(_))),
        "{refused:?}"
    );
    assert_eq!(post(&site.store, 300..310).await.unwrap(), 310);
    // A killed collector's store, with its log.
    let path = site.at("killed");
    killed(&site.path(), &path);
    let restored = restore(&site.at("backup"), &path, |_, _, _| {}).unwrap();
    assert_eq!(restored.copied.streams[0].stored, 100);
    let (store, events) = open(&path);
    assert_eq!((names(&events), stored(&store).await), (vec![], 100));
    store.close().await.unwrap();
    assert_is_whole(&path);
    let replaced = restored.replaced.unwrap();
    let (store, events) = open(&replaced);
    assert_eq!((names(&events), stored(&store).await), (vec![], 310));
    store.close().await.unwrap();
    // Where nothing is, nothing is replaced.
    let new = site.at("new");
    assert_eq!(
        restore(&site.at("backup"), &new, |_, _, _| {})
            .unwrap()
            .replaced,
        None
    );
    assert_eq!(
        File::open(&new).unwrap().metadata().unwrap().len() % 4096,
        0
    );
}
