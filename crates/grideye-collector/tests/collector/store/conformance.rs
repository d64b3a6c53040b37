//! Runs every check against every store.

use crate::store::books::*;
use crate::store::frames::*;
use crate::store::helpers::{open, open_database, open_in};
use crate::store::recordings::*;
use grideye_collector::StoreLocation;

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
    an_ended_boot_balances_and_stays_balanced
    a_recording_holds_what_arrives_between_start_and_stop
    a_frame_sent_again_during_a_recording_is_not_in_it
    recordings_are_ordered_by_device_sensor_boot_and_number
    a_span_is_read_in_pages
    a_running_recording_can_be_read
    names_are_taken_once
    a_recording_is_stopped_once
    a_note_is_kept_until_another_replaces_it
    labels_are_kept_in_their_order_until_they_are_taken_away
    a_deleted_recording_is_gone_and_its_number_is_not_given_again
    a_lease_counts_its_renewals_until_the_recording_ends
    of_many_streams_those_added_to_last_are_listed
    recordings_are_limited
    the_newest_record_is_that_of_the_stream_added_to_last
    many_at_once_are_all_kept
    the_space_used_grows_with_the_store
    a_closed_store_says_so
}
