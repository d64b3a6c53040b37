//! What is not yet known to be durable, and the account of it: read = acknowledged + dropped + spooled, at every moment.

use crate::config::RING_FRAMES_MAX;
use grideye_frame::Reading;
use grideye_recording::Record;
use grideye_recording::wire::{Account, Acknowledgement, Batch, Gap, SensorBatch};
use std::collections::{BTreeMap, VecDeque};

/// The reason under which frames are dropped because the ring was full.
pub const RING_FULL: &str = "ring-full";
/// The count of rows of missing frames that were dropped, which are no frames that were read.
pub const ROWS_DROPPED: &str = "missing-rows-dropped";
/// Kinds of faults that one account tells apart at most; the rest are counted together.
pub const FAULT_KINDS_MAX: usize = 32;
/// The count of faults beyond [`FAULT_KINDS_MAX`] kinds.
pub const OTHER_FAULTS: &str = "other";

/// Records of all sensors of an agent, oldest out first when there are too many.
#[derive(Debug)]
pub struct Ring {
    limit: usize,
    len: usize,
    arrivals: u64,
    streams: Vec<Stream>,
}

#[derive(Debug)]
struct Stream {
    sensor: String,
    held: VecDeque<Held>,
    account: Account,
    acknowledged: u64,
    /// The highest number that was ever handed out in a batch: more than that no answer can vouch for.
    sent_through: Option<u64>,
}

#[derive(Debug)]
struct Held {
    arrival: u64,
    record: Record,
}

impl Stream {
    fn let_go(&mut self, record: &Record, reason: Option<&str>) {
        match (record.reading, reason) {
            (Reading::Frame(_), None) => {
                self.account.spooled -= 1;
                self.acknowledged += 1;
            }
            (Reading::Frame(_), Some(reason)) => {
                self.account.spooled -= 1;
                *self.account.dropped.entry(reason.to_owned()).or_default() += 1;
            }
            (Reading::NoData(_), None) => {}
            (Reading::NoData(_), Some(_)) => count(&mut self.account.errors, ROWS_DROPPED),
        }
    }
}

impl Ring {
    /// A ring for these sensors, holding up to `limit` records of all of them together (1 to [`RING_FRAMES_MAX`]).
    pub fn new(limit: usize, sensors: impl IntoIterator<Item = String>) -> Self {
        let stream = |sensor| Stream {
            sensor,
            held: VecDeque::new(),
            account: Account::default(),
            acknowledged: 0,
            sent_through: None,
        };
        Self {
            limit: limit.clamp(1, RING_FRAMES_MAX),
            len: 0,
            arrivals: 0,
            streams: sensors.into_iter().map(stream).collect(),
        }
    }

    /// Adds a record to the stream at this index, in the order in which the sensors were named. Returns how many
    /// records had to go for it.
    pub fn push(&mut self, stream: usize, record: Record) -> usize {
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
            record,
        });
        self.arrivals += 1;
        self.len += 1;
        self.drop_oldest_beyond_the_limit()
    }

    /// Counts a fault of this stream.
    pub fn count_fault(&mut self, stream: usize, kind: &str) {
        if let Some(stream) = self.streams.get_mut(stream) {
            count(&mut stream.account.errors, kind);
        }
    }

    /// The oldest records, at most `records_max` of them, with every sensor's account. They stay until acknowledged.
    pub fn batch(&mut self, device: &str, boot: &str, records_max: usize) -> Batch {
        let mut left = records_max;
        let mut counts = vec![0; self.streams.len()];
        while left > 0 {
            let next = |(index, stream): (usize, &Stream)| {
                let held = stream.held.get(counts.get(index).copied()?)?;
                Some((held.arrival, index))
            };
            let Some((_, oldest)) = self.streams.iter().enumerate().filter_map(next).min() else {
                break;
            };
            if let Some(count) = counts.get_mut(oldest) {
                *count += 1;
            }
            left -= 1;
        }
        let sensors = self.streams.iter_mut().zip(counts).map(|(stream, count)| {
            let frames: Vec<Record> = stream
                .held
                .iter()
                .take(count)
                .map(|held| held.record)
                .collect();
            stream.sent_through = frames
                .last()
                .map(|record| record.seq)
                .max(stream.sent_through);
            SensorBatch {
                sensor: stream.sensor.clone(),
                account: Some(stream.account.clone()),
                frames,
            }
        });
        Batch {
            device: device.to_owned(),
            boot: boot.to_owned(),
            t_sent_boot_ns: None,
            sensors: sensors.collect(),
        }
    }

    /// Lets go of what the collector has on disk: everything sent up to `durable_through`, but for the gaps. Returns how many
    /// records went.
    pub fn acknowledge(&mut self, answer: &Acknowledgement) -> usize {
        let mut freed = 0;
        for stream in &mut self.streams {
            let named = answer.durable_through.get(&stream.sensor).copied();
            let Some(through) =
                named.and_then(|named| stream.sent_through.map(|sent| sent.min(named)))
            else {
                continue;
            };
            let gaps: Vec<&Gap> = answer
                .gaps
                .iter()
                .filter(|gap| gap.sensor == stream.sensor)
                .collect();
            let is_durable = |seq: u64| {
                seq <= through && !gaps.iter().any(|gap| (gap.from..=gap.to).contains(&seq))
            };
            freed += remove(stream, None, is_durable);
        }
        self.len -= freed;
        freed
    }

    /// Sets a batch aside that the collector refuses for ever: its records are dropped and counted under `reason`, so
    /// that the rest can go on. Returns how many records went.
    pub fn set_aside(&mut self, batch: &Batch, reason: &str) -> usize {
        let mut freed = 0;
        for refused in &batch.sensors {
            if let Some(stream) = self
                .streams
                .iter_mut()
                .find(|stream| stream.sensor == refused.sensor)
            {
                let is_refused = |seq: u64| refused.frames.iter().any(|record| record.seq == seq);
                freed += remove(stream, Some(reason), is_refused);
            }
        }
        self.len -= freed;
        freed
    }

    /// Records held.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether nothing waits for the collector.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Every sensor's account.
    #[must_use]
    pub fn accounts(&self) -> BTreeMap<String, Account> {
        let named = |stream: &Stream| (stream.sensor.clone(), stream.account.clone());
        self.streams.iter().map(named).collect()
    }

    /// Frames of this sensor that the collector has on disk.
    #[must_use]
    pub fn acknowledged(&self, sensor: &str) -> u64 {
        let stream = self.streams.iter().find(|stream| stream.sensor == sensor);
        stream.map_or(0, |stream| stream.acknowledged)
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
            if let Some(held) = stream.held.pop_front() {
                stream.let_go(&held.record, Some(RING_FULL));
            }
            self.len -= 1;
            dropped += 1;
        }
        dropped
    }
}

fn remove(stream: &mut Stream, reason: Option<&str>, goes: impl Fn(u64) -> bool) -> usize {
    let held = std::mem::take(&mut stream.held);
    let before = held.len();
    for held in held {
        if goes(held.record.seq) {
            stream.let_go(&held.record, reason);
        } else {
            stream.held.push_back(held);
        }
    }
    before - stream.held.len()
}

fn count(counts: &mut BTreeMap<String, u64>, kind: &str) {
    let is_known = counts.contains_key(kind) || counts.len() < FAULT_KINDS_MAX;
    let kind = if is_known { kind } else { OTHER_FAULTS };
    *counts.entry(kind.to_owned()).or_default() += 1;
}

#[cfg(test)]
mod tests {
    use super::*;
    use grideye_frame::{NoData, PIXELS, PixelWord, RawFrame, ThermistorWord};
    use grideye_recording::{ClockState, Stamp};
    use proptest::prelude::*;

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
        Ring::new(limit, SENSORS.map(String::from))
    }

    fn answer(sensor: &str, through: u64, gaps: &[(u64, u64)]) -> Acknowledgement {
        let gap = |(from, to): &(u64, u64)| Gap {
            sensor: sensor.to_owned(),
            from: *from,
            to: *to,
        };
        Acknowledgement {
            durable_through: BTreeMap::from([(sensor.to_owned(), through)]),
            gaps: gaps.iter().map(gap).collect(),
        }
    }

    fn seqs(batch: &Batch) -> Vec<Vec<u64>> {
        let of = |sensor: &SensorBatch| sensor.frames.iter().map(|record| record.seq).collect();
        batch.sensors.iter().map(of).collect()
    }

    #[test]
    fn a_full_ring_drops_the_oldest_of_all_sensors_and_says_so() {
        let mut ring = ring(3);
        for (stream, seq) in [(0, 0), (1, 0), (0, 1)] {
            assert_eq!(ring.push(stream, record(seq, true)), 0);
        }
        assert_eq!(ring.push(1, record(1, true)), 1);
        assert_eq!(ring.push(1, record(2, false)), 1);
        let accounts = ring.accounts();
        assert_eq!(
            accounts[SENSORS[0]].dropped,
            BTreeMap::from([(RING_FULL.to_owned(), 1)])
        );
        assert_eq!(
            accounts[SENSORS[1]].dropped,
            BTreeMap::from([(RING_FULL.to_owned(), 1)])
        );
        assert_eq!(seqs(&ring.batch("pi", "b", 10)), [vec![1], vec![1, 2]]);
        assert_eq!(ring.push(0, record(2, true)), 1);
        assert_eq!(ring.push(0, record(3, true)), 1);
        assert_eq!(ring.push(0, record(4, true)), 1);
        assert_eq!(
            ring.accounts()[SENSORS[1]].errors,
            BTreeMap::from([(ROWS_DROPPED.to_owned(), 1)])
        );
    }

    #[test]
    fn a_batch_takes_the_oldest_of_all_sensors_and_no_more_than_asked() {
        let mut ring = ring(100);
        for (stream, seq) in [(0, 0), (0, 1), (1, 0), (0, 2), (1, 1)] {
            ring.push(stream, record(seq, true));
        }
        assert_eq!(seqs(&ring.batch("pi", "b", 3)), [vec![0, 1], vec![0]]);
        assert!(seqs(&ring.batch("pi", "b", 0)).iter().all(Vec::is_empty));
        assert_eq!(ring.len(), 5);
    }

    #[test]
    fn gaps_stay_and_an_answer_cannot_vouch_for_what_was_never_sent() {
        let mut ring = ring(100);
        for seq in 0..6 {
            ring.push(0, record(seq, true));
        }
        assert_eq!(ring.acknowledge(&answer(SENSORS[0], 5, &[])), 0);
        ring.batch("pi", "b", 4);
        assert_eq!(ring.acknowledge(&answer(SENSORS[0], 999, &[(1, 2)])), 2);
        assert_eq!(seqs(&ring.batch("pi", "b", 10))[0], [1, 2, 4, 5]);
        assert_eq!(ring.acknowledged(SENSORS[0]), 2);
        assert_eq!(ring.acknowledge(&answer("i2c-7:0x69", 9, &[])), 0);
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
            stream: usize,
            through: u64,
            gap: (u64, u64),
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
            2 => (0..2_usize, 0..60_u64, (0..60_u64, 0..5_u64))
                .prop_map(|(stream, through, (from, more))| Action::Acknowledge { stream, through, gap: (from, from + more) }),
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
            for action in actions {
                match action {
                    Action::Push { stream, is_frame, skip } => {
                        next[stream] += skip;
                        ring.push(stream, record(next[stream], is_frame));
                        next[stream] += 1;
                        read[stream] += u64::from(is_frame);
                    }
                    Action::Batch { records_max } => {
                        let batch = ring.batch("pi", "b", records_max);
                        prop_assert!(seqs(&batch).iter().map(Vec::len).sum::<usize>() <= records_max);
                    }
                    Action::Acknowledge { stream, through, gap } => {
                        ring.acknowledge(&answer(SENSORS[stream], through, &[gap]));
                    }
                    Action::SetAside { records_max } => {
                        let batch = ring.batch("pi", "b", records_max);
                        ring.set_aside(&batch, "refused-422");
                    }
                }
                prop_assert!(ring.len() <= limit);
                let everything = ring.batch("pi", "b", usize::MAX);
                prop_assert_eq!(seqs(&everything).iter().map(Vec::len).sum::<usize>(), ring.len());
                for (index, sensor) in SENSORS.iter().enumerate() {
                    let account = &ring.accounts()[*sensor];
                    let dropped: u64 = account.dropped.values().sum();
                    prop_assert_eq!(account.read, read[index]);
                    prop_assert_eq!(account.read, ring.acknowledged(sensor) + dropped + account.spooled);
                    let held = everything.sensors[index].frames.iter();
                    let held = held.filter(|record| record.reading.frame().is_some()).count();
                    prop_assert_eq!(account.spooled, u64::try_from(held).unwrap());
                }
            }
        }
    }
}
