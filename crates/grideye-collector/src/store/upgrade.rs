//! From an older layout of the file to the present one: a copy of the file as it is, beside it, then one transaction.
//!
//! Killed or failing at any moment, the file stays as it was: the next program that opens it begins again.

use super::StoreError;
use super::sqlite::{BackupError, copy};
use rusqlite::{Connection, OpenFlags};
use std::path::{Path, PathBuf};

/// From each layout that is read to the next one. The first is the oldest that a released program wrote.
const STEPS: [(i64, &str); 1] = [(2, TO_3)];

/// The oldest layout that is read.
pub(super) const OLDEST: i64 = STEPS[0].0;

/// Layout 2 had the wall clock's time of arrival where layout 3 has store time, by which frames grow old. Those times are
/// left, for the order of deletion; none of them is an age: all that is there counts as stored now, because a clock that
/// had jumped would make it old.
const TO_3: &str = "
ALTER TABLE chunks RENAME COLUMN t_arrival_ns TO t_store_ns;
CREATE INDEX chunks_by_age ON chunks (t_store_ns, stream_id, first_seq);
ALTER TABLE counters ADD COLUMN t_store_ns INTEGER NOT NULL DEFAULT 0;
ALTER TABLE counters ADD COLUMN t_aged_from_ns INTEGER NOT NULL DEFAULT 0;
UPDATE counters SET t_store_ns = coalesce((SELECT max(t_store_ns) FROM chunks), 0);
UPDATE counters SET t_aged_from_ns = t_store_ns;
";

/// What was done to a file of an older layout.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Upgraded {
    pub(super) from: i64,
    pub(super) backup: PathBuf,
}

/// Upgrades the file between two layouts in the caller's transaction, which holds off all other writers, after a copy of it.
pub(super) fn upgrade(
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

/// Copies the file as it is now, whole and synced, under a name that appears last. A copy of the same state that an
/// interrupted upgrade left is taken as it is.
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
        Err(error) => Err(StoreError::Unusable {
            message: error.to_string(),
        }),
    }
}

/// Tells states of one store apart: the epoch, which grows with recordings, and the last group of posts.
fn state(connection: &Connection) -> Result<(i64, i64), StoreError> {
    let sql = "SELECT epoch, max(groups, (SELECT coalesce(max(id), 0) FROM pending)) FROM counters";
    Ok(connection.query_row(sql, [], |row| Ok((row.get(0)?, row.get(1)?)))?)
}
