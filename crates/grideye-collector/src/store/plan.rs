//! Decides in memory what batches change, the same for every engine. Nobody else may change the same streams meanwhile.

use crate::limits::Limits;
use crate::store::account;
use crate::store::error::{Result, StoreError};
use crate::store::row::{count, fitting, unsigned};
use crate::store::runs::Runs;
use crate::store::types::{Appended, SensorAppended, StreamSummary};
use grideye_recording::wire::{Account, Batch, SensorBatch};
use grideye_recording::{Record, StreamId};
use hashbrown::{Equivalent, HashMap};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

#[derive(Debug, Clone)]
pub(super) struct Taken {
    pub(super) batch: Arc<Batch>,
    pub(super) t_arrival_ns: i64,
}

impl Taken {
    pub(super) fn parts(&self) -> impl Iterator<Item = (StreamName<'_>, &SensorBatch)> {
        let parts = self.batch.sensors.iter();
        parts.map(|part| (self.name_of(part), part))
    }

    pub(super) fn name_of<'n>(&'n self, part: &'n SensorBatch) -> StreamName<'n> {
        StreamName {
            device: &self.batch.device,
            sensor: &part.sensor,
            boot: &self.batch.boot,
        }
    }

    pub(super) fn streams(&self) -> impl Iterator<Item = StreamName<'_>> {
        self.parts().map(|(name, _)| name)
    }
}

/// A [`StreamId`] borrowed from a batch; it can look up a map with `StreamId` keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct StreamName<'b> {
    // In the order of `StreamId`'s fields, so that both hash alike.
    pub(super) device: &'b str,
    pub(super) sensor: &'b str,
    pub(super) boot: &'b str,
}

impl StreamName<'_> {
    pub(super) fn to_id(self) -> StreamId {
        StreamId {
            device: self.device.to_owned(),
            sensor: self.sensor.to_owned(),
            boot: self.boot.to_owned(),
        }
    }
}

impl Equivalent<Arc<StreamId>> for StreamName<'_> {
    fn equivalent(&self, id: &Arc<StreamId>) -> bool {
        self.device == id.device && self.sensor == id.sensor && self.boot == id.boot
    }
}

/// A record, and the wall clock of the collector when it arrived.
pub(super) type Arrived = (Record, i64);

/// One stream: its stored state, and the planned changes.
#[derive(Debug, Default)]
pub(super) struct StreamState {
    /// The engine's own key of the stream.
    pub(super) key: i64,
    pub(super) stored: i64,
    pub(super) expired: i64,
    pub(super) missing: i64,
    pub(super) account: Option<Account>,
    pub(super) account_read: Option<i64>,
    pub(super) came_since_account: i64,
    pub(super) t_last_arrival_ns: i64,
    pub(super) t_sent_boot_ns: Option<i64>,
    pub(super) runs: Runs,
    /// The new frames by their numbers.
    pub(super) fresh: BTreeMap<u64, Arrived>,
    pub(super) is_touched: bool,
    /// No batch of it was accepted yet.
    pub(super) is_new: bool,
}

impl StreamState {
    pub(super) fn restore_run(&mut self, first: i64, last: i64) -> Result<()> {
        let (first, last) = (unsigned("first_seq", first)?, unsigned("last_seq", last)?);
        self.runs.restore(first, last);
        Ok(())
    }

    /// The store now has everything planned: the next plan starts from here.
    pub(super) fn settle(&mut self) {
        self.fresh.clear();
        self.runs.settle();
        self.is_touched = false;
    }

    /// Whether all these frames come after every number received so far.
    pub(super) fn is_behind(&self, frames: &[Record]) -> bool {
        let last = self.runs.last();
        let is_behind = |first: &Record| last.is_none_or(|last| last < first.seq);
        frames.first().is_none_or(is_behind) && ascend(frames)
    }

    /// Whether the store itself has the number, not only the plan.
    pub(super) fn is_settled(&self, seq: u64) -> bool {
        self.runs.contains(seq) && !self.fresh.contains_key(&seq)
    }

    /// Of the new frames: the lowest and highest number, how many have pixels, how many are missing.
    pub(super) fn share(&self) -> Option<(i64, i64, i64, i64)> {
        let (first, last) = (self.fresh.keys().next()?, self.fresh.keys().next_back()?);
        let stored = self.fresh.values().filter(|(record, _)| has_pixels(record));
        let stored = count(stored.count());
        // Numbers in `fresh` were checked to fit.
        let number = |seq: &u64| i64::try_from(*seq).unwrap_or(i64::MAX);
        let missing = count(self.fresh.len()) - stored;
        Some((number(first), number(last), stored, missing))
    }

    pub(super) fn summary(&self, id: &Arc<StreamId>, limits: &Limits) -> Result<StreamSummary> {
        let stored = unsigned("stored", self.stored)?;
        let missing = unsigned("missing", self.missing)?;
        let durable_through = self.runs.last();
        let expected = durable_through.map_or(0, |last| last + 1);
        Ok(StreamSummary {
            id: Arc::clone(id),
            stored,
            expired: unsigned("expired", self.expired)?,
            missing,
            durable_through,
            gaps: self.runs.gaps(&id.sensor, limits.gaps_listed_max),
            never_came: expected.saturating_sub(stored + missing),
            account: self.account.clone(),
            came_since_account: unsigned("came_since_account", self.came_since_account)?,
            t_last_arrival_ns: self.t_last_arrival_ns,
        })
    }
}

fn ascend(frames: &[Record]) -> bool {
    frames.is_sorted_by(|one, next| one.seq < next.seq)
}

fn has_pixels(record: &Record) -> bool {
    record.reading.frame().is_some()
}

/// The stored records under numbers that came again, to compare with the new ones.
pub(super) type Contents = HashMap<Arc<StreamId>, BTreeMap<u64, Record>>;

pub(super) type Streams = HashMap<Arc<StreamId>, StreamState>;

/// The streams of a group, and the changes its batches have made so far.
pub(super) struct Plan<'p> {
    pub(super) streams: &'p mut Streams,
    pub(super) contents: &'p Contents,
    pub(super) limits: &'p Limits,
}

impl Plan<'_> {
    /// Takes a batch whole, or rejects it and changes nothing.
    pub(super) fn take(&mut self, taken: &Taken) -> Result<Appended> {
        let batch = &*taken.batch;
        for (name, part) in taken.parts() {
            self.check(name, part)?;
        }
        let mut sensors = Vec::with_capacity(batch.sensors.len());
        for (name, part) in taken.parts() {
            sensors.push(self.add(taken, name, part)?);
        }
        Ok(Appended { sensors })
    }

    fn check(&self, name: StreamName<'_>, part: &SensorBatch) -> Result<()> {
        let state = self.streams.get(&name).ok_or_else(gone)?;
        if let Some(account) = &part.account {
            fitting("account.read", account.read)?;
        }
        for record in &part.frames {
            fitting("seq", record.seq)?;
            fitting("t_boot_ns", record.stamp.t_boot_ns)?;
        }
        if state.is_behind(&part.frames) {
            // All numbers are new: nothing to compare.
            return Ok(());
        }
        let ascend = ascend(&part.frames);
        let mut within: BTreeMap<u64, &Record> = BTreeMap::new();
        for record in &part.frames {
            let before = || match ascend {
                true => None,
                false => within.get(&record.seq).copied(),
            };
            let kept = || {
                let fresh = state.fresh.get(&record.seq).map(|(record, _)| record);
                fresh.or_else(|| self.contents.get(&name)?.get(&record.seq))
            };
            let known = match state.runs.contains(record.seq) {
                true => before().or_else(kept),
                false => before(),
            };
            if known.is_some_and(|known| known != record) {
                return Err(StoreError::Conflict {
                    device: name.device.to_owned(),
                    sensor: name.sensor.to_owned(),
                    boot: name.boot.to_owned(),
                    seq: record.seq,
                });
            }
            if !ascend {
                within.insert(record.seq, record);
            }
        }
        Ok(())
    }

    fn add(
        &mut self,
        taken: &Taken,
        name: StreamName<'_>,
        part: &SensorBatch,
    ) -> Result<SensorAppended> {
        let t_arrival_ns = taken.t_arrival_ns;
        let (id, state) = self.streams.get_key_value_mut(&name).ok_or_else(gone)?;
        let mut fresh = Vec::with_capacity(part.frames.len());
        let is_behind = state.is_behind(&part.frames);
        for record in &part.frames {
            if is_behind {
                state.runs.append(record.seq);
            } else if state.runs.contains(record.seq) {
                continue;
            } else {
                state.runs.add(record.seq);
            }
            state.fresh.insert(record.seq, (*record, t_arrival_ns));
            fresh.push(record.seq);
            if has_pixels(record) {
                state.stored += 1;
            } else {
                state.missing += 1;
            }
        }
        fresh.sort_unstable();
        if !fresh.is_empty() {
            state.t_last_arrival_ns = t_arrival_ns;
        }
        state.is_touched = true;
        state.t_sent_boot_ns = taken
            .batch
            .t_sent_boot_ns
            .and_then(|sent| i64::try_from(sent).ok());
        take_account(state, part)?;
        Ok(SensorAppended {
            stream: state.summary(id, self.limits)?,
            fresh,
            is_new: std::mem::take(&mut state.is_new),
        })
    }
}

fn gone() -> StoreError {
    StoreError::Failed("a stream is gone".to_owned())
}

/// Batches can arrive out of order: the account with the most frames read is the latest.
fn take_account(state: &mut StreamState, part: &SensorBatch) -> Result<()> {
    let came = frames_in(part);
    let has_ended = [state.account.as_ref(), part.account.as_ref()]
        .into_iter()
        .flatten()
        .any(|account| account.ended);
    if has_ended {
        return end_account(state, part, came);
    }
    let came = count(came);
    if let Some(account) = &part.account {
        let read = fitting("account.read", account.read)?;
        if state.account_read.is_none_or(|known| known <= read) {
            state.account = Some(account.clone());
            state.account_read = Some(read);
            state.came_since_account = 0;
        }
    }
    if let Some(account) = &mut state.account {
        state.came_since_account += came;
        let stored = unsigned("stored", state.stored)?;
        account::take_back(account, stored, state.came_since_account.unsigned_abs());
    }
    Ok(())
}

/// How many frames with pixels a part brings, each number once.
fn frames_in(part: &SensorBatch) -> usize {
    let with_pixels = part.frames.iter().filter(|record| has_pixels(record));
    if ascend(&part.frames) {
        return with_pixels.count();
    }
    let numbers: BTreeSet<u64> = with_pixels.map(|record| record.seq).collect();
    numbers.len()
}

/// Updates the account of a boot that has ended.
fn end_account(state: &mut StreamState, part: &SensorBatch, came: usize) -> Result<()> {
    let stored = unsigned("stored", state.stored)?;
    let came = u64::try_from(came).unwrap_or(u64::MAX);
    let merged = account::of_ended_run(state.account.as_ref(), part.account.as_ref(), stored, came);
    state.account_read = Some(fitting("account.read", merged.read)?);
    state.account = Some(merged);
    state.came_since_account = 0;
    Ok(())
}
