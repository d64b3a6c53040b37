//! The queries.

use crate::Limits;
use crate::account;
use crate::store::{
    Members, Recording, RecordingId, Span, StoreError, StoredRecord, StreamSummary,
};
use grideye_frame::{NoData, PIXELS, PixelWord, RawFrame, Reading, ThermistorWord};
use grideye_recording::wire::Gap;
use grideye_recording::{ClockState, Record, Stamp, StreamId};
use rusqlite::{Connection, Row, params};
use std::collections::BTreeMap;
use std::sync::Arc;

pub(super) fn ping(connection: &Connection) -> Result<(), StoreError> {
    connection
        .prepare_cached("SELECT max(id) FROM streams")?
        .query_row([], |_| Ok(()))?;
    Ok(())
}

const STREAM_COLUMNS: &str =
    "id, device, sensor, boot, stored, missing, account, came_since_account, t_last_arrival_ns";

pub(super) fn streams(
    connection: &Connection,
    limits: &Limits,
) -> Result<Vec<StreamSummary>, StoreError> {
    // One snapshot, so that counts and gaps belong together.
    let connection = connection.unchecked_transaction()?;
    let mut statement = connection.prepare_cached(&format!(
        "SELECT {STREAM_COLUMNS} FROM streams ORDER BY device, sensor, boot"
    ))?;
    let mut rows = statement.query([])?;
    let mut streams = Vec::new();
    while let Some(row) = rows.next()? {
        streams.push(summary(&connection, row, limits)?);
    }
    Ok(streams)
}

pub(super) fn stream(
    connection: &Connection,
    key: i64,
    limits: &Limits,
) -> Result<StreamSummary, StoreError> {
    let mut statement = connection.prepare_cached(&format!(
        "SELECT {STREAM_COLUMNS} FROM streams WHERE id = ?"
    ))?;
    let mut rows = statement.query([key])?;
    match rows.next()? {
        Some(row) => summary(connection, row, limits),
        None => Err(StoreError::Failed(format!("stream {key} is gone"))),
    }
}

fn summary(
    connection: &Connection,
    row: &Row<'_>,
    limits: &Limits,
) -> Result<StreamSummary, StoreError> {
    let key: i64 = row.get(0)?;
    let id = stream_id(row, 1)?;
    let (stored, missing) = (unsigned(row, 4)?, unsigned(row, 5)?);
    let account: Option<String> = row.get(6)?;
    let (durable_through, gaps) = gaps(connection, key, &id.sensor, limits.gaps_listed_max)?;
    let expected = durable_through.map_or(0, |last| last + 1);
    Ok(StreamSummary {
        id,
        stored,
        missing,
        durable_through,
        gaps,
        never_came: expected.saturating_sub(stored + missing),
        account: account.as_deref().map(account::from_json).transpose()?,
        came_since_account: unsigned(row, 7)?,
        t_last_arrival_ns: row.get(8)?,
    })
}

/// The highest number received, and the newest runs of numbers below it that never came.
fn gaps(
    connection: &Connection,
    key: i64,
    sensor: &str,
    listed_max: usize,
) -> Result<(Option<u64>, Vec<Gap>), StoreError> {
    let mut statement = connection.prepare_cached(
        "SELECT first, last FROM runs WHERE stream_id = ? ORDER BY first DESC LIMIT ?",
    )?;
    let runs_needed = i64::try_from(listed_max.saturating_add(1)).unwrap_or(i64::MAX);
    let mut rows = statement.query(params![key, runs_needed])?;
    let mut runs = Vec::new();
    while let Some(row) = rows.next()? {
        runs.push((unsigned(row, 0)?, unsigned(row, 1)?));
    }
    // Before the oldest run of all there is a gap as well, down to 0.
    let before_each = runs.iter().skip(1).map(|(_, last)| last + 1);
    let before_first = (runs.len() <= listed_max).then_some(0);
    let mut gaps: Vec<Gap> = before_each
        .chain(before_first)
        .zip(&runs)
        .filter(|(from, (first, _))| from < first)
        .map(|(from, (first, _))| Gap {
            sensor: sensor.to_owned(),
            from,
            to: first - 1,
        })
        .collect();
    gaps.reverse();
    Ok((runs.first().map(|(_, last)| *last), gaps))
}

const RECORD_COLUMNS: &str =
    "seq, t_boot_ns, t_utc_ns, clock, missing, thermistor, pixels, t_arrival_ns";

pub(super) fn record(
    connection: &Connection,
    key: i64,
    seq: i64,
) -> Result<Option<Record>, StoreError> {
    let mut statement = connection.prepare_cached(&format!(
        "SELECT {RECORD_COLUMNS} FROM frames WHERE stream_id = ? AND seq = ?"
    ))?;
    let mut rows = statement.query(params![key, seq])?;
    rows.next()?.map(record_of).transpose()
}

pub(super) fn newest(connection: &Connection) -> Result<Vec<StoredRecord>, StoreError> {
    let connection = connection.unchecked_transaction()?;
    let mut statement = connection.prepare_cached(
        "SELECT id, device, sensor, boot FROM streams WHERE last_arrival > 0 ORDER BY last_arrival",
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
        "SELECT {RECORD_COLUMNS} FROM frames WHERE stream_id = ? ORDER BY seq DESC LIMIT 1"
    ))?;
    let mut records = Vec::with_capacity(latest.len());
    for (key, id) in latest.into_values() {
        let mut rows = statement.query([key])?;
        if let Some(row) = rows.next()? {
            records.push(stored_record(&Arc::new(id), row)?);
        }
    }
    Ok(records)
}

const RECORDING_COLUMNS: &str = "id, name, t_start_ns, t_stop_ns, after_arrival, through_arrival";

pub(super) fn recordings(connection: &Connection) -> Result<Vec<Recording>, StoreError> {
    let connection = connection.unchecked_transaction()?;
    let mut statement = connection.prepare_cached(&format!(
        "SELECT {RECORDING_COLUMNS} FROM recordings ORDER BY id DESC"
    ))?;
    let mut rows = statement.query([])?;
    let mut recordings = Vec::new();
    while let Some(row) = rows.next()? {
        recordings.push(recording_of(&connection, row)?.0);
    }
    Ok(recordings)
}

pub(super) fn recording(connection: &Connection, id: RecordingId) -> Result<Recording, StoreError> {
    Ok(recording_and_range(connection, id)?.0)
}

/// What belongs to a recording: what arrived after its start and not after its stop, or until now while it runs.
pub(super) fn members(connection: &Connection, id: RecordingId) -> Result<Members, StoreError> {
    let connection = connection.unchecked_transaction()?;
    let (recording, arrival) = recording_and_range(&connection, id)?;
    let mut statement = connection.prepare_cached(
        "SELECT s.device, s.sensor, s.boot, s.id, min(a.first_seq), max(a.last_seq)
         FROM arrivals a JOIN streams s ON s.id = a.stream_id
         WHERE a.arrival > ? AND a.arrival <= ?
         GROUP BY s.id ORDER BY s.device, s.sensor, s.boot",
    )?;
    let mut rows = statement.query(params![arrival.0, arrival.1])?;
    let mut spans = Vec::new();
    while let Some(row) = rows.next()? {
        spans.push(Span {
            stream: Arc::new(stream_id(row, 0)?),
            stream_key: row.get(3)?,
            seq: (row.get(4)?, row.get(5)?),
            arrival,
        });
    }
    Ok(Members { recording, spans })
}

fn recording_and_range(
    connection: &Connection,
    id: RecordingId,
) -> Result<(Recording, (i64, i64)), StoreError> {
    let mut statement = connection.prepare_cached(&format!(
        "SELECT {RECORDING_COLUMNS} FROM recordings WHERE id = ?"
    ))?;
    let mut rows = statement.query([id.0])?;
    match rows.next()? {
        Some(row) => recording_of(connection, row),
        None => Err(StoreError::NoSuchRecording { id }),
    }
}

fn recording_of(
    connection: &Connection,
    row: &Row<'_>,
) -> Result<(Recording, (i64, i64)), StoreError> {
    let (after, through): (i64, Option<i64>) = (row.get(4)?, row.get(5)?);
    let (frames, missing, sensors, last) = connection
        .prepare_cached(
            "SELECT coalesce(sum(stored), 0), coalesce(sum(missing), 0), count(DISTINCT stream_id), max(arrival)
             FROM arrivals WHERE arrival > ? AND arrival <= ?",
        )?
        .query_row(params![after, through.unwrap_or(i64::MAX)], |counts| {
            Ok((
                unsigned(counts, 0)?,
                unsigned(counts, 1)?,
                unsigned(counts, 2)?,
                counts.get::<_, Option<i64>>(3)?,
            ))
        })?;
    let recording = Recording {
        id: RecordingId(row.get(0)?),
        name: row.get(1)?,
        t_start_ns: row.get(2)?,
        t_stop_ns: row.get(3)?,
        frames,
        missing,
        sensors,
    };
    Ok((recording, (after, through.or(last).unwrap_or(after))))
}

pub(super) fn page(
    connection: &Connection,
    span: &Span,
    after_seq: Option<u64>,
    rows_max: usize,
) -> Result<Vec<StoredRecord>, StoreError> {
    let first = match after_seq {
        None => span.seq.0,
        Some(seq) => match i64::try_from(seq).ok().and_then(|seq| seq.checked_add(1)) {
            Some(next) => next,
            None => return Ok(Vec::new()),
        },
    };
    let rows_max = i64::try_from(rows_max).unwrap_or(i64::MAX);
    let mut statement = connection.prepare_cached(&format!(
        "SELECT {RECORD_COLUMNS} FROM frames
         WHERE stream_id = ? AND seq BETWEEN ? AND ? AND arrival > ? AND arrival <= ? ORDER BY seq LIMIT ?"
    ))?;
    let mut rows = statement.query(params![
        span.stream_key,
        first,
        span.seq.1,
        span.arrival.0,
        span.arrival.1,
        rows_max
    ])?;
    let mut records = Vec::new();
    while let Some(row) = rows.next()? {
        records.push(stored_record(&span.stream, row)?);
    }
    Ok(records)
}

fn stored_record(stream: &Arc<StreamId>, row: &Row<'_>) -> Result<StoredRecord, StoreError> {
    Ok(StoredRecord {
        stream: Arc::clone(stream),
        record: record_of(row)?,
        t_arrival_ns: row.get(7)?,
    })
}

/// From [`RECORD_COLUMNS`].
fn record_of(row: &Row<'_>) -> Result<Record, StoreError> {
    let clock: i64 = row.get(3)?;
    let missing: Option<String> = row.get(4)?;
    Ok(Record {
        seq: unsigned(row, 0)?,
        stamp: Stamp {
            t_boot_ns: unsigned(row, 1)?,
            t_utc_ns: row.get(2)?,
            clock: match clock {
                0 => ClockState::Unsynced,
                1 => ClockState::Synced,
                2 => ClockState::Stepped,
                other => return Err(damaged(&format!("clock state {other}"))),
            },
        },
        reading: match missing {
            Some(name) => Reading::NoData(
                name.parse::<NoData>()
                    .map_err(|unknown| damaged(&format!("{name:?}: {unknown}")))?,
            ),
            None => Reading::Frame(RawFrame {
                thermistor: ThermistorWord(row.get(5)?),
                pixels: bytes_to_words(
                    row.get_ref(6)?
                        .as_blob()
                        .map_err(|error| damaged(&error.to_string()))?,
                )?,
            }),
        },
    })
}

fn bytes_to_words(bytes: &[u8]) -> Result<[PixelWord; PIXELS], StoreError> {
    let mut words = [PixelWord::default(); PIXELS];
    if bytes.len() != 2 * PIXELS {
        return Err(damaged(&format!("a frame of {} bytes", bytes.len())));
    }
    for (word, pair) in words.iter_mut().zip(bytes.chunks_exact(2)) {
        *word = PixelWord(u16::from_le_bytes([pair[0], pair[1]]));
    }
    Ok(words)
}

fn damaged(what: &str) -> StoreError {
    StoreError::Failed(format!("the store holds {what}"))
}

fn stream_id(row: &Row<'_>, first: usize) -> rusqlite::Result<StreamId> {
    Ok(StreamId {
        device: row.get(first)?,
        sensor: row.get(first + 1)?,
        boot: row.get(first + 2)?,
    })
}

/// A column that is never negative.
fn unsigned(row: &Row<'_>, column: usize) -> rusqlite::Result<u64> {
    let number: i64 = row.get(column)?;
    u64::try_from(number)
        .map_err(|_negative| rusqlite::Error::IntegralValueOutOfRange(column, number))
}
