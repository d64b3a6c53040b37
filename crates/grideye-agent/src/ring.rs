//! What is in memory and not yet known to be durable, and the account of it: read = acknowledged + dropped + spooled, at
//! every moment, where spooled is in memory or on the spool's disk.

use crate::config::RING_FRAMES_MAX;
use crate::parcel::{Item, Lane, Parcel};
use crate::spool::{Dropped, Place};
use grideye_frame::Reading;
use grideye_recording::wire::Account;
use grideye_recording::{Record, StreamId};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;
use std::time::Duration;

/// The reason under which frames are dropped because the ring was full.
pub const RING_FULL: &str = "ring-full";
/// The count of rows of missing frames that were dropped, which are no frames that were read.
pub const ROWS_DROPPED: &str = "missing-rows-dropped";
/// Kinds of faults that one account tells apart at most; the rest are counted together.
pub const FAULT_KINDS_MAX: usize = 32;
/// The count of faults beyond [`FAULT_KINDS_MAX`] kinds.
pub const OTHER_FAULTS: &str = "other";
/// What is younger goes to the collector first, what is older when there is time for it.
pub const LIVE_FOR: Duration = Duration::from_secs(10);

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

#[derive(Debug)]
struct Stream {
    id: Arc<StreamId>,
    /// In ascending seq.
    held: VecDeque<Held>,
    account: Account,
    acknowledged: u64,
    /// Numbers in a post whose fate is not known: the collector may have them.
    in_doubt: BTreeSet<u64>,
    /// Those of them that were dropped and counted since.
    dropped_in_doubt: BTreeSet<u64>,
}

#[derive(Debug)]
struct Held {
    arrival: u64,
    at: Duration,
    record: Record,
    place: Option<Place>,
}

/// A record in memory that is on the disk as well.
#[derive(Debug, Clone)]
pub struct OnDisk {
    id: Arc<StreamId>,
    seq: u64,
    /// Where.
    pub place: Place,
    /// Whether it carries pixels.
    pub is_frame: bool,
}

impl Stream {
    fn let_go(&mut self, record: &Record, reason: Option<&str>) {
        match (record.reading, reason) {
            (Reading::Frame(_), None) => {
                self.account.spooled = self.account.spooled.saturating_sub(1);
                self.acknowledged += 1;
            }
            (Reading::Frame(_), Some(reason)) => {
                self.account.spooled = self.account.spooled.saturating_sub(1);
                *self.account.dropped.entry(reason.to_owned()).or_default() += 1;
            }
            (Reading::NoData(_), None) => {}
            (Reading::NoData(_), Some(_)) => count(&mut self.account.errors, ROWS_DROPPED, 1),
        }
    }

    /// Counts as acknowledged what had been counted as dropped.
    fn take_back(&mut self, is_frame: bool, reason: &str) {
        let counts = if is_frame {
            self.acknowledged += 1;
            &mut self.account.dropped
        } else {
            &mut self.account.errors
        };
        let reason = if is_frame { reason } else { ROWS_DROPPED };
        if let Some(dropped) = counts.get_mut(reason) {
            *dropped = dropped.saturating_sub(1);
            if *dropped == 0 {
                counts.remove(reason);
            }
        }
    }

    fn index_of(&self, seq: u64) -> Option<usize> {
        self.held
            .binary_search_by_key(&seq, |held| held.record.seq)
            .ok()
    }

    /// The records of a lane, as a range of what is held.
    fn range(&self, lane: Lane, now: Duration) -> std::ops::Range<usize> {
        let live_from = self.held.partition_point(|held| held.at + LIVE_FOR <= now);
        match lane {
            Lane::Live => live_from..self.held.len(),
            Lane::Late => 0..live_from,
            Lane::Disk => 0..0,
        }
    }
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
    pub fn parcel(&self, lane: Lane, now: Duration, records_max: usize) -> Parcel {
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
        Parcel {
            lane,
            device: self.device.clone(),
            boot: self.boot.clone(),
            items: chosen.into_iter().map(|(_, item)| item).collect(),
        }
    }

    /// Marks the records of a post whose fate is not known, in place of those marked before.
    pub fn doubt(&mut self, parcel: Option<&Parcel>) {
        for stream in &mut self.streams {
            stream.in_doubt.clear();
            let items = parcel.into_iter().flat_map(|parcel| &parcel.items);
            let of_stream = items.filter(|item| item.stream == stream.id);
            stream
                .in_doubt
                .extend(of_stream.map(|item| item.record.seq));
            if parcel.is_none() {
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
                stream.let_go(&held.record, None);
                self.len -= 1;
                freed += 1;
            } else if stream.dropped_in_doubt.remove(&seq) {
                stream.take_back(item.is_frame(), RING_FULL);
                freed += 1;
            }
        }
        freed
    }

    /// Sets records in memory aside that the collector refuses for ever: they are dropped and counted under `reason`, so
    /// that the rest can go on. Returns how many records went.
    pub fn set_aside(&mut self, items: &[Item], reason: &str) -> usize {
        let mut gone = 0;
        for item in items {
            let Some(stream) = self.stream_mut(&item.stream) else {
                continue;
            };
            let index = stream.index_of(item.record.seq);
            if let Some(held) = index.and_then(|at| stream.held.remove(at)) {
                stream.let_go(&held.record, Some(reason));
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
                stream.let_go(&item.record, None);
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

    /// Counts records from the disk that the collector refuses for ever.
    pub fn refused_from_disk(&mut self, item: &Item, reason: &str) {
        if let Some(stream) = self.stream_mut(&item.stream) {
            stream.let_go(&item.record, Some(reason));
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
        let (gone, kept) = std::mem::take(&mut self.spilled)
            .into_iter()
            .partition(|spilled| removed.contains(&spilled.place.segment));
        self.spilled = kept;
        self.count_spilled_as_dropped(gone);
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
                    is_frame: held.record.reading.frame().is_some(),
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

    fn count_spilled_as_dropped(&mut self, gone: Vec<OnDisk>) {
        for spilled in gone {
            let Some(stream) = self.stream_mut(&spilled.id) else {
                continue;
            };
            if spilled.is_frame {
                stream.account.spooled = stream.account.spooled.saturating_sub(1);
            }
            let counts = if spilled.is_frame {
                &mut stream.account.dropped
            } else {
                &mut stream.account.errors
            };
            let reason = if spilled.is_frame {
                RING_FULL
            } else {
                ROWS_DROPPED
            };
            count(counts, reason, 1);
        }
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
                let (id, is_frame) = (
                    Arc::clone(&stream.id),
                    held.record.reading.frame().is_some(),
                );
                self.spilled.push(OnDisk {
                    id,
                    seq,
                    place,
                    is_frame,
                });
                continue;
            }
            stream.let_go(&held.record, Some(RING_FULL));
            if stream.in_doubt.contains(&seq) {
                stream.dropped_in_doubt.insert(seq);
            }
            dropped += 1;
        }
        dropped
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
mod tests {
    use super::*;
    use grideye_frame::{NoData, PIXELS, PixelWord, RawFrame, ThermistorWord};
    use grideye_recording::{ClockState, Stamp};
    use proptest::prelude::*;

    mod on_disk;

    const SENSORS: [&str; 2] = ["i2c-1:0x68", "i2c-1:0x69"];

    fn record(seq: u64, is_frame: bool) -> Record {
        let frame = RawFrame {
            thermistor: ThermistorWord(400),
            pixels: [PixelWord(80); PIXELS],
        };
        Record {
            seq,
            stamp: Stamp {
                t_boot_ns: seq,
                t_utc_ns: 0,
                clock: ClockState::Unsynced,
            },
            reading: if is_frame {
                Reading::Frame(frame)
            } else {
                Reading::NoData(NoData::Nack)
            },
        }
    }

    fn ring(limit: usize) -> Ring {
        Ring::new(limit, "pi", "b", SENSORS.map(String::from))
    }

    fn push(ring: &mut Ring, stream: usize, record: Record) -> usize {
        ring.push(stream, record, Duration::ZERO)
    }

    fn live(ring: &Ring, records_max: usize) -> Parcel {
        ring.parcel(Lane::Live, Duration::ZERO, records_max)
    }

    fn seqs(parcel: &Parcel) -> [Vec<u64>; 2] {
        let of = |sensor: &str| {
            let items = parcel.items.iter();
            let of_sensor = items.filter(|item| item.stream.sensor == sensor);
            of_sensor.map(|item| item.record.seq).collect()
        };
        SENSORS.map(of)
    }

    #[test]
    fn a_full_ring_drops_the_oldest_of_all_sensors_and_says_so() {
        let mut ring = ring(3);
        for (stream, seq) in [(0, 0), (1, 0), (0, 1)] {
            assert_eq!(push(&mut ring, stream, record(seq, true)), 0);
        }
        assert_eq!(push(&mut ring, 1, record(1, true)), 1);
        assert_eq!(push(&mut ring, 1, record(2, false)), 1);
        let accounts = ring.accounts();
        assert_eq!(
            accounts[SENSORS[0]].dropped,
            BTreeMap::from([(RING_FULL.to_owned(), 1)])
        );
        assert_eq!(
            accounts[SENSORS[1]].dropped,
            BTreeMap::from([(RING_FULL.to_owned(), 1)])
        );
        assert_eq!(seqs(&live(&ring, 10)), [vec![1], vec![1, 2]]);
        assert_eq!(push(&mut ring, 0, record(2, true)), 1);
        assert_eq!(push(&mut ring, 0, record(3, true)), 1);
        assert_eq!(push(&mut ring, 0, record(4, true)), 1);
        assert_eq!(
            ring.accounts()[SENSORS[1]].errors,
            BTreeMap::from([(ROWS_DROPPED.to_owned(), 1)])
        );
    }

    #[test]
    fn a_batch_takes_the_oldest_of_all_sensors_and_no_more_than_asked() {
        let mut ring = ring(100);
        for (stream, seq) in [(0, 0), (0, 1), (1, 0), (0, 2), (1, 1)] {
            push(&mut ring, stream, record(seq, true));
        }
        assert_eq!(seqs(&live(&ring, 3)), [vec![0, 1], vec![0]]);
        assert!(seqs(&live(&ring, 0)).iter().all(Vec::is_empty));
        assert_eq!(ring.len(), 5);
    }

    #[test]
    fn what_is_old_goes_in_a_lane_of_its_own() {
        let mut ring = ring(100);
        for seq in 0..5 {
            ring.push(0, record(seq, true), Duration::from_secs(seq));
        }
        let now = Duration::from_secs(2) + LIVE_FOR;
        assert_eq!(seqs(&ring.parcel(Lane::Late, now, 9))[0], [0, 1, 2]);
        assert_eq!(seqs(&ring.parcel(Lane::Late, now, 2))[0], [0, 1]);
        assert_eq!(seqs(&ring.parcel(Lane::Live, now, 9))[0], [3, 4]);
    }

    #[test]
    fn what_was_dropped_while_its_post_was_in_doubt_is_counted_as_delivered_after_all() {
        let mut ring = ring(3);
        for seq in 0..3 {
            push(&mut ring, 0, record(seq, seq != 1));
        }
        let posted = live(&ring, 9);
        ring.doubt(Some(&posted));
        push(&mut ring, 0, record(3, true));
        push(&mut ring, 0, record(4, true));
        let account = |ring: &Ring| ring.accounts()[SENSORS[0]].clone();
        assert_eq!(
            account(&ring).dropped,
            BTreeMap::from([(RING_FULL.to_owned(), 1)])
        );
        assert_eq!(ring.acknowledge(&posted.items), 3);
        ring.doubt(None);
        assert_eq!(account(&ring).dropped, BTreeMap::new());
        assert_eq!(account(&ring).errors, BTreeMap::new());
        assert_eq!(
            (ring.acknowledged(SENSORS[0]), account(&ring).spooled),
            (2, 2)
        );
        // A second answer to the same post counts nothing.
        assert_eq!(ring.acknowledge(&posted.items), 0);
        assert_eq!(ring.acknowledged(SENSORS[0]), 2);
    }

    #[test]
    fn fault_kinds_beyond_the_limit_are_counted_together() {
        let mut ring = ring(1);
        for kind in 0..FAULT_KINDS_MAX + 5 {
            ring.count_fault(0, &kind.to_string());
        }
        let errors = &ring.accounts()[SENSORS[0]].errors;
        assert_eq!(
            (errors.len(), errors[OTHER_FAULTS]),
            (FAULT_KINDS_MAX + 1, 5)
        );
    }

    #[derive(Debug, Clone)]
    enum Action {
        Push {
            stream: usize,
            is_frame: bool,
            skip: u64,
        },
        Batch {
            records_max: usize,
        },
        Acknowledge {
            through: usize,
        },
        LoseTheAnswer {
            records_max: usize,
        },
        SetAside {
            records_max: usize,
        },
    }

    fn action() -> impl Strategy<Value = Action> {
        prop_oneof![
            6 => (0..2_usize, prop::bool::weighted(0.8), 0..3_u64)
                .prop_map(|(stream, is_frame, skip)| Action::Push { stream, is_frame, skip }),
            2 => (0..9_usize).prop_map(|records_max| Action::Batch { records_max }),
            2 => (0..60_usize).prop_map(|through| Action::Acknowledge { through }),
            1 => (0..9_usize).prop_map(|records_max| Action::LoseTheAnswer { records_max }),
            1 => (0..4_usize).prop_map(|records_max| Action::SetAside { records_max }),
        ]
    }

    proptest! {
        #[test]
        fn read_equals_acknowledged_plus_dropped_plus_spooled(
            limit in 1..12_usize,
            actions in prop::collection::vec(action(), 1..200),
        ) {
            let mut ring = ring(limit);
            let mut next = [0, 0];
            let mut read = [0, 0];
            let mut posted = live(&ring, 0);
            for action in actions {
                match action {
                    Action::Push { stream, is_frame, skip } => {
                        next[stream] += skip;
                        push(&mut ring, stream, record(next[stream], is_frame));
                        next[stream] += 1;
                        read[stream] += u64::from(is_frame);
                    }
                    Action::Batch { records_max } => {
                        posted = live(&ring, records_max);
                        prop_assert!(posted.items.len() <= records_max);
                        ring.doubt(None);
                    }
                    Action::LoseTheAnswer { records_max } => {
                        posted = live(&ring, records_max);
                        ring.doubt(Some(&posted));
                    }
                    Action::Acknowledge { through } => {
                        ring.acknowledge(posted.items.iter().take(through));
                    }
                    Action::SetAside { records_max } => {
                        let refused = live(&ring, records_max);
                        ring.set_aside(&refused.items, "refused-422");
                    }
                }
                prop_assert!(ring.len() <= limit);
                let everything = live(&ring, usize::MAX);
                prop_assert_eq!(everything.items.len(), ring.len());
                for (sensor, read) in SENSORS.iter().zip(read) {
                    let account = &ring.accounts()[*sensor];
                    let dropped: u64 = account.dropped.values().sum();
                    prop_assert_eq!(account.read, read);
                    prop_assert_eq!(account.read, ring.acknowledged(sensor) + dropped + account.spooled);
                    let held = everything.items.iter().filter(|item| item.is_frame() && item.stream.sensor == *sensor).count();
                    prop_assert_eq!(account.spooled, u64::try_from(held).unwrap());
                }
            }
        }
    }
}
