//! Opens the file's connections, and checks that its path still names the open file, and that nobody else wrote it.
//!
//! A file can be deleted, moved, replaced or overwritten while a program writes it, and every write still succeeds. So the
//! writer checks around each commit, before it answers. While the file is gone nothing is written; every batch checks
//! again. A file or log that another program wrote is left as it is: nothing more is written or acknowledged.
//!
//! The writer's log goes into the file by [`Presence::checkpoint`] alone, because a checkpoint into a file that is no longer
//! the store makes one of neither.

use crate::limits::Limits;
use crate::lock::lock;
use crate::log::{Level, Log, LogEvent};
use crate::store::error::{Result, StoreError};
use crate::store::location::StoreLocation;
use crate::store::sqlite::identity::{self, Found, beside};
use crate::store::sqlite::schema::{READ_WRITE, recognize};
use rusqlite::config::DbConfig;
use rusqlite::{Connection, ErrorCode, OpenFlags};
use rustix::fs::{AtFlags, CWD, FlockOperation, Statx, StatxFlags, flock, statx};
use rustix::io::Errno;
use std::fs::{File, OpenOptions};
use std::io;
use std::os::fd::AsRawFd as _;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::{Duration, Instant};

/// Prepared statements cached per connection: more than this crate has.
const STATEMENTS_MAX: usize = 64;

/// Frames of the log between checkpoints, 32 MB: a page that many batches write is then copied into the file once.
const CHECKPOINT_FRAMES: u32 = 8192;

/// How often to ask whether a restore has ended.
const LOCK_EVERY: Duration = Duration::from_millis(20);

pub(super) struct Place {
    pub(super) name: String,
    flags: OpenFlags,
    /// `None` for a store in memory.
    file: Option<File>,
}

impl Place {
    /// Locks the file against a restore. Sets aside a log that is not its own, unless another collector has both open.
    pub(super) fn of(location: &StoreLocation, limits: &Limits, events: &Log) -> Result<Self> {
        match location {
            StoreLocation::File(path) => {
                let file = make_file(path)?;
                if is_alone(&file, limits.store_lock_time_max)? {
                    accept(path, &file, events)?;
                    // If another collector comes in between, it judges the same.
                    let _ = flock(&file, FlockOperation::LockShared);
                }
                let name = path
                    .to_str()
                    .ok_or_else(|| StoreError::Unusable("the path is not UTF-8".to_owned()))?;
                Ok(Self {
                    name: name.to_owned(),
                    flags: READ_WRITE,
                    file: Some(file),
                })
            }
            StoreLocation::Postgres(url) => {
                Err(StoreError::Unusable(format!("{url} is not a file")))
            }
            StoreLocation::Memory => {
                static STORES: AtomicU64 = AtomicU64::new(0);
                let number = STORES.fetch_add(1, Ordering::Relaxed);
                Ok(Self {
                    name: format!("file:/grideye-{number}?vfs=memdb"),
                    flags: READ_WRITE | OpenFlags::SQLITE_OPEN_URI | OpenFlags::SQLITE_OPEN_CREATE,
                    file: None,
                })
            }
        }
    }

    /// Remembers which file the connections have open.
    pub(super) fn hold(&mut self, connection: &Connection) -> Result<Option<Held>> {
        let Some(file) = self.file.take() else {
            return Ok(None);
        };
        let held = Held::new(Path::new(&self.name), file, connection)?;
        held.check_paths()?;
        held.begin(connection);
        Ok(Some(held))
    }

    pub(super) fn connect(&self, limits: &Limits) -> Result<Connection> {
        let connection = Connection::open_with_flags(&self.name, self.flags)?;
        connection.busy_timeout(limits.store_lock_time_max)?;
        connection.set_prepared_statement_cache_capacity(STATEMENTS_MAX);
        if self.file.is_some() {
            // Switching to WAL writes to the file, so check first that it is ours.
            recognize(&connection)?;
            connection.pragma_update(None, "journal_mode", "WAL")?;
        }
        connection.pragma_update(None, "synchronous", "FULL")?;
        connection.pragma_update(None, "foreign_keys", true)?;
        Ok(connection)
    }
}

/// Creates an empty file that only this user may read, or checks that the existing one is writable.
fn make_file(path: &Path) -> Result<File> {
    let opened = OpenOptions::new()
        .read(true)
        .write(true)
        .create(true)
        .truncate(false)
        .mode(0o600)
        .open(path);
    let file = opened?;
    if file.metadata()?.is_file() {
        return Ok(file);
    }
    Err(StoreError::Unusable("it is not a regular file".to_owned()))
}

/// Locks the file as long as it is open; waits for a restore that is about to end. Returns whether no other collector has the
/// file open: then the lock keeps others out.
fn is_alone(file: &File, time_max: Duration) -> Result<bool> {
    let began = Instant::now();
    loop {
        match flock(file, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => return Ok(true),
            Err(Errno::WOULDBLOCK) => {}
            // A file system without locks.
            Err(_) => return Ok(true),
        }
        if flock(file, FlockOperation::NonBlockingLockShared).is_ok() {
            return Ok(false);
        }
        if began.elapsed() >= time_max {
            let used = "another program restores the store\nhint: start again when it is done";
            return Err(StoreError::Refused(used.to_owned()));
        }
        std::thread::sleep(LOCK_EVERY);
    }
}

/// Sees to it that SQLite finds a file and its own log, or none.
fn accept(path: &Path, file: &File, events: &Log) -> Result<()> {
    let log = beside(path, "-wal");
    let event = |name, what: &str| {
        let event = LogEvent::new(Level::Error, name).with("store", path.display());
        event.with("what", what)
    };
    match identity::judge(file, &log)? {
        Found::Whole => {}
        Found::CutShort => {
            let cut = "the store's file was cut short: it ends before its last page\nhint: restore it from a backup: `grideye restore BACKUP --store FILE`; nothing was changed";
            return Err(StoreError::Refused(cut.to_owned()));
        }
        Found::NoLog => events.say(
            &event("store_log_missing", "the store was not closed, and its log is not there")
                .with("at_risk", "the frames of the last minutes before it ended, unless another program merged the log into the file")
                .with("hint", format!("put {} back if it was moved, before agents send more", log.display())),
        ),
        Found::ForeignLog => {
            let aside = identity::aside(&log, "set-aside");
            std::fs::rename(&log, &aside)?;
            events.say(
                &event("store_log_set_aside", "the log beside the store is of another store, or of another state of this one: the file was replaced or restored by copying")
                    .with("at_risk", "frames that only the replaced file or its log had; agents send what they still hold")
                    .with("log", aside.display())
                    .with("hint", "restore with `grideye restore BACKUP --store FILE`, which keeps the store that it replaces"),
            );
        }
    }
    Ok(())
}

impl From<rusqlite::Error> for StoreError {
    fn from(error: rusqlite::Error) -> Self {
        match error.sqlite_error_code() {
            Some(ErrorCode::DiskFull) => Self::Full,
            Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => Self::Locked,
            Some(ErrorCode::NotADatabase) => Self::NotADatabase,
            Some(ErrorCode::CannotOpen | ErrorCode::ReadOnly | ErrorCode::PermissionDenied) => {
                Self::Unusable(error.to_string())
            }
            _ => Self::Failed(error.to_string()),
        }
    }
}

/// Names of the database file and its log in messages.
const FILE: &str = "file";
const LOG: &str = "log";

/// What happened to a part that another program wrote.
const OVERWRITTEN: &str = "overwritten or cut short by another program";

/// The database and its log, as they were when the store was opened.
#[derive(Debug)]
pub(super) struct Held {
    file: Part,
    log: Part,
    /// SQLite's shared memory, which says where the log ends.
    index: File,
    page_bytes: u64,
    /// The last seen length of the log, in frames.
    frames: AtomicU32,
    expected: Mutex<Expected>,
    /// The part that another program wrote.
    overwritten: OnceLock<&'static str>,
}

/// What the file has.
#[derive(Debug)]
struct Expected {
    /// The mark in its header.
    in_file: u32,
    /// The mark in the log, which a checkpoint brings there.
    in_log: u32,
    bytes: u64,
}

/// A file and its path. Kept open, so that no other file can get its inode number.
#[derive(Debug)]
struct Part {
    name: &'static str,
    path: PathBuf,
    held: File,
    identity: Identity,
}

/// Device (major, minor) and inode.
type Identity = (u32, u32, u64);

fn identity(found: &Statx) -> Identity {
    (found.stx_dev_major, found.stx_dev_minor, found.stx_ino)
}

impl Held {
    /// Remembers the file opened at `path`, and the log of its connection.
    fn new(path: &Path, file: File, connection: &Connection) -> Result<Self> {
        let name = PathBuf::from(connection.path().unwrap_or_default());
        let log = beside(&name, "-wal");
        let page_bytes: u32 = connection.pragma_query_value(None, "page_size", |row| row.get(0))?;
        let expected = Expected {
            in_file: identity::mark_of(&file).unwrap_or_default(),
            in_log: identity::mark_in(connection)?,
            bytes: file.metadata()?.len(),
        };
        Ok(Self {
            file: Part::new(FILE, std::path::absolute(path)?, file)?,
            log: Part::new(LOG, log.clone(), File::open(&log)?)?,
            index: File::open(beside(&name, "-shm"))?,
            page_bytes: page_bytes.into(),
            frames: AtomicU32::default(),
            expected: Mutex::new(expected),
            overwritten: OnceLock::new(),
        })
    }

    /// Begins a log with a mark of its own. On a full disk the old mark stays.
    fn begin(&self, connection: &Connection) {
        fold(connection);
        if let Ok(mark) = identity::renew(connection, false) {
            lock(&self.expected).in_log = mark;
            self.checkpoint(connection);
        }
    }

    /// The last connection that closes must not merge the log into a file that is no longer the store.
    pub(super) fn keep_log_if_overwritten(&self, connection: &Connection) -> Result<()> {
        match self.overwritten.get() {
            Some(_) => keep_log(connection),
            None => Ok(()),
        }
    }

    /// Lets a restore have the file.
    pub(super) fn release(&self) {
        // Closing the file does the same.
        let _ = flock(&self.file.held, FlockOperation::Unlock);
    }

    /// Checks paths and content.
    pub(super) fn check(&self, connection: &Connection) -> Result<()> {
        self.check_log()?;
        self.check_after(connection)
    }

    /// What can have changed while a group was written.
    fn check_after(&self, connection: &Connection) -> Result<()> {
        self.check_paths()?;
        self.check_file(connection)
    }

    fn check_paths(&self) -> Result<()> {
        self.file.check()?;
        self.log.check()
    }

    /// Checks that the file has the mark that it got, and its length. If SQLite reads a later mark than this process wrote,
    /// another program wrote the log, and brought one of the marks since into the file.
    fn check_file(&self, connection: &Connection) -> Result<()> {
        self.check_known()?;
        let mut expected = lock(&self.expected);
        let found = identity::mark_of(&self.file.held);
        let is_known = [expected.in_file, expected.in_log]
            .map(Some)
            .contains(&found);
        if is_known && identity::reaches(&self.file.held, expected.bytes) {
            return Ok(());
        }
        match (found, identity::mark_in(connection)) {
            (Some(found), Ok(seen))
                if seen > expected.in_log && (expected.in_file..=seen).contains(&found) =>
            {
                *expected = Expected {
                    in_file: found,
                    in_log: seen,
                    bytes: self.file.held.metadata()?.len(),
                };
                Ok(())
            }
            _ => self.is_overwritten(FILE),
        }
    }

    /// Checks that the log begins as SQLite knows it, and is as long.
    fn check_log(&self) -> Result<()> {
        self.check_known()?;
        let mut before = None;
        loop {
            let end = identity::end_of_log(&self.index);
            if let Some(end) = end {
                self.frames.store(end.0, Ordering::Relaxed);
                if identity::is_whole(&self.log.held, end, self.page_bytes) {
                    return Ok(());
                }
            }
            // Another thread or program may have begun the log again meanwhile.
            if end == before {
                return match end {
                    None => Ok(()),
                    Some(_) => self.is_overwritten(LOG),
                };
            }
            before = end;
        }
    }

    fn check_known(&self) -> Result<()> {
        match self.overwritten.get() {
            None => Ok(()),
            Some(part) => Err(StoreError::Overwritten(part)),
        }
    }

    /// Remembered for good: nobody knows what else was written since.
    fn is_overwritten(&self, part: &'static str) -> Result<()> {
        let part = *self.overwritten.get_or_init(|| part);
        Err(StoreError::Overwritten(part))
    }

    /// Writes the log into the file, as far as readers allow, and begins it again; returns whether it could.
    fn checkpoint(&self, connection: &Connection) -> bool {
        let mut expected = lock(&self.expected);
        // Of the log: another collector may have set it.
        let mark = identity::mark_in(connection).unwrap_or(expected.in_log);
        let sql = "PRAGMA wal_checkpoint(PASSIVE)";
        let counts = connection.query_row(sql, [], |row| {
            Ok((row.get::<_, i64>(1)?, row.get::<_, i64>(2)?))
        });
        let is_whole = counts.is_ok_and(|(in_log, written)| in_log == written);
        if is_whole {
            let bytes = self.file.held.metadata().map_or(0, |found| found.len());
            (expected.in_file, expected.bytes) = (mark, bytes);
            if let Ok(mark) = identity::renew(connection, false) {
                expected.in_log = mark;
            }
        }
        is_whole
    }

    fn event(&self, part: &'static str, fate: &'static str, is_folded: bool) -> LogEvent {
        let (file, log) = (self.file.path.display(), self.log.path.display());
        let (at_risk, hint) = match part {
            FILE if fate == OVERWRITTEN => (
                "every frame that the file now lacks".to_owned(),
                format!(
                    "stop this program, `grideye restore BACKUP --store {file}`, and start it again; {log} stays as it is, and is set aside then"
                ),
            ),
            LOG => {
                let at_risk = match is_folded {
                    true => "nothing that was acknowledged: the file has all that its log held",
                    false => "the frames of the last minutes: only the log has them",
                };
                let hint = "restart this program, or put the log back if it was moved";
                (at_risk.to_owned(), hint.to_owned())
            }
            _ if self.file.is_linked() => (
                format!("the newest frames, if the file is opened without {log}"),
                format!(
                    "put it back to {file}: this program then continues by itself; to leave it where it is, stop this program, which merges {log} into it"
                ),
            ),
            _ => {
                let folder = format!("/proc/{}/fd", std::process::id());
                let (file, log) = (self.file.held.as_raw_fd(), self.log.held.as_raw_fd());
                (
                    "every frame of the store: the file is lost when this program ends".to_owned(),
                    format!(
                        "copy it now: cp {folder}/{file} SAVED && cp {folder}/{log} SAVED-wal; then stop this program, and start it with --store SAVED"
                    ),
                )
            }
        };
        LogEvent::new(Level::Error, "store_gone")
            .with("store", file)
            .with(
                "what",
                format!("the store's {part} was {fate}; no frame is acknowledged"),
            )
            .with("at_risk", at_risk)
            .with("hint", hint)
    }
}

impl Part {
    fn new(name: &'static str, path: PathBuf, held: File) -> io::Result<Self> {
        let found = statx(&held, "", AtFlags::EMPTY_PATH, StatxFlags::INO)?;
        Ok(Self {
            name,
            path,
            held,
            identity: identity(&found),
        })
    }

    fn check(&self) -> Result<()> {
        // Not `std::fs::metadata`, which also reads the modification time: since Linux 6.13, reading it gives the file
        // a new time at the next write, so the next sync writes the inode too.
        let there = statx(CWD, &self.path, AtFlags::empty(), StatxFlags::INO);
        let fate = match there.as_ref().map(identity) {
            Ok(identity) if identity == self.identity => return Ok(()),
            Ok(_other) => "replaced by another file",
            Err(&error) if error != Errno::NOENT => "made unreachable",
            Err(_) if self.is_linked() => "moved away",
            Err(_) => "deleted",
        };
        Err(StoreError::Gone {
            part: self.name,
            fate,
        })
    }

    fn is_linked(&self) -> bool {
        let held = statx(&self.held, "", AtFlags::EMPTY_PATH, StatxFlags::NLINK);
        held.is_ok_and(|held| held.stx_nlink > 0)
    }
}

/// Tracks whether the file is still there, for the writer. A store in memory has none.
#[derive(Debug)]
pub(super) struct Presence {
    held: Option<Arc<Held>>,
    log: Log,
    gone: Option<(&'static str, &'static str)>,
    /// The length of the log that brings it into the file.
    checkpoint_at: u32,
}

impl Presence {
    pub(super) fn new(held: Option<Arc<Held>>, log: Log) -> Self {
        Self {
            held,
            log,
            gone: None,
            checkpoint_at: CHECKPOINT_FRAMES,
        }
    }

    /// Before a commit: rejects writes to a file that is gone, or beside a log that another program wrote.
    pub(super) fn check_before(&mut self, connection: &Connection) -> Result<()> {
        let Some(held) = self.held.clone() else {
            return Ok(());
        };
        let found = match self.gone {
            None => held.check_log(),
            Some(_) => held.check(connection),
        };
        self.say(&held, found, connection)
    }

    /// After a commit, before the answer.
    pub(super) fn check(&mut self, connection: &Connection) -> Result<()> {
        let Some(held) = self.held.clone() else {
            return Ok(());
        };
        self.say(&held, held.check_after(connection), connection)
    }

    /// Logs a change.
    fn say(&mut self, held: &Held, found: Result<()>, connection: &Connection) -> Result<()> {
        let gone = match found {
            Err(StoreError::Gone { part, fate }) => Some((part, fate)),
            Err(StoreError::Overwritten(part)) => Some((part, OVERWRITTEN)),
            _ => None,
        };
        if gone != self.gone {
            let event = match gone {
                Some((part, fate)) => {
                    let is_folded = part == LOG && fate != OVERWRITTEN && fold(connection);
                    held.event(part, fate, is_folded)
                }
                None => {
                    LogEvent::new(Level::Info, "store_back").with("store", held.file.path.display())
                }
            };
            self.log.say(&event);
            self.gone = gone;
        }
        found
    }

    /// Writes a long log into the file, after a commit whose checks passed.
    pub(super) fn checkpoint(&mut self, connection: &Connection) {
        let Some(held) = &self.held else { return };
        let frames = held.frames.load(Ordering::Relaxed);
        if frames < self.checkpoint_at {
            return;
        }
        let is_whole = held.checkpoint(connection);
        // A reader may keep the log from beginning again.
        let now = identity::end_of_log(&held.index).map_or(frames, |(frames, _)| frames);
        let more = match is_whole {
            true => CHECKPOINT_FRAMES,
            false => CHECKPOINT_FRAMES / 8,
        };
        self.checkpoint_at = now.saturating_add(more);
    }

    /// At the end: checkpoints the log, and checks that every acknowledged frame will be found.
    pub(super) fn check_at_end(&self, connection: &Connection) -> Result<()> {
        let Some(held) = &self.held else {
            return Ok(());
        };
        let content = held.check_log().and_then(|()| held.check_file(connection));
        if content.is_err() {
            held.keep_log_if_overwritten(connection)?;
            return content;
        }
        // If that fails, the next start misses the log.
        let _ = identity::renew(connection, true);
        match fold(connection) {
            true => held.file.check(),
            false => held.check_paths(),
        }
    }
}

/// Lets the last connection close without merging and deleting the log.
pub(super) fn keep_log(connection: &Connection) -> Result<()> {
    connection.set_db_config(DbConfig::SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, true)?;
    Ok(())
}

/// Writes the whole log into the file and syncs it; returns whether that succeeded.
fn fold(connection: &Connection) -> bool {
    let folded = connection.query_row("PRAGMA wal_checkpoint(TRUNCATE)", [], |row| {
        Ok(row.get::<_, i64>(0)? == 0)
    });
    folded.unwrap_or(false)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_commit_to_a_file_is_synced() {
        let folder = tempfile::tempdir().unwrap();
        let location = StoreLocation::File(folder.path().join("frames.sqlite"));
        let limits = Limits::default();
        let place = Place::of(&location, &limits, &Log::silent()).unwrap();
        let connection = place.connect(&limits).unwrap();
        let text =
            |pragma| connection.pragma_query_value(None, pragma, |row| row.get::<_, String>(0));
        let number =
            |pragma| connection.pragma_query_value(None, pragma, |row| row.get::<_, i64>(0));
        assert_eq!(text("journal_mode").unwrap(), "wal");
        // 2 is FULL: the log is synced at every commit (https://sqlite.org/pragma.html#pragma_synchronous).
        assert_eq!(number("synchronous").unwrap(), 2);
    }
}
