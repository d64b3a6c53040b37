//! Where the file is, how each connection to it is opened, and SQLite's errors as a store's.

use crate::limits::Limits;
use crate::store::error::StoreError;
use crate::store::location::StoreLocation;
use crate::store::sqlite::held::Held;
use crate::store::sqlite::schema::recognise;
use rusqlite::{Connection, ErrorCode, OpenFlags};
use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

/// Prepared statements that a connection keeps: more than there are in this crate.
const STATEMENTS_MAX: usize = 64;

pub(super) struct Place {
    pub(super) name: String,
    flags: OpenFlags,
    /// Not of a store in memory.
    file: Option<File>,
}

impl Place {
    pub(super) fn of(location: &StoreLocation) -> Result<Self, StoreError> {
        let flags = OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        match location {
            StoreLocation::File(path) => {
                let file = make_file(path)?;
                let name = path
                    .to_str()
                    .ok_or_else(|| StoreError::Unusable("the path is not UTF-8".to_owned()))?;
                Ok(Self {
                    name: name.to_owned(),
                    flags,
                    file: Some(file),
                })
            }
            StoreLocation::Postgres(url) => Err(StoreError::Unusable(format!("{url} is no file"))),
            StoreLocation::Memory => {
                static STORES: AtomicU64 = AtomicU64::new(0);
                let number = STORES.fetch_add(1, Ordering::Relaxed);
                Ok(Self {
                    name: format!("file:/grideye-{number}?vfs=memdb"),
                    flags: flags | OpenFlags::SQLITE_OPEN_URI | OpenFlags::SQLITE_OPEN_CREATE,
                    file: None,
                })
            }
        }
    }

    /// Takes note of which file the connections have opened.
    pub(super) fn hold(&mut self, connection: &Connection) -> Result<Option<Held>, StoreError> {
        let Some(file) = self.file.take() else {
            return Ok(None);
        };
        let held =
            Held::new(Path::new(&self.name), file, connection).map_err(|error| unusable(&error))?;
        held.check()?;
        Ok(Some(held))
    }

    pub(super) fn connect(&self, limits: &Limits) -> Result<Connection, StoreError> {
        let connection = Connection::open_with_flags(&self.name, self.flags)?;
        connection.busy_timeout(limits.store_lock_time_max)?;
        connection.set_prepared_statement_cache_capacity(STATEMENTS_MAX);
        if self.file.is_some() {
            // The change to WAL is written into the file, so it must be ours.
            recognise(&connection)?;
            connection.pragma_update(None, "journal_mode", "WAL")?;
        }
        connection.pragma_update(None, "synchronous", "FULL")?;
        connection.pragma_update(None, "foreign_keys", true)?;
        Ok(connection)
    }
}

/// Makes an empty file that only this user may read, or finds that the one there may be written.
fn make_file(path: &Path) -> Result<File, StoreError> {
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
    Err(StoreError::Unusable("it is not a plain file".to_owned()))
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

    #[test]
    fn a_full_disk_is_told_from_other_faults() {
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
}
