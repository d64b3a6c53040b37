//! A disk that fills, fails, and cannot be read.

use super::*;
use grideye_agent::config::SpoolMode;
use grideye_agent::deliver::{SPOOL_SLOW, Spooler};
use grideye_agent::limits::SYNC_MAX;
use grideye_agent::log::{Level, Log};
use grideye_agent::queue::Ring;
use grideye_agent::queue::Shared;
use std::sync::Mutex;
use std::time::Duration;

#[test]
fn a_full_spool_drops_the_oldest_and_counts_them_by_boot() {
    let disk = ModelDisk::default();
    let small = Limits {
        bytes_max: 8000,
        ..limits()
    };
    let sensors = SENSORS.map(String::from);
    let mut spool = Spool::open(Box::new(disk.clone()), small, "pi", "b1", &sensors).unwrap();
    spool_group(&mut spool, "b1", 0, 0..20);
    drop(spool);
    let mut spool = Spool::open(Box::new(disk.clone()), small, "pi", "b2", &sensors).unwrap();
    // Not read yet, but counted.
    for group in 0..6 {
        let seqs = 10 * group..10 * group + 10;
        assert_eq!(spool_group(&mut spool, "b2", 0, seqs).len(), 10);
    }
    assert!(spool.bytes() <= small.bytes_max);
    while spool.recover() {}
    let dropped = spool.take_dropped();
    let count = |boot: &str| -> u64 {
        let of_boot = dropped.iter().filter(|dropped| dropped.stream.boot == boot);
        of_boot.map(|dropped| dropped.content.frames).sum()
    };
    assert!(dropped.iter().all(|dropped| dropped.reason == SPOOL_FULL));
    assert_eq!(count("b1"), frames(0..20));
    assert_eq!(
        spool.ended_accounts("b1").unwrap()[SENSORS[0]].dropped[SPOOL_FULL],
        frames(0..20)
    );
    let found = of(&drain(&mut spool, 100), "b2", 0);
    assert_eq!(frames(found.iter().copied()) + count("b2"), frames(0..60));
    let first = found[0];
    assert_eq!(found, (first..60).collect::<Vec<_>>(), "the oldest went");
    assert!(first > 0);
}

#[test]
fn free_space_is_kept_and_a_backlog_is_not_dropped_in_vain() {
    let disk = ModelDisk::default();
    let careful = Limits {
        free_bytes_min: 5000,
        ..limits()
    };
    let sensors = SENSORS.map(String::from);
    let mut spool = Spool::open(Box::new(disk.clone()), careful, "pi", "b1", &sensors).unwrap();
    disk.leave_free(20_000);
    assert_eq!(spool_group(&mut spool, "b1", 0, 0..20).len(), 20);
    // Other files filled the disk: dropping our whole backlog would not reach the minimum.
    disk.leave_free(100);
    let records = items("b1", 0, 20..21);
    let written = spool.write(&records, &[]);
    let error = written.error.unwrap();
    assert_eq!(error.kind(), std::io::ErrorKind::StorageFull);
    assert!(error.to_string().contains("100 bytes are free"), "{error}");
    assert!(spool.take_dropped().is_empty());
    // With a little more space, dropping the oldest is enough.
    disk.leave_free(4900);
    let written = spool.write(&records, &[]);
    assert!(
        written.error.is_some(),
        "this model's free space does not grow"
    );
    assert!(!spool.take_dropped().is_empty());
}

#[test]
fn a_disk_that_fails_costs_nothing_that_is_still_in_memory_and_works_again_when_it_works() {
    for failure in [Failure::Full, Failure::ReadOnly, Failure::Sync, Failure::Io] {
        let disk = ModelDisk::default();
        let mut spool = reopen(&disk, "b1");
        spool_group(&mut spool, "b1", 0, 0..5);
        disk.fail(Some(failure));
        assert_eq!(
            spool_group(&mut spool, "b1", 0, 5..15),
            Vec::<u64>::new(),
            "{failure:?}"
        );
        assert_eq!(
            spool_group(&mut spool, "b1", 0, 5..20),
            Vec::<u64>::new(),
            "{failure:?}"
        );
        disk.fail(None);
        // Write again what is still in memory: once is enough.
        spool_group(&mut spool, "b1", 0, 5..20);
        drop(spool);
        let mut spool = reopen(&disk, "b2");
        assert_eq!(
            spool.ended_accounts("b1").unwrap()[SENSORS[0]].spooled,
            frames(0..20),
            "{failure:?}"
        );
        assert_eq!(
            of(&drain(&mut spool, 4), "b1", 0),
            (0..20).collect::<Vec<_>>(),
            "{failure:?}"
        );
    }
}

#[test]
fn a_segment_that_cannot_be_read_is_set_aside_after_some_attempts_and_the_rest_goes_on() {
    let disk = ModelDisk::default();
    let mut spool = reopen(&disk, "b1");
    let group = spool_group(&mut spool, "b1", 0, 0..30);
    assert_eq!(group.len(), 30);
    disk.fail(Some(Failure::Io));
    for _ in 1..READS_MAX {
        assert!(next_batch(&mut spool, 9).is_err());
    }
    disk.fail(None);
    assert!(
        next_batch(&mut spool, 9).unwrap().is_some(),
        "a read that works again is no reason"
    );
    disk.fail(Some(Failure::Io));
    assert!(next_batch(&mut spool, 9).is_err());
    disk.fail(None);
    let lost: u64 = spool
        .take_dropped()
        .iter()
        .map(|dropped| {
            assert_eq!(dropped.reason, SPOOL_DAMAGED);
            dropped.content.frames
        })
        .sum();
    let found = of(&drain(&mut spool, 9), "b1", 0);
    assert_eq!(frames(found.iter().copied()) + lost, frames(0..30));
    assert!(lost > 0 && found.last() == Some(&29));
}

#[test]
fn the_dropped_part_of_a_post_in_doubt_comes_back_into_the_count() {
    let disk = ModelDisk::default();
    let small = Limits {
        bytes_max: 4000,
        ..limits()
    };
    let sensors = SENSORS.map(String::from);
    let mut spool = Spool::open(Box::new(disk), small, "pi", "b1", &sensors).unwrap();
    spool_group(&mut spool, "b1", 0, 0..5);
    let posted: Batch = next_batch(&mut spool, 5).unwrap().unwrap();
    spool_group(&mut spool, "b1", 0, 5..40);
    let dropped: u64 = spool
        .take_dropped()
        .iter()
        .map(|dropped| dropped.content.frames)
        .sum();
    assert!(dropped >= 5);
    let (delivered, returned) = spool.release(posted.items, None);
    assert_eq!((delivered.len(), returned.len()), (0, 5));
}

#[test]
fn a_record_acknowledged_while_its_segment_was_dropped_does_not_count_as_dropped() {
    let disk = ModelDisk::default();
    let small = Limits {
        bytes_max: 4000,
        ..limits()
    };
    let sensors = SENSORS.map(String::from);
    let mut spool = Spool::open(Box::new(disk), small, "pi", "b1", &sensors).unwrap();
    let first = items("b1", 0, 0..5);
    assert_eq!(spool.write(&first, &[]).records, 5);
    spool_group(&mut spool, "b1", 0, 5..40);
    // The answer comes before the agent heard what the write dropped.
    let (here, gone) = spool.release(first[..2].to_vec(), None);
    assert_eq!((here.len(), gone.len()), (2, 0));
    let dropped = spool.take_dropped();
    let frames_of = dropped.iter().map(|dropped| dropped.content.frames);
    let found = of(&drain(&mut spool, 100), "b1", 0);
    let left = frames(found.iter().copied());
    assert_eq!(frames_of.sum::<u64>() + 2 + left, frames(0..40));
}

#[test]
fn the_dropped_part_of_an_ended_boots_post_in_doubt_comes_back_too() {
    let disk = ModelDisk::default();
    let small = Limits {
        bytes_max: 4000,
        ..limits()
    };
    let sensors = SENSORS.map(String::from);
    let mut spool = Spool::open(Box::new(disk.clone()), small, "pi", "b1", &sensors).unwrap();
    spool_group(&mut spool, "b1", 0, 0..5);
    drop(spool);
    let mut spool = Spool::open(Box::new(disk), small, "pi", "b2", &sensors).unwrap();
    while spool.recover() {}
    let posted = next_batch(&mut spool, 5).unwrap().unwrap();
    spool_group(&mut spool, "b2", 0, 0..40);
    let dropped = |spool: &Spool| {
        let accounts = spool.ended_accounts("b1").unwrap();
        accounts[SENSORS[0]].dropped[SPOOL_FULL]
    };
    assert_eq!(dropped(&spool), 5);
    let one = posted.items.into_iter().take(1).collect();
    assert_eq!(spool.release(one, None).1.len(), 1);
    assert_eq!(dropped(&spool), 4);
    // The post carried another count, so the boot is reported once more.
    assert_eq!(spool.ended_run().unwrap().boot, "b1");
}

#[test]
fn a_disk_slower_than_the_limit_is_counted_and_logged_once_until_it_gets_worse() {
    let disk = ModelDisk::default();
    let ring = Ring::new(1000, "pi", "b1", SENSORS.map(String::from).to_vec());
    let shared = Arc::new(Shared::new(ring, Some(open(&disk, "b1"))));
    let lines: Arc<Mutex<Vec<String>>> = Arc::default();
    let written = Arc::clone(&lines);
    let log = Log::new(move |level, line| {
        assert_eq!(level, Level::Warning, "{line}");
        written.lock().unwrap().push(line.to_owned());
    });
    let mode = SpoolMode::Always {
        sync_every: Duration::from_secs(1),
    };
    let mut spooler = Spooler::new(Arc::clone(&shared), mode, log);
    let mut seqs = 0..;
    let mut write = |sync_takes: Duration, times: u32| {
        disk.slow_down(sync_takes);
        for seq in seqs.by_ref().take(usize::try_from(times).unwrap()) {
            let now = Duration::from_secs(seq);
            shared.with_ring(|ring| ring.push(1, record(seq), now));
            spooler.step(now);
        }
        let accounts = shared.with_ring(|ring| ring.accounts());
        // All sensors share the disk, including those without frames.
        SENSORS.map(|sensor| accounts[sensor].errors.get(SPOOL_SLOW).copied())
    };
    let slow = SYNC_MAX + Duration::from_millis(5);
    assert_eq!(write(Duration::ZERO, 20), [None; 2]);
    assert_eq!(write(slow, 1), [Some(1); 2]);
    assert_eq!(write(slow, 2), [Some(3); 2]);
    assert_eq!(write(Duration::ZERO, 20), [Some(3); 2]);
    assert_eq!(lines.lock().unwrap().len(), 1, "{lines:?}");
    assert_eq!(write(3 * slow, 1), [Some(4); 2]);
    let lines = lines.lock().unwrap();
    assert_eq!(lines.len(), 2, "{lines:?}");
    assert!(
        lines[0].starts_with("the spool's disk took 0.1"),
        "{lines:?}"
    );
    assert!(lines[1].contains("(limit: 0.125 s)\nhint: "));
}
