//! The writer's state of the file, including what the tables lack so far.
//!
//! ```text
//!    a group of batches ──▶ one row of `pending`, synced, acknowledged     (append)
//!                     └──▶ the state of its streams in memory
//!    seconds later, stream by stream ──▶ `chunks`, `runs`, `shares`, `streams`; rows of `pending` that are in all of
//!                                        them are deleted               (settle)
//! ```
//!
//! So a stream's pages are written once for many batches. Readers of the tables first have everything settled. A writer
//! that finds rows in `pending`, after a crash or another program's write, takes them in as if they came now.

use crate::limits::Limits;
use crate::store::error::Result;
use crate::store::plan::{Contents, Plan, StreamState, Streams, Taken};
use crate::store::row::{count, fitting};
use crate::store::sqlite::retain::Deleted;
use crate::store::sqlite::{pending, read};
use crate::store::types::{Appended, StreamSummary};
use crate::store::{account, chunk};
use grideye_recording::StreamId;
use rusqlite::{Connection, params};
use std::collections::{BTreeSet, HashMap, VecDeque};
use std::sync::Arc;

/// Runs held in memory; a store with more forgets its streams and reads them again on demand.
const RUNS_HELD_MAX: usize = 1_000_000;
/// Groups between two counts of the runs, because there may be many streams.
const RUNS_COUNTED_EVERY: i64 = 64;
/// A stream is settled when its oldest batch came this long before the newest batch of all.
const SETTLE_AFTER_NS: u64 = 5_000_000_000;
/// Rows held in memory; above this, the oldest are settled sooner.
const ROWS_HELD_MAX: usize = 65_536;
/// Maximum streams settled after one group, because its batches wait meanwhile.
const SETTLED_MAX: usize = 64;

/// Settling a group may need this many times its bytes before the group is deleted.
const ROOM_TO_SETTLE: u64 = 2;

#[derive(Debug, Default)]
pub(super) struct Known {
    streams: Streams,
    /// SQLite's counter of changes by others; 0 while nothing is known.
    version: i64,
    epoch: i64,
    group: i64,
    /// Streams that the tables lag behind, longest-waiting first.
    unsettled: VecDeque<Unsettled>,
    /// Rows of all these streams.
    rows: usize,
    pending: VecDeque<(i64, u64)>,
    pending_bytes: u64,
    /// The store time at which rows enter the tables.
    now_ns: i64,
}

#[derive(Debug)]
struct Unsettled {
    id: Arc<StreamId>,
    since_group: i64,
    since_ns: i64,
}

impl Known {
    pub(super) fn begin_epoch(&mut self, connection: &Connection) -> Result<()> {
        let mut statement = connection.prepare_cached("SELECT epoch FROM counters")?;
        self.epoch = statement.query_row([], |row| row.get(0))?;
        Ok(())
    }

    pub(super) fn set_time(&mut self, now_ns: i64) {
        self.now_ns = now_ns;
    }

    /// Every stream as it will be once settled, and how many of its frames are not yet: for a reader, which writes
    /// nothing.
    pub(super) fn books(
        connection: &Connection,
        limits: &Limits,
    ) -> Result<Vec<(StreamSummary, u64)>> {
        let mut known = Self::default();
        known.refresh(connection, limits)?;
        let streams = read::streams_within(connection, limits)?.into_iter();
        let with_pending = |stream: StreamSummary| match known.streams.get(&stream.id) {
            Some(state) if state.is_touched => {
                let unsettled = state.share().map_or(0, |(_, _, stored, _)| stored);
                Ok((state.summary(&stream.id, limits)?, unsettled.unsigned_abs()))
            }
            _ => Ok((stream, 0)),
        };
        streams.map(with_pending).collect()
    }

    pub(super) fn forget_deleted(&mut self, deleted: &[Deleted]) {
        if deleted.is_empty() {
            return;
        }
        let mut frames = HashMap::new();
        for part in deleted {
            *frames.entry(part.key).or_insert(0) += part.frames;
        }
        for state in self.streams.values_mut() {
            state.expired += frames.get(&state.key).copied().unwrap_or(0);
        }
    }

    /// Makes this state match the file.
    fn refresh(&mut self, connection: &Connection, limits: &Limits) -> Result<()> {
        let mut statement = connection.prepare_cached("PRAGMA data_version")?;
        let version = statement.query_row([], |row| row.get(0))?;
        if version != self.version {
            *self = Self {
                now_ns: self.now_ns,
                ..Self::default()
            };
            let sql = "SELECT epoch, groups FROM counters";
            (self.epoch, self.group) =
                connection.query_row(sql, [], |row| Ok((row.get(0)?, row.get(1)?)))?;
            for kept in pending::all(connection)? {
                self.take_again(connection, kept, limits)?;
            }
            self.version = version;
        } else if self.group % RUNS_COUNTED_EVERY == 0 && self.runs() > RUNS_HELD_MAX {
            self.settle_known(connection)?;
            self.streams.clear();
        }
        Ok(())
    }

    fn runs(&self) -> usize {
        self.streams.values().map(|state| state.runs.len()).sum()
    }

    /// Takes in a group that is already stored, except for streams whose tables already have it.
    fn take_again(
        &mut self,
        connection: &Connection,
        kept: pending::Group,
        limits: &Limits,
    ) -> Result<()> {
        self.group = kept.group;
        self.pending.push_back((kept.group, kept.bytes));
        self.pending_bytes += kept.bytes;
        let mut group = kept.taken;
        // Every stream of a stored group was accepted, so its row exists or has room, whatever the limit says now.
        self.learn(
            connection,
            &group,
            &Limits {
                streams_max: usize::MAX,
                ..limits.clone()
            },
        )?;
        for taken in &mut group {
            let mut batch = (*taken.batch).clone();
            batch.sensors.retain(|part| {
                let state = self.streams.get(&taken.name_of(part));
                state.is_none_or(|state| state.kept_group < kept.group)
            });
            *taken = Taken {
                batch: Arc::new(batch),
                compact: None,
                t_arrival_ns: taken.t_arrival_ns,
            };
        }
        for appended in self.plan(connection, &group, limits)? {
            appended?;
        }
        self.note(&group);
        Ok(())
    }

    /// Stores a group of batches: each whole, or rejected with the reason.
    pub(super) fn append(
        &mut self,
        connection: &Connection,
        group: &[Taken],
        limits: &Limits,
    ) -> Result<Vec<Result<Appended>>> {
        self.refresh(connection, limits)?;
        self.make_room(connection, limits)?;
        let made = self.learn(connection, group, limits)?;
        let appended = self.plan(connection, group, limits)?;
        self.group += 1;
        let pairs = group.iter().zip(&appended);
        let accepted: Vec<&Taken> = pairs
            .filter(|(_, appended)| appended.is_ok())
            .map(|(taken, _)| taken)
            .collect();
        if !accepted.is_empty() {
            let bytes = pending::keep(connection, self.group, &accepted)?;
            self.pending.push_back((self.group, bytes));
            self.pending_bytes += bytes;
        }
        self.note(accepted);
        for id in made {
            let state = self.streams.get(&id).filter(|state| !state.is_touched);
            let Some(key) = state.map(|state| state.key) else {
                continue;
            };
            // Created for a batch that was then rejected.
            connection
                .prepare_cached("DELETE FROM streams WHERE id = ?")?
                .execute([key])?;
            self.streams.remove(&id);
        }
        if let Some(newest_ns) = group.iter().map(|taken| taken.t_arrival_ns).max() {
            self.settle_old(connection, newest_ns)?;
        }
        Ok(appended)
    }

    /// Settles everything before the pending rows could run out of room in the tables.
    fn make_room(&mut self, connection: &Connection, limits: &Limits) -> Result<()> {
        let Some(bytes_max) = limits.store_bytes_max else {
            return Ok(());
        };
        let to_settle = self.pending_bytes.saturating_mul(ROOM_TO_SETTLE);
        if read::bytes_used(connection)?.saturating_add(to_settle) > bytes_max {
            self.settle_known(connection)?;
        }
        Ok(())
    }

    fn plan(
        &mut self,
        connection: &Connection,
        group: &[Taken],
        limits: &Limits,
    ) -> Result<Vec<Result<Appended>>> {
        let contents = self.contents(connection, group)?;
        let mut plan = Plan {
            streams: &mut self.streams,
            contents: &contents,
            limits,
        };
        Ok(group.iter().map(|taken| plan.take(taken)).collect())
    }

    /// Reads the state of the group's unknown streams, and creates new streams while there is room.
    fn learn(
        &mut self,
        connection: &Connection,
        group: &[Taken],
        limits: &Limits,
    ) -> Result<Vec<Arc<StreamId>>> {
        let mut made = Vec::new();
        for name in group.iter().flat_map(Taken::streams) {
            if self.streams.contains_key(&name) {
                continue;
            }
            let id = Arc::new(name.to_id());
            if let Some(state) = read::state(connection, &id)? {
                self.streams.insert(id, state);
                continue;
            }
            let streams: i64 =
                connection.query_row("SELECT count(*) FROM streams", [], |row| row.get(0))?;
            if streams >= count(limits.streams_max) {
                continue;
            }
            connection
                .prepare_cached("INSERT INTO streams (device, sensor, boot) VALUES (?, ?, ?)")?
                .execute(params![id.device, id.sensor, id.boot])?;
            let state = StreamState {
                key: connection.last_insert_rowid(),
                ..StreamState::default()
            };
            self.streams.insert(Arc::clone(&id), state);
            made.push(id);
        }
        Ok(made)
    }

    /// Reads the stored records under numbers that came again, to compare with the new ones.
    fn contents(&self, connection: &Connection, group: &[Taken]) -> Result<Contents> {
        let mut contents = Contents::new();
        for taken in group {
            for (name, part) in taken.parts() {
                let Some((id, state)) = self.streams.get_key_value(&name) else {
                    continue;
                };
                if state.is_behind(&part.frames) {
                    continue;
                }
                let again = part.frames.iter().map(|record| record.seq);
                let again: BTreeSet<u64> = again.filter(|seq| state.is_settled(*seq)).collect();
                if !again.is_empty() {
                    let kept = read::records(connection, state.key, &again)?;
                    contents.entry(Arc::clone(id)).or_default().extend(kept);
                }
            }
        }
        Ok(contents)
    }

    /// Notes what a group leaves to be settled.
    fn note<'g>(&mut self, group: impl IntoIterator<Item = &'g Taken>) {
        for taken in group {
            for name in taken.streams() {
                let known = self.streams.get_key_value_mut(&name);
                let Some((id, state)) = known.filter(|(_, state)| state.is_touched) else {
                    continue;
                };
                let rows = state.fresh.len();
                if rows > state.rows_noted {
                    self.rows += rows - state.rows_noted;
                    state.rows_noted = rows;
                    state.last_group = Some(self.group);
                }
                if !state.is_unsettled {
                    state.is_unsettled = true;
                    self.unsettled.push_back(Unsettled {
                        id: Arc::clone(id),
                        since_group: self.group,
                        since_ns: taken.t_arrival_ns,
                    });
                }
            }
        }
    }

    fn settle_old(&mut self, connection: &Connection, newest_ns: i64) -> Result<()> {
        let mut settled = 0;
        while settled < SETTLED_MAX {
            let Some(oldest) = self.unsettled.front() else {
                break;
            };
            // A change of the wall clock in either direction is no reason to wait.
            let is_due = newest_ns.abs_diff(oldest.since_ns) >= SETTLE_AFTER_NS;
            if !is_due && self.rows <= ROWS_HELD_MAX {
                break;
            }
            self.settle_next(connection)?;
            settled += 1;
        }
        if settled > 0 {
            self.forget_settled(connection)?;
        }
        Ok(())
    }

    /// Brings the tables up to the last group, including what another program or an earlier process left in `pending`.
    pub(super) fn settle_all(&mut self, connection: &Connection, limits: &Limits) -> Result<()> {
        self.refresh(connection, limits)?;
        self.settle_known(connection)
    }

    fn settle_known(&mut self, connection: &Connection) -> Result<()> {
        while self.settle_next(connection)? {}
        self.forget_settled(connection)
    }

    /// Brings the tables of the longest-waiting stream up to the last group; returns whether there was one.
    fn settle_next(&mut self, connection: &Connection) -> Result<bool> {
        let Some(oldest) = self.unsettled.pop_front() else {
            return Ok(false);
        };
        let now = Now {
            epoch: self.epoch,
            group: self.group,
            t_store_ns: self.now_ns,
        };
        if let Some(state) = self.streams.get_mut(&oldest.id) {
            save(connection, state, now)?;
            self.rows -= state.rows_noted;
            state.settle();
        }
        Ok(true)
    }

    /// Deletes the groups that are in the tables of all their streams.
    fn forget_settled(&mut self, connection: &Connection) -> Result<()> {
        let oldest = self.unsettled.front();
        let through = oldest.map_or(self.group, |oldest| oldest.since_group - 1);
        while let Some((group, bytes)) = self.pending.front() {
            if *group > through {
                break;
            }
            self.pending_bytes -= bytes;
            self.pending.pop_front();
        }
        pending::forget(connection, through, self.group)
    }
}

#[derive(Debug, Clone, Copy)]
struct Now {
    epoch: i64,
    group: i64,
    t_store_ns: i64,
}

fn save(connection: &Connection, state: &StreamState, now: Now) -> Result<()> {
    let Now { epoch, group, .. } = now;
    save_frames(connection, state, now)?;
    save_runs(connection, state)?;
    if let Some((first, last, stored, missing)) = state.share() {
        connection
            .prepare_cached(
                "INSERT INTO shares (epoch, stream_id, first_seq, last_seq, stored, missing) VALUES (?, ?, ?, ?, ?, ?)
                 ON CONFLICT (epoch, stream_id) DO UPDATE SET
                     first_seq = min(first_seq, excluded.first_seq), last_seq = max(last_seq, excluded.last_seq),
                     stored = stored + excluded.stored, missing = missing + excluded.missing",
            )?
            .execute(params![epoch, state.key, first, last, stored, missing])?;
    }
    let account = state.account.as_ref().map(account::to_text);
    connection
        .prepare_cached(
            "UPDATE streams SET stored = ?, missing = ?, last_group = coalesce(?, last_group), t_last_arrival_ns = ?,
                 account = ?, account_read = ?, came_since_account = ?, kept_group = ? WHERE id = ?",
        )?
        .execute(params![
            state.stored,
            state.missing,
            state.last_group,
            state.t_last_arrival_ns,
            account,
            state.account_read,
            state.came_since_account,
            group,
            state.key
        ])?;
    Ok(())
}

fn save_frames(connection: &Connection, state: &StreamState, now: Now) -> Result<()> {
    let mut insert = connection.prepare_cached(
        "INSERT INTO chunks (stream_id, first_seq, last_seq, epoch, t_store_ns, frames, is_sealed, rows)
         VALUES (?, ?, ?, ?, ?, ?, 0, ?)",
    )?;
    for chunk in chunk::cut(state.fresh.iter()) {
        insert.execute(params![
            state.key,
            fitting("seq", chunk.first_seq)?,
            fitting("seq", chunk.last_seq)?,
            now.epoch,
            now.t_store_ns,
            chunk.frames,
            chunk.rows
        ])?;
    }
    Ok(())
}

fn save_runs(connection: &Connection, state: &StreamState) -> Result<()> {
    let number = |seq| i64::try_from(seq).unwrap_or(i64::MAX);
    let (gone, changed) = state.runs.changes();
    for first in gone {
        connection
            .prepare_cached("DELETE FROM runs WHERE stream_id = ? AND first = ?")?
            .execute(params![state.key, number(first)])?;
    }
    for (first, last) in changed {
        connection
            .prepare_cached(
                "INSERT INTO runs (stream_id, first, last) VALUES (?, ?, ?)
                 ON CONFLICT (stream_id, first) DO UPDATE SET last = excluded.last",
            )?
            .execute(params![state.key, number(first), number(last)])?;
    }
    Ok(())
}
