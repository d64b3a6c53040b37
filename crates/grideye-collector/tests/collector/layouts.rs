//! Files of every layout that a released collector wrote: each is opened, read whole, and added to.
//!
//! A program of layout N wrote `tests/stores/layout-N.store` with [`fill`], in the first test below with
//! `GRIDEYE_WRITE_STORE=FILE`; for layout 2 at commit 3efd576. It holds a sealed segment, plain chunks, acknowledged
//! batches that had not yet moved there, two boots, a gap, missing frames, accounts, two recordings (one running), a note and
//! labels.

use crate::batches::{account, batch, counted, frame, missing, numbered, part};
use crate::clocks::{BEGIN_NS, Clocks};
use crate::{disks, postgres};
use grideye_collector::store::migrate::migrate;
use grideye_collector::store::{
    KeptLabel, Label, LabelSpan, Recording, StoredRecord, StreamSummary, backup,
};
use grideye_collector::{
    Clock as _, FrameStore, Limits, Log, PostgresStore, SqliteStore, StoreError, StoreLocation,
};
use grideye_frame::NoData;
use grideye_recording::wire::Batch;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Duration;

fn limits() -> Limits {
    Limits {
        seal_after: Duration::from_secs(10),
        ..Limits::default()
    }
}

fn tended(path: &Path) -> (SqliteStore, Arc<Clocks>) {
    let clocks = Clocks::started_at(BEGIN_NS);
    let location = StoreLocation::File(path.to_owned());
    let store = SqliteStore::open_tended(&location, &limits(), &clocks.handed(), &Log::silent());
    (store.unwrap(), clocks)
}

fn open(path: &Path) -> Result<SqliteStore, StoreError> {
    SqliteStore::open(&StoreLocation::File(path.to_owned()), &limits())
}

/// Fills a store over two minutes; the last batches stay outside a file's chunks.
async fn fill(store: &dyn FrameStore, clocks: &Clocks) {
    let append = async |batch: Batch, at_ms: i64| {
        let t_arrival_ns = BEGIN_NS + at_ms * 1_000_000;
        let passed = t_arrival_ns.saturating_sub(clocks.utc_ns());
        clocks.pass(Duration::from_nanos(passed.unsigned_abs()));
        store.append(Arc::new(batch), t_arrival_ns).await.unwrap();
    };
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
    for post in 0..12_u64 {
        let at_ms = i64::try_from(post).unwrap() * 500;
        let seqs = (5 * post..5 * post + 5).filter(|seq| *seq != 58);
        append(counted(seqs, account(5 * post + 5, 0, 0)), at_ms).await;
    }
    for second in 6..110 {
        append(counted([], account(60, 0, 0)), second * 1000).await;
    }
    let kitchen = store.start_recording("kitchen".to_owned(), BEGIN_NS + 1);
    let kitchen = kitchen.await.unwrap();
    append(other(0..8), 110_000).await;
    append(counted(60..70, account(75, 2, 3)), 110_500).await;
    store
        .stop_recording(kitchen.id, BEGIN_NS + 2)
        .await
        .unwrap();
    let note = "two people, then nobody".to_owned();
    store.note_recording(kitchen.id, note).await.unwrap();
    for (name, first_seq, last_seq) in [("two people", 60, 64), ("nobody", 65, 69)] {
        let span = LabelSpan {
            device: "pi-1".to_owned(),
            sensor: "s1".to_owned(),
            boot: "b1".to_owned(),
            first_seq,
            last_seq,
        };
        let label = Label {
            name: name.to_owned(),
            spans: vec![span],
        };
        store.add_label(kitchen.id, label).await.unwrap();
    }
    store
        .start_recording("hall".to_owned(), BEGIN_NS + 3)
        .await
        .unwrap();
    append(
        batch("pi-1", "b2", vec![part("s1", vec![frame(0), frame(3)])]),
        111_000,
    )
    .await;
    append(other(8..12), 111_500).await;
    append(counted(70..75, account(75, 2, 0)), 112_000).await;
}

type Seen = (
    Vec<StreamSummary>,
    Vec<StoredRecord>,
    Vec<(Recording, Vec<KeptLabel>, Vec<StoredRecord>)>,
);

/// Everything a reader can see of counts, recordings and frames.
async fn seen(store: &dyn FrameStore) -> Seen {
    let mut recorded = Vec::new();
    for recording in store.recordings().await.unwrap() {
        let mut rows = Vec::new();
        for span in store.members(recording.id).await.unwrap().spans {
            rows.extend(store.page(span, None, 10_000).await.unwrap());
        }
        let labels = store.labels(recording.id).await.unwrap();
        recorded.push((recording, labels, rows));
    }
    let streams = store.streams().await.unwrap();
    (streams, store.newest().await.unwrap(), recorded)
}

fn sql(path: &Path, query: &str) -> i64 {
    let connection = rusqlite::Connection::open(path).unwrap();
    connection.query_row(query, [], |row| row.get(0)).unwrap()
}

/// The file as the current program leaves it after a power cut; in one piece.
async fn write(path: &Path) {
    let live = path.with_extension("live");
    let (store, clocks) = tended(&live);
    fill(&store, &clocks).await;
    let connection = rusqlite::Connection::open(&live).unwrap();
    let whole = path.to_str().unwrap();
    connection.execute("VACUUM INTO ?", [whole]).unwrap();
}

/// The contents of a filled store.
async fn expected() -> Seen {
    let reference = SqliteStore::open(&StoreLocation::Memory, &limits()).unwrap();
    fill(&reference, &Clocks::started_at(BEGIN_NS)).await;
    seen(&reference).await
}

/// A copy of an older layout's file, and the path of its backup.
fn copy_of(layout: i64, folder: &Path) -> (PathBuf, PathBuf) {
    let kept =
        Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/stores/layout-{layout}.store"));
    let path = folder.join("frames.sqlite");
    std::fs::copy(kept, &path).unwrap();
    (
        path,
        folder.join(format!("frames.sqlite.layout-{layout}.backup")),
    )
}

/// Checks parts of a layout 2 file that readers cannot see: sealed segments, and batches outside the tables.
fn assert_is_whole(path: &Path) {
    assert_eq!(sql(path, "PRAGMA user_version"), 2);
    assert_eq!(sql(path, "SELECT count(*) FROM chunks WHERE is_sealed"), 1);
    assert_eq!(sql(path, "SELECT count(*) FROM pending"), 3);
    assert_eq!(sql(path, "SELECT sum(t_arrival_ns > 0) FROM chunks"), 5);
}

#[tokio::test]
async fn a_file_of_the_present_layout_holds_what_a_later_program_must_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("layout.store");
    write(&path).await;
    if let Some(keep) = std::env::var_os("GRIDEYE_WRITE_STORE") {
        std::fs::copy(&path, keep).unwrap();
    }
    assert_eq!(sql(&path, "SELECT count(*) FROM chunks WHERE is_sealed"), 1);
    assert_eq!(sql(&path, "SELECT count(*) FROM arrivals"), 5);
    assert!(seen(&open(&path).unwrap()).await == expected().await);
}

#[tokio::test]
async fn a_file_of_each_layout_is_read_whole_and_takes_more() {
    let expected = expected().await;
    let present = sql_of_new("PRAGMA user_version");
    for layout in 2..=present {
        let folder = tempfile::tempdir().unwrap();
        let (path, backup) = copy_of(layout, folder.path());
        let store = open(&path).unwrap();
        assert!(seen(&store).await == expected, "layout {layout}");
        assert_eq!(sql(&path, "PRAGMA user_version"), present);
        assert_eq!(backup.exists(), layout < present);
        // Repeated frames change nothing, and new ones are stored.
        for (seqs, stored) in [(0..75, 74), (75..80, 79)] {
            let seqs = seqs.filter(|seq| *seq != 58);
            store
                .append(Arc::new(numbered(seqs)), BEGIN_NS)
                .await
                .unwrap();
            assert_eq!(store.streams().await.unwrap()[0].stored, stored);
        }
        store.close().await.unwrap();
        assert_eq!(open(&path).unwrap().streams().await.unwrap()[0].stored, 79);
        let tables =
            "SELECT group_concat(sql, ';') FROM (SELECT sql FROM sqlite_schema ORDER BY name)";
        let columns = "SELECT count(*) FROM sqlite_schema t, pragma_table_info(t.name)";
        assert_eq!(sql(&path, columns), sql_of_new(columns), "{tables}");
    }
}

#[tokio::test]
async fn a_backup_of_an_older_layout_is_the_file_and_opens_whole() {
    for layout in 2..sql_of_new("PRAGMA user_version") {
        let folder = tempfile::tempdir().unwrap();
        let (path, _) = copy_of(layout, folder.path());
        let out = folder.path().join("out.sqlite");
        let backed_up = backup(&path, &out, |_, _, _| {}).unwrap();
        assert_eq!((backed_up.streams.len(), backed_up.recordings), (4, 2));
        assert_eq!(sql(&out, "PRAGMA user_version"), layout);
        assert!(seen(&open(&out).unwrap()).await == expected().await);
    }
}

/// The same query on a new store.
fn sql_of_new(query: &str) -> i64 {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("new.sqlite");
    drop(open(&path).unwrap());
    sql(&path, query)
}

#[tokio::test]
async fn the_backup_beside_an_upgraded_file_is_the_file_of_before_and_only_this_user_can_read_it() {
    use std::os::unix::fs::PermissionsExt as _;
    let folder = tempfile::tempdir().unwrap();
    let (path, backup) = copy_of(2, folder.path());
    // A killed upgrade may leave this.
    let unfinished = backup.with_extension("backup.partial");
    std::fs::write(&unfinished, "cut").unwrap();
    drop(open(&path).unwrap());
    assert!(!unfinished.exists());
    let mode = std::fs::metadata(&backup).unwrap().permissions().mode();
    assert_eq!(mode & 0o077, 0);
    assert_is_whole(&backup);
    std::fs::copy(&backup, &path).unwrap();
    std::fs::remove_file(&backup).unwrap();
    assert!(seen(&open(&path).unwrap()).await == expected().await);
}

#[tokio::test]
async fn an_upgrade_that_fails_leaves_the_file_as_it_was_and_its_backup_is_taken_the_next_time() {
    use std::os::unix::fs::MetadataExt as _;
    let folder = tempfile::tempdir().unwrap();
    let (path, backup) = copy_of(2, folder.path());
    // After the copy, the last upgrade step fails.
    let other = rusqlite::Connection::open(&path).unwrap();
    let fault =
        "CREATE TRIGGER fault BEFORE UPDATE ON counters BEGIN SELECT RAISE(ABORT, 'no'); END";
    other.execute_batch(fault).unwrap();
    let error = open(&path).unwrap_err();
    assert!(matches!(error, StoreError::Failed(_)), "{error}");
    assert_is_whole(&path);
    let inode = |path: &Path| std::fs::metadata(path).unwrap().ino();
    let first = inode(&backup);
    open(&path).unwrap_err();
    assert_eq!(inode(&backup), first, "it was copied again");
    other.execute_batch("DROP TRIGGER fault").unwrap();
    let store = open(&path).unwrap();
    assert!(seen(&store).await == expected().await);
    assert_eq!(inode(&backup), first);
    assert_is_whole(&backup);
}

/// Copies the files at as many moments of an upgrade as time allows, as a killed program would leave them.
#[tokio::test]
async fn killed_at_any_moment_an_upgrade_leaves_a_file_that_opens_whole() {
    let folder = tempfile::tempdir().unwrap();
    let (path, backup) = copy_of(2, folder.path());
    let other = rusqlite::Connection::open(&path).unwrap();
    other.pragma_update(None, "journal_mode", "WAL").unwrap();
    drop(other);
    let at = path.clone();
    let upgrading = std::thread::spawn(move || open(&at).unwrap());
    let names = [
        "frames.sqlite",
        "frames.sqlite-wal",
        "frames.sqlite.layout-2.backup.partial",
        "frames.sqlite.layout-2.backup",
    ];
    let mut left = Vec::new();
    while !upgrading.is_finished() {
        let copy = tempfile::tempdir().unwrap();
        for name in names {
            // Not every file exists at every moment.
            let _ = std::fs::copy(folder.path().join(name), copy.path().join(name));
        }
        left.push(copy);
    }
    let _upgraded = upgrading.join().unwrap();
    let expected = expected().await;
    let mut backups = 0;
    for copy in &left {
        backups += usize::from(copy.path().join(backup.file_name().unwrap()).exists());
        let store = open(&copy.path().join("frames.sqlite")).unwrap();
        assert!(seen(&store).await == expected);
    }
    println!(
        "{} moments, {backups} of them with a whole backup",
        left.len()
    );
}

#[tokio::test]
async fn a_copy_of_another_state_is_not_taken_for_the_backup() {
    let folder = tempfile::tempdir().unwrap();
    let (path, backup) = copy_of(2, folder.path());
    std::fs::copy(&path, &backup).unwrap();
    let other = rusqlite::Connection::open(&path).unwrap();
    other
        .execute_batch("UPDATE counters SET epoch = 9")
        .unwrap();
    let error = open(&path).unwrap_err().to_string();
    assert!(
        error.contains("layout-2.backup is a copy of another state"),
        "{error}"
    );
    assert_is_whole(&path);
    std::fs::remove_file(&backup).unwrap();
    open(&path).unwrap();
}

#[tokio::test]
async fn a_disk_without_room_for_the_backup_refuses_the_upgrade_and_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let Some(disk) = disks::Small::mount(folder.path(), 256, "an upgrade on a full disk") else {
        return;
    };
    let (path, backup) = copy_of(2, disk.path());
    // Room for the log, but not for a second file.
    disk.fill_but(80 * 1024);
    let error = open(&path).unwrap_err();
    let error = error.to_string();
    let no_room = "the store has layout 2, and the disk has no room for ";
    assert!(error.starts_with(no_room), "{error}");
    assert!(error.contains("\nhint: make room"), "{error}");
    assert!(!backup.exists() && !backup.with_extension("backup.partial").exists());
    assert_is_whole(&path);
    disk.make_room();
    assert!(seen(&open(&path).unwrap()).await == expected().await);
    assert_is_whole(&backup);
}

#[tokio::test]
async fn a_file_of_an_older_layout_is_migrated_into_a_database() {
    let Some(cluster) = postgres::shared("migration of an older layout") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let (path, backup) = copy_of(2, folder.path());
    let url = cluster.database().parse().unwrap();
    let migrated = migrate(&path, &url, |_, _, _| {}).await.unwrap();
    assert_eq!(
        (migrated.frames, migrated.missing, migrated.difference),
        (94, 6, None)
    );
    assert_is_whole(&backup);
    let store = PostgresStore::open(&url, &limits()).await.unwrap();
    assert_eq!(store.streams().await.unwrap(), expected().await.0);
}

/// Layout 2 files may hold times of clocks that had jumped: such frames count as old as the upgrade.
#[tokio::test]
async fn times_of_arrival_of_before_make_no_frame_old() {
    let folder = tempfile::tempdir().unwrap();
    let (path, backup) = copy_of(2, folder.path());
    let other = rusqlite::Connection::open(&path).unwrap();
    let jumped =
        "UPDATE chunks SET t_arrival_ns = t_arrival_ns + 315360000000000000 WHERE NOT is_sealed";
    other.execute_batch(jumped).unwrap();
    let limits = Limits {
        keep_for: Some(Duration::from_secs(86_400)),
        ..limits()
    };
    let clocks = Clocks::started_at(BEGIN_NS);
    let location = StoreLocation::File(path.clone());
    let lines = Arc::new(Mutex::new(Vec::new()));
    let said = Arc::clone(&lines);
    let log = Log::new(move |event| said.lock().unwrap().push(event.to_string()));
    let store = SqliteStore::open_tended(&location, &limits, &clocks.handed(), &log).unwrap();
    let upgraded = format!(
        "info: store_upgraded from=2 to=4 backup={}",
        backup.display()
    );
    assert_eq!(lines.lock().unwrap()[..], [upgraded]);
    let wait = async |minutes: u64| {
        clocks.pass(Duration::from_secs(60 * minutes));
        store
            .append(Arc::new(numbered([])), clocks.utc_ns())
            .await
            .unwrap();
    };
    let expired = async || store.streams().await.unwrap()[0].expired;
    for _ in 0..143 {
        wait(10).await;
    }
    assert_eq!(expired().await, 0);
    for _ in 0..9 {
        wait(10).await;
    }
    // The sealed, unrecorded frames; the last one waits for its share.
    assert_eq!(expired().await, 58);
}

/// Input for `psql` that creates a database of this layout.
fn dump_of(layout: i32) -> String {
    let kept = format!("tests/stores/layout-{layout}.sql");
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(kept)).unwrap()
}

/// `layout-1.sql` was written at commit 3efd576: [`fill`] into a new database, then `pg_dump --inserts` with
/// `GRIDEYE_WRITE_STORE=FILE`.
#[tokio::test]
async fn a_database_of_each_layout_is_read_whole_and_takes_more_and_a_newer_one_is_refused() {
    let Some(cluster) = postgres::shared("layouts of a database") else {
        return;
    };
    if let Some(keep) = std::env::var_os("GRIDEYE_WRITE_STORE") {
        let url = cluster.database();
        let store = PostgresStore::open(&url.parse().unwrap(), &limits())
            .await
            .unwrap();
        fill(&store, &Clocks::started_at(BEGIN_NS)).await;
        store.close().await.unwrap();
        let dump = std::process::Command::new("pg_dump")
            .args([
                "--inserts",
                "--no-owner",
                "--no-comments",
                "--schema=grideye",
                "--file",
            ])
            .args([
                Path::new(&keep).with_extension("sql").as_os_str(),
                url.as_ref(),
            ])
            .status();
        assert!(dump.unwrap().success());
    }
    let url = cluster.database();
    // Lines that begin with a backslash are commands of `psql`, which `-c` does not accept.
    let dump = dump_of(1);
    let dump: Vec<&str> = dump
        .lines()
        .filter(|line| !line.starts_with('\\'))
        .collect();
    let _ = postgres::sql(&url, &dump.join("\n"));
    let location = url.parse().unwrap();
    let store = PostgresStore::open(&location, &limits()).await.unwrap();
    assert!(seen(&store).await == expected().await);
    for (seqs, stored) in [(0..75, 74), (75..80, 79)] {
        let seqs = seqs.filter(|seq| *seq != 58);
        store
            .append(Arc::new(numbered(seqs)), BEGIN_NS)
            .await
            .unwrap();
        assert_eq!(store.streams().await.unwrap()[0].stored, stored);
    }
    store.close().await.unwrap();
    let _ = postgres::sql(&url, "UPDATE grideye.layout SET layout = 2");
    let newer = PostgresStore::open(&location, &limits())
        .await
        .err()
        .unwrap();
    assert!(newer.to_string().contains("has layout 2"), "{newer}");
}
