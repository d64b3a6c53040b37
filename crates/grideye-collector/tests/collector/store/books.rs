//! The counts: read = stored + dropped + spooled.

use crate::batches::{account, counted, numbered};
use crate::store::helpers::append;
use grideye_collector::FrameStore;
use grideye_recording::wire::{Account, LOST_IN_MEMORY};

/// read, stored, dropped, spooled, unaccounted.
pub(super) async fn books(store: &dyn FrameStore) -> (u64, u64, u64, u64, i128) {
    let stream = store.streams().await.unwrap().remove(0);
    (
        stream.account.as_ref().unwrap().read,
        stream.stored,
        stream.dropped().unwrap(),
        stream.spooled().unwrap(),
        stream.unaccounted().unwrap(),
    )
}

pub(super) async fn the_books_balance_after_every_batch(store: &dyn FrameStore) {
    append(store, counted(0..5, account(5, 0, 5))).await;
    assert_eq!(books(store).await, (5, 5, 0, 0, 0));
    // An outage: 20 more were read, 3 of them dropped, and 5 of the 17 in the spool are in this batch.
    append(store, counted(8..13, account(25, 3, 17))).await;
    assert_eq!(books(store).await, (25, 10, 3, 12, 0));
    // The rest comes without an account.
    append(store, numbered(13..25)).await;
    assert_eq!(books(store).await, (25, 22, 3, 0, 0));
    // Nothing was read since: an account without frames.
    append(store, counted([], account(25, 3, 0))).await;
    assert_eq!(books(store).await, (25, 22, 3, 0, 0));
    let kept = store.streams().await.unwrap().remove(0).account.unwrap();
    assert_eq!(kept, account(25, 3, 0));
}

pub(super) async fn a_lost_frame_unbalances_the_books(store: &dyn FrameStore) {
    append(store, counted(0..5, account(5, 0, 5))).await;
    append(store, counted(6..10, account(10, 0, 4))).await;
    assert_eq!(books(store).await, (10, 9, 0, 0, 1));
}

pub(super) async fn a_lost_answer_unbalances_the_books_only_until_the_next_count(
    store: &dyn FrameStore,
) {
    append(store, counted(0..5, account(5, 0, 5))).await;
    // The answer was lost: the agent still holds these five, and sends the newest first.
    append(store, counted(5..10, account(10, 0, 10))).await;
    assert_eq!(books(store).await, (10, 10, 0, 5, -5));
    append(store, counted(0..5, account(10, 0, 5))).await;
    assert_eq!(books(store).await, (10, 10, 0, 0, 0));
}

pub(super) async fn an_ended_boot_balances_and_stays_balanced(store: &dyn FrameStore) {
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
    // Repeated or late batches do not undo the end.
    append(store, counted(5..7, ended(9, 0, 4))).await;
    append(store, counted(5..7, account(20, 3, 12))).await;
    append(store, numbered(9..10)).await;
    assert_eq!(books(store).await, (20, 10, 3 + 7, 0, 0));
    let kept = store.streams().await.unwrap().remove(0).account.unwrap();
    assert_eq!(kept.dropped[LOST_IN_MEMORY], 7);
}

pub(super) async fn the_space_used_grows_with_the_store(store: &dyn FrameStore) {
    let before = store.usage().await.unwrap();
    assert_eq!(before.bytes_max, None);
    append(store, numbered(0..2000)).await;
    let grown = store.usage().await.unwrap().bytes - before.bytes;
    // 2000 frames, each with three times of 8 bytes and at most 131 bytes of pixels.
    assert!((48_000..4_000_000).contains(&grown), "{grown}");
}

pub(super) async fn an_overtaken_count_does_not_replace_a_later_one(store: &dyn FrameStore) {
    append(store, counted(5..10, account(10, 0, 10))).await;
    assert_eq!(books(store).await, (10, 5, 0, 5, 0));
    append(store, counted(0..5, account(5, 0, 5))).await;
    assert_eq!(books(store).await, (10, 10, 0, 0, 0));
}
