//! A disk that loses power, and files on it that are not the spool's.

use super::*;

/// A short life of a spool: writes, deliveries, tidying. Returns the durable and the delivered numbers at its end.
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
            let Ok(Some(batch)) = next_batch(&mut spool, 9) else {
                return (durable, delivered);
            };
            delivered.extend(batch.items.iter().map(|item| item.record.seq));
            spool.release(batch.items, None);
            if spool.tidy(round == 3).is_err() {
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
                let context =
                    format!("power lost at operation {dies_at}, {tear:?}, names {keeps_names}");
                let messages = spool.take_messages().join("\n");
                assert!(
                    !messages.contains("state is damaged"),
                    "{context}: {messages}"
                );
                let found = of(&drain(&mut spool, 5), "b1", 0);
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

/// A segment cut at every byte: within every record and at every boundary.
#[test]
fn a_segment_cut_at_any_byte_delivers_complete_records_and_sets_the_rest_aside() {
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
        // The cut is also at a boundary between the stream's declaration and the first record.
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
fn a_segment_whose_removal_did_not_reach_the_disk_is_removed_and_not_sent_again() {
    let disk = ModelDisk::default();
    let mut spool = reopen(&disk, "b1");
    spool_group(&mut spool, "b1", 0, 0..60);
    let name = "segment-0000000000000001";
    let bytes = disk.bytes(name);
    assert_eq!(drain(&mut spool, 100).len(), 60);
    drop(spool);
    disk.put(name, &bytes);
    let mut spool = reopen(&disk, "b2");
    assert_eq!(drain(&mut spool, 100), Delivered::new());
    assert_eq!(disk.names(), ["state"]);
}

/// Records that could not be synced are written again, so two segments contain them, and the first copy may not be
/// durable.
#[test]
fn unsynced_records_of_an_earlier_boot_are_synced_before_their_other_copy_goes() {
    let disk = ModelDisk::default();
    let mut spool = reopen(&disk, "b1");
    disk.fail(Some(Failure::Sync));
    assert_eq!(spool_group(&mut spool, "b1", 0, 0..9), Vec::<u64>::new());
    disk.fail(None);
    assert_eq!(spool_group(&mut spool, "b1", 0, 0..3), [0, 1, 2]);
    drop(spool);
    let mut spool = reopen(&disk, "b2");
    spool.tidy(false).unwrap();
    drop(spool);
    disk.power_cycle(Tear::Lost, false);
    let found = of(&drain(&mut reopen(&disk, "b3"), 100), "b1", 0);
    assert!(found.starts_with(&[0, 1, 2]), "{found:?}");
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
fn a_damaged_header_and_a_damaged_state_are_set_aside_with_a_message_and_the_rest_goes_on() {
    let disk = ModelDisk::default();
    let mut spool = reopen(&disk, "b1");
    spool_group(&mut spool, "b1", 0, 0..4);
    drop(spool);
    let mut flipped = Encoder::new(9).header();
    flipped[8] ^= 8;
    disk.put("segment-0000000000000009", &flipped);
    disk.put(
        "segment-000000000000000a",
        b"GIF89a and so on, longer than a header",
    );
    disk.put("state", b"{\"version\": 0}");
    disk.put("notes.txt", b"somebody's own");
    let mut spool = reopen(&disk, "b2");
    let messages = spool.take_messages().join("\n");
    for said in [
        "segment-0000000000000009: no header of a segment; set aside as quarantine/segment-0000000000000009",
        "segment-000000000000000a: no header of a segment; set aside",
        "state is damaged: set aside as quarantine/state",
    ] {
        assert!(messages.contains(said), "{messages}");
    }
    assert_eq!(of(&drain(&mut spool, 100), "b1", 0), [0, 1, 2, 3]);
    // Its number is not reused while a file of that number may return.
    spool_group(&mut spool, "b2", 0, 0..1);
    assert!(
        disk.names()
            .contains(&"segment-000000000000000b".to_owned()),
        "{:?}",
        disk.names()
    );
    assert_eq!(disk.bytes("notes.txt"), b"somebody's own");
}
