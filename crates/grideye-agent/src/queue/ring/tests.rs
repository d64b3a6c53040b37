//! The ring's account is right whatever is added or removed.

use super::*;
use grideye_frame::{NoData, PIXELS, PixelWord, RecordedFrame, ThermistorWord};
use grideye_recording::{ClockState, Stamp};
use proptest::prelude::*;

const SENSORS: [&str; 2] = ["i2c-1:0x68", "i2c-1:0x69"];

fn record(seq: u64, is_frame: bool) -> Record {
    let frame = RecordedFrame {
        thermistor: Some(ThermistorWord(400)),
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
fn one(reason: &str) -> BTreeMap<String, u64> {
    BTreeMap::from([(reason.to_owned(), 1)])
}

fn ring(limit: usize) -> Ring {
    Ring::new(limit, "pi", "b", SENSORS.map(String::from))
}

fn push(ring: &mut Ring, stream: usize, record: Record) -> usize {
    ring.push(stream, record, Duration::ZERO)
}

fn live(ring: &Ring, records_max: usize) -> Batch {
    ring.batch(Lane::Live, Duration::ZERO, records_max)
}

fn seqs(batch: &Batch) -> [Vec<u64>; 2] {
    let of = |sensor: &str| {
        let items = batch.items.iter();
        let of_sensor = items.filter(|item| item.stream.sensor == sensor);
        of_sensor.map(|item| item.record.seq).collect()
    };
    SENSORS.map(of)
}

#[test]
fn a_full_ring_drops_the_oldest_of_all_sensors_and_counts_them() {
    let mut ring = ring(3);
    for (stream, seq) in [(0, 0), (1, 0), (0, 1)] {
        assert_eq!(push(&mut ring, stream, record(seq, true)), 0);
    }
    assert_eq!(push(&mut ring, 1, record(1, true)), 1);
    assert_eq!(push(&mut ring, 1, record(2, false)), 1);
    for sensor in SENSORS {
        assert_eq!(ring.accounts()[sensor].dropped, one(RING_FULL), "{sensor}");
    }
    assert_eq!(seqs(&live(&ring, 10)), [vec![1], vec![1, 2]]);
    for seq in 2..5 {
        assert_eq!(push(&mut ring, 0, record(seq, true)), 1, "frame {seq}");
    }
    assert_eq!(ring.accounts()[SENSORS[1]].errors, one(ROWS_DROPPED));
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
fn old_records_have_their_own_lane() {
    let mut ring = ring(100);
    for seq in 0..5 {
        ring.push(0, record(seq, true), Duration::from_secs(seq));
    }
    let now = Duration::from_secs(2) + LIVE_FOR;
    assert_eq!(seqs(&ring.batch(Lane::Late, now, 9))[0], [0, 1, 2]);
    assert_eq!(seqs(&ring.batch(Lane::Late, now, 2))[0], [0, 1]);
    assert_eq!(seqs(&ring.batch(Lane::Live, now, 9))[0], [3, 4]);
}

#[test]
fn a_record_dropped_while_its_post_was_in_doubt_counts_as_delivered_once_it_arrived() {
    let mut ring = ring(3);
    for seq in 0..3 {
        push(&mut ring, 0, record(seq, seq != 1));
    }
    let posted = live(&ring, 9);
    ring.doubt(Some(&posted));
    push(&mut ring, 0, record(3, true));
    push(&mut ring, 0, record(4, true));
    let account = |ring: &Ring| ring.accounts()[SENSORS[0]].clone();
    assert_eq!(account(&ring).dropped, one(RING_FULL));
    assert_eq!(ring.settle(&posted.items, None), 3);
    ring.doubt(None);
    assert_eq!(account(&ring).dropped, BTreeMap::new());
    assert_eq!(account(&ring).errors, BTreeMap::new());
    assert_eq!(ring.acknowledged(SENSORS[0]), 2);
    assert_eq!(account(&ring).spooled, 2);
    // A second answer to the same post counts nothing.
    assert_eq!(ring.settle(&posted.items, None), 0);
    assert_eq!(ring.acknowledged(SENSORS[0]), 2);
}

#[test]
fn fault_kinds_beyond_the_limit_are_counted_together() {
    let mut ring = ring(1);
    for kind in 0..FAULT_KINDS_MAX + 5 {
        ring.count_fault(0, &kind.to_string());
    }
    let errors = &ring.accounts()[SENSORS[0]].errors;
    assert_eq!(errors.len(), FAULT_KINDS_MAX + 1);
    assert_eq!(errors[OTHER_FAULTS], 5);
}

fn place(segment: u64, from: u64) -> Place {
    Place {
        segment,
        from,
        to: from + 10,
        stream: 0,
    }
}

/// Three records of two sensors, received at 0, 1 and 2 s.
fn three() -> Ring {
    let mut ring = ring(9);
    for (second, stream, seq, is_frame) in [(0, 1, 7, true), (1, 0, 3, false), (2, 1, 8, true)] {
        let record = record(seq, is_frame);
        assert_eq!(ring.push(stream, record, Duration::from_secs(second)), 0);
    }
    ring
}

/// Sensor and sequence number of each record not on the disk, at second `now`, once the oldest is `older_than` seconds
/// old.
fn unwritten(ring: &Ring, now: u64, older_than: u64, records_max: usize) -> Vec<(String, u64)> {
    let (now, older_than) = (Duration::from_secs(now), Duration::from_secs(older_than));
    let records = ring.unwritten(now, older_than, records_max).into_iter();
    let named = records.map(|(id, record)| (id.sensor.clone(), record.seq));
    named.collect()
}

fn write(ring: &mut Ring, places: &[Place]) {
    let records = ring.unwritten(Duration::MAX, Duration::ZERO, places.len());
    ring.written(&records, places);
}

fn evictable(ring: &Ring, now: u64) -> Vec<(Place, bool)> {
    let found = ring.evictable(Duration::from_secs(now), Duration::from_secs(5));
    let found = found.iter().map(|found| (found.place, found.is_frame));
    found.collect()
}

#[test]
fn unwritten_records_are_written_oldest_first_once_one_is_old_enough() {
    let mut ring = three();
    let all = [(SENSORS[1], 7), (SENSORS[0], 3), (SENSORS[1], 8)];
    let all = all.map(|(sensor, seq)| (sensor.to_owned(), seq));
    assert_eq!(unwritten(&ring, 4, 5, 9), []);
    assert_eq!(unwritten(&ring, 5, 5, 9), all);
    assert_eq!(unwritten(&ring, 5, 5, 2), all[..2]);
    write(&mut ring, &[place(1, 24), place(1, 34)]);
    assert_eq!(ring.places(), BTreeSet::from([place(1, 24), place(1, 34)]));
    assert_eq!(unwritten(&ring, 6, 5, 9), []);
    assert_eq!(unwritten(&ring, 7, 5, 9), all[2..]);
}

#[test]
fn only_old_records_on_the_disk_and_in_no_post_in_doubt_leave_memory() {
    let mut ring = three();
    let [first, second, third] = [place(1, 24), place(1, 34), place(2, 24)];
    write(&mut ring, &[first, second, third]);
    assert_eq!(evictable(&ring, 4), []);
    assert_eq!(evictable(&ring, 5), [(first, true)]);
    assert_eq!(evictable(&ring, 6), [(first, true), (second, false)]);
    let posted = live(&ring, 1);
    ring.doubt(Some(&posted));
    assert_eq!(evictable(&ring, 7), [(second, false), (third, true)]);
    ring.doubt(None);
    let old = ring.evictable(Duration::from_secs(6), Duration::from_secs(5));
    ring.evict(&old);
    assert_eq!((ring.len(), ring.places()), (1, BTreeSet::from([third])));
    // They stay in the account, because the disk has them.
    assert_eq!(ring.accounts()[SENSORS[1]].spooled, 2);
    ring.unplace(&BTreeSet::from([1]));
    assert_eq!(ring.places(), BTreeSet::from([third]));
    ring.unplace(&BTreeSet::from([2]));
    assert_eq!(ring.places(), BTreeSet::new());
    assert_eq!(unwritten(&ring, 2, 0, 9), [(SENSORS[1].to_owned(), 8)]);
}

#[test]
fn a_record_pushed_out_to_the_disk_is_dropped_when_its_segment_is_gone() {
    let mut ring = ring(2);
    push(&mut ring, 0, record(0, true));
    push(&mut ring, 0, record(1, false));
    write(&mut ring, &[place(1, 24), place(2, 24)]);
    for seq in [2, 3] {
        assert_eq!(push(&mut ring, 0, record(seq, true)), 0);
    }
    let both = [(place(1, 24), true), (place(2, 24), false)];
    assert_eq!(evictable(&ring, 0), both);
    assert_eq!(ring.places(), BTreeSet::from(both.map(|(place, _)| place)));
    let account = |ring: &Ring| {
        let account = ring.accounts()[SENSORS[0]].clone();
        (account.spooled, account.dropped, account.errors)
    };
    let none = BTreeMap::new;
    assert_eq!(account(&ring), (3, none(), none()));
    ring.unplace(&BTreeSet::from([1]));
    assert_eq!(account(&ring), (2, one(RING_FULL), none()));
    ring.unplace(&BTreeSet::from([2]));
    assert_eq!(account(&ring), (2, one(RING_FULL), one(ROWS_DROPPED)));
}

#[test]
fn rejected_records_are_dropped_under_their_reason_and_the_rest_acknowledged() {
    let mut ring = three();
    let posted = live(&ring, 9);
    assert_eq!(ring.settle(&posted.items[..2], Some("refused-422")), 2);
    assert_eq!(ring.settle(&posted.items[..2], Some("refused-422")), 0);
    assert!(!ring.is_empty());
    assert_eq!(ring.settle(&posted.items, None), 1);
    assert!(ring.is_empty());
    let sensors = [SENSORS[0], SENSORS[1], "none"];
    assert_eq!(sensors.map(|sensor| ring.acknowledged(sensor)), [0, 1, 0]);
    let accounts = ring.stream_accounts().into_iter();
    let accounts = accounts.map(|(id, of)| (id.sensor.clone(), of.dropped, of.errors));
    let accounts: Vec<_> = accounts.collect();
    let none = BTreeMap::new;
    let row = (SENSORS[0].to_owned(), none(), one(ROWS_DROPPED));
    let frame = (SENSORS[1].to_owned(), one("refused-422"), none());
    assert_eq!(accounts, [row, frame]);
}

#[derive(Debug, Clone)]
enum Action {
    /// A frame or a missing frame of this stream, after skipping this many numbers.
    Push(usize, bool, u64),
    /// This many records.
    Batch(usize),
    Acknowledge(usize),
    LoseTheAnswer(usize),
    SetAside(usize),
}

fn action() -> impl Strategy<Value = Action> {
    prop_oneof![
        6 => (0..2_usize, prop::bool::weighted(0.8), 0..3_u64)
            .prop_map(|(stream, is_frame, skip)| Action::Push(stream, is_frame, skip)),
        2 => (0..9_usize).prop_map(Action::Batch),
        2 => (0..60_usize).prop_map(Action::Acknowledge),
        1 => (0..9_usize).prop_map(Action::LoseTheAnswer),
        1 => (0..4_usize).prop_map(Action::SetAside),
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
                Action::Push(stream, is_frame, skip) => {
                    next[stream] += skip;
                    push(&mut ring, stream, record(next[stream], is_frame));
                    next[stream] += 1;
                    read[stream] += u64::from(is_frame);
                }
                Action::Batch(records_max) => {
                    posted = live(&ring, records_max);
                    prop_assert!(posted.items.len() <= records_max);
                    ring.doubt(None);
                }
                Action::LoseTheAnswer(records_max) => {
                    posted = live(&ring, records_max);
                    ring.doubt(Some(&posted));
                }
                Action::Acknowledge(through) => {
                    ring.settle(posted.items.iter().take(through), None);
                }
                Action::SetAside(records_max) => {
                    let refused = live(&ring, records_max);
                    ring.settle(&refused.items, Some("refused-422"));
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
