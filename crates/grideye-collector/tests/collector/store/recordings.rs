//! Recordings, their notes and labels.

use crate::batches::{batch, frame, numbered, part};
use crate::store::helpers::{append, everything, seqs};
use grideye_collector::store::{Label, LabelSpan, RecordingId};
use grideye_collector::{FrameStore, StoreError};

pub(super) async fn a_recording_holds_what_arrives_between_start_and_stop(store: &dyn FrameStore) {
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
    // A late frame from before the start arrives during the recording, and belongs to it.
    append(store, numbered([7])).await;
    append(store, numbered([6, 12])).await;
    let stopped = store.stop_recording(recording.id, 200).await.unwrap();
    // Frames from before and after have numbers within the recording, but do not belong to it.
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
    // Nor once they are settled, which starting the next recording does.
    let next = store.start_recording("next".to_owned(), 300).await;
    next.unwrap();
    let members = store.members(recording.id).await.unwrap();
    assert_eq!(
        seqs(&everything(store, &members).await),
        [3, 4, 5, 6, 7, 12]
    );
}

pub(super) async fn a_frame_sent_again_during_a_recording_is_not_in_it(store: &dyn FrameStore) {
    append(store, numbered(0..3)).await;
    let recording = store.start_recording("late".to_owned(), 1).await.unwrap();
    append(store, numbered(0..5)).await;
    let members = store.members(recording.id).await.unwrap();
    assert_eq!(members.recording.frames, 2);
    assert_eq!(seqs(&everything(store, &members).await), [3, 4]);
    // Nor does an empty one contain anything.
    store.stop_recording(recording.id, 2).await.unwrap();
    let empty = store.start_recording("empty".to_owned(), 3).await.unwrap();
    append(store, numbered(0..5)).await;
    assert!(store.members(empty.id).await.unwrap().spans.is_empty());
}

pub(super) async fn recordings_are_ordered_by_device_sensor_boot_and_number(
    store: &dyn FrameStore,
) {
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

pub(super) async fn a_span_is_read_in_pages(store: &dyn FrameStore) {
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

pub(super) async fn a_running_recording_can_be_read(store: &dyn FrameStore) {
    let recording = store
        .start_recording("running".to_owned(), 1)
        .await
        .unwrap();
    append(store, numbered(0..3)).await;
    let members = store.members(recording.id).await.unwrap();
    append(store, numbered(3..6)).await;
    // Frames that came after the request are excluded, so that the file has one end.
    assert_eq!(seqs(&everything(store, &members).await), [0, 1, 2]);
}

pub(super) async fn names_are_taken_once(store: &dyn FrameStore) {
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

pub(super) async fn a_recording_is_stopped_once(store: &dyn FrameStore) {
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

pub(super) async fn a_note_is_kept_until_another_replaces_it(store: &dyn FrameStore) {
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

pub(super) async fn labels_are_kept_in_their_order_until_they_are_taken_away(
    store: &dyn FrameStore,
) {
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
    assert!(matches!(more, Err(StoreError::TooManyLabels(3))));
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

pub(super) async fn recordings_are_limited(store: &dyn FrameStore) {
    for number in 0..4 {
        store
            .start_recording(format!("r{number}"), 1)
            .await
            .unwrap();
    }
    let error = store.start_recording("r4".to_owned(), 1).await.unwrap_err();
    assert!(matches!(error, StoreError::TooManyRecordings(4)), "{error}");
}

pub(super) async fn a_deleted_recording_is_gone_and_its_number_is_not_given_again(
    store: &dyn FrameStore,
) {
    let start = async |name: &str| store.start_recording(name.to_owned(), 1).await.unwrap().id;
    let (first, second) = (start("first").await, start("second").await);
    append(store, numbered(0..3)).await;
    let span = LabelSpan {
        device: "pi-1".to_owned(),
        sensor: "s1".to_owned(),
        boot: "b1".to_owned(),
        first_seq: 0,
        last_seq: 1,
    };
    let label = Label {
        name: "somebody".to_owned(),
        spans: vec![span],
    };
    store.add_label(second, label).await.unwrap();
    let noted = store.note_recording(second, "of the second".to_owned());
    noted.await.unwrap();
    store.renew_recording(second).await.unwrap();
    let before = store.streams().await.unwrap();
    store.delete_recording(second).await.unwrap();
    for unknown in [
        store.delete_recording(second).await,
        store.stop_recording(second, 2).await.map(drop),
        store.renew_recording(second).await,
        store.labels(second).await.map(drop),
        store.members(second).await.map(drop),
    ] {
        assert!(matches!(unknown, Err(StoreError::NoSuchRecording(_))));
    }
    assert_eq!(store.leases().await.unwrap(), []);
    // The frames stay, and the other recording has them.
    assert_eq!(store.streams().await.unwrap(), before);
    let left = store.recordings().await.unwrap();
    assert_eq!((left.len(), left[0].id, left[0].frames), (1, first, 3));
    // A repeated request to delete it must not meet another one.
    let third = start("second").await;
    assert_eq!((second, third), (RecordingId(2), RecordingId(3)));
    store.delete_recording(third).await.unwrap();
    store.delete_recording(first).await.unwrap();
    assert_eq!(start("fourth").await, RecordingId(4));
    let fourth = store.members(RecordingId(4)).await.unwrap();
    assert_eq!((&*fourth.recording.note, fourth.spans.len()), ("", 0));
    assert_eq!(store.labels(RecordingId(4)).await.unwrap(), []);
}

pub(super) async fn a_lease_counts_its_renewals_until_the_recording_ends(store: &dyn FrameStore) {
    let first = store.start_recording("first".to_owned(), 1).await.unwrap();
    let second = store.start_recording("second".to_owned(), 1).await.unwrap();
    assert_eq!(store.leases().await.unwrap(), []);
    for renewals in 1..4 {
        store.renew_recording(second.id).await.unwrap();
        assert_eq!(store.leases().await.unwrap(), [(second.id, renewals)]);
    }
    store.stop_recording(second.id, 2).await.unwrap();
    assert_eq!(store.leases().await.unwrap(), []);
    let ended = store.renew_recording(second.id).await;
    assert!(matches!(ended, Err(StoreError::NotRunning { .. })));
    let running = store.members(first.id).await.unwrap().recording;
    assert_eq!(running.t_stop_ns, None);
}
