//! Seals and deletes old rows, a little at a time between two groups of batches. Ages are in store time (`time.rs`).

use crate::limits::Limits;
use crate::log::{Level, LogEvent};
use crate::store::error::Result;
use crate::store::segment::{self, SealedRow};
use crate::store::sqlite::append::Moving;
use crate::store::sqlite::retain::{Deleted, DeletedCounts, Retention};
use crate::store::sqlite::time::{self, nanoseconds};
use crate::store::sqlite::{read, retain};
use rusqlite::{Connection, params};
use std::sync::atomic::Ordering;
use std::time::Duration;

/// Target rows of a segment: four minutes of a sensor at 10 Hz.
const SEGMENT_ROWS: usize = 2400;
/// Fewer rows than this are not worth a segment.
const SEGMENT_ROWS_MIN: usize = 32;
/// A segment that does not fill up is sealed after this many times the usual wait.
const WAITS_MAX: u32 = 6;
/// Pause between two steps, so that batches are answered between them.
const STEP_EVERY_NS: i64 = 50_000_000;
const ROUND_EVERY_NS: i64 = 10_000_000_000;
/// Maximum streams visited in a step.
const VISITS_MAX: i64 = 64;
/// Maximum segments sealed in a step, because batches wait meanwhile.
const SEALED_MAX: usize = 2;

#[derive(Debug, Default)]
pub(super) struct Tender {
    /// True between the first and the last step of a round.
    is_in_round: bool,
    at: i64,
    next_step_ns: i64,
    retention: Retention,
    /// The frames held by recordings, as last logged.
    held_said: i64,
}

impl Tender {
    pub(super) fn is_due(&self, now_ns: i64) -> bool {
        now_ns >= self.next_step_ns
    }

    pub(super) fn step(
        &mut self,
        connection: &Connection,
        now_ns: i64,
        limits: &Limits,
    ) -> Result<Vec<Deleted>> {
        self.next_step_ns = now_ns.saturating_add(STEP_EVERY_NS);
        if !self.is_in_round {
            time::keep(connection, now_ns)?;
            self.retention.measure(connection, now_ns, limits)?;
            self.is_in_round = true;
        }
        let (mut deleted, is_done) = self.retention.delete(connection, now_ns, limits)?;
        if is_done && self.seal(connection, now_ns, limits, &mut deleted)? {
            (self.is_in_round, self.at) = (false, 0);
            self.next_step_ns = now_ns.saturating_add(ROUND_EVERY_NS);
        }
        Ok(deleted)
    }

    /// After a round, publishes how many frames are kept only because recordings hold them; returns an event when there
    /// are some for the first time, and whenever their number has doubled.
    pub(super) fn held(&mut self, counts: &DeletedCounts) -> Option<LogEvent> {
        if self.is_in_round {
            return None;
        }
        let held = self.retention.held();
        counts.held.store(held.unsigned_abs(), Ordering::Relaxed);
        let is_more = held > self.held_said.saturating_mul(2);
        is_more.then(|| {
            self.held_said = held;
            LogEvent::new(Level::Warning, "frames_held")
                .with("frames", held)
                .with("by", "recordings")
                .with("hint", "delete recordings that are no longer needed")
        })
    }

    /// A recording was deleted.
    pub(super) fn look_through_all_again(&mut self) {
        self.held_said = 0;
        self.retention.look_through_all_again();
    }

    /// Seals a little of what is older than `seal_after`, and deletes boots without frames if frames are deleted; returns
    /// whether this round is finished.
    fn seal(
        &mut self,
        connection: &Connection,
        now_ns: i64,
        limits: &Limits,
        deleted: &mut Vec<Deleted>,
    ) -> Result<bool> {
        let old = (now_ns, limits.seal_after);
        let deletes = limits.keep_for.is_some() || limits.keep_bytes.is_some();
        let mut sealed = 0;
        for (key, mut sealed_through) in streams_after(connection, self.at)? {
            if deletes {
                deleted.extend(retain::delete_empty(connection, key)?);
            }
            while sealed < SEALED_MAX {
                match seal_next(connection, key, sealed_through, old)? {
                    Some(through) => sealed_through = through,
                    None => break,
                }
                sealed += 1;
            }
            if sealed >= SEALED_MAX {
                // The next step continues with this stream.
                return Ok(false);
            }
            self.at = key;
        }
        Ok(streams_after(connection, self.at)?.is_empty())
    }
}

/// The next streams, and the number up to which each is sealed.
fn streams_after(connection: &Connection, at: i64) -> Result<Vec<(i64, i64)>> {
    let sql = "SELECT id, sealed_through FROM streams WHERE id > ? ORDER BY id LIMIT ?";
    let mut statement = connection.prepare_cached(sql)?;
    let rows = statement.query_map(params![at, VISITS_MAX], |row| {
        Ok((row.get(0)?, row.get(1)?))
    })?;
    Ok(rows.collect::<Result<_, _>>()?)
}

#[derive(Debug, Default)]
struct Gathered {
    rows: Vec<SealedRow>,
    chunks: usize,
    frames: i64,
    first_seq: i64,
    last_seq: i64,
    epoch: i64,
    t_store_ns: i64,
    /// Nothing more can be added: it is full, or the following chunk cannot join it.
    is_closed: bool,
}

/// Seals the next segment of a stream, if one is ready; returns the number up to which the stream is then sealed.
fn seal_next(
    connection: &Connection,
    key: i64,
    sealed_through: i64,
    (now_ns, seal_after): (i64, Duration),
) -> Result<Option<i64>> {
    let before = |time| now_ns.saturating_sub(nanoseconds(time));
    let gathered = gather(connection, key, sealed_through, before(seal_after))?;
    // Rows this old are sealed even if their segment is not full.
    let long_before_ns = before(seal_after.saturating_mul(WAITS_MAX));
    let is_ready = gathered.is_closed || gathered.t_store_ns < long_before_ns;
    if gathered.chunks == 0 || !is_ready {
        return Ok(None);
    }
    if gathered.rows.len() >= SEGMENT_ROWS_MIN {
        let segment = segment::seal(&gathered.rows)?;
        connection
            .prepare_cached("DELETE FROM chunks WHERE stream_id = ? AND first_seq BETWEEN ? AND ?")?
            .execute(params![key, gathered.first_seq, gathered.last_seq])?;
        let sealed = Moving {
            key,
            first_seq: gathered.first_seq,
            last_seq: gathered.last_seq,
            epoch: gathered.epoch,
            t_store_ns: gathered.t_store_ns,
            frames: gathered.frames,
            is_sealed: true,
            rows: segment,
        };
        sealed.insert(connection)?;
    }
    connection
        .prepare_cached("UPDATE streams SET sealed_through = ? WHERE id = ?")?
        .execute(params![gathered.last_seq, key])?;
    Ok(Some(gathered.last_seq))
}

/// Chunks after `sealed_through`, without a gap, in one epoch, and stored before `before_ns`.
fn gather(
    connection: &Connection,
    key: i64,
    sealed_through: i64,
    before_ns: i64,
) -> Result<Gathered> {
    let mut statement = connection.prepare_cached(
        "SELECT first_seq, last_seq, epoch, is_sealed, rows, t_store_ns, frames FROM chunks
         WHERE stream_id = ? AND first_seq > ? ORDER BY first_seq",
    )?;
    let mut chunks = statement.query(params![key, sealed_through])?;
    let mut gathered = Gathered::default();
    while let Some(chunk) = chunks.next()? {
        let (first, last, epoch): (i64, i64, i64) = (chunk.get(0)?, chunk.get(1)?, chunk.get(2)?);
        let (is_sealed, t_store_ns): (bool, i64) = (chunk.get(3)?, chunk.get(5)?);
        if gathered.chunks == 0 {
            (gathered.first_seq, gathered.epoch) = (first, epoch);
        } else if is_sealed
            || epoch != gathered.epoch
            || gathered.last_seq.checked_add(1) != Some(first)
        {
            gathered.is_closed = true;
            break;
        }
        if t_store_ns >= before_ns {
            break;
        }
        gathered.chunks += 1;
        gathered.last_seq = last;
        gathered.t_store_ns = gathered.t_store_ns.max(t_store_ns);
        gathered.frames += chunk.get::<_, i64>(6)?;
        if is_sealed {
            // Already a segment: the stream is sealed up to its end.
            gathered.is_closed = true;
            break;
        }
        gathered.rows.extend(read::rows_of(chunk)?);
        if gathered.rows.len() >= SEGMENT_ROWS {
            gathered.is_closed = true;
            break;
        }
    }
    Ok(gathered)
}
