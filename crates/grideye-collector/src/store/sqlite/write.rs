//! The writer: one thread, one transaction at a time, as many requests in it as are waiting.

use super::{WriteFault, read};
use crate::Limits;
use crate::account;
use crate::store::{Appended, Recording, RecordingId, SensorAppended, StoreError};
use grideye_frame::{PixelWord, RawFrame, Reading};
use grideye_recording::wire::{Account, Batch, SensorBatch};
use grideye_recording::{COUNT_MAX, ClockState, Record, StreamId};
use rusqlite::{Connection, OptionalExtension, Savepoint, TransactionBehavior, params};
use std::collections::BTreeSet;
use std::sync::Arc;
use tokio::sync::{mpsc, oneshot};

type Reply<T> = oneshot::Sender<Result<T, StoreError>>;

/// What the writer is asked for.
#[derive(Debug)]
pub(super) enum Command {
    Append {
        batch: Arc<Batch>,
        t_arrival_ns: i64,
        reply: Reply<Appended>,
    },
    Start {
        name: String,
        t_start_ns: i64,
        reply: Reply<Recording>,
    },
    Stop {
        id: RecordingId,
        t_stop_ns: i64,
        reply: Reply<Recording>,
    },
}

/// The thread's own state.
pub(super) struct Writer {
    connection: Connection,
    limits: Limits,
    fault: WriteFault,
}

impl Writer {
    pub(super) fn new(connection: Connection, limits: Limits, fault: WriteFault) -> Self {
        Self {
            connection,
            limits,
            fault,
        }
    }

    /// Serves until every sender is gone and the queue is empty, then folds the log into the file.
    pub(super) fn run(mut self, mut queue: mpsc::Receiver<Command>) {
        while let Some(first) = queue.blocking_recv() {
            let mut group = vec![first];
            while group.len() < self.limits.commit_group_max {
                let Ok(next) = queue.try_recv() else { break };
                group.push(next);
            }
            self.commit(group);
        }
        // Only tidies: what was acknowledged is in the log already.
        let _ = self
            .connection
            .query_row("PRAGMA wal_checkpoint(TRUNCATE)", [], |_| Ok(()));
    }

    /// One transaction and one sync for the whole group; answers only after it.
    fn commit(&mut self, group: Vec<Command>) {
        let mut pending = Vec::with_capacity(group.len());
        let outcome = self.transact(group, &mut pending);
        self.fault.set(outcome.clone().err());
        for reply in pending {
            reply(outcome.clone());
        }
    }

    fn transact(
        &mut self,
        group: Vec<Command>,
        pending: &mut Vec<Pending>,
    ) -> Result<(), StoreError> {
        let limits = &self.limits;
        let begun = self
            .connection
            .transaction_with_behavior(TransactionBehavior::Immediate);
        let (mut transaction, mut broken) = match begun {
            Ok(transaction) => (Some(transaction), None),
            Err(error) => (None, Some(StoreError::from(error))),
        };
        for command in group {
            let savepoint = match (&broken, transaction.as_mut()) {
                (None, Some(transaction)) => transaction.savepoint().map_err(StoreError::from),
                (Some(error), _) => Err(error.clone()),
                (None, None) => Err(StoreError::Closed),
            };
            let failed = perform(command, savepoint, limits, pending);
            broken = broken.or(failed);
        }
        match (broken, transaction) {
            (Some(error), _) => Err(error),
            (None, Some(transaction)) => Ok(transaction.commit()?),
            (None, None) => Err(StoreError::Closed),
        }
    }
}

/// Answers one request, once it is known whether the group was committed.
type Pending = Box<dyn FnOnce(Result<(), StoreError>)>;

/// Does one command in its savepoint; answers the error that breaks the whole group, if there is one.
fn perform(
    command: Command,
    savepoint: Result<Savepoint<'_>, StoreError>,
    limits: &Limits,
    pending: &mut Vec<Pending>,
) -> Option<StoreError> {
    match command {
        Command::Append {
            batch,
            t_arrival_ns,
            reply,
        } => settle(savepoint, reply, pending, |savepoint| {
            append(savepoint, &batch, t_arrival_ns, limits)
        }),
        Command::Start {
            name,
            t_start_ns,
            reply,
        } => settle(savepoint, reply, pending, |savepoint| {
            start(savepoint, &name, t_start_ns, limits)
        }),
        Command::Stop {
            id,
            t_stop_ns,
            reply,
        } => settle(savepoint, reply, pending, |savepoint| {
            stop(savepoint, id, t_stop_ns)
        }),
    }
}

/// Keeps what the work did, or undoes it, and leaves the answer for after the commit.
fn settle<T: 'static>(
    savepoint: Result<Savepoint<'_>, StoreError>,
    reply: Reply<T>,
    pending: &mut Vec<Pending>,
    work: impl FnOnce(&Connection) -> Result<T, StoreError>,
) -> Option<StoreError> {
    let outcome = savepoint.and_then(|savepoint| {
        let done = work(&savepoint)?;
        savepoint.commit()?;
        Ok(done)
    });
    let failed = match &outcome {
        Err(error) if breaks_the_group(error) => Some(error.clone()),
        _ => None,
    };
    pending.push(Box::new(move |committed| {
        // The one who asked may have gone; the work stays done.
        let _ = reply.send(committed.and(outcome));
    }));
    failed
}

/// Whether the database itself failed: it may have undone the whole transaction by then.
fn breaks_the_group(error: &StoreError) -> bool {
    matches!(
        error,
        StoreError::Full
            | StoreError::Locked
            | StoreError::NotADatabase
            | StoreError::Unusable { .. }
            | StoreError::Closed
            | StoreError::Failed(_)
    )
}

fn append(
    connection: &Connection,
    batch: &Batch,
    t_arrival_ns: i64,
    limits: &Limits,
) -> Result<Appended, StoreError> {
    let arrival = last_arrival(connection)? + 1;
    let mut sensors = Vec::with_capacity(batch.sensors.len());
    for part in &batch.sensors {
        let id = StreamId {
            device: batch.device.clone(),
            sensor: part.sensor.clone(),
            boot: batch.boot.clone(),
        };
        let key = stream_key(connection, &id, limits)?;
        let fresh = append_frames(connection, key, &id, part, (arrival, t_arrival_ns))?;
        append_runs(connection, key, &fresh)?;
        append_arrival(connection, key, part, &fresh, (arrival, t_arrival_ns))?;
        append_account(connection, key, part)?;
        sensors.push(SensorAppended {
            stream: read::stream(connection, key, limits)?,
            fresh,
        });
    }
    Ok(Appended { sensors })
}

/// The number of the batch that was taken last.
fn last_arrival(connection: &Connection) -> Result<i64, StoreError> {
    let mut statement = connection.prepare_cached("SELECT max(arrival) FROM arrivals")?;
    let last: Option<i64> = statement.query_row([], |row| row.get(0))?;
    Ok(last.unwrap_or(0))
}

/// The store's number of a stream, which is made if it is new.
fn stream_key(connection: &Connection, id: &StreamId, limits: &Limits) -> Result<i64, StoreError> {
    let key = connection
        .prepare_cached("SELECT id FROM streams WHERE device = ? AND sensor = ? AND boot = ?")?
        .query_row(params![id.device, id.sensor, id.boot], |row| row.get(0))
        .optional()?;
    if let Some(key) = key {
        return Ok(key);
    }
    let streams: i64 =
        connection.query_row("SELECT count(*) FROM streams", [], |row| row.get(0))?;
    if streams >= count(limits.streams_max) {
        return Err(StoreError::TooManyStreams {
            limit: limits.streams_max,
        });
    }
    connection
        .prepare_cached("INSERT INTO streams (device, sensor, boot) VALUES (?, ?, ?)")?
        .execute(params![id.device, id.sensor, id.boot])?;
    Ok(connection.last_insert_rowid())
}

/// Adds the records that are not there yet, and answers which those were.
fn append_frames(
    connection: &Connection,
    key: i64,
    id: &StreamId,
    part: &SensorBatch,
    (arrival, t_arrival_ns): (i64, i64),
) -> Result<BTreeSet<u64>, StoreError> {
    let mut insert = connection.prepare_cached(
        "INSERT INTO frames (stream_id, seq, t_boot_ns, t_utc_ns, clock, missing, thermistor, pixels, t_arrival_ns, arrival)
         VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT (stream_id, seq) DO NOTHING",
    )?;
    let mut fresh = BTreeSet::new();
    for record in &part.frames {
        let row = Row::of(record)?;
        let added = insert.execute(params![
            key,
            row.seq,
            row.t_boot_ns,
            record.stamp.t_utc_ns,
            row.clock,
            row.missing,
            row.thermistor,
            row.pixels,
            t_arrival_ns,
            arrival
        ])?;
        if added == 1 {
            fresh.insert(record.seq);
        } else if read::record(connection, key, row.seq)?.as_ref() != Some(record) {
            return Err(StoreError::Conflict {
                device: id.device.clone(),
                sensor: id.sensor.clone(),
                boot: id.boot.clone(),
                seq: record.seq,
            });
        }
    }
    Ok(fresh)
}

/// A record as the columns of `frames`.
struct Row {
    seq: i64,
    t_boot_ns: i64,
    clock: i64,
    missing: Option<&'static str>,
    thermistor: Option<u16>,
    pixels: Option<Vec<u8>>,
}

impl Row {
    fn of(record: &Record) -> Result<Self, StoreError> {
        let (missing, thermistor, pixels) = match &record.reading {
            Reading::Frame(raw) => (None, Some(raw.thermistor.0), Some(words_to_bytes(raw))),
            Reading::NoData(reason) => (Some(reason.name()), None, None),
        };
        Ok(Self {
            seq: fitting("seq", record.seq)?,
            t_boot_ns: fitting("t_boot_ns", record.stamp.t_boot_ns)?,
            clock: match record.stamp.clock {
                ClockState::Unsynced => 0,
                ClockState::Synced => 1,
                ClockState::Stepped => 2,
            },
            missing,
            thermistor,
            pixels,
        })
    }
}

/// Little-endian, as the bus delivered them.
fn words_to_bytes(raw: &RawFrame) -> Vec<u8> {
    raw.pixels
        .iter()
        .flat_map(|PixelWord(word)| word.to_le_bytes())
        .collect()
}

/// The wire's limit is the database's as well; this holds for those who come in another way.
fn fitting(field: &'static str, value: u64) -> Result<i64, StoreError> {
    i64::try_from(value).map_err(|_too_large| StoreError::NumberTooLarge {
        field,
        value,
        max: COUNT_MAX,
    })
}

/// Grows, joins or adds runs of received numbers.
fn append_runs(connection: &Connection, key: i64, fresh: &BTreeSet<u64>) -> Result<(), StoreError> {
    let mut seqs = fresh.iter().copied().peekable();
    while let Some(first) = seqs.next() {
        let mut last = first;
        while let Some(next) = seqs.next_if_eq(&(last + 1)) {
            last = next;
        }
        join_run(
            connection,
            key,
            fitting("seq", first)?,
            fitting("seq", last)?,
        )?;
    }
    Ok(())
}

fn join_run(connection: &Connection, key: i64, first: i64, last: i64) -> Result<(), StoreError> {
    let after: Option<i64> = connection
        .prepare_cached("DELETE FROM runs WHERE stream_id = ? AND first = ? RETURNING last")?
        .query_row(params![key, last.checked_add(1)], |row| row.get(0))
        .optional()?;
    let last = after.unwrap_or(last);
    let before: Option<(i64, i64)> = connection
        .prepare_cached(
            "SELECT first, last FROM runs WHERE stream_id = ? AND first < ? ORDER BY first DESC LIMIT 1",
        )?
        .query_row(params![key, first], |row| Ok((row.get(0)?, row.get(1)?)))
        .optional()?;
    match before {
        Some((start, end)) if end + 1 == first => connection
            .prepare_cached("UPDATE runs SET last = ? WHERE stream_id = ? AND first = ?")?
            .execute(params![last, key, start])?,
        _ => connection
            .prepare_cached("INSERT INTO runs (stream_id, first, last) VALUES (?, ?, ?)")?
            .execute(params![key, first, last])?,
    };
    Ok(())
}

/// Notes the arrival, and counts what it brought.
fn append_arrival(
    connection: &Connection,
    key: i64,
    part: &SensorBatch,
    fresh: &BTreeSet<u64>,
    (arrival, t_arrival_ns): (i64, i64),
) -> Result<(), StoreError> {
    let (Some(first), Some(last)) = (fresh.first(), fresh.last()) else {
        return Ok(());
    };
    // A number twice in one batch was new once.
    let with_pixels: BTreeSet<u64> = part
        .frames
        .iter()
        .filter(|record| record.reading.frame().is_some() && fresh.contains(&record.seq))
        .map(|record| record.seq)
        .collect();
    let (stored, missing) = (with_pixels.len(), fresh.len() - with_pixels.len());
    let (first, last) = (fitting("seq", *first)?, fitting("seq", *last)?);
    connection
        .prepare_cached(
            "INSERT INTO arrivals (arrival, stream_id, first_seq, last_seq, stored, missing) VALUES (?, ?, ?, ?, ?, ?)
             ON CONFLICT (arrival, stream_id) DO UPDATE SET
                 first_seq = min(first_seq, excluded.first_seq), last_seq = max(last_seq, excluded.last_seq),
                 stored = stored + excluded.stored, missing = missing + excluded.missing",
        )?
        .execute(params![arrival, key, first, last, count(stored), count(missing)])?;
    connection
        .prepare_cached(
            "UPDATE streams SET stored = stored + ?, missing = missing + ?, last_arrival = ?, t_last_arrival_ns = ?
             WHERE id = ?",
        )?
        .execute(params![count(stored), count(missing), arrival, t_arrival_ns, key])?;
    Ok(())
}

/// Keeps the agent's count if it is its latest, and notes what came with it or since.
fn append_account(connection: &Connection, key: i64, part: &SensorBatch) -> Result<(), StoreError> {
    let came: BTreeSet<u64> = part
        .frames
        .iter()
        .filter(|record| record.reading.frame().is_some())
        .map(|record| record.seq)
        .collect();
    let known = known_account(connection, key)?;
    let has_ended = [known.as_ref(), part.account.as_ref()]
        .into_iter()
        .flatten()
        .any(|account| account.ended);
    if has_ended {
        let came = u64::try_from(came.len()).unwrap_or(u64::MAX);
        return end_account(connection, key, known.as_ref(), part, came);
    }
    if let Some(account) = &part.account {
        if replace_account(connection, key, account, came.len())? {
            return Ok(());
        }
    }
    connection
        .prepare_cached(
            "UPDATE streams SET came_since_account = came_since_account + ? WHERE id = ? AND account IS NOT NULL",
        )?
        .execute(params![count(came.len()), key])?;
    Ok(())
}

fn known_account(connection: &Connection, key: i64) -> Result<Option<Account>, StoreError> {
    let account: Option<String> = connection
        .prepare_cached("SELECT account FROM streams WHERE id = ?")?
        .query_row([key], |row| row.get(0))?;
    account.as_deref().map(account::from_json).transpose()
}

/// Keeps the count of a run that is over.
fn end_account(
    connection: &Connection,
    key: i64,
    known: Option<&Account>,
    part: &SensorBatch,
    came: u64,
) -> Result<(), StoreError> {
    let stored: i64 = connection
        .prepare_cached("SELECT stored FROM streams WHERE id = ?")?
        .query_row([key], |row| row.get(0))?;
    let stored = u64::try_from(stored).unwrap_or(0);
    let merged = account::of_ended_run(known, part.account.as_ref(), stored, came);
    connection
        .prepare_cached(
            "UPDATE streams SET account = ?, account_read = ?, came_since_account = 0 WHERE id = ?",
        )?
        .execute(params![
            account::to_json(&merged).to_string(),
            fitting("account.read", merged.read)?,
            key
        ])?;
    Ok(())
}

/// Batches can overtake each other: the count with the most frames read is the latest.
fn replace_account(
    connection: &Connection,
    key: i64,
    account: &Account,
    came: usize,
) -> Result<bool, StoreError> {
    let read = fitting("account.read", account.read)?;
    let replaced = connection
        .prepare_cached(
            "UPDATE streams SET account = ?, account_read = ?, came_since_account = ?
             WHERE id = ? AND (account_read IS NULL OR account_read <= ?)",
        )?
        .execute(params![
            account::to_json(account).to_string(),
            read,
            count(came),
            key,
            read
        ])?;
    Ok(replaced == 1)
}

fn count(number: usize) -> i64 {
    i64::try_from(number).unwrap_or(i64::MAX)
}

fn start(
    connection: &Connection,
    name: &str,
    t_start_ns: i64,
    limits: &Limits,
) -> Result<Recording, StoreError> {
    let taken: Option<bool> = connection
        .prepare_cached("SELECT t_stop_ns IS NULL FROM recordings WHERE name = ?")?
        .query_row([name], |row| row.get(0))
        .optional()?;
    if let Some(running) = taken {
        return Err(StoreError::NameTaken {
            name: name.to_owned(),
            running,
        });
    }
    let recordings: i64 =
        connection.query_row("SELECT count(*) FROM recordings", [], |row| row.get(0))?;
    if recordings >= count(limits.recordings_max) {
        return Err(StoreError::TooManyRecordings {
            limit: limits.recordings_max,
        });
    }
    connection
        .prepare_cached(
            "INSERT INTO recordings (name, t_start_ns, after_arrival) VALUES (?, ?, ?)",
        )?
        .execute(params![name, t_start_ns, last_arrival(connection)?])?;
    read::recording(connection, RecordingId(connection.last_insert_rowid()))
}

fn stop(connection: &Connection, id: RecordingId, t_stop_ns: i64) -> Result<Recording, StoreError> {
    let recording = read::recording(connection, id)?;
    if recording.t_stop_ns.is_some() {
        return Err(StoreError::NotRunning {
            id,
            name: recording.name,
        });
    }
    connection
        .prepare_cached("UPDATE recordings SET t_stop_ns = ?, through_arrival = ? WHERE id = ?")?
        .execute(params![t_stop_ns, last_arrival(connection)?, id.0])?;
    read::recording(connection, id)
}
