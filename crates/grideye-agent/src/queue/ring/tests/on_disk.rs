//! Records that are in memory and on the disk, and how they leave either.

use super::*;

fn place(segment: u64, from: u64) -> Place {
    Place {
        segment,
        from,
        to: from + 10,
        stream: 0,
    }
}

/// Three records of two sensors, which came at 0, 1 and 2 s.
fn three() -> Ring {
    let mut ring = ring(9);
    for (second, stream, seq, is_frame) in [(0, 1, 7, true), (1, 0, 3, false), (2, 1, 8, true)] {
        let record = record(seq, is_frame);
        assert_eq!(ring.push(stream, record, Duration::from_secs(second)), 0);
    }
    ring
}

/// Sensor and number of what is on no disk yet, at a second, once one of it is so many seconds old.
fn unwritten(ring: &Ring, now: u64, older_than: u64, records_max: usize) -> Vec<(String, u64)> {
    let (now, older_than) = (Duration::from_secs(now), Duration::from_secs(older_than));
    let records = ring.unwritten(now, older_than, records_max);
    records
        .into_iter()
        .map(|(id, record)| (id.sensor.clone(), record.seq))
        .collect()
}

fn write(ring: &mut Ring, places: &[Place]) {
    let records = ring.unwritten(Duration::MAX, Duration::ZERO, places.len());
    ring.written(&records, places);
}

fn evictable(ring: &Ring, now: u64) -> Vec<(Place, bool)> {
    let found = ring.evictable(Duration::from_secs(now), Duration::from_secs(5));
    found
        .iter()
        .map(|found| (found.place, found.is_frame))
        .collect()
}

#[test]
fn what_is_on_no_disk_is_written_oldest_first_once_one_of_it_is_old_enough() {
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
fn only_what_is_old_on_the_disk_and_in_no_doubt_leaves_the_memory() {
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
    // They stay in the account, for the disk has them.
    assert_eq!(ring.accounts()[SENSORS[1]].spooled, 2);
    ring.unplace(&BTreeSet::from([1]));
    assert_eq!(ring.places(), BTreeSet::from([third]));
    ring.unplace(&BTreeSet::from([2]));
    assert_eq!(ring.places(), BTreeSet::new());
    assert_eq!(unwritten(&ring, 2, 0, 9), [(SENSORS[1].to_owned(), 8)]);
}

#[test]
fn what_a_full_ring_lets_go_to_the_disk_is_dropped_when_its_segment_is_gone() {
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
    let account = |ring: &Ring| ring.accounts()[SENSORS[0]].clone();
    assert_eq!(
        (account(&ring).spooled, account(&ring).dropped),
        (3, BTreeMap::new())
    );
    ring.unplace(&BTreeSet::from([1]));
    let dropped = BTreeMap::from([(RING_FULL.to_owned(), 1)]);
    assert_eq!(
        (account(&ring).spooled, account(&ring).dropped),
        (2, dropped.clone())
    );
    assert_eq!(account(&ring).errors, BTreeMap::new());
    ring.unplace(&BTreeSet::from([2]));
    assert_eq!(
        (account(&ring).spooled, account(&ring).dropped),
        (2, dropped)
    );
    let rows = BTreeMap::from([(ROWS_DROPPED.to_owned(), 1)]);
    assert_eq!(account(&ring).errors, rows);
}

#[test]
fn what_the_collector_refuses_is_dropped_under_its_reason_and_the_rest_acknowledged_by_sensor() {
    let mut ring = three();
    let posted = live(&ring, 9);
    assert_eq!(ring.drop_refused(&posted.items[..2], "refused-422"), 2);
    assert_eq!(ring.drop_refused(&posted.items[..2], "refused-422"), 0);
    assert!(!ring.is_empty());
    assert_eq!(ring.acknowledge(&posted.items), 1);
    assert!(ring.is_empty());
    let sensors = [SENSORS[0], SENSORS[1], "none"];
    assert_eq!(sensors.map(|sensor| ring.acknowledged(sensor)), [0, 1, 0]);
    let accounts: Vec<_> = ring
        .stream_accounts()
        .into_iter()
        .map(|(id, account)| (id.sensor.clone(), account.dropped, account.errors))
        .collect();
    let refused = BTreeMap::from([("refused-422".to_owned(), 1)]);
    let rows = BTreeMap::from([(ROWS_DROPPED.to_owned(), 1)]);
    assert_eq!(
        accounts,
        [
            (SENSORS[0].to_owned(), BTreeMap::new(), rows),
            (SENSORS[1].to_owned(), refused, BTreeMap::new()),
        ]
    );
}
