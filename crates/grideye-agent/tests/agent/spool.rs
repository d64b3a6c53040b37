//! The spool on a disk that loses power, fills, fails and contains foreign files.

mod backlog;
mod bad_disks;
mod layouts;
mod model;
mod power;
mod segment;

use crate::model_disk::{Failure, ModelDisk, Tear};
use grideye_agent::batch::{Batch, Item, OWN_FIRST};
use grideye_agent::spool::segment::{Encoder, FRAME_BYTES};
use grideye_agent::spool::{Limits, QUARANTINE, READS_MAX, SPOOL_DAMAGED, SPOOL_FULL, Spool};
use grideye_frame::{NoData, PIXELS, PixelWord, Reading, RecordedFrame, ThermistorWord};
use grideye_recording::wire::{self, Account};
use grideye_recording::{ClockState, Record, Stamp, StreamId};
use proptest::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

const SENSORS: [&str; 2] = ["i2c-1:0x68", "i2c-1:0x69"];

fn stream(boot: &str, sensor: usize) -> Arc<StreamId> {
    Arc::new(StreamId {
        device: "pi".to_owned(),
        sensor: SENSORS[sensor].to_owned(),
        boot: boot.to_owned(),
    })
}

/// A record derived from its number.
pub(crate) fn record(seq: u64) -> Record {
    let word = |n: u64| u16::try_from(n % 4096).unwrap();
    let mut pixels = [PixelWord(0); PIXELS];
    for (index, pixel) in (0..).zip(&mut pixels) {
        *pixel = PixelWord(word(31 * seq + index));
    }
    let frame = RecordedFrame {
        thermistor: Some(ThermistorWord(word(7 * seq))),
        pixels,
    };
    Record {
        seq,
        stamp: Stamp {
            t_boot_ns: seq * 100_000_000,
            t_utc_ns: -5,
            clock: ClockState::Unsynced,
        },
        reading: if seq % 10 == 7 {
            Reading::NoData(NoData::Nack)
        } else {
            Reading::Frame(frame)
        },
    }
}

fn frames(seqs: impl IntoIterator<Item = u64>) -> u64 {
    seqs.into_iter()
        .filter(|seq| seq % 10 != 7)
        .count()
        .try_into()
        .unwrap()
}

fn limits() -> Limits {
    Limits {
        bytes_max: 1 << 20,
        free_bytes_min: 0,
        segment_bytes: 2000,
    }
}

fn open(disk: &ModelDisk, boot: &str) -> Spool {
    let sensors = SENSORS.map(String::from);
    Spool::open(Box::new(disk.clone()), limits(), "pi", boot, &sensors).unwrap()
}

/// Opens the spool and reads everything on the disk.
fn reopen(disk: &ModelDisk, boot: &str) -> Spool {
    let mut spool = open(disk, boot);
    while spool.recover() {}
    spool
}

fn account(read: u64, spooled: u64) -> Account {
    Account {
        read,
        spooled,
        ..Account::default()
    }
}

/// These records of one stream, next in the log.
fn items(boot: &str, sensor: usize, seqs: std::ops::Range<u64>) -> Vec<Item> {
    static NEXT: AtomicU64 = AtomicU64::new(OWN_FIRST);
    let id = stream(boot, sensor);
    // Other tests take some between, as another sensor would.
    let item = |seq| {
        let position = NEXT.fetch_add(1, Ordering::SeqCst);
        Item::new(position, Arc::clone(&id), record(seq))
    };
    seqs.map(item).collect()
}

/// Writes records of one stream. Returns the durable numbers.
fn spool_group(
    spool: &mut Spool,
    boot: &str,
    sensor: usize,
    seqs: std::ops::Range<u64>,
) -> Vec<u64> {
    let accounts = [(
        stream(boot, sensor),
        account(frames(0..seqs.end), frames(seqs.clone())),
    )];
    let written = spool.write(&items(boot, sensor, seqs.clone()), &accounts);
    seqs.take(written.records).collect()
}

/// The next batch, whatever is in memory.
fn next_batch(spool: &mut Spool, records_max: usize) -> std::io::Result<Option<Batch>> {
    spool.next_batch(records_max, u64::MAX)
}

type Delivered = Vec<(String, String, u64)>;

/// Delivers everything batch by batch, checking every record.
fn drain(spool: &mut Spool, records_max: usize) -> Delivered {
    let mut delivered = Vec::new();
    while let Some(batch) = next_batch(spool, records_max).unwrap() {
        assert!(batch.items.len() <= records_max);
        assert!(
            batch
                .items
                .iter()
                .all(|item| item.stream.boot == batch.boot)
        );
        delivered.extend(batch.items.iter().map(checked));
        let (_, returned) = spool.release(batch.items, None);
        assert!(returned.is_empty());
        spool.tidy(false).unwrap();
    }
    delivered
}

fn checked(item: &Item) -> (String, String, u64) {
    assert_eq!(item.record, record(item.record.seq), "bytes as read");
    (
        item.stream.boot.clone(),
        item.stream.sensor.clone(),
        item.record.seq,
    )
}

fn of(delivered: &Delivered, boot: &str, sensor: usize) -> Vec<u64> {
    let wanted = |entry: &&(String, String, u64)| entry.0 == boot && entry.1 == SENSORS[sensor];
    delivered
        .iter()
        .filter(wanted)
        .map(|entry| entry.2)
        .collect()
}

#[test]
fn records_come_out_in_order_through_many_segments_and_leave_no_file() {
    let disk = ModelDisk::default();
    let mut spool = reopen(&disk, "b1");
    for group in 0..10 {
        spool_group(&mut spool, "b1", 0, 10 * group..10 * group + 10);
        spool_group(&mut spool, "b1", 1, 5 * group..5 * group + 5);
    }
    assert!(disk.names().len() > 8, "{:?}", disk.names());
    assert_eq!(spool.waiting_frames(), (frames(0..100) + frames(0..50), 0));
    let delivered = drain(&mut spool, 7);
    assert_eq!(of(&delivered, "b1", 0), (0..100).collect::<Vec<_>>());
    assert_eq!(of(&delivered, "b1", 1), (0..50).collect::<Vec<_>>());
    assert_eq!(spool.waiting_frames(), (0, 0));
    assert_eq!(disk.names(), ["state"]);
}

#[test]
fn the_next_boot_delivers_the_rest_first_and_reports_for_the_ended_boot() {
    let disk = ModelDisk::default();
    let mut spool = reopen(&disk, "b1");
    spool_group(&mut spool, "b1", 0, 0..30);
    let first = next_batch(&mut spool, 10).unwrap().unwrap();
    spool.release(first.items, None);
    spool.checkpoint(&[]).unwrap();
    drop(spool);

    let mut spool = open(&disk, "b2");
    // Until the disk has been read, nothing is sent.
    assert!(!spool.is_empty());
    assert_eq!(next_batch(&mut spool, 10).unwrap(), None);
    assert_eq!(spool.ended_run(), None);
    while spool.recover() {}
    spool_group(&mut spool, "b2", 0, 0..5);
    assert_eq!(spool.waiting_frames(), (frames(0..5), frames(10..30)));
    let ended = spool.ended_accounts("b1").unwrap();
    let account = &ended[SENSORS[0]];
    assert_eq!(
        (account.read, account.spooled, account.ended),
        (frames(0..30), frames(10..30), true)
    );
    assert_eq!(spool.ended_accounts("b2"), None);
    let delivered = drain(&mut spool, 100);
    assert_eq!(delivered.len(), 25);
    assert_eq!(of(&delivered, "b1", 0), (10..30).collect::<Vec<_>>());
    assert_eq!(delivered[0].0, "b1");
    // Its last records brought its account along, so no report remains.
    assert_eq!(spool.ended_run(), None);
}

/// The state is not written with every write, so a boot's counts also precede its frames.
#[test]
fn the_counts_of_a_killed_boot_are_read_from_its_segments() {
    let disk = ModelDisk::default();
    let mut spool = reopen(&disk, "b1");
    spool_group(&mut spool, "b1", 0, 0..30);
    drop(spool);
    let spool = reopen(&disk, "b2");
    let account = &spool.ended_accounts("b1").unwrap()[SENSORS[0]];
    assert_eq!(
        (account.read, account.spooled),
        (frames(0..30), frames(0..30))
    );
}

#[test]
fn a_boot_that_left_nothing_on_the_disk_is_reported_exactly_once() {
    let disk = ModelDisk::default();
    drop(reopen(&disk, "b1"));
    let mut spool = reopen(&disk, "b2");
    let batch = spool.ended_run().unwrap();
    assert_eq!((batch.boot.as_str(), batch.items.len()), ("b1", 0));
    assert_eq!(spool.ended_accounts("b1").unwrap().len(), 2);
    spool.told("b1");
    assert_eq!(spool.ended_run(), None);
    spool.checkpoint(&[]).unwrap();
    drop(spool);
    // So is one that delivered everything: the collector may have lost it since.
    let mut spool = reopen(&disk, "b3");
    assert_eq!(spool.ended_run().unwrap().boot, "b2");
    spool.told("b2");
    assert_eq!(spool.ended_run(), None);
}

#[test]
fn a_start_after_a_kill_needs_the_records_that_were_in_memory_and_on_the_disk() {
    let disk = ModelDisk::default();
    let mut spool = reopen(&disk, "b1");
    let records = items("b1", 0, 0..9);
    assert_eq!(spool.write(&records, &[]).records, 9);
    // The first four are acknowledged, the others wait in memory.
    let (here, _) = spool.release(records[..4].to_vec(), None);
    assert_eq!(here.len(), 4);
    spool.tidy(true).unwrap();
    spool.checkpoint(&[]).unwrap();
    drop(spool);
    let mut spool = reopen(&disk, "b2");
    assert_eq!(of(&drain(&mut spool, 100), "b1", 0), [4, 5, 6, 7, 8]);
}

#[test]
fn a_boot_that_ended_normally_with_frames_left_is_reported() {
    let disk = ModelDisk::default();
    let mut spool = reopen(&disk, "b1");
    let accounts = [(stream("b1", 0), account(9, 3))];
    spool.checkpoint(&accounts).unwrap();
    drop(spool);
    let spool = reopen(&disk, "b2");
    assert_eq!(spool.ended_run().unwrap().boot, "b1");
    assert_eq!(spool.ended_accounts("b1").unwrap()[SENSORS[0]].read, 9);
}

/// The cursor must move before a segment is removed. Otherwise the next boot's segment would reuse the number, and the
/// old cursor would skip part of it.
#[test]
fn a_cursor_into_a_removed_segment_costs_the_next_boot_nothing() {
    let disk = ModelDisk::default();
    let mut spool = reopen(&disk, "b1");
    spool_group(&mut spool, "b1", 0, 0..9);
    let first = next_batch(&mut spool, 6).unwrap().unwrap();
    spool.release(first.items, None);
    spool.checkpoint(&[]).unwrap();
    assert_eq!(drain(&mut spool, 100).len(), 3);
    drop(spool);
    let mut spool = reopen(&disk, "b2");
    spool_group(&mut spool, "b2", 0, 0..9);
    drop(spool);
    let mut spool = reopen(&disk, "b3");
    let found = of(&drain(&mut spool, 100), "b2", 0);
    assert_eq!(found, (0..9).collect::<Vec<_>>());
}

#[test]
fn a_rejected_record_is_stored_ready_to_post_and_the_rest_goes_on() {
    let disk = ModelDisk::default();
    {
        let mut spool = reopen(&disk, "b1");
        spool_group(&mut spool, "b1", 0, 0..3);
    }
    let mut spool = reopen(&disk, "b2");
    let batch = next_batch(&mut spool, 1).unwrap().unwrap();
    spool.quarantine(&batch.items[0]).unwrap();
    spool.release(batch.items, Some("refused-422"));
    let account = &spool.ended_accounts("b1").unwrap()[SENSORS[0]];
    assert_eq!((account.dropped["refused-422"], account.spooled), (1, 2));
    assert_eq!(of(&drain(&mut spool, 9), "b1", 0), [1, 2]);
    let line = disk.bytes("quarantine/refused-b1.jsonl");
    let batch = wire::Batch::from_json(line.strip_suffix(b"\n").unwrap()).unwrap();
    assert_eq!(
        (batch.boot.as_str(), batch.sensors[0].frames[0]),
        ("b1", record(0))
    );
}
