//! The tables, and how a file is recognised as a store of this program.

use super::StoreError;
use rusqlite::{Connection, TransactionBehavior};

/// Marks the file as ours: "GEYE".
const APPLICATION_ID: i64 = 0x4745_5945;
/// The layout below.
const LAYOUT: i64 = 1;

/// `frames` is clustered by its key, so that one stream is read in one sweep and a frame cannot be there twice.
/// `runs` holds the received numbers as runs, so that gaps are known without walking the frames.
/// `arrivals` is the durable order in which batches came; recordings are ranges of it.
const TABLES: &str = "
CREATE TABLE streams (
    id INTEGER PRIMARY KEY,
    device TEXT NOT NULL,
    sensor TEXT NOT NULL,
    boot TEXT NOT NULL,
    stored INTEGER NOT NULL DEFAULT 0,
    missing INTEGER NOT NULL DEFAULT 0,
    last_arrival INTEGER NOT NULL DEFAULT 0,
    t_last_arrival_ns INTEGER NOT NULL DEFAULT 0,
    account TEXT,
    account_read INTEGER,
    came_since_account INTEGER NOT NULL DEFAULT 0,
    UNIQUE (device, sensor, boot)
) STRICT;
CREATE TABLE frames (
    stream_id INTEGER NOT NULL REFERENCES streams (id),
    seq INTEGER NOT NULL,
    t_boot_ns INTEGER NOT NULL,
    t_utc_ns INTEGER NOT NULL,
    clock INTEGER NOT NULL CHECK (clock BETWEEN 0 AND 2),
    t_arrival_ns INTEGER NOT NULL,
    arrival INTEGER NOT NULL,
    missing TEXT,
    thermistor INTEGER,
    pixels BLOB CHECK (pixels IS NULL OR length(pixels) = 128),
    PRIMARY KEY (stream_id, seq),
    CHECK ((missing IS NULL) = (pixels IS NOT NULL)),
    CHECK ((missing IS NULL) = (thermistor IS NOT NULL))
) STRICT, WITHOUT ROWID;
CREATE TABLE runs (
    stream_id INTEGER NOT NULL REFERENCES streams (id),
    first INTEGER NOT NULL,
    last INTEGER NOT NULL,
    PRIMARY KEY (stream_id, first)
) STRICT, WITHOUT ROWID;
CREATE TABLE arrivals (
    arrival INTEGER NOT NULL,
    stream_id INTEGER NOT NULL REFERENCES streams (id),
    first_seq INTEGER NOT NULL,
    last_seq INTEGER NOT NULL,
    stored INTEGER NOT NULL,
    missing INTEGER NOT NULL,
    PRIMARY KEY (arrival, stream_id)
) STRICT, WITHOUT ROWID;
CREATE TABLE recordings (
    id INTEGER PRIMARY KEY,
    name TEXT NOT NULL UNIQUE,
    t_start_ns INTEGER NOT NULL,
    t_stop_ns INTEGER,
    after_arrival INTEGER NOT NULL,
    through_arrival INTEGER
) STRICT;
";

/// Makes the tables in an empty file, or makes sure that they are there.
pub(super) fn prepare(connection: &mut Connection) -> Result<(), StoreError> {
    let transaction = connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
    if recognise(&transaction)? == Found::Nothing {
        transaction.execute_batch(TABLES)?;
        transaction.pragma_update(None, "application_id", APPLICATION_ID)?;
        transaction.pragma_update(None, "user_version", LAYOUT)?;
    }
    transaction.commit()?;
    Ok(())
}

/// What a file holds that may become, or is, a store.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Found {
    /// Nothing: a file just made.
    Nothing,
    /// The tables above.
    Store,
}

/// Looks without changing anything, and refuses what is not ours to write.
pub(super) fn recognise(connection: &Connection) -> Result<Found, StoreError> {
    let number = |pragma| connection.pragma_query_value(None, pragma, |row| row.get::<_, i64>(0));
    let tables: i64 =
        connection.query_row("SELECT count(*) FROM sqlite_schema", [], |row| row.get(0))?;
    match (number("application_id")?, number("user_version")?) {
        (0, 0) if tables == 0 => Ok(Found::Nothing),
        (APPLICATION_ID, LAYOUT) => Ok(Found::Store),
        (APPLICATION_ID, found) => Err(StoreError::Newer {
            found,
            known: LAYOUT,
        }),
        _ => Err(StoreError::Foreign),
    }
}
