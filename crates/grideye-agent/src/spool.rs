//! The spool: what the collector does not have, on a disk that may fill, fail and lose power.
//!
//! ```text
//!   segment-0000000000000007   header │ stream │ account │ frame │ frame │ …        appended, then synced
//!   segment-0000000000000008   header │ stream │ account │ frame │ …  ◀─ writing
//!   state                      cursor: segment 7, byte 4321; the runs that the collector has not heard to the end
//!   quarantine/                what could not be read, and what the collector refused
//!   lock                       held while an agent uses the folder
//! ```
//!
//! * A record is on disk when its segment was synced behind it, and not before.
//! * The cursor is written, synced and renamed into place BEFORE a segment is removed: a crash between the two leaves a
//!   segment that the next start removes, never a cursor that points at nothing.
//! * A start reads each segment up to the first record that is not whole, sets the rest aside by name, and goes on.
//! * After a failed write or sync the segment is given up and the records, which are still in memory, go to a new one.
//! * When it is full the oldest segment goes, and its frames are counted as [`SPOOL_FULL`].
//! * A run that was killed is spoken for by the next one: its records go first, with an account that says that it ended.
//! * What a later version of this program wrote is refused by name, and nothing of the folder is changed.
//! * A run whose records the collector does not let this agent send is held, and those behind it go on.

mod aside;
mod backlog;
mod cursor;
pub mod disk;
mod recover;
mod runs;
pub mod segment;
mod state;
mod writing;

pub use disk::{Disk, Folder, FolderError, LOCK, OpenError, QUARANTINE};
pub use state::RUNS_MAX;

use grideye_recording::StreamId;
use state::{Count, Cursor, Run};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::io;
use std::sync::Arc;
use writing::Writing;

/// The reason under which frames are dropped because the spool was full.
pub const SPOOL_FULL: &str = "spool-full";
/// The reason under which frames are dropped that the disk held and could not give back.
pub const SPOOL_DAMAGED: &str = "spool-damaged";
/// Bytes of a segment, from which on another one is begun: some ten minutes of one sensor at 10 Hz.
pub const SEGMENT_BYTES: u64 = 1 << 20;
/// Bytes that the quarantine may hold; beyond, what is set aside is counted and said, but not kept.
pub const QUARANTINE_BYTES_MAX: u64 = 16 << 20;
/// Runs of records on disk, each without a gap, that are remembered. While there are more, records stay in memory.
pub const EXTENTS_MAX: usize = 10_000;
/// Attempts to read a segment, after which its frames are given up.
pub const READS_MAX: u32 = 3;
/// The largest segment that is read: this program writes none that is larger.
const SEGMENT_READ_MAX: usize = 16 << 20;

/// How much a spool may hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of all segments together.
    pub bytes_max: u64,
    /// Bytes that are left free on the disk.
    pub free_bytes_min: u64,
    /// Bytes of a segment, from which on another one is begun.
    pub segment_bytes: u64,
}

impl Limits {
    /// Segments of the usual size, or of an eighth of the spool where that is less.
    #[must_use]
    pub fn new(bytes_max: u64, free_bytes_min: u64) -> Self {
        Self {
            bytes_max,
            free_bytes_min,
            segment_bytes: SEGMENT_BYTES.min(bytes_max / 8),
        }
    }
}

/// Where a record is on the disk: its bytes, and those before it since the record before.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place {
    /// The segment.
    pub segment: u64,
    /// The first byte.
    pub from: u64,
    /// The byte behind the last.
    pub to: u64,
    /// The stream's index in the segment.
    pub(crate) stream: u16,
}

/// Frames, and rows that say why there is none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Content {
    /// Frames.
    pub frames: u64,
    /// Rows without a frame.
    pub rows: u64,
}

impl Content {
    fn add(&mut self, is_frame: bool) {
        if is_frame {
            self.frames += 1;
        } else {
            self.rows += 1;
        }
    }

    fn take(&mut self, is_frame: bool) {
        if is_frame {
            self.frames = self.frames.saturating_sub(1);
        } else {
            self.rows = self.rows.saturating_sub(1);
        }
    }
}

/// What left the spool in another way than to the collector.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Dropped {
    /// Whose.
    pub stream: Arc<StreamId>,
    /// How much.
    pub content: Content,
    /// Why.
    pub reason: &'static str,
}

/// What became of a group of records that was to be written.
#[derive(Debug, Default)]
pub struct Written {
    /// Where the first so many of them are on the disk.
    pub places: Vec<Place>,
    /// Why the others are not.
    pub error: Option<io::Error>,
}

/// A segment that is there.
#[derive(Debug, Default)]
struct Segment {
    bytes: u64,
    streams: Vec<Arc<StreamId>>,
    failed_reads: u32,
}

/// Records that wait in a segment, without a gap between them.
#[derive(Debug, Default, Clone)]
struct Extent {
    to: u64,
    content: BTreeMap<u16, Content>,
}

/// The spool of one agent.
pub struct Spool {
    disk: Box<dyn Disk>,
    limits: Limits,
    own: (String, String),
    segments: BTreeMap<u64, Segment>,
    /// Segments of runs before, that are yet to be looked at.
    unread: VecDeque<u64>,
    writing: Option<(u64, Writing)>,
    next_number: u64,
    /// By segment and first byte.
    backlog: BTreeMap<(u64, u64), Extent>,
    waiting: BTreeMap<Arc<StreamId>, Content>,
    /// The highest number found on disk, while the segments of runs before are looked at.
    found_through: BTreeMap<Arc<StreamId>, u64>,
    /// Runs that are over, in the order of their ends.
    runs: Vec<Run>,
    own_run: Run,
    /// Runs of which nothing is to be sent for the time being.
    held: BTreeSet<String>,
    cursor: Cursor,
    dropped: Vec<Dropped>,
    removed: BTreeSet<u64>,
    messages: Vec<String>,
    quarantine_bytes: u64,
}

impl std::fmt::Debug for Spool {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("Spool")
            .field("segments", &self.segments.len())
            .field("waiting", &self.waiting)
            .finish_non_exhaustive()
    }
}

impl Spool {
    /// Takes over a disk for the run `boot` of `device`, and notes that run on it. The segments that it holds are looked
    /// at later, by [`Spool::recover`].
    ///
    /// # Errors
    /// [`OpenError`]. A disk that cannot be read is not taken; one that cannot be written is, and fails later.
    pub fn open(
        disk: Box<dyn Disk>,
        limits: Limits,
        device: &str,
        boot: &str,
        sensors: &[String],
    ) -> Result<Self, OpenError> {
        let mut spool = Self {
            disk,
            limits,
            own: (device.to_owned(), boot.to_owned()),
            segments: BTreeMap::new(),
            unread: VecDeque::new(),
            writing: None,
            next_number: 1,
            backlog: BTreeMap::new(),
            waiting: BTreeMap::new(),
            found_through: BTreeMap::new(),
            runs: Vec::new(),
            own_run: Run {
                device: device.to_owned(),
                boot: boot.to_owned(),
                sensors: sensors
                    .iter()
                    .map(|sensor| (sensor.clone(), Count::default()))
                    .collect(),
            },
            held: BTreeSet::new(),
            cursor: Cursor::default(),
            dropped: Vec::new(),
            removed: BTreeSet::new(),
            messages: Vec::new(),
            quarantine_bytes: 0,
        };
        spool.load()?;
        if let Err(error) = spool.save() {
            spool.say(&format!("state not written: {error}"));
        }
        Ok(spool)
    }

    /// What was dropped since this was last asked.
    pub fn take_dropped(&mut self) -> Vec<Dropped> {
        std::mem::take(&mut self.dropped)
    }

    /// The segments that are gone since this was last asked: what memory believes to be in them is on no disk.
    pub fn take_removed(&mut self) -> BTreeSet<u64> {
        std::mem::take(&mut self.removed)
    }

    /// What a person should know, since this was last asked.
    pub fn take_messages(&mut self) -> Vec<String> {
        std::mem::take(&mut self.messages)
    }

    /// Frames of this run, then frames of runs before, that wait on the disk.
    #[must_use]
    pub fn waiting_frames(&self) -> (u64, u64) {
        let mut frames = (0, 0);
        for (id, content) in &self.waiting {
            if id.boot == self.own.1 {
                frames.0 += content.frames;
            } else {
                frames.1 += content.frames;
            }
        }
        frames
    }

    /// Frames of this run that wait on the disk, by sensor.
    #[must_use]
    pub fn waiting_by_sensor(&self) -> BTreeMap<String, u64> {
        let own = self.waiting.iter().filter(|(id, _)| id.boot == self.own.1);
        own.map(|(id, content)| (id.sensor.clone(), content.frames))
            .collect()
    }

    /// Whether every segment of the runs before has been looked at.
    #[must_use]
    pub fn is_recovered(&self) -> bool {
        self.unread.is_empty()
    }

    /// Whether nothing waits on the disk.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.unread.is_empty() && self.backlog.is_empty()
    }

    /// Bytes of all segments.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.segments.values().map(|segment| segment.bytes).sum()
    }

    fn say(&mut self, message: &str) {
        /// Messages that wait to be logged.
        const MESSAGES_MAX: usize = 100;
        if self.messages.len() < MESSAGES_MAX {
            self.messages.push(format!("spool: {message}"));
        }
    }

    fn remove(&mut self, number: u64) -> io::Result<()> {
        self.segments.remove(&number);
        self.removed.insert(number);
        match self.disk.remove(&name_of(number)) {
            // A segment whose first write failed has no file.
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
            other => other,
        }
    }

    fn stream(&self, segment: u64, index: u16) -> Option<Arc<StreamId>> {
        let streams = &self.segments.get(&segment)?.streams;
        streams.get(usize::from(index)).map(Arc::clone)
    }
}

/// The name of a segment's file.
fn name_of(number: u64) -> String {
    format!("{SEGMENT_PREFIX}{number:016x}")
}

const SEGMENT_PREFIX: &str = "segment-";

/// The number in the name of a segment's file.
fn number_of(name: &str) -> Option<u64> {
    let digits = name.strip_prefix(SEGMENT_PREFIX)?;
    let number = u64::from_str_radix(digits, 16).ok()?;
    (name_of(number) == name).then_some(number)
}
