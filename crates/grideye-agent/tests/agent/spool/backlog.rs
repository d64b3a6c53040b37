//! Which records on the disk wait, and which of them are sent.

use super::*;

#[test]
fn only_records_that_were_put_into_the_backlog_are_sent() {
    let disk = ModelDisk::default();
    let mut spool = reopen(&disk, "b1");
    let id = stream("b1", 0);
    let records: Vec<_> = (0..5).map(|seq| (Arc::clone(&id), record(seq))).collect();
    let accounts = [(id, account(frames(0..5), frames(0..5)))];
    let places = spool.write(&records, &accounts).places;
    // The collector took those between as they were read.
    let waiting = [0, 4].map(|seq: usize| {
        let is_frame = records[seq].1.reading.frame().is_some();
        (places[seq], is_frame)
    });
    assert!(spool.add_backlog(&waiting));
    assert_eq!(of(&drain(&mut spool, 10), "b1", 0), [0, 4]);
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
