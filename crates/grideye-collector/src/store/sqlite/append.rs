//! Writes a group of batches in one transaction: a row of `arrivals` for what each brought of a stream, and the stream's
//! counts. Memory holds the state of the streams that were added to, so that a new frame needs no look-up; it is never
//! ahead of the tables, and is forgotten when another program writes the file.
//!
//! Arrivals move into `chunks`, where a stream's rows are beside one another, some seconds later and many at once: a
//! B-tree by stream and number in the group's commit writes a page or two for each batch, which alone costs as much time
//! as all else that a post takes. Who reads by stream moves them before.

use crate::limits::Limits;
use crate::store::error::Result;
use crate::store::plan::{Contents, Plan, StreamState, Streams, Taken};
use crate::store::row::count;
use crate::store::sqlite::read;
use crate::store::types::Appended;
use crate::store::{account, chunk};
use grideye_recording::StreamId;
use rusqlite::{Connection, params};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Runs held in memory; a store with more forgets its streams and reads them again on demand.
const RUNS_HELD_MAX: usize = 1_000_000;
/// Groups between two counts of the runs, because there may be many streams.
const RUNS_COUNTED_EVERY: i64 = 64;
/// Arrivals move when the oldest came this long before the newest batch.
const MOVE_AFTER_NS: u64 = 5_000_000_000;
/// Or when they take this many bytes, because batches wait meanwhile.
const ARRIVED_BYTES_MAX: u64 = 2 * 1024 * 1024;
/// To move them may need this many times their bytes.
const ROOM_TO_MOVE: u64 = 2;
#[derive(Debug, Default)]
pub(super) struct Known {
    streams: Streams,
    /// SQLite's counter of changes by others.
    version: Option<i64>,
    /// Bytes of the arrivals, and when the oldest came, as far as this writer has added them.
    arrived_bytes: u64,
    arrived_since_ns: Option<i64>,
}

/// What the rows of a group have in common.
#[derive(Debug, Clone, Copy)]
struct Now {
    group: i64,
    epoch: i64,
    t_store_ns: i64,
}

impl Known {
    /// Stores a group of batches: each whole, or rejected with the reason.
    pub(super) fn append(
        &mut self,
        connection: &Connection,
        group: &[Taken],
        t_store_ns: i64,
        limits: &Limits,
    ) -> Result<Vec<Result<Appended>>> {
        let version = connection
            .prepare_cached("PRAGMA data_version")?
            .query_row([], |row| row.get(0))?;
        if self.version.replace(version) != Some(version) {
            self.streams.clear();
        }
        let made = self.learn(connection, group)?;
        let contents = self.contents(connection, group)?;
        let mut plan = Plan {
            streams: &mut self.streams,
            contents: &contents,
            limits,
        };
        let appended: Vec<_> = group.iter().map(|taken| plan.take(taken)).collect();
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
        if appended.iter().any(Result::is_ok) {
            self.save(connection, group, t_store_ns)?;
            self.move_old(connection, group, limits)?;
        }
        Ok(appended)
    }

    /// Reads the state of the group's unknown streams, and creates new streams.
    fn learn(&mut self, connection: &Connection, group: &[Taken]) -> Result<Vec<Arc<StreamId>>> {
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
            connection
                .prepare_cached("INSERT INTO streams (device, sensor, boot) VALUES (?, ?, ?)")?
                .execute(params![id.device, id.sensor, id.boot])?;
            let state = StreamState {
                key: connection.last_insert_rowid(),
                is_new: true,
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
        for (name, part) in group.iter().flat_map(Taken::parts) {
            let Some((id, state)) = self.streams.get_key_value(&name) else {
                continue;
            };
            if state.is_behind(&part.frames) {
                continue;
            }
            let again = part.frames.iter().map(|record| record.seq);
            let again: BTreeSet<u64> = again.filter(|seq| state.runs.contains(*seq)).collect();
            if !again.is_empty() {
                move_arrivals(connection)?;
                let kept = read::records(connection, state.key, &again)?;
                contents.entry(Arc::clone(id)).or_default().extend(kept);
            }
        }
        Ok(contents)
    }

    /// Writes what the accepted batches changed.
    fn save(&mut self, connection: &Connection, group: &[Taken], t_store_ns: i64) -> Result<()> {
        let (group_number, epoch) = connection
            .prepare_cached("UPDATE counters SET groups = groups + 1 RETURNING groups, epoch")?
            .query_row([], |row| Ok((row.get(0)?, row.get(1)?)))?;
        let now = Now {
            group: group_number,
            epoch,
            t_store_ns,
        };
        for name in group.iter().flat_map(Taken::streams) {
            let state = self.streams.get_mut(&name);
            if let Some(state) = state.filter(|state| state.is_touched) {
                self.arrived_bytes += save_stream(connection, state, now)?;
                state.settle();
            }
        }
        if group_number % RUNS_COUNTED_EVERY == 0 {
            let runs = self.streams.values().map(|state| state.runs.len());
            if runs.sum::<usize>() > RUNS_HELD_MAX {
                self.streams.clear();
            }
        }
        Ok(())
    }

    /// Moves the arrivals when it is time, or before they could run out of room.
    fn move_old(
        &mut self,
        connection: &Connection,
        group: &[Taken],
        limits: &Limits,
    ) -> Result<()> {
        let newest_ns = group.iter().map(|taken| taken.t_arrival_ns).max();
        let newest_ns = newest_ns.unwrap_or_default();
        let since_ns = *self.arrived_since_ns.get_or_insert(newest_ns);
        let bytes = self.arrived_bytes.saturating_mul(ROOM_TO_MOVE);
        let has_room = match limits.store_bytes_max {
            Some(bytes_max) => read::bytes_used(connection)?.saturating_add(bytes) <= bytes_max,
            None => true,
        };
        // A change of the wall clock in either direction is no reason to wait.
        let is_due = newest_ns.abs_diff(since_ns) >= MOVE_AFTER_NS;
        if is_due || !has_room || self.arrived_bytes > ARRIVED_BYTES_MAX {
            move_arrivals(connection)?;
            (self.arrived_bytes, self.arrived_since_ns) = (0, None);
        }
        Ok(())
    }
}

/// A chunk on its way into the table.
pub(super) struct Moving {
    pub(super) key: i64,
    pub(super) first_seq: i64,
    pub(super) last_seq: i64,
    pub(super) epoch: i64,
    pub(super) t_store_ns: i64,
    pub(super) frames: i64,
    pub(super) is_sealed: bool,
    pub(super) rows: Vec<u8>,
}

impl Moving {
    /// Takes the rows of the next, if they follow its own.
    fn join(&mut self, next: Self) -> Option<Self> {
        let follows = (self.key, self.epoch, self.last_seq.checked_add(1))
            == (next.key, next.epoch, Some(next.first_seq));
        if !follows || next.last_seq - self.first_seq >= count(chunk::PLAIN_ROWS_MAX) {
            return Some(std::mem::replace(self, next));
        }
        self.last_seq = next.last_seq;
        self.t_store_ns = self.t_store_ns.max(next.t_store_ns);
        self.frames += next.frames;
        self.rows.extend(next.rows);
        None
    }

    pub(super) fn insert(self, connection: &Connection) -> Result<()> {
        connection
            .prepare_cached(
                "INSERT INTO chunks (stream_id, first_seq, last_seq, epoch, t_store_ns, frames, is_sealed, rows)
                 VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
            )?
            .execute(params![
                self.key,
                self.first_seq,
                self.last_seq,
                self.epoch,
                self.t_store_ns,
                self.frames,
                self.is_sealed,
                self.rows
            ])?;
        Ok(())
    }
}

/// Moves all arrivals into `chunks`, those of a stream that follow one another as one.
pub(crate) fn move_arrivals(connection: &Connection) -> Result<()> {
    let mut statement = connection.prepare_cached(
        "SELECT stream_id, first_seq, last_seq, epoch, t_store_ns, frames, rows FROM arrivals
         ORDER BY stream_id, first_seq",
    )?;
    let arrivals = statement.query_map([], |row| {
        Ok(Moving {
            key: row.get(0)?,
            first_seq: row.get(1)?,
            last_seq: row.get(2)?,
            epoch: row.get(3)?,
            t_store_ns: row.get(4)?,
            frames: row.get(5)?,
            is_sealed: false,
            rows: row.get(6)?,
        })
    })?;
    let mut moving: Option<Moving> = None;
    for next in arrivals {
        let whole = match &mut moving {
            Some(moving) => moving.join(next?),
            None => moving.replace(next?),
        };
        whole.map_or(Ok(()), |whole| whole.insert(connection))?;
    }
    if let Some(last) = moving {
        last.insert(connection)?;
        connection
            .prepare_cached("DELETE FROM arrivals")?
            .execute([])?;
    }
    Ok(())
}

/// One row of `streams`, and those of its new frames; its runs only when another than the newest changed. Returns the
/// bytes of the frames.
fn save_stream(connection: &Connection, state: &StreamState, now: Now) -> Result<u64> {
    let account = state.account.as_ref().map(account::to_text);
    let share = state.share();
    let (first, last, stored, missing) = share.unwrap_or_default();
    connection
        .prepare_cached(
            "UPDATE streams SET stored = ?1, missing = ?2, t_last_arrival_ns = ?3, account = ?4, account_read = ?5,
                 came_since_account = ?6, last_seq = ?7, last_group = coalesce(?8, last_group),
                 share_first = CASE share_epoch WHEN ?9 THEN min(share_first, ?10) ELSE iif(?9, ?10, share_first) END,
                 share_last = CASE share_epoch WHEN ?9 THEN max(share_last, ?11) ELSE iif(?9, ?11, share_last) END,
                 share_stored = CASE share_epoch WHEN ?9 THEN share_stored + ?12 ELSE iif(?9, ?12, share_stored) END,
                 share_missing = CASE share_epoch WHEN ?9 THEN share_missing + ?13 ELSE iif(?9, ?13, share_missing) END,
                 share_epoch = coalesce(?9, share_epoch)
             WHERE id = ?14",
        )?
        .execute(params![
            state.stored,
            state.missing,
            state.t_last_arrival_ns,
            account,
            state.account_read,
            state.came_since_account,
            state.runs.last().map_or(-1, number),
            share.map(|_| now.group),
            share.map(|_| now.epoch),
            first,
            last,
            stored,
            missing,
            state.key
        ])?;
    save_runs(connection, state)?;
    save_frames(connection, state, now)
}

/// Returns the bytes of the rows.
fn save_frames(connection: &Connection, state: &StreamState, now: Now) -> Result<u64> {
    let mut insert = connection.prepare_cached(
        "INSERT INTO arrivals (stream_id, first_seq, last_seq, epoch, t_store_ns, frames, rows) VALUES (?, ?, ?, ?, ?, ?, ?)",
    )?;
    let mut bytes = 0;
    for chunk in chunk::cut(state.fresh.values()) {
        bytes += count(chunk.rows.len()).unsigned_abs();
        insert.execute(params![
            state.key,
            number(chunk.first_seq),
            number(chunk.last_seq),
            now.epoch,
            now.t_store_ns,
            chunk.frames,
            chunk.rows
        ])?;
    }
    Ok(bytes)
}

fn save_runs(connection: &Connection, state: &StreamState) -> Result<()> {
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

/// Numbers were checked to fit.
fn number(seq: u64) -> i64 {
    i64::try_from(seq).unwrap_or(i64::MAX)
}
