//! Makes a file ready: a new one gets its tables; one of an older layout is copied as it is, then upgraded in one transaction.
//!
//! Killed or failing at any moment, the file stays as it was: the next program that opens it begins again.

use crate::store::error::StoreError;
use crate::store::sqlite::backup::{BackupError, copy};
use crate::store::sqlite::schema::{
    APPLICATION_ID, Found, LAYOUT, STEPS, TABLES, add_what_is_written, recognise,
};
use rusqlite::{Connection, OpenFlags, TransactionBehavior};
use std::path::{Path, PathBuf};

/// What was done to a file of an older layout.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Upgraded {
    pub(super) from: i64,
    pub(super) backup: PathBuf,
}

/// Makes the tables in an empty file, upgrades those of an older layout, or makes sure that they are there.
pub(crate) fn prepare(
    connection: &mut Connection,
    file: &Path,
) -> Result<Option<Upgraded>, StoreError> {
    let transaction = connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
    let mut upgraded = None;
    match recognise(&transaction)? {
        Found::Nothing => {
            transaction.execute_batch(TABLES)?;
            transaction.pragma_update(None, "application_id", APPLICATION_ID)?;
            transaction.pragma_update(None, "user_version", LAYOUT)?;
        }
        Found::Older(from) => {
            upgraded = Some(upgrade(&transaction, file, (from, LAYOUT))?);
        }
        Found::Store => {}
    }
    add_what_is_written(&transaction)?;
    transaction.commit()?;
    Ok(upgraded)
}

/// Upgrades the file between two layouts in the caller's transaction, which holds off all other writers, after a copy of it.
fn upgrade(
    transaction: &Connection,
    file: &Path,
    (from, to): (i64, i64),
) -> Result<Upgraded, StoreError> {
    let backup = back_up(transaction, file, from)?;
    for (_, step) in STEPS.iter().filter(|(layout, _)| *layout >= from) {
        transaction.execute_batch(step)?;
    }
    transaction.pragma_update(None, "user_version", to)?;
    Ok(Upgraded { from, backup })
}

/// Copies the file whole and synced; a copy of the same state that an interrupted upgrade left is taken as it is.
fn back_up(transaction: &Connection, file: &Path, from: i64) -> Result<PathBuf, StoreError> {
    let mut name = file.as_os_str().to_owned();
    name.push(format!(".layout-{from}.backup"));
    let backup = PathBuf::from(name);
    if backup.exists() {
        let found = Connection::open_with_flags(&backup, OpenFlags::SQLITE_OPEN_READ_ONLY)?;
        return if state(&found).ok() == Some(state(transaction)?) {
            Ok(backup)
        } else {
            Err(StoreError::BackupInTheWay { from, backup })
        };
    }
    // On a connection of its own, because the other one is within its transaction.
    let flags = OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let source = Connection::open_with_flags(file, flags)?;
    match copy(&source, &backup, &mut |_, _, _| (), |_, _| Ok(())) {
        Ok(()) => Ok(backup),
        Err(BackupError::NoRoom { bytes, .. }) => Err(StoreError::NoRoomForBackup {
            from,
            backup,
            bytes,
        }),
        Err(error) => Err(StoreError::Unusable(error.to_string())),
    }
}

/// Tells states of one store apart: the epoch, which grows with recordings, and the last group of posts.
fn state(connection: &Connection) -> Result<(i64, i64), StoreError> {
    let sql = "SELECT epoch, max(groups, (SELECT coalesce(max(id), 0) FROM pending)) FROM counters";
    Ok(connection.query_row(sql, [], |row| Ok((row.get(0)?, row.get(1)?)))?)
}
