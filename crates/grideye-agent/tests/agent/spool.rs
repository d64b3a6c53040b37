//! The spool over a disk that loses power, fills, fails and holds what others left there.

use crate::model_disk::{Failure, ModelDisk, Tear};
use grideye_agent::parcel::{Item, Parcel};
use grideye_agent::spool::segment::{Encoder, FRAME_BYTES};
use grideye_agent::spool::{Limits, QUARANTINE, READS_MAX, SPOOL_DAMAGED, SPOOL_FULL, Spool};
use grideye_frame::{NoData, PIXELS, PixelWord, RawFrame, Reading, ThermistorWord};
use grideye_recording::wire::{Account, Batch};
use grideye_recording::{ClockState, Record, Stamp, StreamId};
use proptest::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

const SENSORS: [&str; 2] = ["i2c-1:0x68", "i2c-1:0x69"];

fn stream(boot: &str, sensor: usize) -> Arc<StreamId> {
    Arc::new(StreamId {
        device: "pi".to_owned(),
        sensor: SENSORS[sensor].to_owned(),
        boot: boot.to_owned(),
    })
}

/// A record whose every part follows from its number.
pub(crate) fn record(seq: u64) -> Record {
    let word = |n: u64| u16::try_from(n % 4096).unwrap();
    let mut pixels = [PixelWord(0); PIXELS];
    for (index, pixel) in (0..).zip(&mut pixels) {
        *pixel = PixelWord(word(31 * seq + index));
    }
    let frame = RawFrame {
        thermistor: ThermistorWord(word(7 * seq)),
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

/// Opens the spool and looks at all that is on the disk.
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

/// Writes a group of one stream and puts it into the backlog. Returns the numbers that are durable.
fn spool_group(
    spool: &mut Spool,
    boot: &str,
    sensor: usize,
    seqs: std::ops::Range<u64>,
) -> Vec<u64> {
    let id = stream(boot, sensor);
    let records: Vec<_> = seqs
        .clone()
        .map(|seq| (Arc::clone(&id), record(seq)))
        .collect();
    let accounts = [(
        Arc::clone(&id),
        account(frames(0..seqs.end), frames(seqs.clone())),
    )];
    let written = spool.write(&records, &accounts);
    let durable: Vec<u64> = seqs.take(written.places.len()).collect();
    let items: Vec<_> = written
        .places
        .iter()
        .zip(&durable)
        .map(|(place, seq)| (*place, record(*seq).reading.frame().is_some()))
        .collect();
    assert!(spool.add_backlog(&items));
    durable
}

type Delivered = Vec<(String, String, u64)>;

/// Takes everything out, batch by batch, and checks every record.
fn drain(spool: &mut Spool, records_max: usize) -> Delivered {
    let mut delivered = Vec::new();
    while let Some(parcel) = spool.next_parcel(records_max).unwrap() {
        assert!(parcel.items.len() <= records_max);
        assert!(
            parcel
                .items
                .iter()
                .all(|item| item.stream.boot == parcel.boot)
        );
        delivered.extend(parcel.items.iter().map(checked));
        let (_, returned) = spool.release(parcel.items);
        assert!(returned.is_empty());
        spool.tidy(&BTreeSet::new(), false).unwrap();
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
fn what_was_written_comes_out_in_order_through_many_segments_and_leaves_no_file() {
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
fn the_next_run_delivers_what_is_left_first_and_speaks_for_the_run_that_ended() {
    let disk = ModelDisk::default();
    let mut spool = reopen(&disk, "b1");
    spool_group(&mut spool, "b1", 0, 0..30);
    let first = spool.next_parcel(10).unwrap().unwrap();
    spool.release(first.items);
    spool.checkpoint(&BTreeSet::new(), &[]).unwrap();
    drop(spool);

    let mut spool = open(&disk, "b2");
    // Until it is known what is there, nothing is said of it.
    assert!(!spool.is_recovered() && !spool.is_empty());
    assert_eq!(spool.next_parcel(10).unwrap(), None);
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
    // Its last records brought its account along, so nothing more is to be said.
    assert_eq!(spool.ended_run(), None);
}

#[test]
fn a_run_that_left_nothing_on_the_disk_is_told_of_all_the_same_and_only_once() {
    let disk = ModelDisk::default();
    drop(reopen(&disk, "b1"));
    let mut spool = reopen(&disk, "b2");
    let parcel = spool.ended_run().unwrap();
    assert_eq!((parcel.boot.as_str(), parcel.items.len()), ("b1", 0));
    assert_eq!(spool.ended_accounts("b1").unwrap().len(), 2);
    spool.told("b1");
    assert_eq!(spool.ended_run(), None);
    spool.checkpoint(&BTreeSet::new(), &[]).unwrap();
    // A run that ended with everything delivered needs nobody to speak for it.
    let accounts = [(stream("b2", 0), account(9, 0))];
    spool.close(&BTreeSet::new(), &accounts).unwrap();
    drop(spool);
    assert_eq!(reopen(&disk, "b3").ended_run(), None);
}

/// A short life of a spool: writes, deliveries, tidying. Returns what was durable, and what was delivered, when it ended.
fn live(disk: &ModelDisk) -> (Vec<u64>, Vec<u64>) {
    let (mut durable, mut delivered) = (Vec::new(), Vec::new());
    let sensors = SENSORS.map(String::from);
    let Ok(mut spool) = Spool::open(Box::new(disk.clone()), limits(), "pi", "b1", &sensors) else {
        return (durable, delivered);
    };
    let mut next = 0;
    for round in 0..6 {
        let group = spool_group(&mut spool, "b1", 0, next..next + 7);
        let is_whole = group.len() == 7;
        durable.extend(group);
        if !is_whole {
            return (durable, delivered);
        }
        next += 7;
        if round % 2 == 1 {
            let Ok(Some(parcel)) = spool.next_parcel(9) else {
                return (durable, delivered);
            };
            delivered.extend(parcel.items.iter().map(|item| item.record.seq));
            spool.release(parcel.items);
            if spool.tidy(&BTreeSet::new(), round == 3).is_err() {
                return (durable, delivered);
            }
        }
    }
    (durable, delivered)
}

#[test]
fn a_loss_of_power_at_any_moment_costs_nothing_that_was_durable_and_invents_nothing() {
    let whole = ModelDisk::default();
    live(&whole);
    let (mut losses, mut recovered, mut again) = (0, 0, 0);
    let tears = [0, 25, 50, 75, 99];
    let tears = tears
        .iter()
        .flat_map(|percent| [Tear::Cut(*percent), Tear::Zeros(*percent)]);
    let tears: Vec<Tear> = tears.chain([Tear::Lost, Tear::Kept]).collect();
    for dies_at in 0..=whole.operations() {
        for tear in &tears {
            for keeps_names in [false, true] {
                let disk = ModelDisk::default();
                disk.die_at(dies_at);
                let (durable, delivered) = live(&disk);
                disk.power_cycle(*tear, keeps_names);
                let mut spool = reopen(&disk, "b2");
                let found = of(&drain(&mut spool, 5), "b1", 0);
                let context =
                    format!("power lost at operation {dies_at}, {tear:?}, names {keeps_names}");
                let wanted: Vec<u64> = durable
                    .iter()
                    .copied()
                    .filter(|seq| !delivered.contains(seq))
                    .collect();
                assert!(
                    wanted.iter().all(|seq| found.contains(seq)),
                    "{context}: {wanted:?} {found:?}"
                );
                assert!(
                    found.windows(2).all(|pair| pair[0] < pair[1]),
                    "{context}: {found:?}"
                );
                assert!(found.iter().all(|seq| *seq < 42), "{context}: {found:?}");
                losses += 1;
                recovered += found.len();
                again += found.iter().filter(|seq| delivered.contains(seq)).count();
                // And the spool still works.
                spool_group(&mut spool, "b2", 1, 0..3);
                assert_eq!(drain(&mut spool, 5).len(), 3, "{context}");
                let left: Vec<String> = disk
                    .names()
                    .into_iter()
                    .filter(|name| !name.starts_with(QUARANTINE))
                    .collect();
                assert_eq!(left, ["state"], "{context}");
            }
        }
    }
    println!(
        "{losses} losses of power: {recovered} records recovered, of which {again} had been delivered before; durable and lost: 0"
    );
    assert!(losses > 500 && recovered > losses);
}

/// A segment cut at every byte of it: so also within every record and at every boundary.
#[test]
fn a_segment_that_is_cut_at_any_byte_gives_what_was_whole_and_the_rest_is_set_aside_by_name() {
    let mut encoder = Encoder::new(1);
    let mut bytes = encoder.header();
    let mut ends = Vec::new();
    for seq in 0..6 {
        encoder.record(&mut bytes, &stream("b1", 0), &record(seq));
        ends.push(bytes.len());
    }
    for cut in 0..bytes.len() {
        let disk = ModelDisk::default();
        disk.put("segment-0000000000000001", &bytes[..cut]);
        let mut spool = reopen(&disk, "b2");
        let whole = ends.iter().filter(|end| **end <= cut).count();
        let found = of(&drain(&mut spool, 100), "b1", 0);
        assert_eq!(found.len(), whole, "cut at byte {cut}");
        let is_torn = cut > 24 && !ends.contains(&cut);
        let aside = disk
            .names()
            .into_iter()
            .filter(|name| name.starts_with(QUARANTINE));
        let aside: Vec<String> = aside.collect();
        // Between the stream's declaration and the first record the cut is at a boundary as well.
        let declared = 24 + 8 + 3 + 3 + 2 + 2 + 10;
        assert_eq!(
            aside.is_empty(),
            !is_torn || cut == declared,
            "cut at byte {cut}: {aside:?}"
        );
        if let Some(name) = aside.first() {
            assert!(
                name.starts_with("quarantine/segment-0000000000000001-from-byte-"),
                "{name}"
            );
            assert!(bytes[..cut].ends_with(&disk.bytes(name)));
            let messages = spool.take_messages();
            assert!(
                messages
                    .iter()
                    .any(|message| message.contains("set aside as quarantine/segment-")),
                "{messages:?}"
            );
        }
    }
}

#[test]
fn damage_in_the_middle_costs_the_rest_of_its_segment_and_not_the_next_one() {
    let disk = ModelDisk::default();
    let mut spool = reopen(&disk, "b1");
    spool_group(&mut spool, "b1", 0, 0..60);
    drop(spool);
    let name = "segment-0000000000000002";
    let mut bytes = disk.bytes(name);
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    disk.put(name, &bytes);
    let mut spool = reopen(&disk, "b2");
    let found = of(&drain(&mut spool, 100), "b1", 0);
    let missing: Vec<u64> = (0..60).filter(|seq| !found.contains(seq)).collect();
    assert!(!missing.is_empty() && missing.len() < 12, "{missing:?}");
    assert!(
        missing.windows(2).all(|pair| pair[1] == pair[0] + 1),
        "{missing:?}"
    );
    assert!(found.contains(&59) && found.contains(&0));
}

#[test]
fn another_format_and_a_damaged_state_are_set_aside_with_a_message_and_the_rest_goes_on() {
    let disk = ModelDisk::default();
    let mut spool = reopen(&disk, "b1");
    spool_group(&mut spool, "b1", 0, 0..4);
    drop(spool);
    let mut newer = Encoder::new(9).header();
    newer[8] = 9;
    disk.put("segment-0000000000000009", &newer);
    disk.put(
        "segment-000000000000000a",
        b"GIF89a and so on, longer than a header",
    );
    disk.put("state", b"{\"version\": 0}");
    disk.put("notes.txt", b"somebody's own");
    let mut spool = reopen(&disk, "b2");
    let messages = spool.take_messages().join("\n");
    for said in [
        "segment-0000000000000009: format 9, and this version reads format 1; set aside as quarantine/segment-0000000000000009\nhint: ",
        "segment-000000000000000a: no header of a segment; set aside",
        "state is damaged, or of another version: set aside as quarantine/state",
    ] {
        assert!(messages.contains(said), "{messages}");
    }
    assert_eq!(of(&drain(&mut spool, 100), "b1", 0), [0, 1, 2, 3]);
    // Its number is not used again while a file of that number may come back.
    spool_group(&mut spool, "b2", 0, 0..1);
    assert!(
        disk.names()
            .contains(&"segment-000000000000000b".to_owned()),
        "{:?}",
        disk.names()
    );
    assert_eq!(disk.bytes("notes.txt"), b"somebody's own");
}

#[test]
fn a_full_spool_drops_the_oldest_and_counts_them_by_run() {
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
    // Not looked at yet, and counted all the same.
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
fn the_floor_of_free_space_is_kept_and_a_backlog_is_not_given_up_where_that_would_not_help() {
    let disk = ModelDisk::default();
    let careful = Limits {
        free_bytes_min: 5000,
        ..limits()
    };
    let sensors = SENSORS.map(String::from);
    let mut spool = Spool::open(Box::new(disk.clone()), careful, "pi", "b1", &sensors).unwrap();
    disk.leave_free(20_000);
    assert_eq!(spool_group(&mut spool, "b1", 0, 0..20).len(), 20);
    // Others have filled the disk: all our backlog would not make the floor.
    disk.leave_free(100);
    let records = [(stream("b1", 0), record(20))];
    let written = spool.write(&records, &[]);
    let error = written.error.unwrap();
    assert_eq!(error.kind(), std::io::ErrorKind::StorageFull);
    assert!(error.to_string().contains("100 bytes are free"), "{error}");
    assert!(spool.take_dropped().is_empty());
    // A little more, and the oldest makes the room.
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
        // Written once more, as they are still in memory: once is enough.
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
        assert!(spool.next_parcel(9).is_err());
    }
    disk.fail(None);
    assert!(
        spool.next_parcel(9).unwrap().is_some(),
        "a read that works again is no reason"
    );
    disk.fail(Some(Failure::Io));
    assert!(spool.next_parcel(9).is_err());
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
fn what_the_collector_refuses_is_kept_as_it_can_be_posted_and_the_rest_goes_on() {
    let disk = ModelDisk::default();
    {
        let mut spool = reopen(&disk, "b1");
        spool_group(&mut spool, "b1", 0, 0..3);
    }
    let mut spool = reopen(&disk, "b2");
    let parcel = spool.next_parcel(1).unwrap().unwrap();
    spool.set_aside(&parcel.items[0], "refused-422").unwrap();
    assert_eq!(of(&drain(&mut spool, 9), "b1", 0), [1, 2]);
    let line = disk.bytes("quarantine/refused-b1.jsonl");
    let batch = Batch::from_json(
        line.strip_suffix(b"\n").unwrap(),
        &grideye_recording::wire::Limits::default(),
    )
    .unwrap();
    assert_eq!(
        (batch.boot.as_str(), batch.sensors[0].frames[0]),
        ("b1", record(0))
    );
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
    let posted: Parcel = spool.next_parcel(5).unwrap().unwrap();
    spool_group(&mut spool, "b1", 0, 5..40);
    let dropped: u64 = spool
        .take_dropped()
        .iter()
        .map(|dropped| dropped.content.frames)
        .sum();
    assert!(dropped >= 5);
    let (delivered, returned) = spool.release(posted.items);
    assert_eq!((delivered.len(), returned.len()), (0, 5));
}

// ---- against a model ---------------------------------------------------------------------------------------------

#[derive(Debug, Clone)]
enum Action {
    Write { sensor: usize, records: u64 },
    Deliver { records_max: usize },
    Tidy { keeps_writing: bool },
    Fail(Option<usize>),
    LosePower { tear: usize, keeps_names: bool },
    Kill,
}

const TEARS: [Tear; 5] = [
    Tear::Lost,
    Tear::Kept,
    Tear::Cut(40),
    Tear::Zeros(70),
    Tear::Cut(99),
];
const FAILURES: [Failure; 4] = [Failure::Full, Failure::ReadOnly, Failure::Sync, Failure::Io];

fn action() -> impl Strategy<Value = Action> {
    prop_oneof![
        8 => (0..2_usize, 1..25_u64).prop_map(|(sensor, records)| Action::Write { sensor, records }),
        6 => (1..30_usize).prop_map(|records_max| Action::Deliver { records_max }),
        4 => any::<bool>().prop_map(|keeps_writing| Action::Tidy { keeps_writing }),
        1 => prop::option::of(0..FAILURES.len()).prop_map(Action::Fail),
        2 => (0..TEARS.len(), any::<bool>()).prop_map(|(tear, keeps_names)| Action::LosePower { tear, keeps_names }),
        2 => Just(Action::Kill),
    ]
}

/// What the model knows of one run and sensor: what must come out, and what may.
#[derive(Debug, Default)]
struct Model {
    next: u64,
    durable: BTreeSet<u64>,
    written: BTreeSet<u64>,
    delivered: BTreeMap<u64, u32>,
    order: Vec<u64>,
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]
    #[test]
    fn nothing_durable_is_lost_nothing_is_invented_and_the_order_stays(
        actions in prop::collection::vec(action(), 1..60),
    ) {
        let disk = ModelDisk::default();
        let mut runs = 1;
        let mut boot = "b1".to_owned();
        let mut spool = reopen(&disk, &boot);
        let mut models: BTreeMap<(String, usize), Model> = BTreeMap::new();
        let mut is_failing = false;
        for action in actions {
            match action {
                Action::Write { sensor, records } => {
                    let model = models.entry((boot.clone(), sensor)).or_default();
                    // What a failed write left in memory is written again.
                    let from = model.durable.last().map_or(0, |last| last + 1);
                    let to = from + records;
                    model.written.extend(from..to);
                    model.next = to;
                    model.durable.extend(spool_group(&mut spool, &boot, sensor, from..to));
                }
                Action::Deliver { records_max } => {
                    if let Ok(Some(parcel)) = spool.next_parcel(records_max) {
                        for item in &parcel.items {
                            let (boot, sensor, seq) = checked(item);
                            let sensor = SENSORS.iter().position(|name| *name == sensor).unwrap();
                            let model = models.get_mut(&(boot, sensor)).unwrap();
                            prop_assert!(model.written.contains(&seq));
                            *model.delivered.entry(seq).or_default() += 1;
                            model.order.push(seq);
                        }
                        let (_, returned) = spool.release(parcel.items);
                        prop_assert!(returned.is_empty());
                    }
                }
                Action::Tidy { keeps_writing } => {
                    let _ = spool.tidy(&BTreeSet::new(), keeps_writing);
                }
                Action::Fail(failure) => {
                    // Reads that fail give segments up, which is another test's subject.
                    let failure = failure.map(|index| FAILURES[index]).filter(|failure| *failure != Failure::Io);
                    is_failing = failure.is_some();
                    disk.fail(failure);
                }
                Action::LosePower { tear, keeps_names } => {
                    drop(spool);
                    disk.power_cycle(TEARS[tear], keeps_names);
                    is_failing = false;
                    runs += 1;
                    boot = format!("b{runs}");
                    spool = reopen(&disk, &boot);
                }
                Action::Kill => {
                    drop(spool);
                    runs += 1;
                    boot = format!("b{runs}");
                    spool = reopen(&disk, &boot);
                }
            }
            prop_assert!(spool.bytes() <= limits().bytes_max);
        }
        if is_failing {
            disk.fail(None);
        }
        for (boot, sensor, seq) in drain(&mut spool, 9) {
            let sensor = SENSORS.iter().position(|name| *name == sensor).unwrap();
            let model = models.get_mut(&(boot, sensor)).unwrap();
            *model.delivered.entry(seq).or_default() += 1;
            model.order.push(seq);
        }
        for (stream, model) in &models {
            for seq in &model.durable {
                prop_assert!(model.delivered.contains_key(seq), "{:?}: {} is lost", stream, seq);
            }
            // A start may send again what was delivered before it, from some point on, and then all of it in order.
            let back = model.order.windows(2).filter(|pair| pair[1] <= pair[0]).count();
            prop_assert!(back < runs, "{:?}: {:?}", stream, model.order);
        }
        prop_assert_eq!(spool.waiting_frames(), (0, 0));
        prop_assert!(FRAME_BYTES > 128);
    }
}
