//! Seals old rows, and lets go of those that are too old or for which there is no room, a little at a time between two
//! groups of posts.
//!
//! Time is that of the newest arrival. Frames of a recording are never let go. A number that was let go stays known: the
//! same frame again changes nothing.

use super::read;
use crate::Limits;
use crate::store::StoreError;
use crate::store::segment::{self, SealedRow};
use rusqlite::{Connection, params};
use std::collections::HashMap;
use std::time::Duration;

/// Rows that one segment is to have: four minutes of a sensor at 10 Hz.
const SEGMENT_ROWS: usize = 2400;
/// Fewer rows than these are not worth a segment of their own.
const SEGMENT_ROWS_MIN: usize = 32;
/// A segment that does not fill up is sealed after so many times the usual wait.
const WAITS_MAX: u32 = 6;
/// The pause between two steps, so that posts are answered between them.
const STEP_EVERY_NS: i64 = 50_000_000;
/// The pause between two rounds over all streams.
const ROUND_EVERY_NS: i64 = 10_000_000_000;
/// Streams that are looked at in a step at most.
const VISITS_MAX: i64 = 64;
/// Segments that are sealed in a step at most, because posts wait meanwhile.
const SEALED_MAX: usize = 2;
/// Chunks of one stream that are let go in a round at most.
const EXPIRED_MAX: usize = 64;
/// Without room, this part of the time that is kept is let go in a round.
const SHARE_OF_TIME: i64 = 64;

/// How far the round over all streams came.
#[derive(Debug, Default)]
pub(super) struct Tender {
    /// The last stream that was looked at.
    at: i64,
    next_step_ns: i64,
    next_round_ns: i64,
    /// What arrived before is let go because of the room.
    no_room_before_ns: Option<i64>,
}

/// Frames that were let go, by the number of their stream.
pub(super) type Expired = HashMap<i64, i64>;

impl Tender {
    /// Whether a step is due.
    pub(super) fn is_due(&mut self, now_ns: i64) -> bool {
        // A wall clock that is set back would otherwise be waited for.
        if self.next_step_ns.saturating_sub(now_ns) > 2 * ROUND_EVERY_NS {
            (self.next_step_ns, self.next_round_ns) = (now_ns, now_ns);
        }
        now_ns >= self.next_step_ns
    }

    /// One step, in a transaction of its own.
    pub(super) fn step(
        &mut self,
        connection: &Connection,
        now_ns: i64,
        limits: &Limits,
    ) -> Result<Expired, StoreError> {
        self.next_step_ns = now_ns.saturating_add(STEP_EVERY_NS);
        let mut expired = Expired::new();
        if self.at == 0 {
            self.measure(connection, now_ns, limits)?;
        }
        let by_age = limits.keep_for.map(|time| before(now_ns, time));
        let gone_before_ns = by_age.into_iter().chain(self.no_room_before_ns).max();
        let mut sealed = 0;
        for (key, mut sealed_through) in streams_after(connection, self.at)? {
            if let Some(gone_before_ns) = gone_before_ns {
                let frames = expire(connection, key, gone_before_ns)?;
                *expired.entry(key).or_default() += frames;
            }
            while sealed < SEALED_MAX {
                let old_before = Old::at(now_ns, limits.seal_after);
                match seal_next(connection, key, sealed_through, old_before)? {
                    Some(through) => sealed_through = through,
                    None => break,
                }
                sealed += 1;
            }
            if sealed >= SEALED_MAX {
                // The next step goes on with this stream.
                return Ok(expired);
            }
            self.at = key;
        }
        if streams_after(connection, self.at)?.is_empty() {
            self.at = 0;
            self.next_round_ns = now_ns.saturating_add(ROUND_EVERY_NS);
            self.next_step_ns = self.next_round_ns;
        }
        Ok(expired)
    }

    /// At the beginning of a round: what has to go for the room.
    fn measure(
        &mut self,
        connection: &Connection,
        now_ns: i64,
        limits: &Limits,
    ) -> Result<(), StoreError> {
        let Some(bytes_max) = limits.keep_bytes else {
            return Ok(());
        };
        if read::bytes_used(connection)? <= bytes_max {
            self.no_room_before_ns = None;
            return Ok(());
        }
        let oldest: Option<i64> = connection.query_row(
            "SELECT min((SELECT t_arrival_ns FROM chunks WHERE stream_id = s.id ORDER BY first_seq LIMIT 1)) FROM streams s",
            [],
            |row| row.get(0),
        )?;
        let from = oldest.into_iter().chain(self.no_room_before_ns).max();
        let from = from.unwrap_or(now_ns).min(now_ns);
        let share = now_ns.saturating_sub(from) / SHARE_OF_TIME;
        self.no_room_before_ns = Some(from.saturating_add(share).saturating_add(1));
        Ok(())
    }
}

fn before(now_ns: i64, time: Duration) -> i64 {
    now_ns.saturating_sub(i64::try_from(time.as_nanos()).unwrap_or(i64::MAX))
}

/// The next streams, and up to which number each is sealed.
fn streams_after(connection: &Connection, at: i64) -> Result<Vec<(i64, i64)>, StoreError> {
    let sql = "SELECT id, sealed_through FROM streams WHERE id > ? ORDER BY id LIMIT ?";
    let mut statement = connection.prepare_cached(sql)?;
    let rows = statement.query_map(params![at, VISITS_MAX], |row| {
        Ok((row.get(0)?, row.get(1)?))
    })?;
    Ok(rows.collect::<Result<_, _>>()?)
}

/// Lets go of what arrived before this moment and belongs to no recording; how many frames.
fn expire(connection: &Connection, key: i64, before_ns: i64) -> Result<i64, StoreError> {
    let mut statement = connection.prepare_cached(
        "SELECT first_seq, t_arrival_ns, frames, EXISTS (
             SELECT * FROM recordings r WHERE c.epoch > r.after_epoch AND c.epoch <= coalesce(r.through_epoch, c.epoch))
         FROM chunks c WHERE stream_id = ? ORDER BY first_seq",
    )?;
    let mut rows = statement.query([key])?;
    let mut gone = Vec::new();
    while let Some(row) = rows.next()? {
        if row.get::<_, i64>(1)? >= before_ns || gone.len() >= EXPIRED_MAX {
            break;
        }
        if !row.get::<_, bool>(3)? {
            gone.push((row.get::<_, i64>(0)?, row.get::<_, i64>(2)?));
        }
    }
    drop(rows);
    let mut delete =
        connection.prepare_cached("DELETE FROM chunks WHERE stream_id = ? AND first_seq = ?")?;
    for (first_seq, _) in &gone {
        delete.execute(params![key, first_seq])?;
    }
    let frames = gone.iter().map(|(_, frames)| frames).sum();
    if frames > 0 {
        connection
            .prepare_cached("UPDATE streams SET expired = expired + ? WHERE id = ?")?
            .execute(params![frames, key])?;
    }
    Ok(frames)
}

/// What is old enough to be sealed, and what is so old that a segment need not be full.
#[derive(Debug, Clone, Copy)]
struct Old {
    before_ns: i64,
    long_before_ns: i64,
}

impl Old {
    fn at(now_ns: i64, seal_after: Duration) -> Self {
        Self {
            before_ns: before(now_ns, seal_after),
            long_before_ns: before(now_ns, seal_after.saturating_mul(WAITS_MAX)),
        }
    }
}

/// Rows that become one segment.
#[derive(Debug, Default)]
struct Gathered {
    rows: Vec<SealedRow>,
    chunks: usize,
    frames: i64,
    first_seq: i64,
    last_seq: i64,
    epoch: i64,
    t_arrival_ns: i64,
    /// Nothing more will be added to it: it is full, or what follows cannot join it.
    is_closed: bool,
}

/// Seals the next segment of a stream, if one is ready; up to which number the stream is sealed then.
fn seal_next(
    connection: &Connection,
    key: i64,
    sealed_through: i64,
    old: Old,
) -> Result<Option<i64>, StoreError> {
    let gathered = gather(connection, key, sealed_through, old.before_ns)?;
    let is_ready = gathered.is_closed || gathered.t_arrival_ns < old.long_before_ns;
    if gathered.chunks == 0 || !is_ready {
        return Ok(None);
    }
    if gathered.rows.len() >= SEGMENT_ROWS_MIN {
        let segment = segment::seal(&gathered.rows)?;
        connection
            .prepare_cached("DELETE FROM chunks WHERE stream_id = ? AND first_seq BETWEEN ? AND ?")?
            .execute(params![key, gathered.first_seq, gathered.last_seq])?;
        connection
            .prepare_cached(
                "INSERT INTO chunks (stream_id, first_seq, last_seq, epoch, t_arrival_ns, frames, is_sealed, rows)
                 VALUES (?, ?, ?, ?, ?, ?, 1, ?)",
            )?
            .execute(params![
                key,
                gathered.first_seq,
                gathered.last_seq,
                gathered.epoch,
                gathered.t_arrival_ns,
                gathered.frames,
                segment
            ])?;
    }
    connection
        .prepare_cached("UPDATE streams SET sealed_through = ? WHERE id = ?")?
        .execute(params![gathered.last_seq, key])?;
    Ok(Some(gathered.last_seq))
}

/// Chunks behind `sealed_through` that follow each other without a gap, in one epoch, and arrived before this moment.
fn gather(
    connection: &Connection,
    key: i64,
    sealed_through: i64,
    before_ns: i64,
) -> Result<Gathered, StoreError> {
    let mut statement = connection.prepare_cached(
        "SELECT first_seq, last_seq, epoch, is_sealed, rows, t_arrival_ns, frames FROM chunks
         WHERE stream_id = ? AND first_seq > ? ORDER BY first_seq",
    )?;
    let mut chunks = statement.query(params![key, sealed_through])?;
    let mut gathered = Gathered::default();
    while let Some(chunk) = chunks.next()? {
        let (first, last, epoch): (i64, i64, i64) = (chunk.get(0)?, chunk.get(1)?, chunk.get(2)?);
        let (is_sealed, t_arrival_ns): (bool, i64) = (chunk.get(3)?, chunk.get(5)?);
        if gathered.chunks == 0 {
            (gathered.first_seq, gathered.epoch) = (first, epoch);
        } else if is_sealed
            || epoch != gathered.epoch
            || gathered.last_seq.checked_add(1) != Some(first)
        {
            gathered.is_closed = true;
            break;
        }
        if t_arrival_ns >= before_ns {
            break;
        }
        gathered.chunks += 1;
        gathered.last_seq = last;
        gathered.t_arrival_ns = gathered.t_arrival_ns.max(t_arrival_ns);
        gathered.frames += chunk.get::<_, i64>(6)?;
        if is_sealed {
            // It is one already: the stream is sealed up to its end.
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
