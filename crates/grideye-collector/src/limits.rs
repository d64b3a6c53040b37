//! Every bound of the collector, by name.

use grideye_recording::wire::{FRAME_BYTES_MAX, FRAMES_MAX};
use std::time::Duration;

/// What the collector takes, holds and waits for at most. Each field has a test that reaches it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Limits {
    /// Connections open at once, all peers together; fewer where the process may not open as many files. One more displaces the
    /// oldest of the least worth (`connections.rs`), or is answered 503.
    pub connections_max: usize,
    /// The same from one address (IPv6: one /64) that is no trusted proxy. One more displaces one of its own, or gets 503.
    pub connections_per_peer_max: usize,
    /// From the first byte awaited to the end of the request's headers. Then the connection is closed.
    pub header_time_max: Duration,
    /// Bytes of a request's first line and headers together. More is answered 431.
    pub header_bytes_max: usize,
    /// From the end of the headers to the end of the body. Then 408.
    pub body_time_max: Duration,
    /// Bytes of a body of frames. More is answered 413.
    pub body_bytes_max: usize,
    /// Bytes of any other body. More is answered 413.
    pub small_body_bytes_max: usize,
    /// Bytes of all bodies of frames that have arrived and are not on disk yet. A request that finds no room is answered 503.
    pub bodies_bytes_max: usize,
    /// The same for one token, or without tokens for one address. More is answered 429. Bodies of up to 4 KiB do not count.
    pub bodies_bytes_per_sender_max: usize,
    /// How much one body of frames may hold.
    pub batch: grideye_recording::wire::Limits,
    /// From the end of the headers to the first byte of the answer. Then 504.
    pub handler_time_max: Duration,
    /// A peer that takes no byte of an answer for so long is cut off.
    pub write_stall_max: Duration,
    /// After the shutdown was asked for: open requests may finish for so long, then they are cut off.
    pub shutdown_time_max: Duration,
    /// Requests to the store's writer that may wait, by default one of each connection. One more is answered 503.
    pub writer_queue_max: usize,
    /// Requests to the store's writer that share one commit.
    pub commit_group_max: usize,
    /// How long the store waits for another program that holds its file.
    pub store_lock_time_max: Duration,
    /// The longest between a commit of another collector on the same store and its showing on the live page.
    pub follow_every: Duration,
    /// Connections of the store that read beside the writer.
    pub readers_max: usize,
    /// Streams (device, sensor, boot) that the store takes. One more is answered 507.
    pub streams_max: usize,
    /// Gaps that an answer lists for a sensor; the newest are kept.
    pub gaps_listed_max: usize,
    /// Recordings that the store takes. One more is answered 507.
    pub recordings_max: usize,
    /// Characters of a recording's name.
    pub recording_name_chars_max: usize,
    /// Characters of a recording's note.
    pub recording_note_chars_max: usize,
    /// Labels of one recording. One more is answered 507.
    pub labels_max: usize,
    /// Characters of a label's name.
    pub label_name_chars_max: usize,
    /// Ranges of frames in one label.
    pub label_spans_max: usize,
    /// Rows of a recording, 168 bytes each, that the page can play. Of one more it is told to take the file instead.
    pub playback_rows_max: u64,
    /// Rows that a download takes from the store at once.
    pub page_rows: usize,
    /// Sensors of which the present state is held. Frames of one more are answered 507.
    pub sensors_max: usize,
    /// Bytes that the store's file may take; a write beyond is answered 507. `None`: as many as the disk has.
    pub store_bytes_max: Option<u64>,
    /// Requests a second of one token, in the long run. One more is answered 429.
    pub requests_per_second_max: u32,
    /// Requests at once of one token.
    pub requests_burst_max: u32,
    /// The same of one address without a good token, where tokens are asked for.
    pub unknown_requests_per_second_max: u32,
    /// Requests at once of one address without a good token.
    pub unknown_requests_burst_max: u32,
    /// Addresses without a good token that are counted each on its own; the others share one count.
    pub unknown_peers_max: usize,
    /// How long somebody stays signed in to the page.
    pub session_time_max: Duration,
    /// How soon a token that was made or revoked is noticed.
    pub tokens_reread_every: Duration,
    /// How deep the JSON of a small body may nest. More is answered 400. That of frames nests as deep as its shape.
    pub json_depth_max: usize,
    /// Events of one kind are logged no oftener; those between are counted.
    pub log_every: Duration,
    /// Rows in a file are sealed into segments when they were stored so long ago.
    pub seal_after: Duration,
    /// Older unrecorded frames in a file are deleted: a tenth of the store in a fortieth of this time at most. `None`: never.
    pub keep_for: Option<Duration>,
    /// When a file holds more, the oldest unrecorded frames are deleted: in an hour at most a tenth, and twice what came. `None`: never.
    pub keep_bytes: Option<u64>,
    /// Clients that follow the live page's events. One more is answered 503.
    pub live_clients_max: usize,
    /// Events that a live client may lag behind. Then it is told how many it missed.
    pub live_lag_max: usize,
    /// Frames of a sensor that one event carries; of more, the newest.
    pub live_frames_max: usize,
    /// A live client hears at least one event in so long.
    pub live_keep_alive: Duration,
    /// Sensors of which the newest frames are held in memory for the program's own routes.
    pub recent_sensors_max: usize,
    /// Frames held of each of these.
    pub recent_frames_max: usize,
    /// How far back the rate of frames is measured.
    pub rate_window: Duration,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            connections_max: 4096,
            connections_per_peer_max: 2560,
            header_time_max: Duration::from_secs(10),
            header_bytes_max: 16 * 1024,
            body_time_max: Duration::from_secs(10),
            body_bytes_max: FRAMES_MAX * FRAME_BYTES_MAX + 64 * 1024,
            small_body_bytes_max: 16 * 1024,
            bodies_bytes_max: 64 * 1024 * 1024,
            bodies_bytes_per_sender_max: 8 * 1024 * 1024,
            batch: grideye_recording::wire::Limits::default(),
            handler_time_max: Duration::from_secs(20),
            write_stall_max: Duration::from_secs(20),
            shutdown_time_max: Duration::from_secs(5),
            writer_queue_max: 4096,
            commit_group_max: 256,
            store_lock_time_max: Duration::from_secs(5),
            follow_every: Duration::from_secs(1),
            readers_max: 2,
            streams_max: 20_000,
            gaps_listed_max: 64,
            recordings_max: 10_000,
            recording_name_chars_max: 64,
            recording_note_chars_max: 500,
            labels_max: 10_000,
            label_name_chars_max: 64,
            label_spans_max: 64,
            playback_rows_max: 500_000,
            page_rows: 512,
            sensors_max: 4096,
            store_bytes_max: None,
            requests_per_second_max: 100,
            requests_burst_max: 200,
            unknown_requests_per_second_max: 10,
            unknown_requests_burst_max: 60,
            unknown_peers_max: 4096,
            session_time_max: Duration::from_secs(12 * 3600),
            tokens_reread_every: Duration::from_secs(1),
            json_depth_max: 8,
            log_every: Duration::from_secs(1),
            seal_after: Duration::from_secs(600),
            keep_for: None,
            keep_bytes: None,
            live_clients_max: 64,
            live_lag_max: 256,
            live_frames_max: 64,
            live_keep_alive: Duration::from_secs(5),
            recent_sensors_max: 32,
            recent_frames_max: 3000,
            rate_window: Duration::from_secs(5),
        }
    }
}
