//! The queries.

use crate::limits::Limits;
use crate::store::account;
use crate::store::chunk::Kept;
use crate::store::error::{RecordingId, Result, StoreError};
use crate::store::plan::StreamState;
use crate::store::row::{count, damaged, unsigned};
use crate::store::segment::SealedRow;
use crate::store::types::{Members, Recording, Span, StoredRecord, StreamSummary};
use grideye_recording::{Record, StreamId};
use rusqlite::{Connection, Row, params};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

pub(super) fn bytes(connection: &Connection) -> Result<u64> {
    let number = |pragma| connection.pragma_query_value(None, pragma, |row| row.get::<_, i64>(0));
    let bytes = number("page_count")?.saturating_mul(number("page_size")?);
    Ok(u64::try_from(bytes).unwrap_or(0))
}

/// Bytes of the file in use; SQLite reuses free pages.
pub(super) fn bytes_used(connection: &Connection) -> Result<u64> {
    let number = |pragma| connection.pragma_query_value(None, pragma, |row| row.get::<_, i64>(0));
    let pages = number("page_count")? - number("freelist_count")?;
    Ok(u64::try_from(pages.saturating_mul(number("page_size")?)).unwrap_or(0))
}

pub(super) fn ping(connection: &Connection) -> Result<()> {
    connection
        .prepare_cached("SELECT max(id) FROM streams")?
        .query_row([], |_| Ok(()))?;
    Ok(())
}

const STREAM_COLUMNS: &str =
    "id, device, sensor, boot, stored, missing, account, account_read, came_since_account,
    t_last_arrival_ns, expired";

/// Follows [`STREAM_COLUMNS`]: the end of the newest run, which layouts before 4 have in its row.
pub(super) const LAST_SEQ: &str = "last_seq";
pub(super) const LAST_SEQ_OF_OLDER: &str = "-1";

pub(super) fn streams(connection: &Connection, limits: &Limits) -> Result<Vec<StreamSummary>> {
    // One snapshot, so that counts and gaps match.
    let snapshot = connection.unchecked_transaction()?;
    streams_within(&snapshot, limits, LAST_SEQ)
}

/// The same within the caller's transaction.
pub(super) fn streams_within(
    connection: &Connection,
    limits: &Limits,
    last_seq: &str,
) -> Result<Vec<StreamSummary>> {
    let mut statement = connection.prepare_cached(&format!(
        "SELECT {STREAM_COLUMNS}, {last_seq} FROM streams
         WHERE id IN (SELECT id FROM streams ORDER BY last_group DESC, id DESC LIMIT ?)
         ORDER BY device, sensor, boot"
    ))?;
    let newest = count(limits.gaps_listed_max.saturating_add(1));
    let streams = statement.query_and_then([count(limits.streams_listed_max)], |row| {
        let state = state_of(connection, row, newest)?;
        state.summary(&Arc::new(stream_id(row, 1)?), limits)
    })?;
    streams.collect()
}

/// The full state of a stream, for the writer.
pub(super) fn state(connection: &Connection, id: &StreamId) -> Result<Option<StreamState>> {
    let mut statement = connection.prepare_cached(&format!(
        "SELECT {STREAM_COLUMNS}, {LAST_SEQ} FROM streams WHERE device = ? AND sensor = ? AND boot = ?"
    ))?;
    let mut rows = statement.query(params![id.device, id.sensor, id.boot])?;
    let row = rows.next()?;
    row.map(|row| state_of(connection, row, i64::MAX))
        .transpose()
}

/// From [`STREAM_COLUMNS`], with the newest runs.
fn state_of(connection: &Connection, row: &Row<'_>, runs_max: i64) -> Result<StreamState> {
    let account: Option<String> = row.get(6)?;
    let mut state = StreamState {
        key: row.get(0)?,
        stored: row.get(4)?,
        missing: row.get(5)?,
        account: account.as_deref().map(account::from_json).transpose()?,
        account_read: row.get(7)?,
        came_since_account: row.get(8)?,
        t_last_arrival_ns: row.get(9)?,
        expired: row.get(10)?,
        ..StreamState::default()
    };
    let mut statement = connection.prepare_cached(
        "SELECT first, last FROM runs WHERE stream_id = ? ORDER BY first DESC LIMIT ?",
    )?;
    let mut runs = statement.query([state.key, runs_max])?;
    while let Some(run) = runs.next()? {
        state.restore_run(run.get(0)?, run.get(1)?)?;
    }
    if let Ok(last_seq) = u64::try_from(row.get::<_, i64>(11)?) {
        state.runs.restore_last(last_seq);
    }
    Ok(state)
}

const CHUNK_COLUMNS: &str = "first_seq, last_seq, epoch, is_sealed, rows";

/// The rows of one chunk, from [`CHUNK_COLUMNS`].
pub(crate) fn rows_of(row: &Row<'_>) -> Result<Vec<SealedRow>> {
    Kept {
        first_seq: row.get(0)?,
        last_seq: row.get(1)?,
        epoch: row.get(2)?,
        is_sealed: row.get(3)?,
        rows: row
            .get_ref(4)?
            .as_blob()
            .map_err(|error| damaged(&error.to_string()))?,
    }
    .open()
}

/// The stored records under these numbers, except deleted ones.
pub(super) fn records(
    connection: &Connection,
    key: i64,
    seqs: &BTreeSet<u64>,
) -> Result<BTreeMap<u64, Record>> {
    let mut statement = connection.prepare_cached(&format!(
        "SELECT {CHUNK_COLUMNS} FROM chunks WHERE stream_id = ? AND first_seq <= ? ORDER BY first_seq DESC LIMIT 1"
    ))?;
    let mut records = BTreeMap::new();
    let mut last = None;
    for seq in seqs {
        // In ascending order: numbers up to the end of the last chunk are already done.
        if last.is_some_and(|last| *seq <= last) {
            continue;
        }
        let number = i64::try_from(*seq).unwrap_or(i64::MAX);
        let mut rows = statement.query(params![key, number])?;
        let Some(row) = rows.next()? else { continue };
        if row.get::<_, i64>(1)? < number {
            continue;
        }
        for row in rows_of(row)? {
            last = Some(row.record.seq);
            if seqs.contains(&row.record.seq) {
                records.insert(row.record.seq, row.record);
            }
        }
    }
    Ok(records)
}

pub(super) fn newest(connection: &Connection) -> Result<Vec<StoredRecord>> {
    let connection = connection.unchecked_transaction()?;
    let mut statement = connection.prepare_cached(
        "SELECT id, device, sensor, boot FROM streams WHERE last_group > 0 ORDER BY last_group",
    )?;
    let mut rows = statement.query([])?;
    let mut latest = BTreeMap::new();
    while let Some(row) = rows.next()? {
        let id = stream_id(row, 1)?;
        latest.insert(
            (id.device.clone(), id.sensor.clone()),
            (row.get::<_, i64>(0)?, id),
        );
    }
    let mut statement = connection.prepare_cached(&format!(
        "SELECT {CHUNK_COLUMNS} FROM chunks WHERE stream_id = ? ORDER BY first_seq DESC LIMIT 1"
    ))?;
    let mut records = Vec::with_capacity(latest.len());
    for (key, id) in latest.into_values() {
        let mut rows = statement.query([key])?;
        if let Some(row) = rows.next()? {
            let last = rows_of(row)?.pop();
            records.extend(last.map(|row| stored_record(&Arc::new(id), &row)));
        }
    }
    Ok(records)
}

const RECORDING_COLUMNS: &str = "id, name, t_start_ns, t_stop_ns, after_epoch, through_epoch,
    coalesce((SELECT note FROM notes WHERE recording_id = recordings.id), '')";

pub(super) fn recordings(connection: &Connection) -> Result<Vec<Recording>> {
    let connection = connection.unchecked_transaction()?;
    let mut statement = connection.prepare_cached(&format!(
        "SELECT {RECORDING_COLUMNS} FROM recordings ORDER BY id DESC"
    ))?;
    let all = |row: &Row<'_>| Ok(recording_of(&connection, row, i64::MAX)?.0);
    statement.query_and_then([], all)?.collect()
}

/// How many recordings there are, and how many streams.
pub(super) fn counts(connection: &Connection) -> Result<(u64, u64)> {
    let sql = "SELECT (SELECT count(*) FROM recordings), (SELECT count(*) FROM streams)";
    let counts = connection.query_row(sql, [], |row| Ok((row.get(0)?, row.get(1)?)))?;
    Ok((
        unsigned("recordings", counts.0)?,
        unsigned("streams", counts.1)?,
    ))
}

pub(super) fn leases(connection: &Connection) -> Result<Vec<(RecordingId, i64)>> {
    let mut statement = connection.prepare_cached("SELECT recording_id, renewals FROM leases")?;
    let leases = statement.query_map([], |row| Ok((RecordingId(row.get(0)?), row.get(1)?)))?;
    Ok(leases.collect::<Result<_, _>>()?)
}

pub(super) fn recording(connection: &Connection, id: RecordingId) -> Result<Recording> {
    Ok(recording_and_range(connection, id, i64::MAX)?.0)
}

/// The frames of a recording: those that arrived after its start and before its stop; for a running one, up to epoch
/// `through`.
pub(super) fn members(connection: &Connection, id: RecordingId, through: i64) -> Result<Members> {
    let connection = connection.unchecked_transaction()?;
    let (recording, epochs) = recording_and_range(&connection, id, through)?;
    let mut statement = connection.prepare_cached(
        "SELECT s.device, s.sensor, s.boot, s.id, min(a.first_seq), max(a.last_seq)
         FROM all_shares a JOIN streams s ON s.id = a.stream_id
         WHERE a.epoch > ? AND a.epoch <= ?
         GROUP BY s.id ORDER BY s.device, s.sensor, s.boot",
    )?;
    let spans = statement.query_map([epochs.0, epochs.1], |row| {
        Ok(Span {
            stream: Arc::new(stream_id(row, 0)?),
            stream_key: row.get(3)?,
            seq: (row.get(4)?, row.get(5)?),
            epochs,
        })
    })?;
    let spans = spans.collect::<Result<_, _>>()?;
    Ok(Members { recording, spans })
}

fn recording_and_range(
    connection: &Connection,
    id: RecordingId,
    through: i64,
) -> Result<(Recording, (i64, i64))> {
    let mut statement = connection.prepare_cached(&format!(
        "SELECT {RECORDING_COLUMNS} FROM recordings WHERE id = ?"
    ))?;
    let mut rows = statement.query([id.0])?;
    match rows.next()? {
        Some(row) => recording_of(connection, row, through),
        None => Err(StoreError::NoSuchRecording(id)),
    }
}

/// A recording, and its epochs: up to `through_now` while it runs.
fn recording_of(
    connection: &Connection,
    row: &Row<'_>,
    through_now: i64,
) -> Result<(Recording, (i64, i64))> {
    let (after, through): (i64, Option<i64>) = (row.get(4)?, row.get(5)?);
    let epochs = (after, through.unwrap_or(through_now));
    let (frames, missing, sensors) = connection
        .prepare_cached(
            "SELECT coalesce(sum(stored), 0), coalesce(sum(missing), 0), count(DISTINCT stream_id)
             FROM all_shares WHERE epoch > ? AND epoch <= ?",
        )?
        .query_row([epochs.0, epochs.1], |counts| {
            Ok((counts.get(0)?, counts.get(1)?, counts.get(2)?))
        })?;
    let recording = Recording {
        id: RecordingId(row.get(0)?),
        name: row.get(1)?,
        note: row.get(6)?,
        t_start_ns: row.get(2)?,
        t_stop_ns: row.get(3)?,
        frames: unsigned("stored", frames)?,
        missing: unsigned("missing", missing)?,
        sensors: unsigned("sensors", sensors)?,
    };
    Ok((recording, epochs))
}

pub(super) fn page(
    connection: &Connection,
    span: &Span,
    after_seq: Option<u64>,
    rows_max: usize,
) -> Result<Vec<StoredRecord>> {
    let Some(first) = span.first_after(after_seq) else {
        return Ok(Vec::new());
    };
    // The chunk that may contain the first number, and those after it.
    let mut statement = connection.prepare_cached(&format!(
        "SELECT {CHUNK_COLUMNS} FROM chunks
         WHERE stream_id = ?1 AND first_seq <= ?3 AND first_seq >= coalesce(
             (SELECT max(first_seq) FROM chunks WHERE stream_id = ?1 AND first_seq <= ?2), ?2)
         ORDER BY first_seq"
    ))?;
    let mut chunks = statement.query(params![span.stream_key, first, span.seq.1])?;
    let mut records = Vec::new();
    let within = unsigned("seq", first)?..=unsigned("seq", span.seq.1)?;
    while let Some(chunk) = chunks.next()? {
        let epoch: i64 = chunk.get(2)?;
        if epoch <= span.epochs.0 || epoch > span.epochs.1 {
            continue;
        }
        for row in rows_of(chunk)? {
            if records.len() >= rows_max {
                return Ok(records);
            }
            if within.contains(&row.record.seq) {
                records.push(stored_record(&span.stream, &row));
            }
        }
    }
    Ok(records)
}

fn stored_record(stream: &Arc<StreamId>, row: &SealedRow) -> StoredRecord {
    StoredRecord {
        stream: Arc::clone(stream),
        record: row.record,
        t_arrival_ns: row.t_arrival_ns,
    }
}

pub(crate) fn stream_id(row: &Row<'_>, first: usize) -> rusqlite::Result<StreamId> {
    Ok(StreamId {
        device: row.get(first)?,
        sensor: row.get(first + 1)?,
        boot: row.get(first + 2)?,
    })
}
