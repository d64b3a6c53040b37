//! The ring: records in memory that are not yet known to be durable, and their account. At every moment read =
//! acknowledged + dropped + spooled, where spooled is in memory or on the spool's disk.

use crate::batch::{Batch, Item, Lane, Place};
use crate::limits::{LIVE_FOR, RING_FRAMES_MAX};
use crate::spool::Dropped;
use grideye_frame::Reading;
use grideye_recording::wire::Account;
use grideye_recording::{Record, StreamId};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;
use std::time::Duration;

/// The reason for frames dropped because the ring was full.
pub const RING_FULL: &str = "ring-full";
/// The count of dropped records of missing frames; they are not frames that were read.
pub const ROWS_DROPPED: &str = "missing-rows-dropped";
/// Maximum number of fault kinds in one account; further kinds are counted together.
pub const FAULT_KINDS_MAX: usize = 32;
/// The count of faults of kinds beyond [`FAULT_KINDS_MAX`].
pub const OTHER_FAULTS: &str = "other";

/// Records of all sensors of an agent. When there are too many, the oldest leaves first.
#[derive(Debug)]
pub struct Ring {
    limit: usize,
    len: usize,
    arrivals: u64,
    device: String,
    boot: String,
    streams: Vec<Stream>,
    /// Records that a full ring pushed out but the disk has. Bounded by the ring's size, because only the next write
    /// gives places.
    spilled: Vec<OnDisk>,
}
#[derive(Debug)]
struct Stream {
    id: Arc<StreamId>,
    held: VecDeque<Held>,
    account: Account,
    acknowledged: u64,
    /// Sequence numbers in a post that may have arrived.
    in_doubt: BTreeSet<u64>,
    /// Those that were dropped and counted since.
    dropped_in_doubt: BTreeSet<u64>,
}

#[derive(Debug)]
struct Held {
    arrival: u64,
    at: Duration,
    record: Record,
    place: Option<Place>,
}

#[derive(Debug, Clone)]
pub(crate) struct OnDisk {
    id: Arc<StreamId>,
    seq: u64,
    pub(crate) place: Place,
    pub(crate) is_frame: bool,
}

impl Ring {
    /// A ring for these sensors of one boot, for `limit` records in total (1 to [`RING_FRAMES_MAX`]).
    pub fn new(
        limit: usize,
        device: &str,
        boot: &str,
        sensors: impl IntoIterator<Item = String>,
    ) -> Self {
        let stream = |sensor| Stream {
            id: Arc::new(StreamId {
                device: device.to_owned(),
                sensor,
                boot: boot.to_owned(),
            }),
            held: VecDeque::new(),
            account: Account::default(),
            acknowledged: 0,
            in_doubt: BTreeSet::new(),
            dropped_in_doubt: BTreeSet::new(),
        };
        Self {
            limit: limit.clamp(1, RING_FRAMES_MAX),
            len: 0,
            arrivals: 0,
            device: device.to_owned(),
            boot: boot.to_owned(),
            streams: sensors.into_iter().map(stream).collect(),
            spilled: Vec::new(),
        }
    }

    /// Adds a record, received at `now`, to the sensor with this index. Returns how many records were dropped for it.
    pub fn push(&mut self, stream: usize, record: Record, now: Duration) -> usize {
        let Some(stream) = self.streams.get_mut(stream) else {
            return 0;
        };
        match record.reading {
            Reading::Frame(_) => {
                stream.account.read += 1;
                stream.account.spooled += 1;
            }
            Reading::NoData(_) => stream.account.missing += 1,
        }
        stream.held.push_back(Held {
            arrival: self.arrivals,
            at: now,
            record,
            place: None,
        });
        self.arrivals += 1;
        self.len += 1;
        let mut dropped = 0;
        while self.len > self.limit {
            dropped += usize::from(self.drop_oldest());
        }
        dropped
    }

    pub(crate) fn count_fault(&mut self, stream: usize, kind: &str) {
        if let Some(stream) = self.streams.get_mut(stream) {
            count(&mut stream.account.errors, kind, 1);
        }
    }

    /// Counts a fault that belongs to no single sensor, in every account.
    pub(crate) fn count_fault_of_all(&mut self, kind: &str) {
        for stream in &mut self.streams {
            count(&mut stream.account.errors, kind, 1);
        }
    }

    /// The oldest records of a lane, at most `records_max`. They stay in the ring until acknowledged.
    #[must_use]
    pub fn batch(&self, lane: Lane, now: Duration, records_max: usize) -> Batch {
        let lane_of = |stream: &Stream| stream.range(lane, now);
        let chosen = self.oldest(records_max, lane_of, |_| true);
        let item = |(stream, held): (&Stream, &Held)| Item {
            stream: Arc::clone(&stream.id),
            record: held.record,
            place: held.place,
        };
        Batch {
            lane,
            device: self.device.clone(),
            boot: self.boot.clone(),
            items: chosen.into_iter().map(item).collect(),
        }
    }

    /// Matching records within each stream's `range`, in order of arrival.
    fn oldest(
        &self,
        records_max: usize,
        range: impl Fn(&Stream) -> std::ops::Range<usize>,
        is_asked_for: fn(&Held) -> bool,
    ) -> Vec<(&Stream, &Held)> {
        let mut chosen = Vec::new();
        for stream in &self.streams {
            let held = stream.held.range(range(stream));
            let first = held.filter(|held| is_asked_for(held)).take(records_max);
            chosen.extend(first.map(|held| (stream, held)));
        }
        chosen.sort_unstable_by_key(|(_, held)| held.arrival);
        chosen.truncate(records_max);
        chosen
    }

    /// Marks the records of a post that may have arrived, and clears the previous marks.
    pub(crate) fn doubt(&mut self, batch: Option<&Batch>) {
        for stream in &mut self.streams {
            stream.in_doubt.clear();
            let items = batch.into_iter().flat_map(|batch| &batch.items);
            let of_stream = items.filter(|item| item.stream == stream.id);
            let seqs = of_stream.map(|item| item.record.seq);
            stream.in_doubt.extend(seqs);
            if batch.is_none() {
                stream.dropped_in_doubt.clear();
            }
        }
    }

    /// Removes records that were posted from memory: the collector has stored them, or rejected them, which counts
    /// under `reason`. Returns how many.
    pub(crate) fn settle<'i>(
        &mut self,
        items: impl IntoIterator<Item = &'i Item>,
        reason: Option<&str>,
    ) -> usize {
        let mut gone = 0;
        for item in items {
            let Some(stream) = self.stream_mut(&item.stream) else {
                continue;
            };
            let seq = item.record.seq;
            if let Some(held) = stream.take(seq) {
                stream.settle(held.is_frame(), reason);
                self.len -= 1;
                gone += 1;
            } else if reason.is_none() && stream.dropped_in_doubt.remove(&seq) {
                stream.take_back(item.is_frame(), RING_FULL);
                gone += 1;
            }
        }
        gone
    }

    /// Accounts for records that were posted from the disk.
    pub(crate) fn settle_from_disk(&mut self, items: &[Item], reason: Option<&str>) {
        for item in items {
            if let Some(stream) = self.stream_mut(&item.stream) {
                stream.settle(item.is_frame(), reason);
            }
        }
    }
    pub(crate) fn dropped_from_disk(&mut self, dropped: &Dropped) {
        let Some(stream) = self.stream_mut(&dropped.stream) else {
            return;
        };
        let frames = dropped.content.frames;
        let account = &mut stream.account;
        account.spooled = account.spooled.saturating_sub(frames);
        if frames > 0 {
            let reason = dropped.reason.to_owned();
            *account.dropped.entry(reason).or_default() += frames;
        }
        count(&mut account.errors, ROWS_DROPPED, dropped.content.rows);
    }

    /// Moves records from dropped to acknowledged: the post in doubt had arrived.
    pub(crate) fn take_back(&mut self, items: &[Item], reason: &str) {
        for item in items {
            if let Some(stream) = self.stream_mut(&item.stream) {
                stream.take_back(item.is_frame(), reason);
            }
        }
    }

    /// The oldest records that are not on the disk; none while all are younger than `older_than`.
    #[must_use]
    pub fn unwritten(
        &self,
        now: Duration,
        older_than: Duration,
        records_max: usize,
    ) -> Vec<(Arc<StreamId>, Record)> {
        let all = |stream: &Stream| 0..stream.held.len();
        let chosen = self.oldest(records_max, all, |held| held.place.is_none());
        let is_old = |(_, held): &(&Stream, &Held)| held.at + older_than <= now;
        if !chosen.iter().any(is_old) {
            return Vec::new();
        }
        let named = |(stream, held): (&Stream, &Held)| (Arc::clone(&stream.id), held.record);
        chosen.into_iter().map(named).collect()
    }

    /// Notes the places on disk of the records that are still in memory.
    pub(crate) fn written(&mut self, records: &[(Arc<StreamId>, Record)], places: &[Place]) {
        for ((id, record), place) in records.iter().zip(places) {
            let Some(stream) = self.stream_mut(id) else {
                continue;
            };
            let index = stream.index_of(record.seq);
            if let Some(held) = index.and_then(|at| stream.held.get_mut(at)) {
                held.place = Some(*place);
            }
        }
    }
    pub(crate) fn unplace(&mut self, removed: &BTreeSet<u64>) {
        if removed.is_empty() {
            return;
        }
        let is_gone = |place: &Place| removed.contains(&place.segment);
        let spilled = std::mem::take(&mut self.spilled).into_iter();
        let (gone, kept): (Vec<_>, _) = spilled.partition(|spilled| is_gone(&spilled.place));
        self.spilled = kept;
        for spilled in gone {
            if let Some(stream) = self.stream_mut(&spilled.id) {
                stream.settle(spilled.is_frame, Some(RING_FULL));
            }
        }
        for held in self.streams.iter_mut().flat_map(|stream| &mut stream.held) {
            held.place.take_if(|place| is_gone(place));
        }
    }

    /// Records at least this old that are also on the disk and in no post in doubt, oldest first.
    pub(crate) fn evictable(&self, now: Duration, older_than: Duration) -> Vec<OnDisk> {
        let mut found = self.spilled.clone();
        for stream in &self.streams {
            let is_old = |held: &&Held| held.at + older_than <= now;
            let old = stream.held.iter().take_while(is_old);
            let settled = old.filter(|held| !stream.in_doubt.contains(&held.record.seq));
            found.extend(settled.filter_map(|held| held.on_disk(&stream.id)));
        }
        found.sort_unstable_by_key(|found| found.place);
        found
    }

    /// Removes records from memory that the disk has; they stay in the account.
    pub(crate) fn evict(&mut self, records: &[OnDisk]) {
        self.spilled.clear();
        for record in records {
            let stream = self.stream_mut(&record.id);
            if stream.is_some_and(|stream| stream.take(record.seq).is_some()) {
                self.len -= 1;
            }
        }
    }

    /// The places on disk of records in memory.
    pub(crate) fn places(&self) -> BTreeSet<Place> {
        let held = self.streams.iter().flat_map(|stream| &stream.held);
        let spilled = self.spilled.iter().map(|spilled| spilled.place);
        held.filter_map(|held| held.place).chain(spilled).collect()
    }

    /// Number of records in memory.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether memory is empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Every sensor's account.
    #[must_use]
    pub fn accounts(&self) -> BTreeMap<String, Account> {
        let named = |stream: &Stream| (stream.id.sensor.clone(), stream.account.clone());
        self.streams.iter().map(named).collect()
    }

    pub(crate) fn stream_accounts(&self) -> Vec<(Arc<StreamId>, Account)> {
        let named = |stream: &Stream| (Arc::clone(&stream.id), stream.account.clone());
        self.streams.iter().map(named).collect()
    }

    /// Acknowledged frames of this sensor.
    #[must_use]
    pub fn acknowledged(&self, sensor: &str) -> u64 {
        let mut streams = self.streams.iter();
        let stream = streams.find(|stream| stream.id.sensor == sensor);
        stream.map_or(0, |stream| stream.acknowledged)
    }

    fn stream_mut(&mut self, id: &Arc<StreamId>) -> Option<&mut Stream> {
        self.streams.iter_mut().find(|stream| stream.id == *id)
    }

    /// Removes the oldest record from memory. Returns whether it is dropped because the disk does not have it.
    fn drop_oldest(&mut self) -> bool {
        let arrival = |stream: &&mut Stream| stream.held.front().map(|held| held.arrival);
        let streams = self.streams.iter_mut();
        let oldest = streams.filter(|stream| !stream.held.is_empty());
        let oldest = oldest.min_by_key(arrival);
        let taken = oldest.and_then(|stream| Some((stream.held.pop_front()?, stream)));
        let Some((held, stream)) = taken else {
            return false;
        };
        self.len -= 1;
        if let Some(spilled) = held.on_disk(&stream.id) {
            self.spilled.push(spilled);
            return false;
        }
        stream.settle(held.is_frame(), Some(RING_FULL));
        if stream.in_doubt.contains(&held.record.seq) {
            stream.dropped_in_doubt.insert(held.record.seq);
        }
        true
    }
}

impl Held {
    fn is_frame(&self) -> bool {
        self.record.reading.frame().is_some()
    }

    fn on_disk(&self, id: &Arc<StreamId>) -> Option<OnDisk> {
        Some(OnDisk {
            id: Arc::clone(id),
            seq: self.record.seq,
            place: self.place?,
            is_frame: self.is_frame(),
        })
    }
}

impl Stream {
    fn settle(&mut self, is_frame: bool, reason: Option<&str>) {
        let account = &mut self.account;
        if is_frame {
            account.spooled = account.spooled.saturating_sub(1);
        }
        match (is_frame, reason) {
            (true, None) => self.acknowledged += 1,
            (true, Some(reason)) => *account.dropped.entry(reason.to_owned()).or_default() += 1,
            (false, None) => {}
            (false, Some(_)) => count(&mut account.errors, ROWS_DROPPED, 1),
        }
    }

    /// Moves one record from dropped to acknowledged.
    fn take_back(&mut self, is_frame: bool, reason: &str) {
        let (counts, reason) = if is_frame {
            self.acknowledged += 1;
            (&mut self.account.dropped, reason)
        } else {
            (&mut self.account.errors, ROWS_DROPPED)
        };
        if let Some(dropped) = counts.get_mut(reason) {
            *dropped = dropped.saturating_sub(1);
            if *dropped == 0 {
                counts.remove(reason);
            }
        }
    }

    fn index_of(&self, seq: u64) -> Option<usize> {
        let found = self.held.binary_search_by_key(&seq, |held| held.record.seq);
        found.ok()
    }

    fn take(&mut self, seq: u64) -> Option<Held> {
        self.index_of(seq).and_then(|at| self.held.remove(at))
    }

    /// A lane's records, as a range of `held`.
    fn range(&self, lane: Lane, now: Duration) -> std::ops::Range<usize> {
        let live_from = self.held.partition_point(|held| held.at + LIVE_FOR <= now);
        match lane {
            Lane::Live => live_from..self.held.len(),
            Lane::Late => 0..live_from,
            Lane::Disk => 0..0,
        }
    }
}

fn count(counts: &mut BTreeMap<String, u64>, kind: &str, more: u64) {
    if more == 0 {
        return;
    }
    let is_known = counts.contains_key(kind) || counts.len() < FAULT_KINDS_MAX;
    let kind = if is_known { kind } else { OTHER_FAULTS };
    *counts.entry(kind.to_owned()).or_default() += more;
}

#[cfg(test)]
mod tests;
