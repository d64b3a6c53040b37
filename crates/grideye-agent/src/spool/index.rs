//! The spool's index in memory: its segments, the records that wait in them, and messages for the log.

use super::disk::{Disk, OpenError};
use super::limits::{Limits, RUNS_AHEAD_MAX};
use super::name::name_of;
use super::state::{Count, Cursor, Run};
use super::types::{Dropped, Segment, Writing};
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
    /// The position of the next record found on the disk.
    pub(super) next_found: u64,
    /// While segments of earlier boots are read: the highest sequence number found on disk.
    pub(super) found_through: BTreeMap<Arc<StreamId>, u64>,
    /// Ended boots, in the order of their ends.
    pub(super) runs: Vec<Run>,
    pub(super) own_run: Run,
    /// Boots whose records are held for now.
    pub(super) held: BTreeSet<String>,
    pub(super) cursor: Cursor,
    pub(super) dropped: Vec<Dropped>,
    pub(super) messages: Vec<String>,
    pub(super) quarantine_bytes: u64,
}

impl fmt::Debug for Spool {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Spool")
            .field("segments", &self.segments.len())
            .field("waiting", &self.waiting_frames())
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
            next_found: 0,
            found_through: BTreeMap::new(),
            runs: Vec::new(),
            own_run: Run {
                device: device.to_owned(),
                boot: boot.to_owned(),
                sensors: sensors.map(|sensor| (sensor, Count::default())).collect(),
                is_told: false,
            },
            held: BTreeSet::new(),
            cursor: Cursor::default(),
            dropped: Vec::new(),
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

    /// Messages for the log since the last call.
    pub fn take_messages(&mut self) -> Vec<String> {
        std::mem::take(&mut self.messages)
    }

    /// Frames that wait on the disk: of this boot, and of earlier ones.
    #[must_use]
    pub fn waiting_frames(&self) -> (u64, u64) {
        let own: u64 = self.waiting_by_sensor(&self.own_run.boot).values().sum();
        let all = self
            .segments
            .values()
            .flat_map(|segment| segment.waiting.values());
        let all: u64 = all.map(|content| content.frames).sum();
        (own, all - own)
    }

    /// Frames of a boot that wait on the disk, by sensor; a sensor of which only missing frames wait has 0.
    #[must_use]
    pub fn waiting_by_sensor(&self, boot: &str) -> BTreeMap<String, u64> {
        let mut frames = BTreeMap::new();
        for (id, content) in self.segments.values().flat_map(|segment| &segment.waiting) {
            if id.boot == boot {
                *frames.entry(id.sensor.clone()).or_default() += content.frames;
            }
        }
        frames
    }

    /// Whether nothing waits on the disk.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        let mut segments = self.segments.values();
        self.unread.is_empty() && segments.all(|segment| segment.waiting.is_empty())
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
        match self.disk.remove(&name_of(number)) {
            // A segment has no file if its first write failed.
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
            other => other,
        }
    }

    /// Whether so many runs of records were acknowledged before older ones that no more should be.
    #[must_use]
    pub fn is_scattered(&self) -> bool {
        let runs = self.segments.values().map(|segment| segment.done.len());
        runs.sum::<usize>() >= RUNS_AHEAD_MAX
    }
}
