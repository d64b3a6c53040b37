//! The ring: the newest part of the log, in memory, and the account of this boot. At every moment read = acknowledged +
//! dropped + spooled, where spooled is in memory or on the spool's disk.
//!
//! ```text
//!   position   │ on the disk │ on the disk and in memory │ being written │ in memory │
//!              └ next_batch  ┴ first                     ┴ written       ┴ claimed   ┴ next
//! ```
//!
//! Without a disk, everything is in memory.

use crate::batch::{Batch, Item, Lane, OWN_FIRST};
use crate::limits::{ACKNOWLEDGED_RANGES_MAX, LIVE_FOR, RING_FRAMES_MAX};
use crate::ranges::Ranges;
use crate::spool::{Dropped, count_lost};
use grideye_frame::Reading;
use grideye_recording::wire::{Account, Acknowledgement};
use grideye_recording::{Record, StreamId};
use std::collections::{BTreeMap, VecDeque};
use std::ops::Range;
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
    device: String,
    boot: String,
    streams: Vec<Stream>,
    /// In the order of their positions.
    held: VecDeque<Held>,
    next: u64,
    /// What stands before was handed to the disk.
    claimed: u64,
    /// What stands before is on the disk, unless it was settled before it was claimed.
    written: u64,
    /// Settled in memory after they were claimed, so that the disk has them and need not send them.
    settled: Vec<Item>,
    /// Whether the oldest records are delivered first, without exception.
    is_in_order: bool,
}

#[derive(Debug)]
struct Stream {
    id: Arc<StreamId>,
    account: Account,
    acknowledged: u64,
    /// The numbers of these frames; the oldest are forgotten when there are too many ranges.
    numbers: Ranges,
}

impl Stream {
    fn acknowledge(&mut self, seq: u64) {
        self.acknowledged += 1;
        self.numbers.insert(seq);
        self.numbers.keep_highest(ACKNOWLEDGED_RANGES_MAX);
    }
}

#[derive(Debug)]
struct Held {
    position: u64,
    at: Duration,
    stream: usize,
    record: Record,
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
            account: Account::default(),
            acknowledged: 0,
            numbers: Ranges::default(),
        };
        Self {
            limit: limit.clamp(1, RING_FRAMES_MAX),
            device: device.to_owned(),
            boot: boot.to_owned(),
            streams: sensors.into_iter().map(stream).collect(),
            held: VecDeque::new(),
            next: OWN_FIRST,
            claimed: OWN_FIRST,
            written: OWN_FIRST,
            settled: Vec::new(),
            is_in_order: false,
        }
    }

    /// Adds a record, received at `now`, to the sensor with this index. Returns how many records were dropped for it.
    pub fn push(&mut self, stream: usize, record: Record, now: Duration) -> usize {
        let Some(of) = self.streams.get_mut(stream) else {
            return 0;
        };
        match record.reading {
            Reading::Frame(_) => {
                of.account.read += 1;
                of.account.spooled += 1;
            }
            Reading::NoData(_) => of.account.missing += 1,
        }
        // Threads of several buses may come here in another order than they looked at the clock.
        let at = self.held.back().map_or(now, |last| last.at.max(now));
        self.held.push_back(Held {
            position: self.next,
            at,
            stream,
            record,
        });
        self.next += 1;
        let mut dropped = 0;
        while self.held.len() > self.limit {
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

    /// The oldest records of a lane in memory, at most `records_max`. They stay until settled.
    #[must_use]
    pub fn batch(&self, lane: Lane, now: Duration, records_max: usize) -> Batch {
        let old = self.held.partition_point(|held| held.at + LIVE_FOR <= now);
        let range = match lane {
            Lane::Live if self.is_in_order => 0..0,
            Lane::Live => old..self.held.len(),
            Lane::Backlog => 0..old,
        };
        Batch {
            lane,
            device: self.device.clone(),
            boot: self.boot.clone(),
            items: self.items(range, records_max),
        }
    }

    /// Stops or resumes delivering the newest records first.
    pub(crate) fn deliver_in_order(&mut self, is_in_order: bool) {
        self.is_in_order = is_in_order;
    }

    fn items(&self, range: Range<usize>, records_max: usize) -> Vec<Item> {
        let held = self.held.range(range).take(records_max);
        held.map(|held| self.item(held)).collect()
    }

    fn item(&self, held: &Held) -> Item {
        let stream = Arc::clone(&self.streams[held.stream].id);
        Item::new(held.position, stream, held.record)
    }

    /// Removes records that were posted from memory: the collector has stored them, or rejected them, which counts
    /// under `reason`. Returns those that only the disk can have.
    pub(crate) fn settle(&mut self, items: Vec<Item>, reason: Option<&str>) -> Vec<Item> {
        let is_here = |item: &Item| self.index_of(item.position).is_ok();
        let (here, elsewhere): (Vec<Item>, Vec<Item>) = items.into_iter().partition(is_here);
        if let Some(first) = here.first() {
            // A post's records stand side by side, so one move closes the gap.
            let first = self
                .held
                .partition_point(|held| held.position < first.position);
            let gone = self.held.drain(first..first + here.len());
            debug_assert!(
                gone.map(|held| held.position)
                    .eq(here.iter().map(|item| item.position))
            );
        }
        for item in here {
            self.count(&item, reason);
            if item.position < self.claimed {
                self.settled.push(item);
            }
        }
        let is_written = |item: &Item| item.position < self.written;
        let (on_disk, dropped): (Vec<Item>, Vec<Item>) =
            elsewhere.into_iter().partition(is_written);
        if reason.is_none() {
            self.take_back(&dropped, &[RING_FULL]);
        }
        on_disk
    }

    /// Accounts for records that were taken off the disk.
    pub(crate) fn settle_from_disk(&mut self, items: &[Item], reason: Option<&str>) {
        for item in items {
            self.count(item, reason);
        }
    }

    /// Accounts for records that were dropped from the disk, and forgets them.
    pub(crate) fn dropped_from_disk(&mut self, dropped: &Dropped) {
        while self
            .held
            .front()
            .is_some_and(|held| held.position < dropped.before)
        {
            self.held.pop_front();
        }
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

    /// Moves records from dropped, for the first of these reasons that has any, to acknowledged: their post in doubt had
    /// arrived.
    pub(crate) fn take_back(&mut self, items: &[Item], reasons: &[&str]) {
        for item in items {
            let Some(stream) = self.stream_mut(&item.stream) else {
                continue;
            };
            let (counts, reasons) = match item.is_frame() {
                true => (&mut stream.account.dropped, reasons),
                false => (&mut stream.account.errors, &[ROWS_DROPPED][..]),
            };
            let mut reasons = reasons.iter();
            let Some(reason) = reasons.find(|reason| counts.contains_key(**reason)) else {
                continue;
            };
            if let Some(dropped) = counts.get_mut(*reason) {
                *dropped -= 1;
                if *dropped == 0 {
                    counts.remove(*reason);
                }
            }
            if item.is_frame() {
                stream.acknowledge(item.record.seq);
            }
        }
    }

    /// The numbers of the acknowledged frames, by sensor.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = (&str, &Ranges)> {
        let streams = self.streams.iter();
        streams.map(|stream| (stream.id.sensor.as_str(), &stream.numbers))
    }

    /// What the collector acknowledged and, by this answer, no longer has.
    pub(crate) fn lost(&self, answer: &Acknowledgement) -> Vec<(Arc<StreamId>, Ranges)> {
        let of_stream = |stream: &Stream| {
            let lost = stream.numbers.lost(answer, &stream.id.sensor);
            (Arc::clone(&stream.id), lost)
        };
        self.streams.iter().map(of_stream).collect()
    }

    /// Accounts for frames that the collector lost, `again` of which wait on the disk again.
    pub(crate) fn lose(&mut self, id: &Arc<StreamId>, lost: &Ranges, again: u64) {
        if let Some(stream) = self.stream_mut(id) {
            stream.numbers.remove(lost);
            stream.acknowledged -= lost.count();
            stream.account.spooled += again;
            count_lost(&mut stream.account.dropped, lost, again);
        }
    }

    /// Hands the oldest records that are not on the disk to the disk; none while all are younger than `older_than`.
    /// `written` tells the outcome.
    #[must_use]
    pub fn claim(&mut self, now: Duration, older_than: Duration, records_max: usize) -> Vec<Item> {
        let from = self
            .held
            .partition_point(|held| held.position < self.written);
        let oldest = self.held.get(from);
        if oldest.is_none_or(|held| held.at + older_than > now) {
            return Vec::new();
        }
        let items = self.items(from..self.held.len(), records_max);
        self.claimed = items.last().map_or(self.claimed, |last| last.position + 1);
        items
    }

    /// Notes that these records are on the disk, and no others of those claimed.
    pub(crate) fn written(&mut self, records: &[Item]) {
        self.written = records
            .last()
            .map_or(self.written, |last| last.position + 1);
        self.claimed = self.written;
    }

    /// What was settled in memory since the last call and the disk may have.
    pub(crate) fn take_settled(&mut self) -> Vec<Item> {
        std::mem::take(&mut self.settled)
    }

    /// Removes records at least this old from memory, as far as the disk has them; they stay in the account.
    pub(crate) fn evict(&mut self, now: Duration, older_than: Duration) {
        let is_over = |held: &Held| held.position < self.written && held.at + older_than <= now;
        let over = self.held.partition_point(is_over);
        self.held.drain(..over);
    }

    /// The oldest position in memory: those before are on the disk, or settled.
    pub(crate) fn first(&self) -> u64 {
        self.held.front().map_or(self.next, |held| held.position)
    }

    /// Number of records in memory.
    #[must_use]
    pub fn len(&self) -> usize {
        self.held.len()
    }

    /// Whether memory is empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.held.is_empty()
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

    fn index_of(&self, position: u64) -> Result<usize, usize> {
        self.held
            .binary_search_by_key(&position, |held| held.position)
    }

    /// Accounts for a record that no longer waits: acknowledged, or dropped for this reason.
    fn count(&mut self, item: &Item, reason: Option<&str>) {
        let Some(stream) = self.stream_mut(&item.stream) else {
            return;
        };
        let account = &mut stream.account;
        if item.is_frame() {
            account.spooled = account.spooled.saturating_sub(1);
        }
        match (item.is_frame(), reason) {
            (true, None) => stream.acknowledge(item.record.seq),
            (true, Some(reason)) => *account.dropped.entry(reason.to_owned()).or_default() += 1,
            (false, None) => {}
            (false, Some(_)) => count(&mut account.errors, ROWS_DROPPED, 1),
        }
    }

    /// Removes the oldest record from memory. Returns whether it is dropped because the disk does not have it.
    fn drop_oldest(&mut self) -> bool {
        let Some(held) = self.held.pop_front() else {
            return false;
        };
        if held.position < self.written {
            return false;
        }
        let item = self.item(&held);
        self.count(&item, Some(RING_FULL));
        if item.position < self.claimed {
            self.settled.push(item);
        }
        true
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
