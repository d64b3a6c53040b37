//! The queries. Each is one statement, so that its rows are one snapshot, on a connection that many requests share.

use crate::limits::Limits;
use crate::store::account;
use crate::store::error::{RecordingId, Result, StoreError};
use crate::store::plan::StreamState;
use crate::store::postgres::session::{NO_THERMISTOR, Parameters, Session};
use crate::store::row::{count, damaged, unsigned};
use crate::store::types::{Members, Recording, Span, StoreUsage, StoredRecord, StreamSummary};
use grideye_frame::{NoData, Reading, RecordedFrame, ThermistorWord};
use grideye_recording::record::layout::words_of;
use grideye_recording::{ClockState, Record, Stamp, StreamId};
use std::num::TryFromIntError;
use std::sync::Arc;
use tokio_postgres::Row;

pub(super) async fn usage(session: &Session, bytes_max: Option<u64>) -> Result<StoreUsage> {
    let sql =
        "SELECT pg_database_size(current_database()), (SELECT count(*) FROM grideye.recordings),
                      (SELECT count(*) FROM grideye.streams)";
    let row = &session.query(sql, &[]).await?[0];
    Ok(StoreUsage {
        bytes: unsigned("pg_database_size", row.try_get(0)?)?,
        bytes_max,
        deleted_by_age: 0,
        deleted_by_size: 0,
        held: 0,
        recordings: unsigned("recordings", row.try_get(1)?)?,
        streams: unsigned("streams", row.try_get(2)?)?,
    })
}

pub(super) async fn leases(session: &Session) -> Result<Vec<(RecordingId, i64)>> {
    let sql = "SELECT recording, renewals FROM grideye.leases";
    let rows = session.query(sql, &[]).await?;
    let lease = |row: &Row| Ok((RecordingId(row.try_get(0)?), row.try_get(1)?));
    rows.iter().map(lease).collect()
}

pub(super) async fn ping(session: &Session) -> Result<()> {
    let sql = "SELECT epoch FROM grideye.layout";
    session.query(sql, &[]).await?;
    Ok(())
}

pub(super) async fn streams(session: &Session, limits: &Limits) -> Result<Vec<StreamSummary>> {
    let sql = "SELECT s.*, r.firsts, r.lasts
               FROM grideye.streams s, LATERAL (
                   SELECT array_agg(first_seq) AS firsts, array_agg(last_seq) AS lasts FROM (
                       SELECT first_seq, last_seq FROM grideye.runs
                       WHERE device = s.device AND stream = s.stream ORDER BY first_seq DESC LIMIT $1) newest
               ) r WHERE (s.device, s.stream) IN (
                   SELECT device, stream FROM grideye.streams ORDER BY t_last_arrival_ns DESC LIMIT $2)";
    let newest = count(limits.gaps_listed_max.saturating_add(1));
    let most = count(limits.streams_listed_max);
    let rows = session.query(sql, &[&newest, &most]).await?;
    let summaries: Result<Vec<_>, _> = rows.iter().map(|row| summary(row, limits)).collect();
    let mut summaries = summaries?;
    summaries.sort_by(|one, other| one.id.cmp(&other.id));
    Ok(summaries)
}

/// From the columns of `streams`.
pub(super) fn state_of(row: &Row) -> Result<StreamState> {
    let account: Option<&str> = row.try_get("account")?;
    Ok(StreamState {
        key: row.try_get::<_, i32>("stream")?.into(),
        stored: row.try_get("stored")?,
        missing: row.try_get("missing")?,
        account: account.map(account::from_json).transpose()?,
        account_read: row.try_get("account_read")?,
        came_since_account: row.try_get("came_since_account")?,
        expired: row.try_get("expired")?,
        t_last_arrival_ns: row.try_get("t_last_arrival_ns")?,
        ..StreamState::default()
    })
}

/// From the columns of `streams`, with the newest runs as `firsts` and `lasts`.
pub(super) fn summary(row: &Row, limits: &Limits) -> Result<StreamSummary> {
    let mut state = state_of(row)?;
    let firsts: Option<Vec<i64>> = row.try_get("firsts")?;
    let lasts: Option<Vec<i64>> = row.try_get("lasts")?;
    let runs = firsts.unwrap_or_default().into_iter();
    for (first, last) in runs.zip(lasts.unwrap_or_default()) {
        state.restore_run(first, last)?;
    }
    state.summary(&Arc::new(stream_id(row)?), limits)
}

pub(super) async fn newest(session: &Session) -> Result<Vec<StoredRecord>> {
    let sql = "SELECT s.device, s.sensor, s.boot, s.added,
                      f.seq, f.t_boot_ns, f.t_utc_ns, f.clock, f.missing, f.thermistor, f.pixels, f.t_arrival_ns
               FROM grideye.streams s, LATERAL (
                   SELECT * FROM grideye.frames WHERE device = s.device AND stream = s.stream
                   ORDER BY seq DESC LIMIT 1
               ) f WHERE s.added > 0
               AND s.added = (SELECT max(added) FROM grideye.streams o WHERE o.device = s.device AND o.sensor = s.sensor)";
    let mut records: Vec<StoredRecord> = Vec::new();
    for row in session.query(sql, &[]).await? {
        records.push(StoredRecord {
            stream: Arc::new(stream_id(&row)?),
            record: record_of(&row, 4)?,
            t_arrival_ns: row.try_get(11)?,
        });
    }
    records.sort_by(|one, other| one.stream.cmp(&other.stream));
    // If two boots of one sensor were added to at the same moment, the later name wins.
    records.reverse();
    records.dedup_by(|one, other| {
        (&one.stream.device, &one.stream.sensor) == (&other.stream.device, &other.stream.sensor)
    });
    records.reverse();
    Ok(records)
}

/// A recording with the counts of its epochs, up to now while it runs.
const RECORDING: &str = "SELECT r.id, r.name, r.t_start_ns, r.t_stop_ns, r.after_epoch, r.through_epoch,
           c.stored, c.missing, c.sensors,
           coalesce((SELECT n.note FROM grideye.notes n WHERE n.recording = r.id), '')
    FROM grideye.recordings r, LATERAL (
        SELECT coalesce(sum(stored), 0)::BIGINT AS stored, coalesce(sum(missing), 0)::BIGINT AS missing,
               count(DISTINCT (device, stream)) AS sensors
        FROM grideye.shares
        WHERE epoch > r.after_epoch AND epoch <= coalesce(r.through_epoch, 9223372036854775807)
    ) c WHERE $1::BIGINT IS NULL OR r.id = $1 ORDER BY r.id DESC";

pub(super) async fn recordings(session: &Session) -> Result<Vec<Recording>> {
    let all: Option<i64> = None;
    let rows = session.query(RECORDING, &[&all]).await?;
    rows.iter().map(|row| Ok(recording_of(row)?.0)).collect()
}

pub(super) async fn recording(
    session: &Session,
    id: RecordingId,
) -> Result<(Recording, (i64, i64))> {
    let rows = session.query(RECORDING, &[&Some(id.0)]).await?;
    let row = rows.first().ok_or(StoreError::NoSuchRecording(id))?;
    recording_of(row)
}

fn recording_of(row: &Row) -> Result<(Recording, (i64, i64))> {
    let after: i64 = row.try_get(4)?;
    let through: Option<i64> = row.try_get(5)?;
    let recording = Recording {
        id: RecordingId(row.try_get(0)?),
        name: row.try_get(1)?,
        note: row.try_get(9)?,
        t_start_ns: row.try_get(2)?,
        t_stop_ns: row.try_get(3)?,
        frames: unsigned("stored", row.try_get(6)?)?,
        missing: unsigned("missing", row.try_get(7)?)?,
        sensors: unsigned("sensors", row.try_get(8)?)?,
    };
    Ok((recording, (after, through.unwrap_or(i64::MAX))))
}

/// The frames of a recording: those of its epochs; `through` bounds a running recording.
pub(super) async fn members(session: &Session, id: RecordingId, through: i64) -> Result<Members> {
    let (mut recording, (after, _)) = self::recording(session, id).await?;
    let sql = "SELECT s.device, s.sensor, s.boot, s.stream, min(a.first_seq), max(a.last_seq),
                      sum(a.stored)::BIGINT, sum(a.missing)::BIGINT
               FROM grideye.shares a JOIN grideye.streams s ON s.device = a.device AND s.stream = a.stream
               WHERE a.epoch > $1 AND a.epoch <= $2
               GROUP BY s.device, s.sensor, s.boot, s.stream";
    let mut spans = Vec::new();
    (recording.frames, recording.missing) = (0, 0);
    for row in session.query(sql, &[&after, &through]).await? {
        spans.push(Span {
            stream: Arc::new(stream_id(&row)?),
            stream_key: row.try_get::<_, i32>(3)?.into(),
            seq: (row.try_get(4)?, row.try_get(5)?),
            epochs: (after, through),
        });
        recording.frames += unsigned("stored", row.try_get(6)?)?;
        recording.missing += unsigned("missing", row.try_get(7)?)?;
    }
    spans.sort_by(|one, other| one.stream.cmp(&other.stream));
    recording.sensors = u64::try_from(spans.len()).unwrap_or(u64::MAX);
    Ok(Members { recording, spans })
}

pub(super) async fn page(
    session: &Session,
    span: &Span,
    after_seq: Option<u64>,
    rows_max: usize,
) -> Result<Vec<StoredRecord>> {
    let Some(first) = span.first_after(after_seq) else {
        return Ok(Vec::new());
    };
    let stream = i32::try_from(span.stream_key).map_err(|error| {
        StoreError::Failed(format!(
            "stream {} of another store: {error}",
            span.stream_key
        ))
    })?;
    let sql = "SELECT seq, t_boot_ns, t_utc_ns, clock, missing, thermistor, pixels, t_arrival_ns FROM grideye.frames
               WHERE device = $1 AND stream = $2 AND seq BETWEEN $3 AND $4 AND epoch > $5 AND epoch <= $6
               ORDER BY seq LIMIT $7";
    let (device, last, (after, through)) = (&span.stream.device, &span.seq.1, &span.epochs);
    let most = count(rows_max);
    let parameters: Parameters<'_> = &[device, &stream, &first, last, after, through, &most];
    let rows = session.query(sql, parameters).await?;
    rows.iter()
        .map(|row| {
            Ok(StoredRecord {
                stream: Arc::clone(&span.stream),
                record: record_of(row, 0)?,
                t_arrival_ns: row.try_get(7)?,
            })
        })
        .collect()
}

pub(super) fn stream_id(row: &Row) -> Result<StreamId> {
    Ok(StreamId {
        device: row.try_get("device")?,
        sensor: row.try_get("sensor")?,
        boot: row.try_get("boot")?,
    })
}

/// A record from the columns seq, t_boot_ns, t_utc_ns, clock, missing, thermistor, pixels, in this order.
pub(super) fn record_of(row: &Row, first: usize) -> Result<Record> {
    let clock: i16 = row.try_get(first + 3)?;
    let state = u8::try_from(clock).ok().and_then(ClockState::from_code);
    let missing: Option<&str> = row.try_get(first + 4)?;
    let thermistor: Option<i32> = row.try_get(first + 5)?;
    let pixels: Option<&[u8]> = row.try_get(first + 6)?;
    let reading = match (missing, thermistor, pixels) {
        (Some(name), _, _) => Reading::NoData(
            name.parse::<NoData>()
                .map_err(|unknown| damaged(&format!("{name:?}: {unknown}")))?,
        ),
        (None, Some(thermistor), Some(pixels)) => Reading::Frame(RecordedFrame {
            thermistor: match thermistor {
                NO_THERMISTOR => None,
                word => Some(ThermistorWord(
                    word.try_into()
                        .map_err(|error: TryFromIntError| damaged(&error.to_string()))?,
                )),
            },
            pixels: pixels
                .try_into()
                .map(words_of)
                .map_err(|_length| damaged(&format!("a frame of {} bytes", pixels.len())))?,
        }),
        _ => return Err(damaged("a frame without its words")),
    };
    Ok(Record {
        seq: unsigned("seq", row.try_get(first)?)?,
        stamp: Stamp {
            t_boot_ns: unsigned("t_boot_ns", row.try_get(first + 1)?)?,
            t_utc_ns: row.try_get(first + 2)?,
            clock: state.ok_or_else(|| damaged(&format!("clock state {clock}")))?,
        },
        reading,
    })
}
