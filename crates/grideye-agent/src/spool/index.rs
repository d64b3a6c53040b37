//! The spool's index in memory: its segments, the records that wait in them, and messages for the log.

use super::disk::{Disk, OpenError};
use super::limits::Limits;
use super::name::name_of;
use super::state::{Count, Cursor, Run};
use super::types::{Content, Dropped, Extent, Segment, Writing};
use grideye_recording::StreamId;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fmt;
use std::io;
use std::sync::Arc;

/// The spool of one agent.
pub struct Spool {
    pub(super) disk: Box<dyn Disk>,
    pub(super) limits: Limits,
    pub(super) segments: BTreeMap<u64, Segment>,
    /// Segments of earlier boots that are still to be read.
    pub(super) unread: VecDeque<u64>,
    pub(super) writing: Option<(u64, Writing)>,
    pub(super) next_number: u64,
    /// By segment and first byte.
    pub(super) backlog: BTreeMap<(u64, u64), Extent>,
    pub(super) waiting: BTreeMap<Arc<StreamId>, Content>,
    /// While segments of earlier boots are read: the highest sequence number found on disk.
    pub(super) found_through: BTreeMap<Arc<StreamId>, u64>,
    /// Ended boots, in the order of their ends.
    pub(super) runs: Vec<Run>,
    pub(super) own_run: Run,
    /// Boots whose records are held for now.
    pub(super) held: BTreeSet<String>,
    pub(super) cursor: Cursor,
    pub(super) dropped: Vec<Dropped>,
    pub(super) removed: BTreeSet<u64>,
    pub(super) messages: Vec<String>,
    pub(super) quarantine_bytes: u64,
}

impl fmt::Debug for Spool {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Spool")
            .field("segments", &self.segments.len())
            .field("waiting", &self.waiting)
            .finish_non_exhaustive()
    }
}

impl Spool {
    /// Opens the spool on a disk for the boot `boot` of `device`, and saves that boot in its state. [`Spool::recover`]
    /// reads the segments later.
    ///
    /// # Errors
    /// [`OpenError`]. An unreadable disk is rejected; an unwritable one is accepted and fails later.
    pub fn open(
        disk: Box<dyn Disk>,
        limits: Limits,
        device: &str,
        boot: &str,
        sensors: &[String],
    ) -> Result<Self, OpenError> {
        let sensors = sensors.iter().cloned();
        let mut spool = Self {
            disk,
            limits,
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
                sensors: sensors.map(|sensor| (sensor, Count::default())).collect(),
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

    /// Records dropped since the last call.
    pub fn take_dropped(&mut self) -> Vec<Dropped> {
        std::mem::take(&mut self.dropped)
    }

    /// Segments removed since the last call: records in memory placed in them are on no disk.
    pub fn take_removed(&mut self) -> BTreeSet<u64> {
        std::mem::take(&mut self.removed)
    }

    /// Messages for the log since the last call.
    pub fn take_messages(&mut self) -> Vec<String> {
        std::mem::take(&mut self.messages)
    }

    /// Frames that wait on the disk: of this boot, and of earlier ones.
    #[must_use]
    pub fn waiting_frames(&self) -> (u64, u64) {
        let mut frames = (0, 0);
        for (id, content) in &self.waiting {
            if id.boot == self.own_run.boot {
                frames.0 += content.frames;
            } else {
                frames.1 += content.frames;
            }
        }
        frames
    }

    /// Frames of this boot that wait on the disk, by sensor.
    #[must_use]
    pub fn waiting_by_sensor(&self) -> BTreeMap<String, u64> {
        let boot = &self.own_run.boot;
        let own = self.waiting.iter().filter(|(id, _)| id.boot == *boot);
        own.map(|(id, content)| (id.sensor.clone(), content.frames))
            .collect()
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

    pub(super) fn say(&mut self, message: &str) {
        /// Maximum number of messages that wait to be logged.
        const MESSAGES_MAX: usize = 100;
        if self.messages.len() < MESSAGES_MAX {
            self.messages.push(format!("spool: {message}"));
        }
    }

    pub(super) fn remove(&mut self, number: u64) -> io::Result<()> {
        self.segments.remove(&number);
        self.removed.insert(number);
        match self.disk.remove(&name_of(number)) {
            // A segment has no file if its first write failed.
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
            other => other,
        }
    }

    pub(super) fn stream(&self, segment: u64, index: u16) -> Option<Arc<StreamId>> {
        let streams = &self.segments.get(&segment)?.streams;
        streams.get(usize::from(index)).map(Arc::clone)
    }
}
