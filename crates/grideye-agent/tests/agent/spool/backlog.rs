//! Which records on the disk wait, and which of them are sent.

use super::*;
use grideye_agent::spool::RUNS_AHEAD_MAX;

#[test]
fn only_records_that_wait_are_sent() {
    let disk = ModelDisk::default();
    let mut spool = reopen(&disk, "b1");
    let records = items("b1", 0, 0..5);
    let accounts = [(stream("b1", 0), account(frames(0..5), frames(0..5)))];
    assert_eq!(spool.write(&records, &accounts).records, 5);
    // The collector took those between as they were read.
    let (here, gone) = spool.release(records[1..4].to_vec(), None);
    assert_eq!((here.len(), gone.len()), (3, 0));
    let (here, gone) = spool.release(records[1..2].to_vec(), None);
    assert_eq!((here.len(), gone.len()), (0, 1), "once");
    assert_eq!(spool.waiting_frames(), (2, 0));
    assert_eq!(of(&drain(&mut spool, 10), "b1", 0), [0, 4]);
}

#[test]
fn records_that_memory_still_has_are_not_read_from_the_disk() {
    let disk = ModelDisk::default();
    let mut spool = reopen(&disk, "b1");
    let records = items("b1", 0, 0..5);
    assert_eq!(spool.write(&records, &[]).records, 5);
    // Not even looked at: a disk that cannot be read costs nothing that is in memory.
    disk.fail(Some(Failure::Io));
    for _ in 0..2 * READS_MAX {
        assert_eq!(spool.next_batch(9, records[0].position).unwrap(), None);
    }
    disk.fail(None);
    let batch = spool.next_batch(9, records[3].position).unwrap().unwrap();
    assert_eq!(batch.items.len(), 3);
    spool.release(batch.items, None);
    assert_eq!(spool.next_batch(9, records[3].position).unwrap(), None);
    assert_eq!(of(&drain(&mut spool, 10), "b1", 0), [3, 4]);
}

#[test]
fn a_log_with_many_gaps_asks_for_delivery_in_order_until_it_has_fewer() {
    let disk = ModelDisk::default();
    let large = Limits::new(1 << 30, 0);
    let sensors = SENSORS.map(String::from);
    let mut spool = Spool::open(Box::new(disk), large, "pi", "b1", &sensors).unwrap();
    let gaps = u64::try_from(RUNS_AHEAD_MAX).unwrap();
    let records = items("b1", 0, 0..2 * gaps + 1);
    assert_eq!(spool.write(&records, &[]).records, records.len());
    let ahead: Vec<Item> = records.iter().skip(1).step_by(2).cloned().collect();
    spool.release(ahead[1..].to_vec(), None);
    assert!(!spool.is_scattered());
    spool.release(ahead[..1].to_vec(), None);
    assert!(spool.is_scattered());
    let batch = next_batch(&mut spool, 10).unwrap().unwrap();
    spool.release(batch.items, None);
    next_batch(&mut spool, 10).unwrap().unwrap();
    assert!(!spool.is_scattered());
    let expected: Vec<u64> = (0..=2 * gaps).step_by(2).skip(10).collect();
    assert_eq!(of(&drain(&mut spool, 1000), "b1", 0), expected);
}

#[test]
fn a_held_boot_is_not_sent_until_retried_and_the_next_boot_is() {
    let disk = ModelDisk::default();
    spool_group(&mut reopen(&disk, "b1"), "b1", 0, 0..3);
    let mut spool = reopen(&disk, "b2");
    spool_group(&mut spool, "b2", 0, 0..2);
    assert_eq!(spool.hold("b1"), frames(0..3));
    let delivered = drain(&mut spool, 10);
    assert!(of(&delivered, "b1", 0).is_empty());
    assert_eq!(of(&delivered, "b2", 0), [0, 1]);
    assert!(spool.try_held());
    assert_eq!(of(&drain(&mut spool, 10), "b1", 0), [0, 1, 2]);
    assert!(!spool.try_held(), "nothing is held now");
}

#[test]
fn a_spool_that_was_just_opened_knows_how_many_bytes_its_segments_have() {
    let disk = ModelDisk::default();
    for boot in ["b1", "b2"] {
        spool_group(&mut reopen(&disk, boot), boot, 0, 0..9);
    }
    let segments = disk.names().into_iter().filter(|name| name != "state");
    let bytes: usize = segments.map(|name| disk.bytes(&name).len()).sum();
    assert!(bytes > 0);
    assert_eq!(open(&disk, "b3").bytes(), u64::try_from(bytes).unwrap());
}
