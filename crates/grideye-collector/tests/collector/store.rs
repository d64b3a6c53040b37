//! What every store must do, held against each one that there is.

use crate::batches::{account, batch, counted, flat, frame, missing, numbered, part};
use crate::postgres;
use grideye_collector::store::{Appended, Label, LabelSpan, Members, RecordingId, StoredRecord};
use grideye_collector::{
    FrameStore, Limits, PostgresStore, SqliteStore, StoreError, StoreLocation,
};
use grideye_frame::NoData;
use grideye_recording::wire::{Account, Acknowledgement, Batch, Gap, LOST_IN_MEMORY};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

/// Runs each check against each store.
macro_rules! conformance {
    ($($check:ident)+) => {
        mod in_memory {
            $(#[tokio::test]
            async fn $check() {
                super::$check(&super::open(&super::StoreLocation::Memory)).await;
            })+
        }

        mod in_a_file {
            $(#[tokio::test]
            async fn $check() {
                let folder = tempfile::tempdir().unwrap();
                super::$check(&super::open_in(folder.path())).await;
            })+
        }

        mod in_postgres {
            $(#[tokio::test]
            async fn $check() {
                if let Some(store) = super::open_database().await {
                    super::$check(&store).await;
                }
            })+
        }
    };
}

conformance! {
    frames_come_back_bit_for_bit
    a_frame_sent_again_changes_nothing
    the_same_key_with_other_content_is_refused_and_nothing_of_the_batch_is_kept
    every_field_of_a_frame_counts_as_content
    gaps_are_the_numbers_that_never_came
    gaps_close_from_both_sides_and_in_any_order
    of_many_gaps_the_newest_are_listed_and_all_are_counted
    boots_and_sensors_have_numbers_of_their_own
    the_highest_numbers_are_kept
    missing_frames_are_rows_with_their_reason
    the_books_balance_after_every_batch
    a_lost_frame_unbalances_the_books
    a_lost_answer_unbalances_the_books_only_until_the_next_count
    an_overtaken_count_does_not_replace_a_later_one
    a_run_that_has_ended_balances_and_stays_so
    a_recording_holds_what_arrives_between_start_and_stop
    a_frame_sent_again_during_a_recording_is_not_in_it
    recordings_are_ordered_by_device_sensor_boot_and_number
    a_span_is_read_in_pages
    a_running_recording_can_be_read
    names_are_taken_once
    a_recording_is_stopped_once
    a_note_is_kept_until_another_replaces_it
    labels_are_kept_in_their_order_until_they_are_taken_away
    streams_are_limited
    recordings_are_limited
    the_newest_record_is_that_of_the_stream_added_to_last
    many_at_once_are_all_kept
    the_room_taken_grows_with_what_is_kept
    a_closed_store_says_so
}

fn limits() -> Limits {
    Limits {
        gaps_listed_max: 3,
        streams_max: 6,
        recordings_max: 4,
        labels_max: 3,
        ..Limits::default()
    }
}

fn open(location: &StoreLocation) -> SqliteStore {
    SqliteStore::open(location, &limits()).unwrap()
}

fn open_in(folder: &Path) -> SqliteStore {
    open(&StoreLocation::File(folder.join("frames.sqlite")))
}

/// A store in a new database of a real PostgreSQL.
async fn open_database() -> Option<PostgresStore> {
    let cluster = postgres::shared("the store in PostgreSQL")?;
    let url = cluster.database().parse().unwrap();
    Some(PostgresStore::open(&url, &limits()).await.unwrap())
}

async fn append(store: &dyn FrameStore, batch: Batch) -> Appended {
    store.append(Arc::new(batch), 7).await.unwrap()
}

/// Gaps and the highest number, after a batch of one sensor.
fn gaps(appended: &Appended) -> (Option<u64>, Vec<(u64, u64)>, u64) {
    let stream = &appended.sensors[0].stream;
    let gaps = stream.gaps.iter().map(|gap| (gap.from, gap.to)).collect();
    (stream.durable_through, gaps, stream.never_came)
}

async fn everything(store: &dyn FrameStore, members: &Members) -> Vec<StoredRecord> {
    let mut records = Vec::new();
    for span in &members.spans {
        records.extend(store.page(span.clone(), None, 10_000).await.unwrap());
    }
    records
}

fn seqs(records: &[StoredRecord]) -> Vec<u64> {
    records.iter().map(|stored| stored.record.seq).collect()
}

async fn frames_come_back_bit_for_bit(store: &dyn FrameStore) {
    let recording = store.start_recording("all".to_owned(), 1).await.unwrap();
    let mut sent: Vec<_> = (0..5).map(frame).collect();
    // The four upper bits of a word have no meaning, and are kept all the same.
    sent.push(flat(5, 0xF7FF, 0xFFFF));
    append(store, batch("pi-1", "b1", vec![part("s1", sent.clone())])).await;
    let members = store.members(recording.id).await.unwrap();
    let kept = everything(store, &members).await;
    assert_eq!(
        kept.iter().map(|stored| stored.record).collect::<Vec<_>>(),
        sent
    );
    assert!(kept.iter().all(|stored| stored.t_arrival_ns == 7));
}

async fn a_frame_sent_again_changes_nothing(store: &dyn FrameStore) {
    let first = append(store, numbered(0..5)).await;
    assert_eq!(first.sensors[0].fresh.len(), 5);
    let before = store.streams().await.unwrap();
    for _ in 0..3 {
        let again = append(store, numbered(0..5)).await;
        assert!(again.sensors[0].fresh.is_empty());
        assert_eq!(
            again.acknowledgement().unwrap(),
            first.acknowledgement().unwrap()
        );
    }
    assert_eq!(store.streams().await.unwrap(), before);
    let partly = append(store, numbered(3..7)).await;
    assert_eq!(
        Vec::from_iter(partly.sensors[0].fresh.iter().copied()),
        [5, 6]
    );
    let twice_in_one = append(store, numbered([7, 7])).await;
    assert_eq!(twice_in_one.sensors[0].stream.stored, 8);
}

async fn the_same_key_with_other_content_is_refused_and_nothing_of_the_batch_is_kept(
    store: &dyn FrameStore,
) {
    append(store, numbered(0..3)).await;
    let before = store.streams().await.unwrap();
    let mut forged = numbered(0..5);
    forged.sensors.insert(0, part("s0", vec![frame(0)]));
    forged.sensors[1].frames[2] = flat(2, 80, 400);
    let error = store.append(Arc::new(forged), 8).await.unwrap_err();
    let text = error.to_string();
    assert!(
        matches!(error, StoreError::Conflict { seq: 2, ref sensor, .. } if sensor == "s1"),
        "{text}"
    );
    assert!(
        text.contains("s1") && text.contains("seq 2") && text.contains("hint: "),
        "{text}"
    );
    assert_eq!(store.streams().await.unwrap(), before);
}

async fn every_field_of_a_frame_counts_as_content(store: &dyn FrameStore) {
    append(store, numbered([0])).await;
    let original = frame(0);
    let mut changed = [original; 5];
    changed[0].stamp.t_boot_ns += 1;
    changed[1].stamp.t_utc_ns += 1;
    changed[2].stamp.clock = grideye_recording::ClockState::Stepped;
    changed[3].reading = missing(0, NoData::Nack).reading;
    changed[4].reading = original.reading.map(|mut raw| {
        raw.thermistor.0 ^= 1;
        raw
    });
    for (index, record) in changed.into_iter().enumerate() {
        let forged = batch("pi-1", "b1", vec![part("s1", vec![record])]);
        let error = store.append(Arc::new(forged), 8).await.unwrap_err();
        assert!(
            matches!(error, StoreError::Conflict { .. }),
            "{index}: {error}"
        );
    }
}

async fn gaps_are_the_numbers_that_never_came(store: &dyn FrameStore) {
    assert_eq!(
        gaps(&append(store, numbered(2..4)).await),
        (Some(3), vec![(0, 1)], 2)
    );
    let holes = append(store, numbered([4, 7, 9])).await;
    assert_eq!(gaps(&holes), (Some(9), vec![(0, 1), (5, 6), (8, 8)], 5));
    let answer = holes.acknowledgement().unwrap();
    let answer = Acknowledgement::from_json(&answer, &Default::default()).unwrap();
    assert_eq!(answer.durable_through["s1"], 9);
    let last = Gap {
        sensor: "s1".to_owned(),
        from: 8,
        to: 8,
    };
    assert_eq!(answer.gaps.last(), Some(&last));
}

async fn gaps_close_from_both_sides_and_in_any_order(store: &dyn FrameStore) {
    append(store, numbered([0, 9])).await;
    assert_eq!(
        gaps(&append(store, numbered([4])).await).1,
        [(1, 3), (5, 8)]
    );
    assert_eq!(
        gaps(&append(store, numbered([8])).await).1,
        [(1, 3), (5, 7)]
    );
    assert_eq!(
        gaps(&append(store, numbered([1])).await).1,
        [(2, 3), (5, 7)]
    );
    assert_eq!(gaps(&append(store, numbered([2, 3])).await).1, [(5, 7)]);
    assert_eq!(
        gaps(&append(store, numbered(5..8)).await),
        (Some(9), vec![], 0)
    );
    // Backwards, one by one: one run in the end, or the gap would be beyond those listed.
    for seq in (20..30).rev() {
        append(store, numbered([seq])).await;
    }
    assert_eq!(gaps(&append(store, numbered([30])).await).1, [(10, 19)]);
}

async fn of_many_gaps_the_newest_are_listed_and_all_are_counted(store: &dyn FrameStore) {
    let sparse = append(store, numbered((1..=6).map(|n| 2 * n))).await;
    assert_eq!(gaps(&sparse), (Some(12), vec![(7, 7), (9, 9), (11, 11)], 7));
}

async fn boots_and_sensors_have_numbers_of_their_own(store: &dyn FrameStore) {
    let two = vec![
        part("s1", vec![frame(0)]),
        part("s2", vec![flat(0, 80, 400)]),
    ];
    append(store, batch("pi-1", "b1", two)).await;
    append(
        store,
        batch("pi-1", "b2", vec![part("s1", vec![flat(0, 81, 400)])]),
    )
    .await;
    append(
        store,
        batch("pi-2", "b1", vec![part("s1", vec![flat(0, 82, 400)])]),
    )
    .await;
    let streams = store.streams().await.unwrap();
    let ids: Vec<_> = streams
        .iter()
        .map(|stream| {
            (
                &*stream.id.device,
                &*stream.id.sensor,
                &*stream.id.boot,
                stream.stored,
            )
        })
        .collect();
    assert_eq!(
        ids,
        [
            ("pi-1", "s1", "b1", 1),
            ("pi-1", "s1", "b2", 1),
            ("pi-1", "s2", "b1", 1),
            ("pi-2", "s1", "b1", 1)
        ]
    );
}

async fn the_highest_numbers_are_kept(store: &dyn FrameStore) {
    let top = grideye_recording::COUNT_MAX;
    let mut record = frame(0);
    record.seq = top;
    record.stamp.t_boot_ns = top;
    let sent = batch("pi-1", "b1", vec![part("s1", vec![record])]);
    let recording = store.start_recording("top".to_owned(), 1).await.unwrap();
    assert_eq!(
        gaps(&append(store, sent).await),
        (Some(top), vec![(0, top - 1)], top)
    );
    let members = store.members(recording.id).await.unwrap();
    let span = members.spans[0].clone();
    assert_eq!(
        store.page(span.clone(), None, 10).await.unwrap()[0].record,
        record
    );
    assert!(store.page(span, Some(top), 10).await.unwrap().is_empty());
    record.seq = top + 1;
    let error = store
        .append(
            Arc::new(batch("pi-1", "b1", vec![part("s1", vec![record])])),
            7,
        )
        .await;
    assert!(matches!(
        error,
        Err(StoreError::NumberTooLarge { field: "seq", .. })
    ));
}

async fn missing_frames_are_rows_with_their_reason(store: &dyn FrameStore) {
    let recording = store.start_recording("faults".to_owned(), 1).await.unwrap();
    let every: Vec<_> = (0..)
        .zip(NoData::ALL)
        .map(|(seq, reason)| missing(seq, *reason))
        .collect();
    let appended = append(store, batch("pi-1", "b1", vec![part("s1", every.clone())])).await;
    let stream = &appended.sensors[0].stream;
    assert_eq!(
        (stream.stored, stream.missing, stream.never_came),
        (0, 11, 0)
    );
    let members = store.members(recording.id).await.unwrap();
    assert_eq!(
        (members.recording.frames, members.recording.missing),
        (0, 11)
    );
    let kept = everything(store, &members).await;
    assert_eq!(
        kept.iter().map(|stored| stored.record).collect::<Vec<_>>(),
        every
    );
}

/// read, stored, dropped, spooled, unaccounted.
async fn books(store: &dyn FrameStore) -> (u64, u64, u64, u64, i128) {
    let stream = store.streams().await.unwrap().remove(0);
    (
        stream.account.as_ref().unwrap().read,
        stream.stored,
        stream.dropped().unwrap(),
        stream.spooled().unwrap(),
        stream.unaccounted().unwrap(),
    )
}

async fn the_books_balance_after_every_batch(store: &dyn FrameStore) {
    append(store, counted(0..5, account(5, 0, 5))).await;
    assert_eq!(books(store).await, (5, 5, 0, 0, 0));
    // An outage: 20 more were read, 3 of them dropped, and 5 of the 17 in the spool are in this batch.
    append(store, counted(8..13, account(25, 3, 17))).await;
    assert_eq!(books(store).await, (25, 10, 3, 12, 0));
    // A second lane brings the rest without a count.
    append(store, numbered(13..25)).await;
    assert_eq!(books(store).await, (25, 22, 3, 0, 0));
    // Nothing was read since: a count without frames.
    append(store, counted([], account(25, 3, 0))).await;
    assert_eq!(books(store).await, (25, 22, 3, 0, 0));
    let kept = store.streams().await.unwrap().remove(0).account.unwrap();
    assert_eq!(kept, account(25, 3, 0));
}

async fn a_lost_frame_unbalances_the_books(store: &dyn FrameStore) {
    append(store, counted(0..5, account(5, 0, 5))).await;
    append(store, counted(6..10, account(10, 0, 4))).await;
    assert_eq!(books(store).await, (10, 9, 0, 0, 1));
}

async fn a_lost_answer_unbalances_the_books_only_until_the_next_count(store: &dyn FrameStore) {
    append(store, counted(0..5, account(5, 0, 5))).await;
    // The answer was lost: the agent still holds those five, and sends the newest first.
    append(store, counted(5..10, account(10, 0, 10))).await;
    assert_eq!(books(store).await, (10, 10, 0, 5, -5));
    append(store, counted(0..5, account(10, 0, 5))).await;
    assert_eq!(books(store).await, (10, 10, 0, 0, 0));
}

async fn a_run_that_has_ended_balances_and_stays_so(store: &dyn FrameStore) {
    append(store, counted(0..5, account(5, 0, 5))).await;
    // 20 read, 3 dropped, 12 in memory and on disk: then the agent is killed, with 4 of them on disk.
    append(store, counted([], account(20, 3, 12))).await;
    assert_eq!(books(store).await, (20, 5, 3, 12, 0));
    let ended = |read, dropped, spooled| Account {
        ended: true,
        ..account(read, dropped, spooled)
    };
    append(store, counted(5..7, ended(9, 0, 4))).await;
    assert_eq!(books(store).await, (20, 7, 3 + 8, 2, 0));
    append(store, counted(7..9, ended(9, 0, 2))).await;
    assert_eq!(books(store).await, (20, 9, 3 + 8, 0, 0));
    // What comes twice or late un-ends nothing.
    append(store, counted(5..7, ended(9, 0, 4))).await;
    append(store, counted(5..7, account(20, 3, 12))).await;
    append(store, numbered(9..10)).await;
    assert_eq!(books(store).await, (20, 10, 3 + 7, 0, 0));
    let kept = store.streams().await.unwrap().remove(0).account.unwrap();
    assert_eq!(kept.dropped[LOST_IN_MEMORY], 7);
}

async fn the_room_taken_grows_with_what_is_kept(store: &dyn FrameStore) {
    let before = store.usage().await.unwrap();
    assert_eq!(before.bytes_max, None);
    append(store, numbered(0..2000)).await;
    let grown = store.usage().await.unwrap().bytes - before.bytes;
    // 2000 frames, each with three times of 8 bytes and at most 131 bytes of pixels.
    assert!((48_000..4_000_000).contains(&grown), "{grown}");
}

async fn an_overtaken_count_does_not_replace_a_later_one(store: &dyn FrameStore) {
    append(store, counted(5..10, account(10, 0, 10))).await;
    assert_eq!(books(store).await, (10, 5, 0, 5, 0));
    append(store, counted(0..5, account(5, 0, 5))).await;
    assert_eq!(books(store).await, (10, 10, 0, 0, 0));
}

async fn a_recording_holds_what_arrives_between_start_and_stop(store: &dyn FrameStore) {
    append(store, numbered([0, 1, 2, 10])).await;
    let recording = store
        .start_recording("kitchen".to_owned(), 100)
        .await
        .unwrap();
    assert_eq!(
        (recording.t_start_ns, recording.t_stop_ns, recording.frames),
        (100, None, 0)
    );
    append(store, numbered(3..6)).await;
    // A late frame from before the start arrives within, and belongs to it.
    append(store, numbered([7])).await;
    append(store, numbered([6, 12])).await;
    let stopped = store.stop_recording(recording.id, 200).await.unwrap();
    // What came before and after lies within the numbers of the recording, and does not belong to it.
    append(store, numbered([8, 9, 11])).await;
    assert_eq!(
        (stopped.t_stop_ns, stopped.frames, stopped.sensors),
        (Some(200), 6, 1)
    );
    let members = store.members(recording.id).await.unwrap();
    assert_eq!(members.recording, stopped);
    assert_eq!(
        seqs(&everything(store, &members).await),
        [3, 4, 5, 6, 7, 12]
    );
    assert_eq!(store.recordings().await.unwrap(), [stopped]);
}

async fn a_frame_sent_again_during_a_recording_is_not_in_it(store: &dyn FrameStore) {
    append(store, numbered(0..3)).await;
    let recording = store.start_recording("late".to_owned(), 1).await.unwrap();
    append(store, numbered(0..5)).await;
    let members = store.members(recording.id).await.unwrap();
    assert_eq!(members.recording.frames, 2);
    assert_eq!(seqs(&everything(store, &members).await), [3, 4]);
    // Nor does an empty one hold anything.
    store.stop_recording(recording.id, 2).await.unwrap();
    let empty = store.start_recording("empty".to_owned(), 3).await.unwrap();
    append(store, numbered(0..5)).await;
    assert!(store.members(empty.id).await.unwrap().spans.is_empty());
}

async fn recordings_are_ordered_by_device_sensor_boot_and_number(store: &dyn FrameStore) {
    let recording = store.start_recording("order".to_owned(), 1).await.unwrap();
    for (device, boot, sensor) in [
        ("pi-2", "b1", "s1"),
        ("pi-1", "b2", "s2"),
        ("pi-1", "b1", "s2"),
        ("pi-1", "b9", "s1"),
    ] {
        append(
            store,
            batch(device, boot, vec![part(sensor, vec![frame(1)])]),
        )
        .await;
        append(
            store,
            batch(device, boot, vec![part(sensor, vec![frame(0)])]),
        )
        .await;
    }
    let members = store.members(recording.id).await.unwrap();
    let kept = everything(store, &members).await;
    let keys: Vec<_> = kept
        .iter()
        .map(|stored| {
            let id = &*stored.stream;
            format!(
                "{} {} {} {}",
                id.device, id.sensor, id.boot, stored.record.seq
            )
        })
        .collect();
    assert_eq!(
        keys,
        [
            "pi-1 s1 b9 0",
            "pi-1 s1 b9 1",
            "pi-1 s2 b1 0",
            "pi-1 s2 b1 1",
            "pi-1 s2 b2 0",
            "pi-1 s2 b2 1",
            "pi-2 s1 b1 0",
            "pi-2 s1 b1 1"
        ]
    );
}

async fn a_span_is_read_in_pages(store: &dyn FrameStore) {
    let recording = store.start_recording("pages".to_owned(), 1).await.unwrap();
    append(store, numbered(0..10)).await;
    let span = store.members(recording.id).await.unwrap().spans.remove(0);
    let mut read = Vec::new();
    let mut after = None;
    loop {
        let page = store.page(span.clone(), after, 4).await.unwrap();
        assert!(page.len() <= 4);
        let Some(last) = page.last() else { break };
        after = Some(last.record.seq);
        read.extend(seqs(&page));
    }
    assert_eq!(read, Vec::from_iter(0..10));
}

async fn a_running_recording_can_be_read(store: &dyn FrameStore) {
    let recording = store
        .start_recording("running".to_owned(), 1)
        .await
        .unwrap();
    append(store, numbered(0..3)).await;
    let members = store.members(recording.id).await.unwrap();
    append(store, numbered(3..6)).await;
    // What came after it was asked for is not in it, so that the file has one end.
    assert_eq!(seqs(&everything(store, &members).await), [0, 1, 2]);
}

async fn names_are_taken_once(store: &dyn FrameStore) {
    let first = store
        .start_recording("kitchen".to_owned(), 1)
        .await
        .unwrap();
    let running = store
        .start_recording("kitchen".to_owned(), 2)
        .await
        .unwrap_err();
    assert!(
        matches!(running, StoreError::NameTaken { running: true, .. }),
        "{running}"
    );
    store.stop_recording(first.id, 3).await.unwrap();
    let ended = store
        .start_recording("kitchen".to_owned(), 4)
        .await
        .unwrap_err();
    assert!(
        matches!(ended, StoreError::NameTaken { running: false, .. }),
        "{ended}"
    );
    // Two at once are fine.
    store.start_recording("hall".to_owned(), 5).await.unwrap();
    store.start_recording("attic".to_owned(), 5).await.unwrap();
}

async fn a_recording_is_stopped_once(store: &dyn FrameStore) {
    let recording = store.start_recording("once".to_owned(), 1).await.unwrap();
    store.stop_recording(recording.id, 2).await.unwrap();
    let again = store.stop_recording(recording.id, 3).await.unwrap_err();
    assert!(matches!(again, StoreError::NotRunning { .. }), "{again}");
    let unknown = store.stop_recording(RecordingId(99), 3).await.unwrap_err();
    assert!(
        matches!(unknown, StoreError::NoSuchRecording { .. }),
        "{unknown}"
    );
    assert!(matches!(
        store.members(RecordingId(0)).await,
        Err(StoreError::NoSuchRecording { .. })
    ));
}

async fn streams_are_limited(store: &dyn FrameStore) {
    for boot in 0..6 {
        append(
            store,
            batch(
                "pi-1",
                &format!("b{boot}"),
                vec![part("s1", vec![frame(0)])],
            ),
        )
        .await;
    }
    let seventh = batch("pi-1", "b6", vec![part("s1", vec![frame(0)])]);
    let error = store.append(Arc::new(seventh), 1).await.unwrap_err();
    assert!(
        matches!(error, StoreError::TooManyStreams { limit: 6 }),
        "{error}"
    );
    append(store, batch("pi-1", "b0", vec![part("s1", vec![frame(1)])])).await;
    assert_eq!(store.streams().await.unwrap().len(), 6);
}

async fn a_note_is_kept_until_another_replaces_it(store: &dyn FrameStore) {
    let first = store.start_recording("first".to_owned(), 1).await.unwrap();
    let second = store.start_recording("second".to_owned(), 2).await.unwrap();
    assert_eq!((&*first.note, &*second.note), ("", ""));
    append(store, numbered(0..3)).await;
    for note in ["two people, é", "one person", ""] {
        let noted = store
            .note_recording(first.id, note.to_owned())
            .await
            .unwrap();
        assert_eq!((&*noted.note, noted.frames), (note, 3));
        assert_eq!(store.members(first.id).await.unwrap().recording.note, note);
    }
    store
        .note_recording(second.id, "of the second".to_owned())
        .await
        .unwrap();
    let stopped = store.stop_recording(second.id, 3).await.unwrap();
    assert_eq!(stopped.note, "of the second");
    let notes = store.recordings().await.unwrap();
    let notes: Vec<_> = notes.iter().map(|recording| &*recording.note).collect();
    assert_eq!(notes, ["of the second", ""]);
    let unknown = store.note_recording(RecordingId(99), "x".to_owned()).await;
    assert!(matches!(unknown, Err(StoreError::NoSuchRecording { .. })));
}

async fn labels_are_kept_in_their_order_until_they_are_taken_away(store: &dyn FrameStore) {
    let first = store.start_recording("first".to_owned(), 1).await.unwrap();
    let second = store.start_recording("second".to_owned(), 2).await.unwrap();
    append(store, numbered(0..9)).await;
    let label = |name: &str, first_seq, last_seq| Label {
        name: name.to_owned(),
        spans: vec![LabelSpan {
            device: "pi-1".to_owned(),
            sensor: "s1".to_owned(),
            boot: "b1".to_owned(),
            first_seq,
            last_seq,
        }],
    };
    let labels = [
        label("two people, é", 0, 3),
        label("nobody", 2, 8),
        label("nobody", 4, u64::MAX),
    ];
    for (number, label) in (1..).zip(&labels) {
        let kept = store.add_label(first.id, label.clone()).await.unwrap();
        assert_eq!((kept.number, &kept.label), (number, label));
    }
    let more = store.add_label(first.id, labels[0].clone()).await;
    assert!(matches!(more, Err(StoreError::TooManyLabels { limit: 3 })));
    store.add_label(second.id, labels[1].clone()).await.unwrap();
    store.remove_label(first.id, 2).await.unwrap();
    let kept = store.labels(first.id).await.unwrap();
    let kept: Vec<_> = kept.iter().map(|kept| (kept.number, &kept.label)).collect();
    assert_eq!(kept, [(1, &labels[0]), (3, &labels[2])]);
    assert_eq!(store.labels(second.id).await.unwrap().len(), 1);
    let gone = store.remove_label(first.id, 2).await;
    assert!(matches!(
        gone,
        Err(StoreError::NoSuchLabel { number: 2, .. })
    ));
    let nowhere = RecordingId(99);
    for unknown in [
        store.labels(nowhere).await.map(drop),
        store.remove_label(nowhere, 1).await,
        store.add_label(nowhere, labels[0].clone()).await.map(drop),
    ] {
        assert!(matches!(unknown, Err(StoreError::NoSuchRecording { .. })));
    }
}

async fn recordings_are_limited(store: &dyn FrameStore) {
    for number in 0..4 {
        store
            .start_recording(format!("r{number}"), 1)
            .await
            .unwrap();
    }
    let error = store.start_recording("r4".to_owned(), 1).await.unwrap_err();
    assert!(
        matches!(error, StoreError::TooManyRecordings { limit: 4 }),
        "{error}"
    );
}

async fn the_newest_record_is_that_of_the_stream_added_to_last(store: &dyn FrameStore) {
    append(store, numbered(0..9)).await;
    append(store, batch("pi-1", "b2", vec![part("s1", vec![frame(1)])])).await;
    let newest = store.newest().await.unwrap();
    assert_eq!(
        (newest.len(), &*newest[0].stream.boot, newest[0].record),
        (1, "b2", frame(1))
    );
    append(store, numbered([8, 11])).await;
    let newest = store.newest().await.unwrap();
    assert_eq!(
        (newest.len(), &*newest[0].stream.boot, newest[0].record),
        (1, "b1", frame(11))
    );
}

async fn many_at_once_are_all_kept(store: &dyn FrameStore) {
    let posts = (0..200).map(|seq| store.append(Arc::new(numbered([seq])), 1));
    let mut refused = 0;
    for post in Vec::from_iter(posts) {
        refused += u32::from(post.await.is_err());
    }
    assert_eq!(refused, 0);
    let stream = store.streams().await.unwrap().remove(0);
    assert_eq!(
        (stream.stored, stream.durable_through, stream.never_came),
        (200, Some(199), 0)
    );
}

async fn a_closed_store_says_so(store: &dyn FrameStore) {
    let queued = store.append(Arc::new(numbered(0..3)), 1);
    store.close().await.unwrap();
    assert_eq!(
        queued.await.unwrap().sensors[0].stream.stored,
        3,
        "what was asked for before is done"
    );
    assert!(matches!(
        store.append(Arc::new(numbered(3..6)), 1).await,
        Err(StoreError::Closed)
    ));
    assert!(matches!(store.ping().await, Err(StoreError::Closed)));
    store.close().await.unwrap();
}

// What is true of a file alone.

#[tokio::test]
async fn what_was_acknowledged_is_there_after_a_restart() {
    let folder = tempfile::tempdir().unwrap();
    let store = open_in(folder.path());
    let recording = store.start_recording("before".to_owned(), 1).await.unwrap();
    append(&store, counted(0..5, account(6, 0, 6))).await;
    let before = (
        store.streams().await.unwrap(),
        store.newest().await.unwrap(),
    );
    // Dropped without being closed, as if killed: what was answered must be there.
    drop(store);
    let store = open_in(folder.path());
    assert_eq!(
        (
            store.streams().await.unwrap(),
            store.newest().await.unwrap()
        ),
        before
    );
    append(&store, numbered(0..7)).await;
    let stopped = store.stop_recording(recording.id, 9).await.unwrap();
    assert_eq!(stopped.frames, 7);
}

#[tokio::test]
async fn a_file_of_a_version_without_notes_and_labels_takes_them() {
    let folder = tempfile::tempdir().unwrap();
    let store = open_in(folder.path());
    let recording = store.start_recording("before".to_owned(), 1).await.unwrap();
    store.close().await.unwrap();
    rusqlite::Connection::open(folder.path().join("frames.sqlite"))
        .unwrap()
        .execute_batch("DROP TABLE notes; DROP TABLE labels")
        .unwrap();
    let store = open_in(folder.path());
    let noted = store.note_recording(recording.id, "now".to_owned()).await;
    assert_eq!(noted.unwrap().note, "now");
    assert_eq!(store.labels(recording.id).await.unwrap(), []);
}

#[tokio::test]
async fn a_file_that_only_this_user_can_read() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let store = open_in(folder.path());
    append(&store, numbered(0..5)).await;
    for entry in std::fs::read_dir(folder.path()).unwrap() {
        let entry = entry.unwrap();
        let mode = entry.metadata().unwrap().permissions().mode();
        assert_eq!(mode & 0o077, 0, "{}", entry.path().display());
    }
}

fn refusal(path: &Path) -> String {
    let error = SqliteStore::open(&StoreLocation::File(path.to_owned()), &limits()).unwrap_err();
    error.to_string()
}

#[test]
fn what_is_no_store_is_refused_and_left_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let text = folder.path().join("notes.txt");
    std::fs::write(
        &text,
        "nothing like a database, and long enough to be looked at\n".repeat(40),
    )
    .unwrap();
    assert!(
        refusal(&text).contains("not a database\nhint: "),
        "{}",
        refusal(&text)
    );
    assert!(
        std::fs::read_to_string(&text)
            .unwrap()
            .starts_with("nothing like")
    );

    let foreign = folder.path().join("foreign.sqlite");
    rusqlite::Connection::open(&foreign)
        .unwrap()
        .execute_batch("CREATE TABLE mine (x)")
        .unwrap();
    let before = std::fs::read(&foreign).unwrap();
    assert!(
        refusal(&foreign).contains("another program\nhint: "),
        "{}",
        refusal(&foreign)
    );
    assert!(
        std::fs::read(&foreign).unwrap() == before,
        "a file of another program was written to"
    );

    let newer = folder.path().join("newer.sqlite");
    drop(open(&StoreLocation::File(newer.clone())));
    rusqlite::Connection::open(&newer)
        .unwrap()
        .pragma_update(None, "user_version", 4)
        .unwrap();
    assert!(refusal(&newer).contains("layout 4"), "{}", refusal(&newer));

    assert!(
        refusal(folder.path()).contains("hint: "),
        "{}",
        refusal(folder.path())
    );
    let nowhere = refusal(&folder.path().join("no/such/folder.sqlite"));
    assert!(
        nowhere.contains("No such file") && nowhere.contains("hint: the folder must exist"),
        "{nowhere}"
    );
}

/// A store whose file another connection holds, so that nothing is written.
fn held(folder: &Path, limits: &Limits) -> (SqliteStore, rusqlite::Connection) {
    let path = folder.join("frames.sqlite");
    let store = SqliteStore::open(&StoreLocation::File(path.clone()), limits).unwrap();
    let other = rusqlite::Connection::open(path).unwrap();
    other.execute_batch("BEGIN IMMEDIATE").unwrap();
    (store, other)
}

#[tokio::test]
async fn a_full_queue_refuses_and_loses_nothing_that_it_took() {
    let folder = tempfile::tempdir().unwrap();
    let limits = Limits {
        writer_queue_max: 4,
        commit_group_max: 2,
        ..limits()
    };
    let (store, other) = held(folder.path(), &limits);
    // The writer holds at most one group, and the queue four more.
    let posts: Vec<_> = (0..12)
        .map(|seq| store.append(Arc::new(numbered([seq])), 1))
        .collect();
    other.execute_batch("ROLLBACK").unwrap();
    let mut kept = 0;
    for post in posts {
        match post.await {
            Ok(_) => kept += 1,
            Err(error) => assert!(matches!(error, StoreError::Busy { waiting: 4 }), "{error}"),
        }
    }
    assert!((4..=6).contains(&kept), "{kept} were taken");
    assert_eq!(store.streams().await.unwrap()[0].stored, kept);
}

#[tokio::test]
async fn a_file_that_another_program_holds_is_waited_for_and_then_given_up() {
    let folder = tempfile::tempdir().unwrap();
    let limits = Limits {
        store_lock_time_max: Duration::from_millis(50),
        ..limits()
    };
    let (store, other) = held(folder.path(), &limits);
    let error = store.append(Arc::new(numbered([0])), 1).await.unwrap_err();
    assert!(matches!(error, StoreError::Locked), "{error}");
    assert!(error.to_string().contains("\nhint: close"), "{error}");
    other.execute_batch("ROLLBACK").unwrap();
    append(&store, numbered([0])).await;
}

#[tokio::test]
async fn a_store_that_cannot_write_is_ill_until_it_writes_again() {
    let folder = tempfile::tempdir().unwrap();
    let limits = Limits {
        store_lock_time_max: Duration::from_millis(50),
        ..limits()
    };
    let (store, other) = held(folder.path(), &limits);
    store.ping().await.unwrap();
    store.append(Arc::new(numbered([0])), 1).await.unwrap_err();
    assert!(matches!(store.ping().await, Err(StoreError::Locked)));
    other.execute_batch("ROLLBACK").unwrap();
    append(&store, numbered([0])).await;
    store.ping().await.unwrap();
    // A batch that is refused for what it says is no fault of the store.
    let mut other_content = numbered([0]);
    other_content.sensors[0].frames[0].stamp.t_boot_ns += 1;
    let refused = store.append(Arc::new(other_content), 1).await;
    assert!(matches!(refused, Err(StoreError::Conflict { .. })));
    store.ping().await.unwrap();
}

#[tokio::test]
async fn a_write_that_fails_undoes_its_whole_commit_and_says_so_to_all_in_it() {
    let folder = tempfile::tempdir().unwrap();
    let store = open_in(folder.path());
    append(&store, numbered(0..5)).await;
    // Undoes the whole transaction, as SQLite itself does when a disk is full.
    let other = rusqlite::Connection::open(folder.path().join("frames.sqlite")).unwrap();
    let fault =
        "CREATE TRIGGER fault BEFORE INSERT ON pending WHEN instr(new.batches, x'0800000000000000')
                 BEGIN SELECT RAISE(ROLLBACK, 'full'); END; BEGIN IMMEDIATE";
    other.execute_batch(fault).unwrap();
    // While the file is held, the first goes alone, and the others wait and share the next commit.
    let alone = store.append(Arc::new(numbered([20])), 1);
    let shared: Vec<_> = [5, 8, 9]
        .map(|seq| store.append(Arc::new(numbered([seq])), 1))
        .into();
    other.execute_batch("COMMIT").unwrap();
    let mut failed = usize::from(alone.await.is_err());
    for post in shared {
        failed += usize::from(post.await.is_err());
    }
    let kept = store.streams().await.unwrap()[0].stored;
    assert!(failed >= 1);
    assert_eq!(
        kept,
        5 + 4 - u64::try_from(failed).unwrap(),
        "an error was answered, and only then nothing kept"
    );
    other.execute_batch("DROP TRIGGER fault").unwrap();
    append(&store, numbered([5, 8, 9, 20])).await;
    assert_eq!(store.streams().await.unwrap()[0].stored, 9);
}
