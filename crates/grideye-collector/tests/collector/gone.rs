//! A store with its file deleted, moved or replaced while it is open: nothing is acknowledged into a lost file, and no
//! acknowledged frame is lost.

use crate::batches::numbered;
use crate::server::Server;
use grideye_collector::{
    FrameStore as _, Limits, Log, LogEvent, SqliteStore, StoreError, StoreLocation,
};
use serde_json::json;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Arc, Mutex};

/// A store in its own folder, with a recording of everything.
struct Site {
    folder: tempfile::TempDir,
    store: SqliteStore,
    events: Arc<Mutex<Vec<LogEvent>>>,
}

impl Site {
    async fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("store")).unwrap();
        let events = Arc::<Mutex<Vec<LogEvent>>>::default();
        let sink = Arc::clone(&events);
        let log = Log::new(move |event| sink.lock().unwrap().push(event.clone()));
        let location = StoreLocation::File(path(folder.path()));
        let store =
            SqliteStore::open_tended(&location, &Limits::default(), &clock(), &log).unwrap();
        store.start_recording("all".to_owned(), 1).await.unwrap();
        Self {
            folder,
            store,
            events,
        }
    }

    fn path(&self) -> PathBuf {
        path(self.folder.path())
    }

    fn log(&self) -> PathBuf {
        let mut path = self.path().into_os_string();
        path.push("-wal");
        path.into()
    }

    /// A path beside the store's folder.
    fn elsewhere(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    async fn post(&self, seqs: Range<u64>) -> Result<u64, StoreError> {
        let appended = self.store.append(Arc::new(numbered(seqs)), 7).await?;
        Ok(appended.sensors[0].stream.stored)
    }

    /// Posts the first batch and waits for all the writer's follow-up work.
    async fn begin(&self) {
        self.post(0..5).await.unwrap();
        self.store.streams().await.unwrap();
    }

    /// Checks that nothing is acknowledged.
    #[track_caller]
    fn refused<T: std::fmt::Debug>(&self, answer: Result<T, StoreError>, expected: (&str, &str)) {
        match answer {
            Err(StoreError::Gone { part, fate }) => assert_eq!((part, fate), expected),
            other => panic!("{other:?} {:?}", self.events()),
        }
    }

    async fn takes_nothing(&self, part: &str, fate: &str) {
        let gone = (part, fate);
        self.refused(self.post(5..10).await, gone);
        self.refused(self.post(5..10).await, gone);
        self.refused(self.store.start_recording("b".to_owned(), 2).await, gone);
        self.refused(self.store.ping().await, gone);
        assert_eq!(self.events(), ["store_gone"], "once, not for each batch");
    }

    async fn goes_on(&self) {
        self.store.ping().await.unwrap();
        assert_eq!(self.post(5..10).await.unwrap(), 10, "each frame once");
        assert_eq!(self.post(10..15).await.unwrap(), 15);
        self.store.ping().await.unwrap();
        assert_eq!(self.events(), ["store_gone", "store_back"]);
        self.store.close().await.unwrap();
        assert_eq!(readable(&self.path()).await, Vec::from_iter(0..15));
    }

    fn events(&self) -> Vec<&'static str> {
        let events = self.events.lock().unwrap();
        events.iter().map(|event| event.event).collect()
    }

    fn field(&self, name: &str) -> String {
        let events = self.events.lock().unwrap();
        let field = events[0].fields.iter().find(|(field, _)| *field == name);
        field.unwrap().1.clone()
    }

    /// Does what the log's hint says, up to "then".
    fn follow_hint(&self) {
        let hint = self.field("hint");
        let (_, command) = hint.split_once("copy it now: ").unwrap();
        let (command, _) = command.split_once("; then").unwrap();
        let saved = self.elsewhere("saved").display().to_string();
        let command = command.replace("SAVED", &saved);
        let done = Command::new("sh").args(["-c", &command]).status().unwrap();
        assert!(done.success(), "{command}");
    }
}

fn path(folder: &Path) -> PathBuf {
    folder.join("store/frames.sqlite")
}

/// The numbers of the frames that a collector reads there from the recording.
async fn readable(path: &Path) -> Vec<u64> {
    let location = StoreLocation::File(path.to_owned());
    let store = SqliteStore::open(&location, &Limits::default()).unwrap();
    let all = store.recordings().await.unwrap().pop().unwrap().id;
    let mut seqs = Vec::new();
    for span in store.members(all).await.unwrap().spans {
        let records = store.page(span, None, 10_000).await.unwrap();
        seqs.extend(records.iter().map(|stored| stored.record.seq));
    }
    let stored: u64 = store
        .streams()
        .await
        .unwrap()
        .iter()
        .map(|s| s.stored)
        .sum();
    assert_eq!(stored, u64::try_from(seqs.len()).unwrap());
    store.close().await.unwrap();
    seqs
}

/// Another store, with one frame.
async fn another(path: &Path) {
    let location = StoreLocation::File(path.to_owned());
    let store = SqliteStore::open(&location, &Limits::default()).unwrap();
    store.start_recording("other".to_owned(), 1).await.unwrap();
    store.append(Arc::new(numbered([99])), 7).await.unwrap();
    store.close().await.unwrap();
}

#[tokio::test]
async fn a_file_that_was_moved_is_written_again_once_it_is_back() {
    let site = Site::new().await;
    site.begin().await;
    fs::rename(site.path(), site.elsewhere("moved")).unwrap();
    site.takes_nothing("file", "moved away").await;
    assert!(site.field("hint").starts_with("put it back to "));
    fs::rename(site.elsewhere("moved"), site.path()).unwrap();
    site.goes_on().await;
}

#[tokio::test]
async fn a_folder_that_was_moved_is_written_to_again_once_it_is_back() {
    let site = Site::new().await;
    site.begin().await;
    let folder = site.elsewhere("store");
    fs::rename(&folder, site.elsewhere("moved")).unwrap();
    site.takes_nothing("file", "moved away").await;
    fs::rename(site.elsewhere("moved"), &folder).unwrap();
    site.goes_on().await;
}

#[tokio::test]
async fn a_file_that_another_has_the_place_of_is_written_again_once_it_is_back() {
    let site = Site::new().await;
    another(&site.elsewhere("other")).await;
    site.begin().await;
    fs::rename(site.path(), site.elsewhere("moved")).unwrap();
    fs::copy(site.elsewhere("other"), site.path()).unwrap();
    site.takes_nothing("file", "replaced by another file").await;
    fs::rename(site.elsewhere("moved"), site.path()).unwrap();
    site.goes_on().await;
}

#[tokio::test]
async fn a_log_that_was_moved_is_written_again_once_it_is_back() {
    let site = Site::new().await;
    site.begin().await;
    fs::rename(site.log(), site.elsewhere("moved")).unwrap();
    site.takes_nothing("log", "moved away").await;
    fs::rename(site.elsewhere("moved"), site.log()).unwrap();
    site.goes_on().await;
}

#[tokio::test]
async fn a_file_that_was_moved_is_whole_without_its_log_once_the_collector_has_stopped() {
    let site = Site::new().await;
    site.begin().await;
    fs::rename(site.path(), site.elsewhere("moved")).unwrap();
    site.takes_nothing("file", "moved away").await;
    let ended = site.store.close().await;
    site.refused(ended, ("file", "moved away"));
    // 5 to 9 were committed before the loss was noticed; sending them again makes no difference.
    assert_eq!(
        readable(&site.elsewhere("moved")).await,
        Vec::from_iter(0..10)
    );
}

#[tokio::test]
async fn a_file_that_was_deleted_is_saved_as_the_log_says() {
    let site = Site::new().await;
    site.begin().await;
    fs::remove_dir_all(site.elsewhere("store")).unwrap();
    site.takes_nothing("file", "deleted").await;
    site.follow_hint();
    let ended = site.store.close().await;
    site.refused(ended, ("file", "deleted"));
    let saved = site.elsewhere("saved");
    assert_eq!(readable(&saved).await, Vec::from_iter(0..10));
    let store = SqliteStore::open(&StoreLocation::File(saved), &Limits::default()).unwrap();
    let again = store.append(Arc::new(numbered(5..10)), 7).await.unwrap();
    assert_eq!(
        again.sensors[0].stream.stored, 10,
        "redelivered, and counted once"
    );
}

#[tokio::test]
async fn a_file_that_was_written_over_is_saved_as_the_log_says_and_its_log_is_not_mixed_into_the_other()
 {
    let site = Site::new().await;
    another(&site.elsewhere("other")).await;
    site.begin().await;
    fs::rename(site.elsewhere("other"), site.path()).unwrap();
    site.takes_nothing("file", "replaced by another file").await;
    site.follow_hint();
    let ended = site.store.close().await;
    site.refused(ended, ("file", "replaced by another file"));
    let saved = site.elsewhere("saved");
    assert_eq!(readable(&saved).await, Vec::from_iter(0..10));
    assert_eq!(readable(&site.path()).await, [99]);
}

#[tokio::test]
async fn a_deleted_log_is_saved_into_the_file_and_a_restart_takes_batches_again() {
    let site = Site::new().await;
    site.begin().await;
    fs::remove_file(site.log()).unwrap();
    site.takes_nothing("log", "deleted").await;
    assert!(site.field("at_risk").starts_with("nothing"));
    // The file alone, as after `kill -9`. Copied by another program, because closing it here would release SQLite's
    // locks.
    let alone = site.elsewhere("alone");
    let copied = Command::new("cp").arg(site.path()).arg(&alone).status();
    assert!(copied.unwrap().success());
    assert_eq!(readable(&alone).await, Vec::from_iter(0..10));
    site.store.close().await.unwrap();
    assert_eq!(readable(&site.path()).await, Vec::from_iter(0..10));
    let location = StoreLocation::File(site.path());
    let store = SqliteStore::open(&location, &Limits::default()).unwrap();
    let again = store.append(Arc::new(numbered(5..15)), 7).await.unwrap();
    assert_eq!(again.sensors[0].stream.stored, 15);
}

#[tokio::test]
async fn agents_are_told_to_keep_their_frames_while_the_file_is_gone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frames.sqlite");
    let location = StoreLocation::File(path.clone());
    let limits = Limits::default();
    let store = Arc::new(SqliteStore::open(&location, &limits).unwrap());
    let server = Server::on(store, limits).await;
    assert_eq!(server.frames(&numbered(0..5)).await.status, 200);
    fs::rename(&path, folder.path().join("moved")).unwrap();
    // Also without a batch.
    let health = server.get("/healthz").await;
    assert_eq!(
        (health.status.as_u16(), &health.json()["status"]),
        (503, &json!("failing"))
    );
    let refused = server.frames(&numbered(5..10)).await;
    assert_eq!(refused.error(), (503, "store_gone".to_owned(), None));
    assert_eq!(refused.headers["retry-after"], "1");
    assert_eq!(server.get("/v1/health").await.status, 503);
    fs::rename(folder.path().join("moved"), &path).unwrap();
    assert_eq!(server.get("/healthz").await.status, 200);
    let taken = server.frames(&numbered(5..10)).await;
    assert_eq!(taken.json()["durable_through"], json!({ "s1": 9 }));
    assert_eq!(server.get("/v1/health").await.status, 200);
    let audit = server.get("/v1/audit").await.json();
    assert_eq!(audit["streams"][0]["stored"], 10);
}

fn clock() -> Arc<dyn grideye_collector::Clock> {
    Arc::new(grideye_collector::SystemClock::new())
}
