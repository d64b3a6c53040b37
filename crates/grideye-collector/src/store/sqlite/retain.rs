//! Deletes frames that are too old or that make the store too large, but never those of a recording.
//!
//! Only a share of the store is deleted at a time, however wrong a clock or a setting, and every deletion is logged.

use crate::limits::Limits;
use crate::log::{Level, LogEvent};
use crate::store::error::Result;
use crate::store::row::count;
use crate::store::sqlite::read;
use crate::store::sqlite::time::nanoseconds;
use grideye_recording::StreamId;
use grideye_recording::wire::BOOTS_TOLD_AGAIN;
use rusqlite::{Connection, OptionalExtension as _, params};
use std::sync::atomic::{AtomicU64, Ordering};

/// At most one in this many frames is deleted at once, after a time without deletions.
const SHARE_AT_ONCE: i128 = 20;
/// How much faster a store may shrink than it ages: with the share above, a tenth in a fortieth of
/// [`Limits::keep_for`].
const TIMES_AS_FAST: i128 = 2;
/// To save space, a twentieth of the store may be deleted per this time, plus [`TIMES_AS_FAST`] times the frames that
/// came.
const SHARE_EVERY_NS: i128 = 3_600_000_000_000;
/// Deletion waits for a hundredth of the time or space to accumulate, so that few log lines report it.
const GRAINS: i64 = 100;
/// Maximum chunks deleted in a step, because batches wait meanwhile.
const DELETED_MAX: usize = 64;
/// Maximum chunks visited in a step.
const VISITS_MAX: usize = 1024;

/// After this many times [`Limits::seal_after`], no chunk is joined to another any more.
const SETTLED_AFTER: u32 = 12;

/// The epochs of all recordings: ranges that do not overlap, above the first value and at most the second.
#[derive(Debug)]
struct Recorded(Vec<(i64, i64)>);

impl Recorded {
    fn read(connection: &Connection) -> Result<Self> {
        let mut statement = connection.prepare_cached(
            "SELECT after_epoch, coalesce(through_epoch, 9223372036854775807) FROM recordings ORDER BY after_epoch",
        )?;
        let mut rows = statement.query([])?;
        let mut ranges: Vec<(i64, i64)> = Vec::new();
        while let Some(row) = rows.next()? {
            let (after, through): (i64, i64) = (row.get(0)?, row.get(1)?);
            match ranges.last_mut() {
                Some(last) if after <= last.1 => last.1 = last.1.max(through),
                _ => ranges.push((after, through)),
            }
        }
        Ok(Self(ranges))
    }

    fn has(&self, epoch: i64) -> bool {
        let begun = self.0.partition_point(|(after, _)| *after < epoch);
        let last = self.0[..begun].last();
        last.is_some_and(|(_, through)| epoch <= *through)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reason {
    /// They are older than [`Limits::keep_for`].
    Age,
    /// The store is larger than [`Limits::keep_bytes`].
    Size,
    /// It is a boot without frames.
    Empty,
}

/// Frames of one stream deleted together.
#[derive(Debug)]
pub(super) struct Deleted {
    reason: Reason,
    id: StreamId,
    first_seq: i64,
    last_seq: i64,
    frames: i64,
}

impl Deleted {
    pub(super) fn event(&self) -> LogEvent {
        let (event, reason) = match self.reason {
            Reason::Age => ("frames_deleted", "age"),
            Reason::Size => ("frames_deleted", "size"),
            Reason::Empty => ("boot_deleted", "empty"),
        };
        LogEvent::new(Level::Info, event)
            .with("reason", reason)
            .with("device", &self.id.device)
            .with("sensor", &self.id.sensor)
            .with("boot", &self.id.boot)
            .with("first_seq", self.first_seq)
            .with("last_seq", self.last_seq)
            .with("frames", self.frames)
    }
}

/// Frames deleted since the start, by reason.
#[derive(Debug, Default)]
pub(super) struct DeletedCounts {
    pub(super) by_age: AtomicU64,
    pub(super) by_size: AtomicU64,
    /// Frames that would be deleted too, if no recording held them.
    pub(super) held: AtomicU64,
}

impl DeletedCounts {
    pub(super) fn add(&self, deleted: &Deleted) {
        let counter = match deleted.reason {
            Reason::Age => &self.by_age,
            Reason::Size => &self.by_size,
            Reason::Empty => return,
        };
        counter.fetch_add(deleted.frames.unsigned_abs(), Ordering::Relaxed);
    }
}

/// How many frames may be deleted, in millionths; can fall below 0, because a chunk is deleted whole.
#[derive(Debug, Default)]
struct Allowance(i128);

impl Allowance {
    const FRAME: i128 = 1_000_000;

    fn gain(&mut self, millionths: i128, frames_max: i128) {
        self.0 = self.0.saturating_add(millionths);
        self.0 = self.0.min(frames_max.saturating_mul(Self::FRAME));
    }

    fn spend(&mut self, frames: i64) {
        self.0 -= i128::from(frames) * Self::FRAME;
    }
}

/// A chunk's position in the order of age: store time, stream, first number.
type Place = (i64, i64, i64);

/// The chunks looked through: all that remain up to a place belong to recordings.
#[derive(Debug, Default, Clone, Copy)]
struct LookedThrough {
    /// `None` before the first.
    through: Option<Place>,
    frames: i64,
}

#[derive(Debug, Default)]
pub(super) struct Retention {
    /// In this round.
    looked: LookedThrough,
    /// Its beginning in which no chunk is joined to another any more: later rounds begin here.
    settled: LookedThrough,
    by_age: Allowance,
    by_size: Allowance,
    /// Time of the last measurement, and the total of frames stored by then.
    measured: Option<(i64, i64)>,
    /// Chunks from before this time came from an older layout: they count as no older than this time.
    aged_from_ns: i64,
    /// While set, the store shrinks to this size in bytes.
    shrink_to: Option<u64>,
}

impl Retention {
    /// At the start of a round: measures how much may be deleted.
    pub(super) fn measure(
        &mut self,
        connection: &Connection,
        now_ns: i64,
        limits: &Limits,
    ) -> Result<()> {
        self.looked = self.settled;
        let sql = "SELECT coalesce(sum(stored), 0), coalesce(sum(expired), 0),
                          (SELECT t_aged_from_ns FROM counters) FROM streams";
        let (stored, deleted, aged_from_ns): (i64, i64, i64) = connection
            .prepare_cached(sql)?
            .query_row([], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))?;
        self.aged_from_ns = aged_from_ns;
        let frames = i128::from(stored.saturating_sub(deleted)).max(1);
        let at_once = (frames / SHARE_AT_ONCE).max(1);
        if let Some((measured_ns, stored_then)) = self.measured.replace((now_ns, stored)) {
            let passed = i128::from(now_ns.saturating_sub(measured_ns));
            let came = TIMES_AS_FAST * i128::from(stored.saturating_sub(stored_then).max(0));
            if let Some(keep_for) = limits.keep_for {
                let grown_old = frames * TIMES_AS_FAST * passed * Allowance::FRAME;
                let keep_ns = i128::from(nanoseconds(keep_for)).max(1);
                self.by_age.gain(grown_old / keep_ns, at_once);
            }
            let share = at_once * passed * Allowance::FRAME / SHARE_EVERY_NS;
            self.by_size.gain(share, at_once);
            self.by_size
                .gain(came * Allowance::FRAME, at_once.saturating_add(came));
        }
        if let Some(bytes_max) = limits.keep_bytes {
            if read::bytes_used(connection)? > bytes_max {
                self.shrink_to = Some(bytes_max - bytes_max / GRAINS.unsigned_abs());
            }
        }
        Ok(())
    }

    /// Deletes a little; the flag says whether this round is finished.
    pub(super) fn delete(
        &mut self,
        connection: &Connection,
        now_ns: i64,
        limits: &Limits,
    ) -> Result<(Vec<Deleted>, bool)> {
        let settle_ns = nanoseconds(limits.seal_after.saturating_mul(SETTLED_AFTER));
        let mut step = Step {
            connection,
            recorded: Recorded::read(connection)?,
            settled_before_ns: now_ns.saturating_sub(settle_ns),
            deleted: Vec::new(),
            chunks_left: DELETED_MAX,
            visits_left: VISITS_MAX,
        };
        if let Some(before_ns) = self.too_old_before(now_ns, limits) {
            while self.by_age.0 > 0 {
                let Some(place) = step.oldest((&mut self.looked, &mut self.settled), before_ns)?
                else {
                    break;
                };
                step.delete(place, before_ns, Reason::Age, &mut self.by_age)?;
            }
        }
        while let Some(bytes_max) = self.shrink_to {
            if read::bytes_used(connection)? <= bytes_max {
                self.shrink_to = None;
                break;
            }
            if self.by_size.0 <= 0 {
                break;
            }
            let Some(place) = step.oldest((&mut self.looked, &mut self.settled), i64::MAX)? else {
                break;
            };
            let grain = now_ns.saturating_sub(place.0) / GRAINS;
            let before_ns = place.0.saturating_add(grain.max(0)).saturating_add(1);
            step.delete(place, before_ns, Reason::Size, &mut self.by_size)?;
        }
        let is_done = step.chunks_left > 0 && step.visits_left > 0;
        Ok((step.deleted, is_done))
    }

    /// Frames that this round would have deleted, if no recording held them.
    pub(super) fn held(&self) -> i64 {
        self.looked.frames
    }

    /// A recording was deleted, so chunks looked through may no longer belong to one.
    pub(super) fn look_through_all_again(&mut self) {
        (self.looked, self.settled) = Default::default();
    }

    /// Chunks stored before this time are too old.
    fn too_old_before(&self, now_ns: i64, limits: &Limits) -> Option<i64> {
        let keep_ns = nanoseconds(limits.keep_for?);
        let grain = (keep_ns / GRAINS).max(1);
        let before_ns = now_ns.saturating_sub(keep_ns).div_euclid(grain) * grain;
        (before_ns > self.aged_from_ns).then_some(before_ns)
    }
}

/// Deletes a boot whose frames were all deleted, if its sensor has [`BOOTS_TOLD_AGAIN`] later ones and its agent holds no
/// more of it.
pub(super) fn delete_empty(connection: &Connection, key: i64) -> Result<Option<Deleted>> {
    let sql = "SELECT device, sensor, boot, last_seq FROM streams s WHERE id = ?1 AND stored + missing > 0
                   AND (account IS NULL OR account ->> 'ended' OR account ->> 'spooled' <= came_since_account)
                   AND NOT EXISTS (SELECT * FROM chunks WHERE stream_id = ?1)
                   AND NOT EXISTS (SELECT * FROM arrivals WHERE stream_id = ?1)
                   AND (SELECT count(*) FROM (SELECT id FROM streams o WHERE o.device = s.device AND o.sensor = s.sensor
                        AND o.last_group > s.last_group LIMIT ?2)) >= ?2";
    let mut statement = connection.prepare_cached(sql)?;
    let found = statement.query_row(params![key, count(BOOTS_TOLD_AGAIN)], |row| {
        Ok((read::stream_id(row, 0)?, row.get(3)?))
    });
    let Some((id, last_seq)) = found.optional()? else {
        return Ok(None);
    };
    for sql in [
        "DELETE FROM runs WHERE stream_id = ?",
        "DELETE FROM shares WHERE stream_id = ?",
        "DELETE FROM streams WHERE id = ?",
    ] {
        connection.prepare_cached(sql)?.execute([key])?;
    }
    Ok(Some(Deleted {
        reason: Reason::Empty,
        id,
        first_seq: 0,
        last_seq,
        frames: 0,
    }))
}

struct Step<'c> {
    connection: &'c Connection,
    recorded: Recorded,
    settled_before_ns: i64,
    deleted: Vec<Deleted>,
    chunks_left: usize,
    visits_left: usize,
}

impl Step<'_> {
    /// The oldest chunk outside all recordings that was stored before `before_ns`, within this step's limit.
    fn oldest(
        &mut self,
        (looked, settled): (&mut LookedThrough, &mut LookedThrough),
        before_ns: i64,
    ) -> Result<Option<Place>> {
        if self.chunks_left == 0 {
            return Ok(None);
        }
        let mut statement = self.connection.prepare_cached(
            "SELECT t_store_ns, stream_id, first_seq, epoch, frames FROM chunks
             WHERE (t_store_ns, stream_id, first_seq) > (?, ?, ?) AND t_store_ns < ?
             ORDER BY t_store_ns, stream_id, first_seq",
        )?;
        let after = looked.through.unwrap_or((i64::MIN, i64::MIN, i64::MIN));
        let mut rows = statement.query(params![after.0, after.1, after.2, before_ns])?;
        while self.visits_left > 0 {
            let Some(row) = rows.next()? else { break };
            self.visits_left -= 1;
            let place = (row.get(0)?, row.get(1)?, row.get(2)?);
            if !self.recorded.has(row.get(3)?) {
                return Ok(Some(place));
            }
            looked.through = Some(place);
            looked.frames += row.get::<_, i64>(4)?;
            if place.0 < self.settled_before_ns {
                *settled = *looked;
            }
        }
        Ok(None)
    }

    /// Deletes a chunk, and the following chunks of its stream that were stored before `before_ns`.
    fn delete(
        &mut self,
        (_, key, first_seq): Place,
        before_ns: i64,
        reason: Reason,
        allowance: &mut Allowance,
    ) -> Result<()> {
        let mut statement = self.connection.prepare_cached(
            "SELECT last_seq, frames, t_store_ns, epoch FROM chunks
             WHERE stream_id = ? AND first_seq >= ? ORDER BY first_seq",
        )?;
        let mut rows = statement.query(params![key, first_seq])?;
        let (mut last_seq, mut frames) = (first_seq, 0);
        while self.chunks_left > 0 && allowance.0 > 0 {
            let Some(row) = rows.next()? else { break };
            if row.get::<_, i64>(2)? >= before_ns || self.recorded.has(row.get(3)?) {
                break;
            }
            last_seq = row.get(0)?;
            let of_chunk: i64 = row.get(1)?;
            frames += of_chunk;
            allowance.spend(of_chunk);
            self.chunks_left -= 1;
        }
        drop(rows);
        self.connection
            .prepare_cached("DELETE FROM chunks WHERE stream_id = ? AND first_seq BETWEEN ? AND ?")?
            .execute(params![key, first_seq, last_seq])?;
        let id = self
            .connection
            .prepare_cached(
                "UPDATE streams SET expired = expired + ? WHERE id = ? RETURNING device, sensor, boot",
            )?
            .query_row(params![frames, key], |row| read::stream_id(row, 0))?;
        self.deleted.push(Deleted {
            reason,
            id,
            first_seq,
            last_seq,
            frames,
        });
        Ok(())
    }
}
