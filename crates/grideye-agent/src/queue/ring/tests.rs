//! The ring's account is right whatever is added or removed.

use super::*;
use crate::spool::{Content, SPOOL_FULL};
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
    assert_eq!(seqs(&ring.batch(Lane::Backlog, now, 9))[0], [0, 1, 2]);
    assert_eq!(seqs(&ring.batch(Lane::Backlog, now, 2))[0], [0, 1]);
    assert_eq!(seqs(&ring.batch(Lane::Live, now, 9))[0], [3, 4]);
    ring.deliver_in_order(true);
    assert!(ring.batch(Lane::Live, now, 9).items.is_empty());
    assert_eq!(ring.batch(Lane::Backlog, now, 9).items.len(), 3);
    ring.deliver_in_order(false);
    assert_eq!(ring.batch(Lane::Live, now, 9).items.len(), 2);
}

#[test]
fn a_record_dropped_while_its_post_was_in_doubt_counts_as_delivered_once_it_arrived() {
    let mut ring = ring(3);
    for seq in 0..3 {
        push(&mut ring, 0, record(seq, seq != 1));
    }
    let posted = live(&ring, 9);
    push(&mut ring, 0, record(3, true));
    push(&mut ring, 0, record(4, true));
    let account = |ring: &Ring| ring.accounts()[SENSORS[0]].clone();
    assert_eq!(account(&ring).dropped, one(RING_FULL));
    assert_eq!(ring.settle(posted.items.clone(), None), []);
    assert_eq!(account(&ring).dropped, BTreeMap::new());
    assert_eq!(account(&ring).errors, BTreeMap::new());
    assert_eq!(ring.acknowledged(SENSORS[0]), 2);
    assert_eq!(account(&ring).spooled, 2);
    // A second answer to the same post counts nothing.
    assert_eq!(ring.settle(posted.items, None), []);
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

/// Three records of two sensors, received at 0, 1 and 2 s.
fn three() -> Ring {
    let mut ring = ring(9);
    for (second, stream, seq, is_frame) in [(0, 1, 7, true), (1, 0, 3, false), (2, 1, 8, true)] {
        let record = record(seq, is_frame);
        assert_eq!(ring.push(stream, record, Duration::from_secs(second)), 0);
    }
    ring
}

/// Sensor and sequence number of each record handed to the disk at second `now`, once the oldest is `older_than` seconds
/// old.
fn claim(
    ring: &mut Ring,
    now: u64,
    older_than: u64,
    records_max: usize,
) -> Vec<(&'static str, u64)> {
    let (now, older_than) = (Duration::from_secs(now), Duration::from_secs(older_than));
    let items = ring.claim(now, older_than, records_max).into_iter();
    let sensor = |item: &Item| SENSORS.iter().find(|name| **name == item.stream.sensor);
    let named = items.map(|item| (*sensor(&item).unwrap(), item.record.seq));
    named.collect()
}

/// Writes the oldest records that are not on the disk.
fn write(ring: &mut Ring, records: usize) -> Vec<Item> {
    let items = ring.claim(Duration::MAX, Duration::ZERO, records);
    ring.written(&items);
    items
}

fn evict(ring: &mut Ring, now: u64) -> [Vec<u64>; 2] {
    ring.evict(Duration::from_secs(now), Duration::from_secs(5));
    seqs(&live(ring, 9))
}

#[test]
fn unwritten_records_are_written_oldest_first_once_one_is_old_enough() {
    let mut ring = three();
    let all = [(SENSORS[1], 7), (SENSORS[0], 3), (SENSORS[1], 8)];
    assert_eq!(claim(&mut ring, 4, 5, 9), []);
    assert_eq!(claim(&mut ring, 5, 5, 9), all);
    assert_eq!(claim(&mut ring, 5, 5, 2), all[..2]);
    // A write that failed claims them again.
    ring.written(&[]);
    assert_eq!(claim(&mut ring, 5, 5, 9), all);
    write(&mut ring, 2);
    assert_eq!(claim(&mut ring, 6, 5, 9), []);
    assert_eq!(claim(&mut ring, 7, 5, 9), all[2..]);
}

#[test]
fn only_old_records_on_the_disk_leave_memory() {
    let mut ring = three();
    write(&mut ring, 2);
    assert_eq!(evict(&mut ring, 4), [vec![3], vec![7, 8]]);
    let first = ring.first();
    assert_eq!(evict(&mut ring, 5), [vec![3], vec![8]]);
    assert_eq!(ring.first(), first + 1);
    assert_eq!(
        evict(&mut ring, 9),
        [vec![], vec![8]],
        "the rest is not on the disk"
    );
    // They stay in the account, because the disk has them.
    assert_eq!(ring.accounts()[SENSORS[1]].spooled, 2);
    write(&mut ring, 1);
    assert_eq!(evict(&mut ring, 7), [Vec::<u64>::new(), vec![]]);
    assert_eq!(ring.first(), first + 3);
    assert_eq!(ring.accounts()[SENSORS[1]].spooled, 2);
}

#[test]
fn a_record_in_a_post_that_left_memory_meanwhile_is_settled_on_the_disk() {
    let mut ring = three();
    let posted = live(&ring, 9);
    write(&mut ring, 2);
    evict(&mut ring, 9);
    let elsewhere = ring.settle(posted.items.clone(), None);
    assert_eq!(elsewhere, posted.items[..2]);
    assert_eq!(ring.acknowledged(SENSORS[1]), 1);
    ring.settle_from_disk(&elsewhere, None);
    assert_eq!(ring.acknowledged(SENSORS[1]), 2);
    assert_eq!(ring.accounts()[SENSORS[1]].spooled, 0);
}

#[test]
fn the_disk_hears_of_records_settled_while_and_after_it_writes_them_and_of_no_others() {
    let mut ring = three();
    let claimed = ring.claim(Duration::MAX, Duration::ZERO, 2);
    let posted = live(&ring, 9);
    ring.settle(posted.items[1..].to_vec(), None);
    ring.written(&claimed);
    assert_eq!(ring.take_settled(), posted.items[1..2]);
    ring.settle(posted.items[..1].to_vec(), None);
    assert_eq!(ring.take_settled(), posted.items[..1]);
    assert!(ring.is_empty());
}

#[test]
fn a_record_pushed_out_is_dropped_unless_the_disk_has_it() {
    let mut ring = ring(2);
    push(&mut ring, 0, record(0, true));
    push(&mut ring, 0, record(1, true));
    let written = write(&mut ring, 1);
    assert_eq!(push(&mut ring, 0, record(2, true)), 0);
    assert_eq!(push(&mut ring, 0, record(3, false)), 1);
    let account = |ring: &Ring| {
        let account = ring.accounts()[SENSORS[0]].clone();
        (account.spooled, account.dropped)
    };
    assert_eq!(account(&ring), (2, one(RING_FULL)));
    // While it is being written, it counts as dropped, and the disk hears of it.
    let claimed = ring.claim(Duration::MAX, Duration::ZERO, 1);
    assert_eq!(push(&mut ring, 0, record(4, true)), 1);
    assert_eq!(
        account(&ring),
        (2, BTreeMap::from([(RING_FULL.to_owned(), 2)]))
    );
    ring.written(&claimed);
    assert_eq!(ring.take_settled(), claimed);
    assert_eq!(
        ring.settle(written.clone(), None),
        written,
        "it is on the disk"
    );
}

#[test]
fn what_was_dropped_from_the_disk_leaves_memory_too_and_is_counted() {
    let mut ring = three();
    let written = write(&mut ring, 2);
    let dropped = |of: &Item, frames, rows| Dropped {
        stream: Arc::clone(&of.stream),
        content: Content { frames, rows },
        reason: SPOOL_FULL,
        before: written[1].position + 1,
    };
    ring.dropped_from_disk(&dropped(&written[0], 1, 0));
    ring.dropped_from_disk(&dropped(&written[1], 0, 1));
    assert_eq!(seqs(&live(&ring, 9)), [vec![], vec![8]]);
    let accounts = ring.accounts();
    assert_eq!(accounts[SENSORS[1]].dropped, one(SPOOL_FULL));
    assert_eq!(accounts[SENSORS[1]].spooled, 1);
    assert_eq!(accounts[SENSORS[0]].errors, one(ROWS_DROPPED));
    // A post with them had arrived.
    assert_eq!(ring.settle(written.clone(), None), written);
    ring.take_back(&written, &[SPOOL_FULL]);
    let accounts = ring.accounts();
    assert_eq!(accounts[SENSORS[1]].dropped, BTreeMap::new());
    assert_eq!(accounts[SENSORS[0]].errors, BTreeMap::new());
    assert_eq!(ring.acknowledged(SENSORS[1]), 1);
}

#[test]
fn rejected_records_are_dropped_under_their_reason_and_the_rest_acknowledged() {
    let mut ring = three();
    let posted = live(&ring, 9);
    for _ in 0..2 {
        ring.settle(posted.items[..2].to_vec(), Some("refused-422"));
        assert_eq!(ring.len(), 1);
    }
    ring.settle(posted.items[2..].to_vec(), None);
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
    SetAside(usize),
}

fn action() -> impl Strategy<Value = Action> {
    prop_oneof![
        6 => (0..2_usize, prop::bool::weighted(0.8), 0..3_u64)
            .prop_map(|(stream, is_frame, skip)| Action::Push(stream, is_frame, skip)),
        2 => (0..9_usize).prop_map(Action::Batch),
        2 => (0..60_usize).prop_map(Action::Acknowledge),
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
                }
                Action::Acknowledge(through) => {
                    // Each post has one answer, at once or after others of its records were dropped.
                    let items = std::mem::take(&mut posted.items).into_iter();
                    ring.settle(items.take(through).collect(), None);
                }
                Action::SetAside(records_max) => {
                    let refused = live(&ring, records_max);
                    ring.settle(refused.items, Some("refused-422"));
                    posted = live(&ring, 0);
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
