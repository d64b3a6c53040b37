//! The errors of a store, and [`RecordingId`], which names a recording in them.

use std::fmt;
use std::str::FromStr;

pub(crate) type Result<T, E = StoreError> = core::result::Result<T, E>;

/// Why a store could not do what it was asked.
#[derive(Debug, Clone, thiserror::Error)]
pub enum StoreError {
    /// A frame came before with other content.
    #[error(
        "sensor {sensor} of {device} sent seq {seq} of boot {boot} before, with other content; nothing of this batch was stored\nhint: two agents share a device name, or a boot name was used twice; give each agent its own `device`, and each start its own boot name"
    )]
    Conflict {
        /// The agent's name.
        device: String,
        /// The sensor.
        sensor: String,
        /// The boot.
        boot: String,
        /// The number sent twice.
        seq: u64,
    },
    /// A number is larger than the store can hold.
    #[error(
        "{field} is {value}, more than the store can hold ({max})\nhint: sequence numbers count from 0 within a boot, times are in nanoseconds"
    )]
    NumberTooLarge {
        /// The field's name on the wire.
        field: &'static str,
        /// The value sent.
        value: u64,
        /// The largest value that fits.
        max: u64,
    },
    /// The limit on recordings is reached.
    #[error(
        "the store already holds the maximum of {0} recordings\nhint: delete one that is no longer needed, on the page or by `grideye record NAME --delete`; its frames stay until they are too old"
    )]
    TooManyRecordings(usize),
    /// Another recording has this name.
    #[error("a recording named {name:?} {}\nhint: choose another name{}", if *.running { "is running" } else { "exists already" }, if *.running { ", or stop that one first" } else { "" })]
    NameTaken {
        /// The name asked for.
        name: String,
        /// Whether the other recording is still running.
        running: bool,
    },
    /// No recording has this number.
    #[error("there is no recording {0}\nhint: GET /v1/recordings lists them")]
    NoSuchRecording(RecordingId),
    /// The limit on labels of a recording is reached.
    #[error(
        "the recording already has the maximum of {0} labels\nhint: delete some, or merge those with the same name"
    )]
    TooManyLabels(usize),
    /// The recording has no label with this number.
    #[error(
        "recording {id} has no label {number}\nhint: GET /v1/recordings/{id}/labels lists them"
    )]
    NoSuchLabel {
        /// The recording.
        id: RecordingId,
        /// The number asked for.
        number: i64,
    },
    /// The recording is already stopped.
    #[error(
        "recording {id} ({name:?}) is already stopped\nhint: GET /v1/recordings/{id}.csv downloads it"
    )]
    NotRunning {
        /// The number asked for.
        id: RecordingId,
        /// Its name.
        name: String,
    },
    /// The writer's queue is full.
    #[error(
        "the store is busy: {0} requests wait to be written\nhint: retry in a second; nothing of this request was stored"
    )]
    Busy(usize),
    /// The disk, or the quota on it, is full.
    #[error(
        "the disk that holds the store is full\nhint: free some space; agents keep their frames and retry"
    )]
    Full,
    /// The store has reached its quota.
    #[error(
        "the store has reached its quota of {0} bytes\nhint: raise the quota (`--store-quota`) or move old frames away; agents keep theirs and retry"
    )]
    QuotaReached(u64),
    /// Another program locked the file for longer than the time limit.
    #[error(
        "the store's file is locked by another program\nhint: close that program, for example a database browser with unsaved changes; nothing of this request was stored"
    )]
    Locked,
    /// The store's path names another file than the open one, or none.
    #[error(
        "the store's {part} was {fate} while it was in use, and nothing is acknowledged until it is back\nhint: the collector's log says what to do; agents keep their frames and retry"
    )]
    Gone {
        /// `file`, or `log` for the file whose name ends in `-wal`.
        part: &'static str,
        /// What happened to it.
        fate: &'static str,
    },
    /// Another program wrote into the open file or its log: which of the two.
    #[error(
        "the store's {0} was overwritten or cut short by another program while it was in use, and nothing more is acknowledged\nhint: stop the collector, restore the store from a backup (`grideye restore BACKUP --store FILE`), and start it again; agents keep their frames and retry"
    )]
    Overwritten(&'static str),
    /// The database cannot be reached, or rejects this program's login.
    #[error(
        "the database cannot be reached: {0}\nhint: is it running, does it exist, and are user and password right? Agents keep their frames and retry"
    )]
    Unreachable(String),
    /// The database aborted the request because of another transaction.
    #[error(
        "the database aborted the request: {0}\nhint: retry in a second; nothing of this request was stored"
    )]
    Contended(String),
    /// A migration into the database was interrupted.
    #[error(
        "a migration into this database is not finished\nhint: run the same `grideye migrate` again; it resumes where it stopped"
    )]
    Unfinished,
    /// The file is not an SQLite database.
    #[error(
        "the file is not a database\nhint: name another file, or move this one away; if the file does not exist, a new store is created"
    )]
    NotADatabase,
    /// The store is not one that this program may open, upgrade or fill: why, and a hint.
    #[error("{0}")]
    Refused(String),
    /// The file cannot be created or opened.
    #[error("{0}\nhint: the folder must exist and be writable for this user, and the file too")]
    Unusable(String),
    /// The store has been closed.
    #[error("the store is closed")]
    Closed,
    /// The database failed for another reason.
    #[error("the store failed: {0}")]
    Failed(String),
}

impl StoreError {
    /// The file or database is another program's.
    pub(super) fn foreign() -> Self {
        let what = "the file is a database of another program\nhint: name another file; if the file does not exist, a new store is created";
        Self::Refused(what.to_owned())
    }

    /// A later version of this program wrote the store.
    pub(super) fn newer(found: i64, known: i64) -> Self {
        Self::Refused(format!(
            "the store has layout {found}, and this program knows layouts up to {known}\nhint: use the program that made it, or a newer one"
        ))
    }
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
