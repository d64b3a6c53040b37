//! The writer: one thread, one transaction at a time, which takes all waiting requests.

use crate::limits::Limits;
use crate::log::Log;
use crate::store::error::{RecordingId, Result, StoreError};
use crate::store::plan::Taken;
use crate::store::queue::{Change, Command, Group, Outcome, Reply, WriteFault};
use crate::store::row::count;
use crate::store::sqlite::append::{Known, move_arrivals};
use crate::store::sqlite::place::Presence;
use crate::store::sqlite::retain::DeletedCounts;
use crate::store::sqlite::tend::Tender;
use crate::store::sqlite::time::{self, StoreTime};
use crate::store::sqlite::{labels, read};
use crate::store::types::Recording;
use rusqlite::{Connection, OptionalExtension as _, params};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::mpsc;

/// Roughly what a large group of batches adds to the file: with less than this left, "full" means the quota.
const GROUP_ROOM: u64 = 8 * 1024 * 1024;

/// How long to wait for more batches before a commit, if the group before had at least [`GATHER_FROM`]: more batches
/// share a sync.
const GATHER: Duration = Duration::from_micros(150);
const GATHER_FROM: usize = 4;

/// Takes the space of a batch, and gives it back.
const TAKE_ROOM: &str =
    "SAVEPOINT room; CREATE TABLE room (bytes BLOB); INSERT INTO room VALUES (zeroblob(65536));
                         ROLLBACK TO room; RELEASE room";

pub(super) struct Writer {
    connection: Connection,
    presence: Presence,
    limits: Limits,
    fault: WriteFault,
    known: Known,
    tender: Tender,
    time: StoreTime,
    deleted: Arc<DeletedCounts>,
    log: Log,
}

impl Writer {
    pub(super) fn new(
        (connection, presence): (Connection, Presence),
        limits: Limits,
        fault: WriteFault,
        time: StoreTime,
        log: Log,
    ) -> Self {
        Self {
            connection,
            presence,
            limits,
            fault,
            known: Known::default(),
            tender: Tender::default(),
            time,
            deleted: Arc::default(),
            log,
        }
    }

    pub(super) fn deleted(&self) -> Arc<DeletedCounts> {
        Arc::clone(&self.deleted)
    }

    /// Tests whether a batch would fit below the quota and on the disk: a full store is unhealthy even before the first
    /// batch.
    pub(super) fn try_to_write(&self) {
        let now_ns = self.time.now_ns();
        let tried = transact(&self.connection, |transaction| {
            transaction.execute_batch(TAKE_ROOM)?;
            time::keep(transaction, now_ns)
        });
        let error = tried.err().map(|error| self.told_from_a_full_disk(error));
        self.fault.set(error);
    }

    /// Serves until every sender is gone and the queue is empty, then checkpoints the log.
    pub(super) fn run(mut self, mut queue: mpsc::Receiver<Command>) -> Result<()> {
        let mut len_before = 0;
        while let Some(first) = queue.blocking_recv() {
            if len_before >= GATHER_FROM {
                std::thread::sleep(GATHER);
            }
            let mut group = Group::gather(first, &mut queue, self.limits.commit_group_max);
            len_before = group.taken.len();
            if len_before > 0 {
                let outcome = self.append(&group.taken);
                group.answer(outcome);
                self.tend();
            }
            if let Some(change) = group.change {
                self.change(change);
            }
        }
        // Only tidies up: acknowledged frames are already in the file or its log.
        let now_ns = self.time.now_ns();
        let _ = self.settled(|transaction| time::keep(transaction, now_ns));
        self.presence.check_at_end(&self.connection)
    }

    /// One transaction and one sync for the whole group.
    fn append(&mut self, taken: &[Taken]) -> Outcome {
        let (now_ns, limits) = (self.time.now_ns(), &self.limits);
        // Forgotten if it fails, because the file is rolled back.
        let mut known = std::mem::take(&mut self.known);
        let outcome = commit(&self.connection, &mut self.presence, |transaction| {
            known.append(transaction, taken, now_ns, limits)
        });
        if outcome.is_ok() {
            self.known = known;
        }
        let outcome = outcome.map_err(|error| self.told_from_a_full_disk(error));
        match &outcome {
            Err(error) => self.fault.set(Some(error.clone())),
            // If every batch was rejected for its content, nothing was written.
            Ok(appended) if appended.iter().any(Result::is_ok) => self.fault.set(None),
            Ok(_) => {}
        }
        outcome
    }

    /// Runs `work` in a transaction after moving the arrivals.
    fn settled<T>(&mut self, work: impl FnOnce(&Connection) -> Result<T>) -> Result<T> {
        commit(&self.connection, &mut self.presence, |transaction| {
            move_arrivals(transaction)?;
            work(transaction)
        })
    }

    fn tend(&mut self) {
        let now_ns = self.time.now_ns();
        if !self.tender.is_due(now_ns) {
            return;
        }
        let (tender, limits) = (&mut self.tender, &self.limits);
        let tended = commit(&self.connection, &mut self.presence, |transaction| {
            tender.step(transaction, now_ns, limits)
        });
        match tended {
            Ok(deleted) => {
                if !deleted.is_empty() {
                    self.known = Known::default();
                }
                for part in deleted {
                    self.deleted.add(&part);
                    self.log.say(&part.event());
                }
                if let Some(event) = self.tender.held(&self.deleted) {
                    self.log.say(&event);
                }
            }
            Err(error) => {
                // The deletion may still have been committed.
                self.known = Known::default();
                self.fault.set(Some(error));
            }
        }
    }

    fn change(&mut self, change: Change) {
        let (recordings_max, labels_max) = (self.limits.recordings_max, self.limits.labels_max);
        match change {
            Change::Start(name, t_ns, reply) => {
                self.run_change(reply, true, |file| start(file, &name, t_ns, recordings_max));
            }
            Change::Stop(id, t_ns, reply) => {
                self.run_change(reply, true, |file| stop(file, id, t_ns));
            }
            Change::Note(id, note, reply) => {
                self.run_change(reply, true, |file| write_note(file, id, &note));
            }
            Change::Renew(id, reply) => self.run_change(reply, true, |file| renew(file, id)),
            Change::Delete(id, reply) => {
                self.run_change(reply, true, |file| delete(file, id));
                self.tender.look_through_all_again();
            }
            Change::AddLabel(id, label, reply) => {
                self.run_change(reply, true, |file| labels::add(file, id, label, labels_max));
            }
            Change::RemoveLabel(id, number, reply) => {
                self.run_change(reply, true, |file| labels::remove(file, id, number));
            }
            Change::AskForTokens(is_asking, reply) => {
                self.run_change(reply, false, |file| ask_for_tokens(file, is_asking));
            }
            Change::EndEpoch(reply) => self.run_change(reply, false, end_epoch),
            Change::Settle(reply) => self.run_change(reply, false, |_file| Ok(())),
        }
    }

    /// Replies to the caller of a change, and notes whether the result shows that the store is writable: not if there
    /// was nothing to move, and not if the request's content was rejected.
    fn run_change<T>(
        &mut self,
        reply: Reply<T>,
        shows_a_write: bool,
        work: impl FnOnce(&Connection) -> Result<T>,
    ) {
        let done = self.settled(work);
        let error = done.as_ref().err();
        if error.map_or(shows_a_write, is_of_the_database) {
            self.fault.set(error.cloned());
        }
        let _ = reply.send(done);
    }

    /// SQLite reports "full" for the disk and for the quota alike.
    fn told_from_a_full_disk(&self, error: StoreError) -> StoreError {
        match (error, self.limits.store_bytes_max) {
            (StoreError::Full, Some(bytes_max)) if self.is_at(bytes_max) => {
                StoreError::QuotaReached(bytes_max)
            }
            (error, _) => error,
        }
    }

    /// Whether so little is left below the quota that one group of batches may have needed more.
    fn is_at(&self, bytes_max: u64) -> bool {
        read::bytes(&self.connection)
            .is_ok_and(|bytes| bytes.saturating_add(GROUP_ROOM) >= bytes_max)
    }
}

/// Runs `work` in a transaction; checks before and after that the file is still in place.
fn commit<T>(
    connection: &Connection,
    presence: &mut Presence,
    work: impl FnOnce(&Connection) -> Result<T>,
) -> Result<T> {
    presence.check_before(connection)?;
    let done = transact(connection, work)?;
    presence.check(connection)?;
    presence.checkpoint(connection);
    Ok(done)
}

/// Runs `work` in a transaction: all of it, or nothing on an error.
fn transact<T>(connection: &Connection, work: impl FnOnce(&Connection) -> Result<T>) -> Result<T> {
    let run = |sql| connection.prepare_cached(sql)?.execute([]);
    run("BEGIN IMMEDIATE")?;
    let done = work(connection).and_then(|done| {
        run("COMMIT")?;
        Ok(done)
    });
    // Some errors end the transaction by themselves.
    if done.is_err() && !connection.is_autocommit() {
        let _ = run("ROLLBACK");
    }
    done
}

fn is_of_the_database(error: &StoreError) -> bool {
    matches!(
        error,
        StoreError::Full
            | StoreError::QuotaReached { .. }
            | StoreError::Locked
            | StoreError::NotADatabase
            | StoreError::Unusable { .. }
            | StoreError::Gone { .. }
            | StoreError::Overwritten(_)
            | StoreError::Closed
            | StoreError::Failed(_)
    )
}

/// Ends the epoch and returns its number. Frames stored from now on belong to a later one.
fn end_epoch(connection: &Connection) -> Result<i64> {
    // The epoch in which a file was upgraded may have a row already.
    connection.execute_batch(
        "INSERT INTO shares SELECT share_epoch, id, share_first, share_last, share_stored, share_missing FROM streams
         WHERE share_epoch = (SELECT epoch FROM counters)
         ON CONFLICT (epoch, stream_id) DO UPDATE SET
             first_seq = min(first_seq, excluded.first_seq), last_seq = max(last_seq, excluded.last_seq),
             stored = stored + excluded.stored, missing = missing + excluded.missing",
    )?;
    let sql = "UPDATE counters SET epoch = epoch + 1 RETURNING epoch - 1";
    let mut statement = connection.prepare_cached(sql)?;
    Ok(statement.query_row([], |row| row.get(0))?)
}

fn start(
    connection: &Connection,
    name: &str,
    t_start_ns: i64,
    recordings_max: usize,
) -> Result<Recording> {
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
    if read::counts(connection)?.0 >= count(recordings_max).unsigned_abs() {
        return Err(StoreError::TooManyRecordings(recordings_max));
    }
    let id = next_id(connection)?;
    connection
        .prepare_cached(
            "INSERT INTO recordings (id, name, t_start_ns, after_epoch) VALUES (?, ?, ?, ?)",
        )?
        .execute(params![id, name, t_start_ns, end_epoch(connection)?])?;
    read::recording(connection, RecordingId(id))
}

/// A number is not given again, even if the newest recording was deleted.
fn next_id(connection: &Connection) -> Result<i64> {
    let sql = "SELECT 1 + max(coalesce(max(id), 0), coalesce(
                   (SELECT CAST(substr(fact, 11) AS INTEGER) FROM facts WHERE fact GLOB 'recording *'), 0))
               FROM recordings";
    Ok(connection.query_row(sql, [], |row| row.get(0))?)
}

fn running(connection: &Connection, id: RecordingId) -> Result<()> {
    let recording = read::recording(connection, id)?;
    match recording.t_stop_ns {
        None => Ok(()),
        Some(_) => Err(StoreError::NotRunning {
            id,
            name: recording.name,
        }),
    }
}

fn stop(connection: &Connection, id: RecordingId, t_stop_ns: i64) -> Result<Recording> {
    running(connection, id)?;
    connection
        .prepare_cached("UPDATE recordings SET t_stop_ns = ?, through_epoch = ? WHERE id = ?")?
        .execute(params![t_stop_ns, end_epoch(connection)?, id.0])?;
    connection.execute("DELETE FROM leases WHERE recording_id = ?", [id.0])?;
    read::recording(connection, id)
}

fn renew(connection: &Connection, id: RecordingId) -> Result<()> {
    running(connection, id)?;
    let sql = "INSERT INTO leases VALUES (?, 1) ON CONFLICT DO UPDATE SET renewals = renewals + 1";
    connection.execute(sql, [id.0])?;
    Ok(())
}

fn delete(connection: &Connection, id: RecordingId) -> Result<()> {
    read::recording(connection, id)?;
    let last = next_id(connection)? - 1;
    connection.execute("DELETE FROM facts WHERE fact GLOB 'recording *'", [])?;
    let sql = "INSERT INTO facts VALUES (format('recording %d was the last to start', ?))";
    connection.execute(sql, [last])?;
    for sql in [
        "DELETE FROM leases WHERE recording_id = ?",
        "DELETE FROM notes WHERE recording_id = ?",
        "DELETE FROM labels WHERE recording_id = ?",
        "DELETE FROM recordings WHERE id = ?",
    ] {
        connection.execute(sql, [id.0])?;
    }
    Ok(())
}

fn ask_for_tokens(connection: &Connection, is_asking: bool) -> Result<bool> {
    let sql = "INSERT OR IGNORE INTO facts SELECT 'asked for tokens' WHERE ?";
    connection.execute(sql, [is_asking])?;
    let sql = "SELECT count(*) > 0 FROM facts WHERE fact = 'asked for tokens'";
    Ok(connection.query_row(sql, [], |row| row.get(0))?)
}

fn write_note(connection: &Connection, id: RecordingId, note: &str) -> Result<Recording> {
    read::recording(connection, id)?;
    connection
        .prepare_cached(
            "INSERT INTO notes (recording_id, note) VALUES (?, ?)
             ON CONFLICT (recording_id) DO UPDATE SET note = excluded.note",
        )?
        .execute(params![id.0, note])?;
    read::recording(connection, id)
}
