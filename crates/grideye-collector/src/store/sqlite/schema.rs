//! The tables, and how a file is recognized as a store of this program.

use crate::store::error::{Result, StoreError};
use rusqlite::{Connection, OpenFlags};

/// Marks the file as ours: "GEYE".
pub(super) const APPLICATION_ID: i64 = 0x4745_5945;
pub(super) const LAYOUT: i64 = 4;

/// Flags for an existing file.
pub(super) const READ_WRITE: OpenFlags =
    OpenFlags::SQLITE_OPEN_READ_WRITE.union(OpenFlags::SQLITE_OPEN_NO_MUTEX);

/// `arrivals` holds what each batch brought of a stream, in the order of arrival; `chunks` holds ascending rows of one
/// stream, some seconds, and once sealed, some minutes. Both have the rows of `chunk.rs`; `frames` counts those with
/// pixels. A frame is in one of the two: arrivals move in order, many at once (`append.rs`).
/// It has a rowid, because a search in keys stored beside such large rows reads every row it passes.
/// `t_store_ns` of a chunk is the store time (`sqlite/time.rs`) of its last row. In `counters` it is the last stored
/// time, and chunks from before `t_aged_from_ns` count as that old.
/// `runs` holds the received numbers as runs, permanently; the newest run of a stream ends with its `last_seq`, and its
/// row is written when another begins. `counters` has the epoch and the number of groups stored.
/// Recordings are ranges of epochs, and `shares` says what each epoch brought to each stream; a stream has the share of
/// the last epoch that brought something. So a batch changes one row of a stream, and adds one of its frames.
/// Deleted rows still count in `stored`; `expired` counts those of them that had pixels.
pub(super) const TABLES: &str = "
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
    last_seq INTEGER NOT NULL DEFAULT -1,
    share_epoch INTEGER NOT NULL DEFAULT 0,
    share_first INTEGER NOT NULL DEFAULT 0,
    share_last INTEGER NOT NULL DEFAULT 0,
    share_stored INTEGER NOT NULL DEFAULT 0,
    share_missing INTEGER NOT NULL DEFAULT 0,
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

/// What layout 4 brought beside columns: in a new file after [`TABLES`], in an older one after its last step.
pub(super) const SINCE_4: &str = "
CREATE TABLE arrivals (
    id INTEGER PRIMARY KEY,
    stream_id INTEGER NOT NULL,
    first_seq INTEGER NOT NULL,
    last_seq INTEGER NOT NULL,
    epoch INTEGER NOT NULL,
    t_store_ns INTEGER NOT NULL,
    frames INTEGER NOT NULL,
    rows BLOB NOT NULL
) STRICT;
CREATE VIEW all_shares AS
    SELECT epoch, stream_id, first_seq, last_seq, stored, missing FROM shares UNION ALL
    SELECT share_epoch, id, share_first, share_last, share_stored, share_missing FROM streams
    WHERE share_epoch = (SELECT epoch FROM counters);
";

/// The step from each readable layout to the next. The first is the oldest that a released program wrote.
pub(super) const STEPS: [(i64, &str); 2] = [(2, TO_3), (3, TO_4)];

const OLDEST: i64 = STEPS[0].0;

/// Layout 2 had the wall clock in place of store time. The old times keep the order of deletion, but are not ages.
const TO_3: &str = "
ALTER TABLE chunks RENAME COLUMN t_arrival_ns TO t_store_ns;
CREATE INDEX chunks_by_age ON chunks (t_store_ns, stream_id, first_seq);
ALTER TABLE counters ADD COLUMN t_store_ns INTEGER NOT NULL DEFAULT 0;
ALTER TABLE counters ADD COLUMN t_aged_from_ns INTEGER NOT NULL DEFAULT 0;
UPDATE counters SET t_store_ns = coalesce((SELECT max(t_store_ns) FROM chunks), 0);
UPDATE counters SET t_aged_from_ns = t_store_ns;
";

/// Layout 3 kept groups of batches in `pending` until the other tables had them (`older.rs`); `kept_group` was the last
/// group that a stream's tables had.
const TO_4: &str = "
DROP TABLE pending;
ALTER TABLE streams DROP COLUMN kept_group;
ALTER TABLE streams ADD COLUMN last_seq INTEGER NOT NULL DEFAULT -1;
ALTER TABLE streams ADD COLUMN share_epoch INTEGER NOT NULL DEFAULT 0;
ALTER TABLE streams ADD COLUMN share_first INTEGER NOT NULL DEFAULT 0;
ALTER TABLE streams ADD COLUMN share_last INTEGER NOT NULL DEFAULT 0;
ALTER TABLE streams ADD COLUMN share_stored INTEGER NOT NULL DEFAULT 0;
ALTER TABLE streams ADD COLUMN share_missing INTEGER NOT NULL DEFAULT 0;
";

/// Not part of the layout: older versions of this program neither need nor touch these tables and the index. A label is JSON: its
/// name and its frames. A fact is a sentence about the store. A running recording with a lease ends if it is not renewed.
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
CREATE TABLE IF NOT EXISTS facts (fact TEXT PRIMARY KEY) STRICT, WITHOUT ROWID;
CREATE INDEX IF NOT EXISTS shares_of_stream ON shares (stream_id);
CREATE TABLE IF NOT EXISTS leases (recording_id INTEGER PRIMARY KEY, renewals INTEGER NOT NULL) STRICT;
";

/// The contents of a file that is or may become a store.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Found {
    /// Empty: a new file.
    Nothing,
    /// The current tables.
    Store,
    /// The tables of an older, readable layout.
    Older(i64),
}

/// Checks without changing anything, and rejects files that are not ours.
pub(super) fn recognize(connection: &Connection) -> Result<Found> {
    let number = |pragma| connection.pragma_query_value(None, pragma, |row| row.get::<_, i64>(0));
    let tables: i64 =
        connection.query_row("SELECT count(*) FROM sqlite_schema", [], |row| row.get(0))?;
    match (number("application_id")?, number("user_version")?) {
        (0, 0) if tables == 0 => Ok(Found::Nothing),
        (APPLICATION_ID, LAYOUT) => Ok(Found::Store),
        (APPLICATION_ID, found) if found < OLDEST => Err(StoreError::Refused(format!(
            "the store has layout {found}, which was in use before the first release; this program knows layouts {OLDEST} to {LAYOUT}\nhint: name another file; with the program that made this one, `grideye record` and the page still export its recordings as CSV"
        ))),
        (APPLICATION_ID, found) if found < LAYOUT => Ok(Found::Older(found)),
        (APPLICATION_ID, found) => Err(StoreError::newer(found, LAYOUT)),
        _ => Err(StoreError::foreign()),
    }
}
