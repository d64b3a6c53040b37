//! The tables, and how a file is recognized as a store of this program.

use crate::store::error::{Result, StoreError};
use rusqlite::{Connection, OpenFlags};

/// Marks the file as ours: "GEYE".
pub(super) const APPLICATION_ID: i64 = 0x4745_5945;
pub(super) const LAYOUT: i64 = 3;

/// How a file is opened that is there.
pub(super) const READ_WRITE: OpenFlags =
    OpenFlags::SQLITE_OPEN_READ_WRITE.union(OpenFlags::SQLITE_OPEN_NO_MUTEX);

/// `pending` holds groups of posts until the other tables have them; `kept_group` of a stream is the last that they have.
/// `chunks` holds rows of one stream, ascending, many in one (`chunk.rs`), old ones sealed; `frames` are those with pixels.
/// It has a rowid, because a search among keys that lie beside such rows reads all the rows that it passes.
/// `t_store_ns` of a chunk is the store time (`sqlite/time.rs`) at which its last row was stored; that of `counters` is the
/// last that was kept, and what came before `t_aged_from_ns` is as old as that.
/// `runs` holds the received numbers as runs, permanently. `counters` has the epoch and the number of groups kept.
/// Recordings are ranges of epochs, and `shares` says what each epoch brought to each stream.
/// Rows that were deleted are still in `stored`; how many of them carried pixels is `expired`.
pub(super) const TABLES: &str = "
CREATE TABLE pending (
    id INTEGER PRIMARY KEY,
    batches BLOB NOT NULL
) STRICT;
CREATE TABLE streams (
    id INTEGER PRIMARY KEY,
    device TEXT NOT NULL,
    sensor TEXT NOT NULL,
    boot TEXT NOT NULL,
    stored INTEGER NOT NULL DEFAULT 0,
    missing INTEGER NOT NULL DEFAULT 0,
    expired INTEGER NOT NULL DEFAULT 0,
    sealed_through INTEGER NOT NULL DEFAULT -1,
    last_group INTEGER NOT NULL DEFAULT 0,
    t_last_arrival_ns INTEGER NOT NULL DEFAULT 0,
    account TEXT,
    account_read INTEGER,
    came_since_account INTEGER NOT NULL DEFAULT 0,
    kept_group INTEGER NOT NULL DEFAULT 0,
    UNIQUE (device, sensor, boot)
) STRICT;
CREATE TABLE chunks (
    stream_id INTEGER NOT NULL REFERENCES streams (id),
    first_seq INTEGER NOT NULL,
    last_seq INTEGER NOT NULL,
    epoch INTEGER NOT NULL,
    t_store_ns INTEGER NOT NULL,
    frames INTEGER NOT NULL,
    is_sealed INTEGER NOT NULL CHECK (is_sealed IN (0, 1)),
    rows BLOB NOT NULL,
    PRIMARY KEY (stream_id, first_seq),
    CHECK (first_seq <= last_seq)
) STRICT;
CREATE INDEX chunks_by_age ON chunks (t_store_ns, stream_id, first_seq);
CREATE TABLE runs (
    stream_id INTEGER NOT NULL REFERENCES streams (id),
    first INTEGER NOT NULL,
    last INTEGER NOT NULL,
    PRIMARY KEY (stream_id, first)
) STRICT, WITHOUT ROWID;
CREATE TABLE shares (
    epoch INTEGER NOT NULL,
    stream_id INTEGER NOT NULL REFERENCES streams (id),
    first_seq INTEGER NOT NULL,
    last_seq INTEGER NOT NULL,
    stored INTEGER NOT NULL,
    missing INTEGER NOT NULL,
    PRIMARY KEY (epoch, stream_id)
) STRICT, WITHOUT ROWID;
CREATE TABLE recordings (
    id INTEGER PRIMARY KEY,
    name TEXT NOT NULL UNIQUE,
    t_start_ns INTEGER NOT NULL,
    t_stop_ns INTEGER,
    after_epoch INTEGER NOT NULL,
    through_epoch INTEGER
) STRICT;
CREATE TABLE counters (
    epoch INTEGER NOT NULL,
    groups INTEGER NOT NULL,
    t_store_ns INTEGER NOT NULL DEFAULT 0,
    t_aged_from_ns INTEGER NOT NULL DEFAULT 0
) STRICT;
INSERT INTO counters (epoch, groups) VALUES (1, 0);
";

/// From each layout that is read to the next one. The first is the oldest that a released program wrote.
pub(super) const STEPS: [(i64, &str); 1] = [(2, TO_3)];

const OLDEST: i64 = STEPS[0].0;

/// Layout 2 had the wall clock where layout 3 has store time. The old times are left for the order of deletion, not as ages.
const TO_3: &str = "
ALTER TABLE chunks RENAME COLUMN t_arrival_ns TO t_store_ns;
CREATE INDEX chunks_by_age ON chunks (t_store_ns, stream_id, first_seq);
ALTER TABLE counters ADD COLUMN t_store_ns INTEGER NOT NULL DEFAULT 0;
ALTER TABLE counters ADD COLUMN t_aged_from_ns INTEGER NOT NULL DEFAULT 0;
UPDATE counters SET t_store_ns = coalesce((SELECT max(t_store_ns) FROM chunks), 0);
UPDATE counters SET t_aged_from_ns = t_store_ns;
";

/// Beside the layout: what an older version of this program neither needs nor touches. A label is a document: its name and the
/// frames that it is of, as JSON.
pub(super) const WRITTEN: &str = "
CREATE TABLE IF NOT EXISTS notes (
    recording_id INTEGER PRIMARY KEY REFERENCES recordings (id),
    note TEXT NOT NULL
) STRICT;
CREATE TABLE IF NOT EXISTS labels (
    recording_id INTEGER NOT NULL REFERENCES recordings (id),
    number INTEGER NOT NULL,
    label TEXT NOT NULL,
    PRIMARY KEY (recording_id, number)
) STRICT, WITHOUT ROWID;
";

/// What a file holds that may become, or is, a store.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Found {
    /// Nothing: a file just made.
    Nothing,
    /// The tables above.
    Store,
    /// Those of an older layout that is read.
    Older(i64),
}

/// Looks without changing anything, and refuses what is not ours to write.
pub(super) fn recognize(connection: &Connection) -> Result<Found> {
    let number = |pragma| connection.pragma_query_value(None, pragma, |row| row.get::<_, i64>(0));
    let tables: i64 =
        connection.query_row("SELECT count(*) FROM sqlite_schema", [], |row| row.get(0))?;
    match (number("application_id")?, number("user_version")?) {
        (0, 0) if tables == 0 => Ok(Found::Nothing),
        (APPLICATION_ID, LAYOUT) => Ok(Found::Store),
        (APPLICATION_ID, found) if found < OLDEST => Err(StoreError::Older {
            found,
            oldest: OLDEST,
            known: LAYOUT,
        }),
        (APPLICATION_ID, found) if found < LAYOUT => Ok(Found::Older(found)),
        (APPLICATION_ID, found) => Err(StoreError::Newer {
            found,
            known: LAYOUT,
        }),
        _ => Err(StoreError::Foreign),
    }
}
