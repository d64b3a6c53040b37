//! Copies a store to a file, even while a collector writes to it, with SQLite's online backup of one snapshot.
//!
//! The copy is written to `OUT.partial`, synced, checked, and then renamed to `OUT`. A read transaction holds the
//! snapshot; without it the copy would restart at each commit. Meanwhile the log (`-wal`) is not checkpointed.
//!
//! A file of an older layout is first copied as it is, then upgraded in one transaction: if killed at any moment, it
//! stays unchanged.

use crate::limits::Limits;
use crate::percent::percent_encoded;
use crate::store::error::{Result, StoreError};
use crate::store::row::count;
use crate::store::sqlite::identity::beside;
use crate::store::sqlite::place::keep_log;
use crate::store::sqlite::schema::{
    APPLICATION_ID, Found, LAYOUT, READ_WRITE, SINCE_4, STEPS, TABLES, WRITTEN, recognize,
};
use crate::store::sqlite::{identity, older, read};
use crate::store::types::{Stage, StreamSummary};
use grideye_recording::StreamId;
use grideye_recording::whole::sync_folder_of;
use rusqlite::backup::{Backup, StepResult};
use rusqlite::{Connection, ErrorCode, OpenFlags, OptionalExtension as _, TransactionBehavior};
use rustix::fs::{CWD, FlockOperation, RenameFlags, flock, renameat_with};
use rustix::io::Errno;
use std::collections::HashMap;
use std::fs::{File, OpenOptions, Permissions};
use std::io;
use std::os::unix::ffi::OsStrExt as _;
use std::os::unix::fs::{MetadataExt as _, OpenOptionsExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};

/// Pages between two progress reports: 4 MiB.
const PAGES_A_STEP: i32 = 1024;

/// The result of a backup.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BackedUp {
    /// Every stream of the copy.
    pub streams: Vec<StreamSummary>,
    /// Recordings.
    pub recordings: u64,
    /// Bytes of the copy.
    pub bytes: u64,
}

/// Why a backup failed. No file is left under its name.
#[derive(Debug, thiserror::Error)]
pub enum BackupError {
    /// The store does not exist.
    #[error("there is no store {}\nhint: name the file given to `grideye collect --store`", .0.display())]
    Missing(PathBuf),
    /// The store cannot be read.
    #[error("cannot back up {}: {reason}", .file.display())]
    Source {
        /// The store.
        file: PathBuf,
        /// What is wrong with it.
        reason: StoreError,
    },
    /// The store itself was named as its backup.
    #[error("{} is the store itself\nhint: name another file for the backup", .0.display())]
    Itself(PathBuf),
    /// A file of that name exists.
    #[error("{} exists already, and a backup never replaces a file\nhint: name another file, or move this one away", .0.display())]
    Exists(PathBuf),
    /// Another process is writing the same backup.
    #[error("another backup is being written to {}\nhint: wait for it, or name another file", .0.display())]
    Taken(PathBuf),
    /// The disk is full.
    #[error("no room for {}: the store takes {bytes} bytes\nhint: free some space, or name a file on another disk; the partial backup was deleted", .out.display())]
    NoRoom {
        /// The file asked for.
        out: PathBuf,
        /// Bytes of the store.
        bytes: u64,
    },
    /// The copy cannot be written.
    #[error("cannot write {}: {reason}\nhint: the folder must exist and be writable for this user", .out.display())]
    Write {
        /// The file asked for.
        out: PathBuf,
        /// The system's error.
        reason: String,
    },
    /// The copy differs from the store.
    #[error(
        "the copy of the store is not whole: {0}\nhint: it was deleted; if a second run fails as well, the store or a disk is damaged (`sqlite3 STORE 'PRAGMA integrity_check'`)"
    )]
    Differs(String),
}

/// Copies the store in `file` to a new file `out`, and compares the two. `progress` receives the stage, the work done
/// and the total.
///
/// # Errors
/// [`BackupError`]; then no new file `out` exists.
pub fn backup(
    file: &Path,
    out: &Path,
    mut progress: impl FnMut(Stage, u64, u64),
) -> Result<BackedUp, BackupError> {
    let unreadable = |reason| BackupError::Source {
        file: file.to_owned(),
        reason,
    };
    let found = std::fs::metadata(file).map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => BackupError::Missing(file.to_owned()),
        _ => unreadable(StoreError::Unusable(error.to_string())),
    })?;
    if std::fs::metadata(out).is_ok_and(|out| (out.dev(), out.ino()) == (found.dev(), found.ino()))
    {
        return Err(BackupError::Itself(out.to_owned()));
    }
    let limits = Limits {
        streams_listed_max: usize::MAX,
        ..Limits::default()
    };
    let source = open(file, &limits).map_err(unreadable)?;
    let snapshot = source
        .unchecked_transaction()
        .map_err(|error| unreadable(error.into()))?;
    // The first read starts the snapshot.
    let books = Books::of(&snapshot, &limits).map_err(unreadable)?;
    let bytes = read::bytes(&snapshot).map_err(unreadable)?;
    copy(&snapshot, out, &mut progress, |copy, progress| {
        compare(copy, &books, &limits, progress)
    })?;
    Ok(BackedUp {
        streams: books.streams,
        recordings: books.recordings,
        bytes,
    })
}

/// Copies everything `source` reads to a new file `out`, which appears whole or not at all; `check` reads the copy
/// before that. `source` must be in a read transaction if another connection writes, and never in a write transaction.
pub(crate) fn copy<P: FnMut(Stage, u64, u64)>(
    source: &Connection,
    out: &Path,
    progress: &mut P,
    check: impl FnOnce(&Connection, &mut P) -> Result<(), BackupError>,
) -> Result<(), BackupError> {
    let partial = Partial::create(out)?;
    fill(source, &partial, progress)?;
    identity::mark_copy(&partial.file)
        .and_then(|()| partial.file.sync_all())
        .map_err(|error| match error.kind() {
            io::ErrorKind::StorageFull => partial.no_room(source),
            _ => partial.unwritable(&error),
        })?;
    let copy = partial.read()?;
    check_integrity(&copy)?;
    check(&copy, progress)?;
    drop(copy);
    partial.name_it()
}

/// Opens an existing store of any known layout. A backup leaves an older layout as it is: a collector upgrades the copy
/// when it opens it.
pub(crate) fn open(file: &Path, limits: &Limits) -> Result<Connection> {
    // Opened for writing, because a reader of a log writes its index file.
    let connection = Connection::open_with_flags(file, READ_WRITE)?;
    if std::fs::metadata(beside(file, "-wal")).is_ok_and(|log| log.len() > 0) {
        // The log of a killed collector is left to the next one, which looks whether it is the file's own.
        keep_log(&connection)?;
    }
    connection.busy_timeout(limits.store_lock_time_max)?;
    match recognize(&connection)? {
        Found::Store | Found::Older(_) => Ok(connection),
        Found::Nothing => Err(StoreError::foreign()),
    }
}

fn fill(
    source: &Connection,
    partial: &Partial,
    progress: &mut impl FnMut(Stage, u64, u64),
) -> Result<(), BackupError> {
    let told = |error: rusqlite::Error| match error.sqlite_error_code() {
        Some(ErrorCode::DiskFull) => partial.no_room(source),
        _ => partial.unwritable(&error),
    };
    // Nobody else knows this file, and network disks lock badly.
    let copy = Connection::open_with_flags_and_vfs(&partial.path, READ_WRITE, c"unix-none");
    let mut copy = copy.map_err(told)?;
    for pragma in ["journal_mode", "synchronous"] {
        copy.pragma_update(None, pragma, "OFF").map_err(told)?;
    }
    let copying = Backup::new(source, &mut copy).map_err(told)?;
    loop {
        let step = copying.step(PAGES_A_STEP).map_err(told)?;
        let pages = |pages: i32| u64::try_from(pages).unwrap_or(0);
        let (left, all) = (copying.progress().remaining, copying.progress().pagecount);
        progress(Stage::Copying, pages(all - left), pages(all));
        match step {
            StepResult::Done => return Ok(()),
            StepResult::More => {}
            _ => {
                return Err(BackupError::Source {
                    file: source.path().unwrap_or_default().into(),
                    reason: StoreError::Locked,
                });
            }
        }
    }
}

fn check_integrity(copy: &Connection) -> Result<(), BackupError> {
    let found = |sql: &str| -> Result<Option<String>, BackupError> {
        let found = copy.query_row(sql, [], |row| row.get(0)).optional();
        found.map_err(|error| differs(&error))
    };
    let integrity = found("PRAGMA integrity_check(1)")?;
    if integrity.as_deref() != Some("ok") {
        return Err(differs(&integrity.unwrap_or_default()));
    }
    match found("PRAGMA foreign_key_check")? {
        Some(table) => Err(differs(&format!("a row of {table} refers to nothing"))),
        None => Ok(()),
    }
}

struct Books {
    streams: Vec<StreamSummary>,
    recordings: u64,
}

impl Books {
    fn of(connection: &Connection, limits: &Limits) -> Result<Self> {
        let last_seq = match recognize(connection)? {
            Found::Older(_) => read::LAST_SEQ_OF_OLDER,
            Found::Store | Found::Nothing => read::LAST_SEQ,
        };
        Ok(Self {
            streams: read::streams_within(connection, limits, last_seq)?,
            recordings: read::counts(connection)?.0,
        })
    }
}

/// Compares the copy's streams and recordings with the store's, then decodes and counts every frame of the copy.
fn compare(
    copy: &Connection,
    books: &Books,
    limits: &Limits,
    progress: &mut impl FnMut(Stage, u64, u64),
) -> Result<(), BackupError> {
    let found = Books::of(copy, limits).map_err(|error| differs(&error))?;
    let pairs = books.streams.iter().zip(&found.streams);
    if let Some((stored, copied)) = pairs.clone().find(|(stored, copied)| stored != copied) {
        return Err(differs(&format!("{stored:?} became {copied:?}")));
    }
    let counts = |books: &Books| (books.streams.len(), books.recordings);
    if counts(books) != counts(&found) {
        let (before, after) = (counts(books), counts(&found));
        let what = format!("streams and recordings {before:?} became {after:?}");
        return Err(differs(&what));
    }
    let all = found.streams.iter().map(readable).sum();
    let counted = count_frames(copy, |done| progress(Stage::Comparing, done, all));
    let counted = counted.map_err(|error| differs(&error))?;
    for stream in &found.streams {
        let (id, expected) = (&*stream.id, readable(stream));
        let counted = counted.get(id).copied().unwrap_or(0);
        if counted != expected {
            let what = format!("{id:?} has {counted} frames, not {expected}");
            return Err(differs(&what));
        }
    }
    progress(Stage::Comparing, all, all);
    Ok(())
}

/// Frames stored and not deleted since.
fn readable(stream: &StreamSummary) -> u64 {
    stream.stored.saturating_sub(stream.expired)
}

/// Decodes every chunk and every arrival, of which older layouts have none, and counts the frames with pixels by stream.
/// `done` receives the count so far.
fn count_frames(copy: &Connection, mut done: impl FnMut(u64)) -> Result<HashMap<StreamId, u64>> {
    let arrivals = match recognize(copy)? {
        Found::Older(_) => "",
        _ => "UNION ALL SELECT first_seq, last_seq, epoch, 0, rows, stream_id FROM arrivals",
    };
    let mut statement = copy.prepare(&format!(
        "SELECT a.*, device, sensor, boot FROM (
             SELECT first_seq, last_seq, epoch, is_sealed, rows, stream_id FROM chunks {arrivals}
         ) a JOIN streams ON id = stream_id"
    ))?;
    let (mut by_stream, mut all) = (HashMap::<StreamId, u64>::new(), 0);
    let mut chunks = statement.query([])?;
    while let Some(chunk) = chunks.next()? {
        let rows = read::rows_of(chunk)?;
        let frames = rows
            .iter()
            .filter(|row| row.record.reading.frame().is_some());
        let frames = count(frames.count()).unsigned_abs();
        *by_stream.entry(read::stream_id(chunk, 6)?).or_default() += frames;
        all += frames;
        done(all);
    }
    Ok(by_stream)
}

fn differs(what: &impl ToString) -> BackupError {
    BackupError::Differs(what.to_string())
}

/// The copy while it is written: `OUT.partial`, readable only by this user, and deleted unless it is renamed.
struct Partial {
    path: PathBuf,
    out: PathBuf,
    file: File,
}

impl Partial {
    fn create(out: &Path) -> Result<Self, BackupError> {
        let (out, path) = (out.to_owned(), beside(out, ".partial"));
        if out.symlink_metadata().is_ok() {
            return Err(BackupError::Exists(out));
        }
        let opened = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .mode(0o600)
            .open(&path);
        let unwritable = |error: io::Error| BackupError::Write {
            out: out.clone(),
            reason: error.to_string(),
        };
        let file = opened.map_err(unwritable)?;
        match flock(&file, FlockOperation::NonBlockingLockExclusive) {
            Err(Errno::WOULDBLOCK) => return Err(BackupError::Taken(out)),
            Err(error) => return Err(unwritable(error.into())),
            Ok(()) => {}
        }
        // The other process may have renamed it meanwhile.
        let is_ours = std::fs::symlink_metadata(&path).and_then(|there| {
            let held = file.metadata()?;
            Ok((there.dev(), there.ino()) == (held.dev(), held.ino()))
        });
        if !is_ours.unwrap_or(false) {
            return Err(BackupError::Taken(out));
        }
        // Also for a leftover file with other permissions.
        file.set_permissions(Permissions::from_mode(0o600))
            .map_err(unwritable)?;
        file.set_len(0).map_err(unwritable)?;
        Ok(Self { path, out, file })
    }

    /// Opens the written file, without a lock or a log file.
    fn read(&self) -> Result<Connection, BackupError> {
        let path = std::path::absolute(&self.path).map_err(|error| self.unwritable(&error))?;
        let escaped = percent_encoded(path.as_os_str().as_bytes(), b"/.-_");
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY
            | OpenFlags::SQLITE_OPEN_NO_MUTEX
            | OpenFlags::SQLITE_OPEN_URI;
        Connection::open_with_flags(format!("file://{escaped}?immutable=1"), flags)
            .map_err(|error| self.unwritable(&error))
    }

    /// Renames the file to its final name unless that exists, and syncs the folder.
    fn name_it(self) -> Result<(), BackupError> {
        let exists = || BackupError::Exists(self.out.clone());
        match renameat_with(CWD, &self.path, CWD, &self.out, RenameFlags::NOREPLACE) {
            Ok(()) => {}
            Err(Errno::EXIST) => return Err(exists()),
            // Some file systems cannot do this atomically: check, then rename.
            Err(Errno::INVAL | Errno::NOSYS) => {
                if self.out.symlink_metadata().is_ok() {
                    return Err(exists());
                }
                std::fs::rename(&self.path, &self.out).map_err(|error| self.unwritable(&error))?;
            }
            Err(error) => return Err(self.unwritable(&error)),
        }
        sync_folder_of(&self.out).map_err(|error| self.unwritable(&error))
    }

    fn unwritable(&self, reason: &impl ToString) -> BackupError {
        BackupError::Write {
            out: self.out.clone(),
            reason: reason.to_string(),
        }
    }

    fn no_room(&self, source: &Connection) -> BackupError {
        BackupError::NoRoom {
            out: self.out.clone(),
            bytes: read::bytes(source).unwrap_or(0),
        }
    }
}

impl Drop for Partial {
    fn drop(&mut self) {
        // After the rename nothing is there.
        let _ = std::fs::remove_file(&self.path);
    }
}

/// The result of an upgrade from an older layout.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Upgraded {
    pub(super) from: i64,
    pub(super) backup: PathBuf,
}

/// Creates the tables in an empty file, upgrades an older layout, or checks that the tables exist.
pub(crate) fn prepare(connection: &mut Connection, file: &Path) -> Result<Option<Upgraded>> {
    let transaction = connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
    let mut upgraded = None;
    match recognize(&transaction)? {
        Found::Nothing => {
            transaction.execute_batch(TABLES)?;
            transaction.execute_batch(SINCE_4)?;
            transaction.pragma_update(None, "application_id", APPLICATION_ID)?;
            transaction.pragma_update(None, "user_version", LAYOUT)?;
        }
        Found::Older(from) => {
            upgraded = Some(upgrade(&transaction, file, (from, LAYOUT))?);
        }
        Found::Store => {}
    }
    transaction.execute_batch(WRITTEN)?;
    transaction.commit()?;
    Ok(upgraded)
}

/// Copies the file, then upgrades its layout in the caller's transaction, which blocks all other writers.
fn upgrade(transaction: &Connection, file: &Path, (from, to): (i64, i64)) -> Result<Upgraded> {
    let backup = back_up(transaction, file, from)?;
    let pending = older::pending(transaction)?;
    for (_, step) in STEPS.iter().filter(|(layout, _)| *layout >= from) {
        transaction.execute_batch(step)?;
    }
    transaction.execute_batch(SINCE_4)?;
    older::take_in(transaction, pending)?;
    transaction.pragma_update(None, "user_version", to)?;
    Ok(Upgraded { from, backup })
}

/// Copies the whole file and syncs it; reuses a copy of the same state that an interrupted upgrade left.
fn back_up(transaction: &Connection, file: &Path, from: i64) -> Result<PathBuf> {
    let backup = beside(file, &format!(".layout-{from}.backup"));
    if backup.exists() {
        let found = Connection::open_with_flags(&backup, OpenFlags::SQLITE_OPEN_READ_ONLY)?;
        return if state(&found).ok() == Some(state(transaction)?) {
            Ok(backup)
        } else {
            Err(StoreError::Refused(format!(
                "the store has layout {from}, and {} is a copy of another state of it\nhint: move that copy away and start again: the store is then copied and upgraded; nothing was changed",
                backup.display()
            )))
        };
    }
    // A second connection, because the first is inside its transaction.
    let source = Connection::open_with_flags(file, READ_WRITE)?;
    match copy(&source, &backup, &mut |_, _, _| (), |_, _| Ok(())) {
        Ok(()) => Ok(backup),
        Err(BackupError::NoRoom { bytes, .. }) => Err(StoreError::Refused(format!(
            "the store has layout {from}, and the disk has no room for {}, the copy of its {bytes} bytes that is needed before the upgrade\nhint: make room on this disk, or move the store to a larger one; nothing was changed",
            backup.display()
        ))),
        Err(error) => Err(StoreError::Unusable(error.to_string())),
    }
}

/// Distinguishes states of one store: the epoch, which grows with recordings, and the last group of batches.
fn state(connection: &Connection) -> Result<(i64, i64)> {
    let sql = "SELECT epoch, max(groups, (SELECT coalesce(max(id), 0) FROM pending)) FROM counters";
    Ok(connection.query_row(sql, [], |row| Ok((row.get(0)?, row.get(1)?)))?)
}
