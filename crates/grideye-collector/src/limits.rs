//! Every limit of the collector, by name.

use grideye_recording::wire::{FRAME_BYTES_MAX, FRAMES_MAX};
use std::time::Duration;

/// The collector's limits on sizes, counts and waits. A test reaches each of them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Limits {
    /// Open connections in total; fewer if the process may not open enough files. One more displaces the oldest of the
    /// lowest standing (`connections.rs`), or gets 503.
    pub connections_max: usize,
    /// Open connections from one address (IPv6: one /64) that is not a trusted proxy. One more displaces one of that
    /// address, or gets 503.
    pub connections_per_peer_max: usize,
    /// Time from waiting for the first byte to the end of the headers; then the connection is closed.
    pub header_time_max: Duration,
    /// Bytes of a request's first line and headers. More gets 431.
    pub header_bytes_max: usize,
    /// Time from the end of the headers to the end of the body; then 408.
    pub body_time_max: Duration,
    /// Bytes of a body of frames. More gets 413.
    pub body_bytes_max: usize,
    /// Bytes of any other body. More gets 413.
    pub small_body_bytes_max: usize,
    /// Bytes of all bodies of frames that arrived and are not yet on disk. A request without room gets 503.
    pub bodies_bytes_max: usize,
    /// Such bytes of one token, or of one address if no tokens are required. More gets 429. Bodies up to 4 KiB do not
    /// count for either.
    pub bodies_bytes_per_sender_max: usize,
    /// Time from the end of the headers to the first byte of the response; then 504.
    pub handler_time_max: Duration,
    /// The same for the routes of an annex that declares them slow: they draw or convert a whole recording, on a small
    /// computer for a minute.
    pub slow_handler_time_max: Duration,
    /// A peer that accepts no byte of a response for this long is disconnected.
    pub write_stall_max: Duration,
    /// Time for open requests to finish after a shutdown request; then they are aborted.
    pub shutdown_time_max: Duration,
    /// Requests waiting for the store's writer, by default one per connection. One more gets 503.
    pub writer_queue_max: usize,
    /// Requests to the store's writer that share one commit.
    pub commit_group_max: usize,
    /// How long the store waits for another program that locks its file.
    pub store_lock_time_max: Duration,
    /// Maximum delay before the live page shows another collector's commit to the same store.
    pub follow_every: Duration,
    /// The store's connections for reading.
    pub readers_max: usize,
    /// Streams (device, sensor, boot) in a list: those added to last. The store may have more.
    pub streams_listed_max: usize,
    /// New streams per second with one token (from one address, if tokens are not required), in the long run. A batch of
    /// one more gets 429.
    pub new_streams_per_second_max: u32,
    /// New streams at once with one token.
    pub new_streams_burst_max: u32,
    /// Gaps listed for a sensor in a response: the newest.
    pub gaps_listed_max: usize,
    /// Recordings in the store. One more gets 507.
    pub recordings_max: usize,
    /// A recording that was renewed once (`grideye record` does so) ends when it is not renewed for this long.
    pub recording_lease: Duration,
    /// Characters of a recording's name.
    pub recording_name_chars_max: usize,
    /// Characters of a recording's note.
    pub recording_note_chars_max: usize,
    /// Labels of one recording. One more gets 507.
    pub labels_max: usize,
    /// Characters of a label's name.
    pub label_name_chars_max: usize,
    /// Ranges of frames in one label.
    pub label_spans_max: usize,
    /// Rows of a recording, 168 bytes each, that the page can play. For longer ones it refers to the CSV file.
    pub playback_rows_max: u64,
    /// Rows that a download reads from the store at once.
    pub page_rows: usize,
    /// Sensors with live state. One more displaces the one that was silent longest.
    pub sensors_max: usize,
    /// Bytes of the store's file; a write beyond gets 507. `None`: limited only by the disk.
    pub store_bytes_max: Option<u64>,
    /// Requests per second with one token, in the long run. One more gets 429.
    pub requests_per_second_max: u32,
    /// Requests at once with one token.
    pub requests_burst_max: u32,
    /// Requests per second from one address without a valid token, if tokens are required.
    pub unknown_requests_per_second_max: u32,
    /// Requests at once from one address without a valid token.
    pub unknown_requests_burst_max: u32,
    /// Addresses without a valid token that are counted individually; the others share one count.
    pub unknown_peers_max: usize,
    /// How long a person stays signed in to the page.
    pub session_time_max: Duration,
    /// How soon a created or revoked token takes effect.
    pub tokens_reread_every: Duration,
    /// Minimum time between log events of one kind; those in between are counted.
    pub log_every: Duration,
    /// Rows in a file are sealed into segments once they have been stored this long.
    pub seal_after: Duration,
    /// Older unrecorded frames in a file are deleted: at most a tenth of the store in a fortieth of this time. `None`:
    /// never.
    pub keep_for: Option<Duration>,
    /// When a file exceeds this size in bytes, the oldest unrecorded frames are deleted: in an hour at most a tenth
    /// plus twice what arrived. `None`: never.
    pub keep_bytes: Option<u64>,
    /// Clients that follow the live page's events, as many of one token (or address, if no tokens are required) as are
    /// free. One more gets 503.
    pub live_clients_max: usize,
    /// Audits answered at once, as many for one token (or address) as are free. One more gets 503.
    pub audits_max: usize,
    /// Requests to the program's own routes answered at once. One more gets 503.
    pub annex_requests_max: usize,
    /// Such requests of one token, or of one address if no tokens are required.
    pub annex_requests_per_sender_max: usize,
    /// Events that a live client may lag behind; then it is told how many it missed.
    pub live_lag_max: usize,
    /// Frames of a sensor in one event; of more, the newest.
    pub live_frames_max: usize,
    /// A live client gets at least one event in this time.
    pub live_keep_alive: Duration,
    /// Sensors with recent frames in memory, for the program's own routes.
    pub recent_sensors_max: usize,
    /// Recent frames per sensor.
    pub recent_frames_max: usize,
    /// The time over which the frame rate is measured.
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
            handler_time_max: Duration::from_secs(20),
            slow_handler_time_max: Duration::from_secs(300),
            write_stall_max: Duration::from_secs(20),
            shutdown_time_max: Duration::from_secs(5),
            writer_queue_max: 4096,
            commit_group_max: 256,
            store_lock_time_max: Duration::from_secs(5),
            follow_every: Duration::from_millis(200),
            readers_max: 2,
            streams_listed_max: 20_000,
            new_streams_per_second_max: 1,
            new_streams_burst_max: 4096,
            gaps_listed_max: 64,
            recordings_max: 10_000,
            recording_lease: Duration::from_secs(300),
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
            log_every: Duration::from_secs(1),
            seal_after: Duration::from_secs(600),
            keep_for: None,
            keep_bytes: None,
            live_clients_max: 128,
            audits_max: 4,
            annex_requests_max: 64,
            annex_requests_per_sender_max: 16,
            live_lag_max: 256,
            live_frames_max: 64,
            live_keep_alive: Duration::from_secs(5),
            recent_sensors_max: 32,
            recent_frames_max: 3000,
            rate_window: Duration::from_secs(5),
        }
    }
}
