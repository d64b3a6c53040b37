//! Frames: stored bit for bit, once, with their gaps counted.

use crate::batches::{bare, batch, flat, frame, missing, numbered, part};
use crate::store::helpers::{append, everything, gaps};
use grideye_collector::{FrameStore, StoreError};
use grideye_frame::NoData;
use grideye_recording::wire::{Acknowledgement, Gap};
use std::sync::Arc;

pub(super) async fn frames_come_back_bit_for_bit(store: &dyn FrameStore) {
    let recording = store.start_recording("all".to_owned(), 1).await.unwrap();
    let mut sent: Vec<_> = (0..5).map(frame).collect();
    // The four upper bits of a word have no meaning, but are stored too.
    sent.push(flat(5, 0xF7FF, 0xFFFF));
    sent.push(bare(frame(6)));
    sent.push(frame(7));
    append(store, batch("pi-1", "b1", vec![part("s1", sent.clone())])).await;
    let members = store.members(recording.id).await.unwrap();
    let kept = everything(store, &members).await;
    assert_eq!(
        kept.iter().map(|stored| stored.record).collect::<Vec<_>>(),
        sent
    );
    assert!(kept.iter().all(|stored| stored.t_arrival_ns == 7));
}

pub(super) async fn a_frame_sent_again_changes_nothing(store: &dyn FrameStore) {
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

pub(super) async fn the_same_key_with_other_content_is_refused_and_nothing_of_the_batch_is_kept(
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

pub(super) async fn every_field_of_a_frame_counts_as_content(store: &dyn FrameStore) {
    append(store, numbered([0])).await;
    let original = frame(0);
    let mut changed = [original; 5];
    changed[0].stamp.t_boot_ns += 1;
    changed[1].stamp.t_utc_ns += 1;
    changed[2].stamp.clock = grideye_recording::ClockState::Stepped;
    changed[3].reading = missing(0, NoData::Nack).reading;
    changed[4] = bare(original);
    for (index, record) in changed.into_iter().enumerate() {
        let forged = batch("pi-1", "b1", vec![part("s1", vec![record])]);
        let error = store.append(Arc::new(forged), 8).await.unwrap_err();
        assert!(
            matches!(error, StoreError::Conflict { .. }),
            "{index}: {error}"
        );
    }
}

pub(super) async fn gaps_are_the_numbers_that_never_came(store: &dyn FrameStore) {
    assert_eq!(
        gaps(&append(store, numbered(2..4)).await),
        (Some(3), vec![(0, 1)], 2)
    );
    let holes = append(store, numbered([4, 7, 9])).await;
    assert_eq!(gaps(&holes), (Some(9), vec![(0, 1), (5, 6), (8, 8)], 5));
    let answer = holes.acknowledgement().unwrap();
    let answer = Acknowledgement::from_json(&answer).unwrap();
    assert_eq!(answer.durable_through["s1"], 9);
    let last = Gap {
        sensor: "s1".to_owned(),
        from: 8,
        to: 8,
    };
    assert_eq!(answer.gaps.last(), Some(&last));
}

pub(super) async fn gaps_close_from_both_sides_and_in_any_order(store: &dyn FrameStore) {
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
    // Backwards, one by one: the result must be one run, or the gap would not be listed.
    for seq in (20..30).rev() {
        append(store, numbered([seq])).await;
    }
    assert_eq!(gaps(&append(store, numbered([30])).await).1, [(10, 19)]);
}

pub(super) async fn of_many_gaps_the_newest_are_listed_and_all_are_counted(store: &dyn FrameStore) {
    let sparse = append(store, numbered((1..=6).map(|n| 2 * n))).await;
    assert_eq!(gaps(&sparse), (Some(12), vec![(7, 7), (9, 9), (11, 11)], 7));
}

pub(super) async fn boots_and_sensors_have_numbers_of_their_own(store: &dyn FrameStore) {
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

pub(super) async fn the_highest_numbers_are_kept(store: &dyn FrameStore) {
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

pub(super) async fn missing_frames_are_rows_with_their_reason(store: &dyn FrameStore) {
    let recording = store.start_recording("faults".to_owned(), 1).await.unwrap();
    let every: Vec<_> = (0..)
        .zip(NoData::ALL)
        .map(|(seq, reason)| missing(seq, reason))
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

pub(super) async fn of_many_streams_those_added_to_last_are_listed(store: &dyn FrameStore) {
    let add = async |boot: u64, seq: u64, t_arrival_ns: i64| {
        let part = part("s1", vec![frame(seq)]);
        let batch = batch("pi-1", &format!("b{boot}"), vec![part]);
        let appended = store.append(Arc::new(batch), t_arrival_ns).await.unwrap();
        appended.sensors[0].is_new
    };
    let listed = async || {
        let streams = store.streams().await.unwrap();
        let boots = streams.iter().map(|stream| stream.id.boot.clone());
        boots.collect::<Vec<_>>()
    };
    for boot in 0..7 {
        assert!(add(boot, 0, i64::try_from(boot).unwrap()).await);
    }
    assert_eq!(listed().await, ["b1", "b2", "b3", "b4", "b5", "b6"]);
    assert!(!add(0, 1, 8).await);
    assert_eq!(listed().await, ["b0", "b2", "b3", "b4", "b5", "b6"]);
    assert_eq!(store.usage().await.unwrap().streams, 7);
}

pub(super) async fn the_newest_record_is_that_of_the_stream_added_to_last(store: &dyn FrameStore) {
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

pub(super) async fn many_at_once_are_all_kept(store: &dyn FrameStore) {
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

pub(super) async fn a_closed_store_says_so(store: &dyn FrameStore) {
    let queued = store.append(Arc::new(numbered(0..3)), 1);
    store.close().await.unwrap();
    assert_eq!(
        queued.await.unwrap().sensors[0].stream.stored,
        3,
        "earlier requests are done"
    );
    assert!(matches!(
        store.append(Arc::new(numbered(3..6)), 1).await,
        Err(StoreError::Closed)
    ));
    assert!(matches!(store.ping().await, Err(StoreError::Closed)));
    store.close().await.unwrap();
}
