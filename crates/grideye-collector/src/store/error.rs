//! The errors of a store, and [`RecordingId`], which names a recording in them.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

pub(crate) type Result<T, E = StoreError> = core::result::Result<T, E>;

/// Why a store could not do what it was asked.
#[derive(Debug, Clone, thiserror::Error)]
pub enum StoreError {
    /// A frame came before with other content.
    #[error(
        "sensor {sensor} of {device} sent seq {seq} of boot {boot} before, with other content; nothing of this batch was stored\nhint: two agents with one device name, or a boot name used twice; give each agent its own `device`, and each run its own boot"
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
    /// The limit on streams is reached.
    #[error(
        "the store holds {0} streams (device, sensor, boot) and takes no more\nhint: remove old recordings' devices, or raise `streams_max`"
    )]
    TooManyStreams(usize),
    /// The limit on recordings is reached.
    #[error("the store holds {0} recordings and takes no more\nhint: raise `recordings_max`")]
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
        "the recording has {0} labels and takes no more\nhint: take some away, or make one of those that say the same"
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
        "recording {id} ({name:?}) was stopped before\nhint: GET /v1/recordings/{id}.csv has it"
    )]
    NotRunning {
        /// The number asked for.
        id: RecordingId,
        /// Its name.
        name: String,
    },
    /// The writer's queue is full.
    #[error(
        "the store is behind: {0} requests wait to be written\nhint: send again in a second; nothing of this request was stored"
    )]
    Busy(usize),
    /// The disk, or the quota on it, is full.
    #[error(
        "the disk that holds the store is full\nhint: make room; agents keep their frames until then and send them again"
    )]
    Full,
    /// The store has reached its quota.
    #[error(
        "the store takes the {0} bytes that it may take\nhint: raise the quota (`--store-quota`) or move old frames away; agents keep theirs until then and send them again"
    )]
    QuotaReached(u64),
    /// Another program locked the file for longer than the time limit.
    #[error(
        "the store's file is locked by another program\nhint: close what holds it, for example a database browser with changes that are not written; nothing of this request was stored"
    )]
    Locked,
    /// The store's path names another file than the open one, or none.
    #[error(
        "the store's {part} was {fate} while it was in use, and nothing is acknowledged until it is back\nhint: the collector's log has what to do; agents keep their frames until then and send them again"
    )]
    Gone {
        /// `file`, or `log` for the file whose name ends in `-wal`.
        part: &'static str,
        /// What happened to it.
        fate: &'static str,
    },
    /// The database cannot be reached, or rejects this program's login.
    #[error(
        "the database cannot be reached: {0}\nhint: is it running, does it exist, and are user and password right? Agents keep their frames until then and send them again"
    )]
    Unreachable(String),
    /// The database aborted the request because of another transaction.
    #[error(
        "the database broke off what it was asked for: {0}\nhint: send again in a second; nothing of this request was stored"
    )]
    Contended(String),
    /// A migration into the database was interrupted.
    #[error(
        "a migration into this database is not finished\nhint: run the same `grideye migrate` again; it goes on where it was"
    )]
    Unfinished,
    /// The database already holds frames or recordings.
    #[error(
        "the database holds frames or recordings already\nhint: migrate into a new database (`createdb`)"
    )]
    NotEmpty,
    /// The file is not an SQLite database.
    #[error(
        "the file is not a database\nhint: name another file, or move this one away; a new store is made where none is"
    )]
    NotADatabase,
    /// The file is another program's database.
    #[error(
        "the file is a database of another program\nhint: name another file; a new store is made where none is"
    )]
    Foreign,
    /// A later version of this program wrote the file.
    #[error(
        "the store has layout {found}, and this program knows layouts up to {known}\nhint: use the program that made it, or a newer one"
    )]
    Newer {
        /// The layout of the file.
        found: i64,
        /// The newest layout this program knows.
        known: i64,
    },
    /// A version before the first release wrote the file.
    #[error(
        "the store has layout {found}, which was in use before the first release; this program knows layouts {oldest} to {known}\nhint: name another file; with the program that made this one, `grideye record` and the page still give its recordings as CSV"
    )]
    Older {
        /// The layout of the file.
        found: i64,
        /// The oldest layout this program knows.
        oldest: i64,
        /// The newest layout this program knows.
        known: i64,
    },
    /// The store needs an upgrade, and the disk has no room for the copy that is made first.
    #[error(
        "the store has layout {from}, and the disk has no room for {}, the copy of its {bytes} bytes that is made before it is upgraded\nhint: make room on this disk, or move the store to a larger one; nothing was changed", .backup.display()
    )]
    NoRoomForBackup {
        /// The layout of the file.
        from: i64,
        /// The path of the copy.
        backup: PathBuf,
        /// Bytes of the store.
        bytes: u64,
    },
    /// The store needs an upgrade, and another copy stands where the first copy goes.
    #[error(
        "the store has layout {from}, and {} is a copy of another state of it, not of the present one\nhint: move that copy away; the store is then copied and upgraded; nothing was changed", .backup.display()
    )]
    BackupInTheWay {
        /// The layout of the file.
        from: i64,
        /// The path of the copy.
        backup: PathBuf,
    },
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
