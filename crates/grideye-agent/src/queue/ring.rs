//! What is in memory and not yet known to be durable, and the account of it: read = acknowledged + dropped + spooled, at
//! every moment, where spooled is in memory or on the spool's disk.

use super::stream::{Held, OnDisk, RING_FULL, ROWS_DROPPED, Stream, count};
use crate::batch::{Batch, Item, Lane, Place};
use crate::limits::RING_FRAMES_MAX;
use crate::spool::Dropped;
use grideye_frame::Reading;
use grideye_recording::wire::Account;
use grideye_recording::{Record, StreamId};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;
use std::time::Duration;

/// Records of all sensors of an agent, oldest out first when there are too many.
#[derive(Debug)]
pub struct Ring {
    limit: usize,
    len: usize,
    arrivals: u64,
    device: String,
    boot: String,
    streams: Vec<Stream>,
    /// What had to go and is on the disk: no more than was held at once, since nothing is placed but by the one who asks.
    spilled: Vec<OnDisk>,
}

impl Ring {
    /// A ring for these sensors of one run, holding up to `limit` records of all of them together (1 to
    /// [`RING_FRAMES_MAX`]).
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

    /// Adds a record, which came at `now`, to the stream at this index, in the order in which the sensors were named.
    /// Returns how many records had to go for it.
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
        self.drop_oldest_beyond_the_limit()
    }

    /// Counts a fault of this stream.
    pub fn count_fault(&mut self, stream: usize, kind: &str) {
        if let Some(stream) = self.streams.get_mut(stream) {
            count(&mut stream.account.errors, kind, 1);
        }
    }

    /// Counts a fault that is no sensor's own, in the account of each.
    pub fn count_fault_of_all(&mut self, kind: &str) {
        for stream in &mut self.streams {
            count(&mut stream.account.errors, kind, 1);
        }
    }

    /// The oldest records of a lane, at most `records_max` of them. They stay until acknowledged.
    #[must_use]
    pub fn batch(&self, lane: Lane, now: Duration, records_max: usize) -> Batch {
        let mut chosen: Vec<(u64, Item)> = Vec::new();
        for stream in &self.streams {
            let range = stream.range(lane, now);
            let first = stream.held.range(range).take(records_max);
            chosen.extend(first.map(|held| {
                let item = Item {
                    stream: Arc::clone(&stream.id),
                    record: held.record,
                    place: held.place,
                };
                (held.arrival, item)
            }));
        }
        chosen.sort_unstable_by_key(|(arrival, _)| *arrival);
        chosen.truncate(records_max);
        Batch {
            lane,
            device: self.device.clone(),
            boot: self.boot.clone(),
            items: chosen.into_iter().map(|(_, item)| item).collect(),
        }
    }

    /// Marks the records of a post whose fate is not known, in place of those marked before.
    pub fn doubt(&mut self, batch: Option<&Batch>) {
        for stream in &mut self.streams {
            stream.in_doubt.clear();
            let items = batch.into_iter().flat_map(|batch| &batch.items);
            let of_stream = items.filter(|item| item.stream == stream.id);
            stream
                .in_doubt
                .extend(of_stream.map(|item| item.record.seq));
            if batch.is_none() {
                stream.dropped_in_doubt.clear();
            }
        }
    }

    /// Lets go of records that were posted from memory and that the collector has on disk. Returns how many went.
    pub fn acknowledge<'i>(&mut self, items: impl IntoIterator<Item = &'i Item>) -> usize {
        let mut freed = 0;
        for item in items {
            let Some(stream) = self.stream_mut(&item.stream) else {
                continue;
            };
            let seq = item.record.seq;
            if let Some(held) = stream.index_of(seq).and_then(|at| stream.held.remove(at)) {
                stream.settle(held.is_frame(), None);
                self.len -= 1;
                freed += 1;
            } else if stream.dropped_in_doubt.remove(&seq) {
                stream.take_back(item.is_frame(), RING_FULL);
                freed += 1;
            }
        }
        freed
    }

    /// Drops records in memory that the collector refuses, and counts them under `reason`, so that the rest can go on. Returns how many records went.
    pub fn drop_refused(&mut self, items: &[Item], reason: &str) -> usize {
        let mut gone = 0;
        for item in items {
            let Some(stream) = self.stream_mut(&item.stream) else {
                continue;
            };
            let index = stream.index_of(item.record.seq);
            if let Some(held) = index.and_then(|at| stream.held.remove(at)) {
                stream.settle(held.is_frame(), Some(reason));
                self.len -= 1;
                gone += 1;
            }
        }
        gone
    }

    /// Counts records as acknowledged that were posted from the disk.
    pub fn delivered_from_disk(&mut self, items: &[Item]) {
        for item in items {
            if let Some(stream) = self.stream_mut(&item.stream) {
                stream.settle(item.is_frame(), None);
            }
        }
    }

    /// Counts records as dropped that the disk no longer has.
    pub fn dropped_from_disk(&mut self, dropped: &Dropped) {
        let Some(stream) = self.stream_mut(&dropped.stream) else {
            return;
        };
        let frames = dropped.content.frames;
        let account = &mut stream.account;
        account.spooled = account.spooled.saturating_sub(frames);
        if frames > 0 {
            *account
                .dropped
                .entry(dropped.reason.to_owned())
                .or_default() += frames;
        }
        count(&mut account.errors, ROWS_DROPPED, dropped.content.rows);
    }

    /// Counts records from the disk as dropped that the collector refuses.
    pub fn refused_from_disk(&mut self, item: &Item, reason: &str) {
        if let Some(stream) = self.stream_mut(&item.stream) {
            stream.settle(item.is_frame(), Some(reason));
        }
    }

    /// Counts records as acknowledged that had been counted as dropped: the post that was in doubt had arrived.
    pub fn take_back(&mut self, items: &[Item], reason: &str) {
        for item in items {
            if let Some(stream) = self.stream_mut(&item.stream) {
                stream.take_back(item.is_frame(), reason);
            }
        }
    }

    /// The records that are on no disk yet, oldest first, at most `records_max`; none while all of them are younger than
    /// `older_than`.
    #[must_use]
    pub fn unwritten(
        &self,
        now: Duration,
        older_than: Duration,
        records_max: usize,
    ) -> Vec<(Arc<StreamId>, Record)> {
        let mut chosen: Vec<(u64, Duration, Arc<StreamId>, Record)> = Vec::new();
        for stream in &self.streams {
            let unwritten = stream.held.iter().filter(|held| held.place.is_none());
            chosen.extend(
                unwritten
                    .take(records_max)
                    .map(|held| (held.arrival, held.at, Arc::clone(&stream.id), held.record)),
            );
        }
        if !chosen.iter().any(|(_, at, ..)| *at + older_than <= now) {
            return Vec::new();
        }
        chosen.sort_unstable_by_key(|(arrival, ..)| *arrival);
        chosen.truncate(records_max);
        chosen
            .into_iter()
            .map(|(_, _, id, record)| (id, record))
            .collect()
    }

    /// Notes where records are on the disk, those that are still held.
    pub fn written(&mut self, records: &[(Arc<StreamId>, Record)], places: &[Place]) {
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

    /// Forgets what was in segments that are gone.
    pub fn unplace(&mut self, removed: &BTreeSet<u64>) {
        if removed.is_empty() {
            return;
        }
        let (gone, kept): (Vec<OnDisk>, Vec<OnDisk>) = std::mem::take(&mut self.spilled)
            .into_iter()
            .partition(|spilled| removed.contains(&spilled.place.segment));
        self.spilled = kept;
        for spilled in gone {
            if let Some(stream) = self.stream_mut(&spilled.id) {
                stream.settle(spilled.is_frame, Some(RING_FULL));
            }
        }
        for held in self.streams.iter_mut().flat_map(|stream| &mut stream.held) {
            if held
                .place
                .is_some_and(|place| removed.contains(&place.segment))
            {
                held.place = None;
            }
        }
    }

    /// What is on the disk as well, is at least so old, and is in no post whose fate is not known, oldest first.
    #[must_use]
    pub fn evictable(&self, now: Duration, older_than: Duration) -> Vec<OnDisk> {
        let mut found = self.spilled.clone();
        for stream in &self.streams {
            let old = stream
                .held
                .iter()
                .take_while(|held| held.at + older_than <= now);
            found.extend(old.filter_map(|held| {
                let seq = held.record.seq;
                let place = held.place.filter(|_| !stream.in_doubt.contains(&seq))?;
                Some(OnDisk {
                    id: Arc::clone(&stream.id),
                    seq,
                    place,
                    is_frame: held.is_frame(),
                })
            }));
        }
        found.sort_unstable_by_key(|found| found.place);
        found
    }

    /// Takes records out of memory that the disk has; they stay in the account.
    pub fn evict(&mut self, records: &[OnDisk]) {
        self.spilled.clear();
        for record in records {
            let Some(stream) = self.stream_mut(&record.id) else {
                continue;
            };
            let index = stream.index_of(record.seq);
            if index.and_then(|at| stream.held.remove(at)).is_some() {
                self.len -= 1;
            }
        }
    }

    /// Where the records in memory are on the disk, those that are.
    #[must_use]
    pub fn places(&self) -> BTreeSet<Place> {
        let held = self.streams.iter().flat_map(|stream| &stream.held);
        let spilled = self.spilled.iter().map(|spilled| spilled.place);
        held.filter_map(|held| held.place).chain(spilled).collect()
    }

    /// Records held in memory.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether nothing in memory waits for the collector.
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

    /// Every stream's account.
    #[must_use]
    pub fn stream_accounts(&self) -> Vec<(Arc<StreamId>, Account)> {
        let named = |stream: &Stream| (Arc::clone(&stream.id), stream.account.clone());
        self.streams.iter().map(named).collect()
    }

    /// Frames of this sensor that the collector has on disk.
    #[must_use]
    pub fn acknowledged(&self, sensor: &str) -> u64 {
        let stream = self
            .streams
            .iter()
            .find(|stream| stream.id.sensor == sensor);
        stream.map_or(0, |stream| stream.acknowledged)
    }

    fn stream_mut(&mut self, id: &Arc<StreamId>) -> Option<&mut Stream> {
        self.streams.iter_mut().find(|stream| stream.id == *id)
    }

    fn drop_oldest_beyond_the_limit(&mut self) -> usize {
        let mut dropped = 0;
        while self.len > self.limit {
            let oldest = self
                .streams
                .iter_mut()
                .filter(|stream| !stream.held.is_empty());
            let Some(stream) =
                oldest.min_by_key(|stream| stream.held.front().map(|held| held.arrival))
            else {
                break;
            };
            let Some(held) = stream.held.pop_front() else {
                break;
            };
            self.len -= 1;
            let seq = held.record.seq;
            if let Some(place) = held.place {
                self.spilled.push(OnDisk {
                    id: Arc::clone(&stream.id),
                    seq,
                    place,
                    is_frame: held.is_frame(),
                });
                continue;
            }
            stream.settle(held.is_frame(), Some(RING_FULL));
            if stream.in_doubt.contains(&seq) {
                stream.dropped_in_doubt.insert(seq);
            }
            dropped += 1;
        }
        dropped
    }
}

#[cfg(test)]
mod tests;
