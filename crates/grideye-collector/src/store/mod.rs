//! Where frames are kept: one trait, so that a site that outgrows one machine can put another engine behind it.

mod chunk;
mod fresh;
mod label;
mod location;
pub mod migrate;
mod plan;
mod postgres;
mod queue;
mod row;
mod runs;
mod schema;
pub mod segment;
mod sqlite;
mod stage;
mod upgrade;

pub use label::{KeptLabel, Label, LabelSpan};
pub use location::{PostgresUrl, StoreLocation, UrlError};
pub use postgres::PostgresStore;
pub use sqlite::{BackedUp, BackupError, SqliteStore, backup};
pub use stage::Stage;

use crate::{Clock, Log};
use axum::body::Bytes;
use grideye_recording::wire::{Account, Acknowledgement, Batch, Gap, WireError};
use grideye_recording::{Record, StreamId};
use std::fmt;
use std::future::Future;
use std::path::PathBuf;
use std::pin::Pin;
use std::str::FromStr;
use std::sync::Arc;
use tokio::sync::mpsc;

/// The answer of a store, when it comes.
pub type Answer<'a, T> = Pin<Box<dyn Future<Output = Result<T, StoreError>> + Send + 'a>>;

/// Opens the store at a place, or makes it where none is. Frames in a file grow old by the clock's monotonic time; what is
/// deleted is logged. Must be called within a tokio runtime.
///
/// # Errors
/// [`StoreError`] of the engine: the file or the database cannot be had, or holds something else.
pub async fn open(
    location: &StoreLocation,
    limits: &crate::Limits,
    clock: &Arc<dyn Clock>,
    log: &Log,
) -> Result<Arc<dyn FrameStore>, StoreError> {
    Ok(match location {
        StoreLocation::Postgres(url) => Arc::new(PostgresStore::open(url, limits).await?),
        StoreLocation::File(_) | StoreLocation::Memory => {
            Arc::new(SqliteStore::open_tended(location, limits, clock, log)?)
        }
    })
}

/// A store of frames and recordings.
///
/// Every method that changes something answers only after the change is on disk and synced. Frames are known by
/// (device, sensor, boot, seq) for ever: the same frame again changes nothing.
pub trait FrameStore: Send + Sync + 'static {
    /// Keeps a batch: all of it, or on an error nothing.
    fn append(&self, batch: Arc<Batch>, t_arrival_ns: i64) -> Answer<'_, Appended>;

    /// The same, of a batch that was read from `compact` ([`Batch::from_binary`]): a store that keeps batches in this form
    /// first need not write it anew.
    fn append_compact(
        &self,
        batch: Arc<Batch>,
        compact: Bytes,
        t_arrival_ns: i64,
    ) -> Answer<'_, Appended> {
        drop(compact);
        self.append(batch, t_arrival_ns)
    }

    /// What is kept of every stream, ordered by device, sensor, boot.
    fn streams(&self) -> Answer<'_, Vec<StreamSummary>>;

    /// For each (device, sensor), the newest record of the stream that was added to last.
    fn newest(&self) -> Answer<'_, Vec<StoredRecord>>;

    /// Starts a recording. Frames that arrive from now on belong to it.
    fn start_recording(&self, name: String, t_start_ns: i64) -> Answer<'_, Recording>;

    /// Ends a recording. Frames that arrive from now on do not belong to it.
    fn stop_recording(&self, id: RecordingId, t_stop_ns: i64) -> Answer<'_, Recording>;

    /// Sets a recording's note; an empty one is none.
    fn note_recording(&self, id: RecordingId, note: String) -> Answer<'_, Recording>;

    /// The labels of a recording, in the order in which they were added.
    fn labels(&self, id: RecordingId) -> Answer<'_, Vec<KeptLabel>>;

    /// Adds a label to a recording. Whether its frames are there is the caller's to know.
    fn add_label(&self, id: RecordingId, label: Label) -> Answer<'_, KeptLabel>;

    /// Takes a label away.
    fn remove_label(&self, id: RecordingId, number: i64) -> Answer<'_, ()>;

    /// Every recording, newest first.
    fn recordings(&self) -> Answer<'_, Vec<Recording>>;

    /// Which frames belong to a recording: the one place that says so.
    fn members(&self, id: RecordingId) -> Answer<'_, Members>;

    /// The next records of one span of a recording, in ascending seq: those after `after_seq`, at most `rows`.
    fn page(
        &self,
        span: Span,
        after_seq: Option<u64>,
        rows: usize,
    ) -> Answer<'_, Vec<StoredRecord>>;

    /// What others keep in the same store from now on, for the live page; once, and only where there may be others.
    fn news(&self) -> Option<mpsc::Receiver<News>> {
        None
    }

    /// How much room the frames take, and how much they may take.
    fn usage(&self) -> Answer<'_, StoreUsage>;

    /// Fails when the store cannot be read, or when the last write failed.
    fn ping(&self) -> Answer<'_, ()>;

    /// Commits what was asked for and lets go of the files. Later calls answer [`StoreError::Closed`].
    fn close(&self) -> Answer<'_, ()>;
}

/// The room that a store takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StoreUsage {
    /// Bytes that it takes now, without a log that is folded in again.
    pub bytes: u64,
    /// Bytes that it may take; `None` where the disk alone is the limit.
    pub bytes_max: Option<u64>,
    /// Frames that this collector deleted because they were too old.
    pub deleted_by_age: u64,
    /// Frames that this collector deleted because the store was too large.
    pub deleted_by_size: u64,
}

/// What became of a batch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Appended {
    /// By sensor, in the batch's order.
    pub sensors: Vec<SensorAppended>,
}

impl Appended {
    /// The answer to the agent, as JSON ([`Acknowledgement`]).
    ///
    /// # Errors
    /// [`WireError`] if it cannot be written.
    pub fn acknowledgement(&self) -> Result<Vec<u8>, WireError> {
        let streams = self.sensors.iter().map(|sensor| &sensor.stream);
        let durable_through = streams.clone().filter_map(|stream| {
            let seq = stream.durable_through?;
            Some((stream.id.sensor.as_str(), seq))
        });
        let gaps = streams.flat_map(|stream| &stream.gaps);
        Acknowledgement::write_json(durable_through, gaps)
    }
}

/// What became of one sensor's part of a batch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SensorAppended {
    /// The stream as it is now.
    pub stream: StreamSummary,
    /// The sequence numbers that were new, in ascending order; the others were there already.
    pub fresh: Vec<u64>,
}

/// What is kept of one stream.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StreamSummary {
    /// Whose frames.
    pub id: Arc<StreamId>,
    /// Frames kept that carry pixels.
    pub stored: u64,
    /// Of the frames in `stored`, those that were deleted because they were old, or the room was used up.
    pub expired: u64,
    /// Rows kept that say why there is no frame.
    pub missing: u64,
    /// The highest sequence number kept.
    pub durable_through: Option<u64>,
    /// Runs of numbers below it that never came, in ascending order; at most the newest `gaps_listed_max`.
    pub gaps: Vec<Gap>,
    /// How many numbers below it never came, those of gaps not listed included.
    pub never_came: u64,
    /// The agent's own count, as last reported.
    pub account: Option<Account>,
    /// Frames that came with or after that count: the agent still had them in its spool when it made it.
    pub came_since_account: u64,
    /// Wall clock of the collector when the stream was last added to, in nanoseconds since 1970-01-01 UTC.
    pub t_last_arrival_ns: i64,
}

impl StreamSummary {
    /// Frames that the agent holds now, by its own count less what has come since; `None` without a count.
    ///
    /// The agent counts a batch as spooled while it sends it, and learns of its arrival only from the answer. So
    /// what came with the count, or after it, is no longer in the spool.
    #[must_use]
    pub fn spooled(&self) -> Option<u64> {
        let account = self.account.as_ref()?;
        Some(account.spooled.saturating_sub(self.came_since_account))
    }

    /// Frames that the agent gave up, whatever the reason; `None` without a count.
    #[must_use]
    pub fn dropped(&self) -> Option<u64> {
        let account = self.account.as_ref()?;
        Some(
            account
                .dropped
                .values()
                .fold(0, |sum, count| sum.saturating_add(*count)),
        )
    }

    /// read - stored - dropped - spooled: 0 when the books balance; `None` without a count.
    ///
    /// Above 0: so many frames were read and are nowhere. Below 0: so many frames are here that the agent counts
    /// as spooled or dropped, because the answer that told of their arrival was lost; its next count mends that.
    #[must_use]
    pub fn unaccounted(&self) -> Option<i128> {
        let account = self.account.as_ref()?;
        let elsewhere =
            i128::from(self.stored) + i128::from(self.dropped()?) + i128::from(self.spooled()?);
        Some(i128::from(account.read) - elsewhere)
    }
}

/// A record together with whose it is and when it came.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredRecord {
    /// Whose.
    pub stream: Arc<StreamId>,
    /// The record.
    pub record: Record,
    /// Wall clock of the collector when it arrived, in nanoseconds since 1970-01-01 UTC.
    pub t_arrival_ns: i64,
}

/// What another collector did in the same store.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum News {
    /// It kept frames of one stream.
    Frames(Box<Elsewhere>),
    /// It started or stopped a recording.
    Recordings,
}

/// Frames that another collector kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Elsewhere {
    /// The stream as it is now.
    pub stream: StreamSummary,
    /// The agent's boot clock when it last sent.
    pub t_sent_boot_ns: Option<u64>,
    /// The newest of the frames, in ascending seq.
    pub records: Vec<StoredRecord>,
}

/// The number of a recording, from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RecordingId(pub i64);

impl fmt::Display for RecordingId {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(formatter)
    }
}

impl FromStr for RecordingId {
    type Err = std::num::ParseIntError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        text.parse().map(Self)
    }
}

/// A recording: the frames that arrived between its start and its stop.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recording {
    /// Its number.
    pub id: RecordingId,
    /// Its name, unlike every other's.
    pub name: String,
    /// What somebody wrote about it; empty if nobody did.
    pub note: String,
    /// Wall clock of the collector at the start, in nanoseconds since 1970-01-01 UTC.
    pub t_start_ns: i64,
    /// The same at the stop; `None` while it runs.
    pub t_stop_ns: Option<i64>,
    /// Frames with pixels in it, until now.
    pub frames: u64,
    /// Rows in it that say why there is no frame, until now.
    pub missing: u64,
    /// Sensors in it, until now.
    pub sensors: u64,
}

/// The frames of a recording, as one span a stream, ordered by device, sensor, boot.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Members {
    /// The recording.
    pub recording: Recording,
    /// Its spans.
    pub spans: Vec<Span>,
}

/// The part of one stream that belongs to a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Span {
    /// Whose frames.
    pub stream: Arc<StreamId>,
    /// The store's own number of the stream.
    pub(crate) stream_key: i64,
    /// The range of numbers in which the members are.
    pub(crate) seq: (i64, i64),
    /// The members' epochs are above the first of these, and not above the second.
    pub(crate) epochs: (i64, i64),
}

impl Span {
    /// The lowest and the highest number of its frames.
    #[must_use]
    pub fn seqs(&self) -> (u64, u64) {
        let number = |seq: i64| u64::try_from(seq).unwrap_or(0);
        (number(self.seq.0), number(self.seq.1))
    }
}

/// Why a store did not do what it was asked.
#[derive(Debug, Clone, thiserror::Error)]
pub enum StoreError {
    /// The frame is known with another content.
    #[error(
        "sensor {sensor} of {device} sent seq {seq} of boot {boot} before, with other content; nothing of this batch was stored\nhint: two agents with one device name, or a boot name used twice; give each agent its own `device`, and each run its own boot"
    )]
    Conflict {
        /// The agent's name.
        device: String,
        /// The sensor.
        sensor: String,
        /// The run.
        boot: String,
        /// The number sent twice.
        seq: u64,
    },
    /// A number does not fit into the store.
    #[error(
        "{field} is {value}, more than the store can hold ({max})\nhint: sequence numbers count from 0 within a boot, times are in nanoseconds"
    )]
    NumberTooLarge {
        /// The field's name on the wire.
        field: &'static str,
        /// What came.
        value: u64,
        /// The highest that can be kept.
        max: u64,
    },
    /// One stream more than the store takes.
    #[error(
        "the store holds {limit} streams (device, sensor, boot) and takes no more\nhint: remove old recordings' devices, or raise `streams_max`"
    )]
    TooManyStreams {
        /// The limit.
        limit: usize,
    },
    /// One recording more than the store takes.
    #[error("the store holds {limit} recordings and takes no more\nhint: raise `recordings_max`")]
    TooManyRecordings {
        /// The limit.
        limit: usize,
    },
    /// A recording has that name.
    #[error("a recording named {name:?} {}\nhint: choose another name{}", if *.running { "is running" } else { "exists already" }, if *.running { ", or stop that one first" } else { "" })]
    NameTaken {
        /// The name asked for.
        name: String,
        /// Whether the one that has it is still running.
        running: bool,
    },
    /// No recording has that number.
    #[error("there is no recording {id}\nhint: GET /v1/recordings lists them")]
    NoSuchRecording {
        /// The number asked for.
        id: RecordingId,
    },
    /// One label more than a recording takes.
    #[error(
        "the recording has {limit} labels and takes no more\nhint: take some away, or make one of those that say the same"
    )]
    TooManyLabels {
        /// The limit.
        limit: usize,
    },
    /// The recording has no label of that number.
    #[error(
        "recording {id} has no label {number}\nhint: GET /v1/recordings/{id}/labels lists them"
    )]
    NoSuchLabel {
        /// The recording.
        id: RecordingId,
        /// The number asked for.
        number: i64,
    },
    /// The recording was stopped before.
    #[error(
        "recording {id} ({name:?}) was stopped before\nhint: GET /v1/recordings/{id}.csv has it"
    )]
    NotRunning {
        /// The number asked for.
        id: RecordingId,
        /// Its name.
        name: String,
    },
    /// More is waiting to be written than the queue takes.
    #[error(
        "the store is behind: {waiting} requests wait to be written\nhint: send again in a second; nothing of this request was stored"
    )]
    Busy {
        /// How many wait.
        waiting: usize,
    },
    /// The disk, or the quota on it, is full.
    #[error(
        "the disk that holds the store is full\nhint: make room; agents keep their frames until then and send them again"
    )]
    Full,
    /// The store takes as much room as it may.
    #[error(
        "the store takes the {bytes_max} bytes that it may take\nhint: raise the quota (`--store-quota`) or move old frames away; agents keep theirs until then and send them again"
    )]
    QuotaReached {
        /// The limit.
        bytes_max: u64,
    },
    /// Another program holds the file, and did not let go of it in time.
    #[error(
        "the store's file is locked by another program\nhint: close what holds it, for example a database browser with changes that are not written; nothing of this request was stored"
    )]
    Locked,
    /// The path of the store names another file than the one that is written, or none.
    #[error(
        "the store's {part} was {fate} while it was in use, and nothing is acknowledged until it is back\nhint: the collector's log has what to do; agents keep their frames until then and send them again"
    )]
    Gone {
        /// `file`, or `log`: the file beside it whose name ends in `-wal`.
        part: &'static str,
        /// What became of it.
        fate: &'static str,
    },
    /// The database cannot be reached, or does not let this program in.
    #[error(
        "the database cannot be reached: {message}\nhint: is it running, does it exist, and are user and password right? Agents keep their frames until then and send them again"
    )]
    Unreachable {
        /// What the system or the database said.
        message: String,
    },
    /// The database broke the request off for the sake of others.
    #[error(
        "the database broke off what it was asked for: {message}\nhint: send again in a second; nothing of this request was stored"
    )]
    Contended {
        /// What the database said.
        message: String,
    },
    /// A migration into the database was interrupted.
    #[error(
        "a migration into this database is not finished\nhint: run the same `grideye migrate` again; it goes on where it was"
    )]
    Unfinished,
    /// The database holds frames or recordings already.
    #[error(
        "the database holds frames or recordings already\nhint: migrate into a new database (`createdb`)"
    )]
    NotEmpty,
    /// The file is no SQLite database.
    #[error(
        "the file is not a database\nhint: name another file, or move this one away; a new store is made where none is"
    )]
    NotADatabase,
    /// The file is a database of another program.
    #[error(
        "the file is a database of another program\nhint: name another file; a new store is made where none is"
    )]
    Foreign,
    /// A later version of this program made the file.
    #[error(
        "the store has layout {found}, and this program knows layouts up to {known}\nhint: use the program that made it, or a newer one"
    )]
    Newer {
        /// The layout found.
        found: i64,
        /// The newest known.
        known: i64,
    },
    /// An earlier version of this program made the file.
    #[error(
        "the store has layout {found}, which was in use before the first release; this program knows layouts {oldest} to {known}\nhint: name another file; with the program that made this one, `grideye record` and the page still give its recordings as CSV"
    )]
    Older {
        /// The layout found.
        found: i64,
        /// The oldest that is known.
        oldest: i64,
        /// The newest that is known.
        known: i64,
    },
    /// The store has an older layout, and no copy of it can be made before it is upgraded.
    #[error(
        "the store has layout {from}, and the disk has no room for {}, the copy of its {bytes} bytes that is made before it is upgraded\nhint: make room on this disk, or move the store to a larger one; nothing was changed", .backup.display()
    )]
    NoRoomForBackup {
        /// The layout found.
        from: i64,
        /// The copy.
        backup: PathBuf,
        /// Bytes of the store.
        bytes: u64,
    },
    /// The store has an older layout, and another copy stands where one is made before it is upgraded.
    #[error(
        "the store has layout {from}, and {} is a copy of another state of it, not of the present one\nhint: move that copy away; the store is then copied and upgraded; nothing was changed", .backup.display()
    )]
    BackupInTheWay {
        /// The layout found.
        from: i64,
        /// The copy.
        backup: PathBuf,
    },
    /// The file cannot be made or opened.
    #[error(
        "{message}\nhint: the folder must exist and be writable for this user, and the file too"
    )]
    Unusable {
        /// What the system said.
        message: String,
    },
    /// The store has been closed.
    #[error("the store is closed")]
    Closed,
    /// The database failed in another way.
    #[error("the store failed: {0}")]
    Failed(String),
}
