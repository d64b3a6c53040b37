//! Opens the file's connections, and checks that its path still names the open file.
//!
//! A file can be deleted, moved or replaced while a program writes it, and every write still succeeds. So the writer
//! checks after each commit, before it answers. While the file is gone nothing is written; every batch checks again.

use crate::limits::Limits;
use crate::log::{Level, Log, LogEvent};
use crate::store::error::{Result, StoreError};
use crate::store::location::StoreLocation;
use crate::store::sqlite::schema::{READ_WRITE, recognize};
use rusqlite::{Connection, ErrorCode, OpenFlags};
use rustix::fs::{AtFlags, CWD, Statx, StatxFlags, statx};
use rustix::io::Errno;
use std::fs::{File, OpenOptions};
use std::io;
use std::os::fd::AsRawFd as _;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Prepared statements cached per connection: more than this crate has.
const STATEMENTS_MAX: usize = 64;

pub(super) struct Place {
    pub(super) name: String,
    flags: OpenFlags,
    /// `None` for a store in memory.
    file: Option<File>,
}

impl Place {
    pub(super) fn of(location: &StoreLocation) -> Result<Self> {
        match location {
            StoreLocation::File(path) => {
                let file = make_file(path)?;
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
        let held =
            Held::new(Path::new(&self.name), file, connection).map_err(|error| unusable(&error))?;
        held.check()?;
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
    let file = opened.map_err(|error| unusable(&error))?;
    if file.metadata().map_err(|error| unusable(&error))?.is_file() {
        return Ok(file);
    }
    Err(StoreError::Unusable("it is not a regular file".to_owned()))
}

fn unusable(error: &io::Error) -> StoreError {
    StoreError::Unusable(error.to_string())
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

/// The database and its log, as they were when the store was opened.
#[derive(Debug)]
pub(super) struct Held {
    file: Part,
    log: Part,
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
    pub(super) fn new(path: &Path, file: File, connection: &Connection) -> io::Result<Self> {
        let log = PathBuf::from(format!("{}-wal", connection.path().unwrap_or_default()));
        let held = Self {
            file: Part::new(FILE, std::path::absolute(path)?, file)?,
            log: Part::new(LOG, log.clone(), File::open(&log)?)?,
        };
        Ok(held)
    }

    pub(super) fn check(&self) -> Result<()> {
        self.file.check()?;
        self.log.check()
    }

    fn event(&self, part: &'static str, fate: &'static str, is_folded: bool) -> LogEvent {
        let (file, log) = (self.file.path.display(), self.log.path.display());
        let (at_risk, hint) = if part == LOG {
            let at_risk = if is_folded {
                "nothing that was acknowledged: the file has all that its log held".to_owned()
            } else {
                "the frames of the last seconds: only the log has them".to_owned()
            };
            let hint = "restart this program, or put the log back if it was moved";
            (at_risk, hint.to_owned())
        } else if self.file.is_linked() {
            let at_risk = format!("the newest frames, if the file is opened without {log}");
            let hint = format!(
                "put it back to {file}: this program then continues by itself; to leave it where it is, stop this program, which merges {log} into it"
            );
            (at_risk, hint)
        } else {
            let at_risk = "every frame of the store: the file is lost when this program ends";
            let folder = format!("/proc/{}/fd", std::process::id());
            let (file, log) = (self.file.held.as_raw_fd(), self.log.held.as_raw_fd());
            let hint = format!(
                "copy it now: cp {folder}/{file} SAVED && cp {folder}/{log} SAVED-wal; then stop this program, and start it with --store SAVED"
            );
            (at_risk.to_owned(), hint)
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

/// Tracks whether the file is still there. A store in memory has none.
#[derive(Debug)]
pub(super) struct Presence {
    held: Option<Arc<Held>>,
    log: Log,
    gone: Option<(&'static str, &'static str)>,
}

impl Presence {
    pub(super) fn new(held: Option<Arc<Held>>, log: Log) -> Self {
        Self {
            held,
            log,
            gone: None,
        }
    }

    /// Before a commit: rejects writes to a file that is gone.
    pub(super) fn check_before(&mut self, connection: &Connection) -> Result<()> {
        match self.gone {
            None => Ok(()),
            Some(_) => self.check(connection),
        }
    }

    /// After a commit, before the answer.
    pub(super) fn check(&mut self, connection: &Connection) -> Result<()> {
        let Some(held) = &self.held else {
            return Ok(());
        };
        let found = held.check();
        let gone = match found {
            Err(StoreError::Gone { part, fate }) => Some((part, fate)),
            _ => None,
        };
        if gone != self.gone {
            let event = match gone {
                Some((part, fate)) => held.event(part, fate, part == LOG && fold(connection)),
                None => {
                    LogEvent::new(Level::Info, "store_back").with("store", held.file.path.display())
                }
            };
            self.log.say(&event);
            self.gone = gone;
        }
        found
    }

    /// At the end: checkpoints the log, and checks that every acknowledged frame will be found.
    pub(super) fn check_at_end(&self, connection: &Connection) -> Result<()> {
        let is_folded = fold(connection);
        match &self.held {
            None => Ok(()),
            Some(held) if is_folded => held.file.check(),
            Some(held) => held.check(),
        }
    }
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
        let connection = Place::of(&location)
            .unwrap()
            .connect(&Limits::default())
            .unwrap();
        let text =
            |pragma| connection.pragma_query_value(None, pragma, |row| row.get::<_, String>(0));
        let number =
            |pragma| connection.pragma_query_value(None, pragma, |row| row.get::<_, i64>(0));
        assert_eq!(text("journal_mode").unwrap(), "wal");
        // 2 is FULL: the log is synced at every commit (https://sqlite.org/pragma.html#pragma_synchronous).
        assert_eq!(number("synchronous").unwrap(), 2);
    }
}
