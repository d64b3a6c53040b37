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

pub mod disk;
mod recover;
pub mod segment;
mod state;

pub use disk::{Disk, Folder, FolderError, LOCK, QUARANTINE};
pub use state::RUNS_MAX;

use crate::parcel::{Item, Lane, Parcel};
use disk::replace;
use grideye_recording::wire::Account;
use grideye_recording::{Record, StreamId};
use segment::{Encoder, Entries, Entry};
use state::{Count, Cursor, Run, STATE, State};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::io;
use std::sync::Arc;

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
    stream: u16,
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

/// The segment that is being written.
#[derive(Debug)]
struct Writing {
    encoder: Encoder,
    end: u64,
    is_named_on_disk: bool,
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
    /// What the disk said. A disk that cannot be read is not taken; one that cannot be written is, and fails later.
    pub fn open(
        disk: Box<dyn Disk>,
        limits: Limits,
        device: &str,
        boot: &str,
        sensors: &[String],
    ) -> io::Result<Self> {
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

    /// Writes records, oldest first, behind the accounts of their streams, and syncs them.
    ///
    /// Where there is no room the oldest backlog goes; see [`Spool::take_dropped`] and [`Spool::take_removed`].
    pub fn write(
        &mut self,
        records: &[(Arc<StreamId>, Record)],
        accounts: &[(Arc<StreamId>, Account)],
    ) -> Written {
        let mut written = Written::default();
        for (id, account) in accounts {
            if let Some(count) = self.own_run.sensors.get_mut(&id.sensor) {
                count.renew(account);
            }
        }
        while let Some(rest) = records
            .get(written.places.len()..)
            .filter(|rest| !rest.is_empty())
        {
            match self.write_some(rest, accounts) {
                Ok(places) => written.places.extend(places),
                Err(error) => {
                    self.abandon();
                    written.error = Some(error);
                    return written;
                }
            }
        }
        written
    }

    /// Puts records that have left the memory into the backlog. False, and nothing done, where that would be more than
    /// [`EXTENTS_MAX`] runs of records.
    pub fn add_backlog(&mut self, items: &[(Place, bool)]) -> bool {
        if self.backlog.len() + items.len() > EXTENTS_MAX
            && self.backlog.len() + runs_in(items) > EXTENTS_MAX
        {
            return false;
        }
        for (place, is_frame) in items {
            self.enqueue(*place, *is_frame);
        }
        true
    }

    /// The oldest records of the backlog, of one run, at most so many.
    ///
    /// # Errors
    /// What the disk said. After [`READS_MAX`] of them the segment is set aside and its frames are counted as
    /// [`SPOOL_DAMAGED`], so that the rest goes on.
    pub fn next_parcel(&mut self, records_max: usize) -> io::Result<Option<Parcel>> {
        if !self.unread.is_empty() {
            return Ok(None);
        }
        while let Some((&(segment, from), extent)) = self.backlog.first_key_value() {
            let to = extent.to;
            let length = usize::try_from(to - from).unwrap_or(SEGMENT_READ_MAX);
            let bytes = match self
                .disk
                .read(&name_of(segment), from, length.min(SEGMENT_READ_MAX))
            {
                Ok(bytes) => bytes,
                Err(error) => {
                    self.failed_read(segment, &error);
                    return Err(error);
                }
            };
            let items = self.items(segment, from, &bytes, records_max);
            if let Some(first) = items.first() {
                let (device, boot) = (first.stream.device.clone(), first.stream.boot.clone());
                return Ok(Some(Parcel {
                    lane: Lane::Disk,
                    device,
                    boot,
                    items,
                }));
            }
            self.give_up(segment, "what was written is not what is read");
        }
        Ok(None)
    }

    /// Lets go of records that the collector has. Returns those that were here, and those that had been counted as dropped
    /// meanwhile, which are to be counted as delivered after all.
    pub fn release(&mut self, items: Vec<Item>) -> (Vec<Item>, Vec<Item>) {
        let boot = items.first().map(|item| item.stream.boot.clone());
        let (delivered, returned): (Vec<Item>, Vec<Item>) = items.into_iter().partition(|item| {
            item.place
                .is_some_and(|place| self.dequeue(place, item.is_frame()))
        });
        for item in returned.iter().filter(|item| item.is_frame()) {
            if let Some(count) = self.run_of(&item.stream) {
                if let Some(dropped) = count.dropped.get_mut(SPOOL_FULL) {
                    *dropped = dropped.saturating_sub(1);
                }
            }
        }
        if let Some(boot) = boot {
            self.forget_told_run(&boot);
        }
        (delivered, returned)
    }

    /// Keeps a record in quarantine that the collector refuses for ever, and lets go of it. What is kept can be posted as
    /// it is, one line a record.
    ///
    /// # Errors
    /// What the disk said, or that the quarantine is full; the record is let go of all the same.
    pub fn set_aside(&mut self, item: &Item, reason: &str) -> io::Result<()> {
        if let Some(place) = item.place {
            self.dequeue(place, item.is_frame());
        }
        if let Some(count) = self.run_of(&item.stream) {
            if item.is_frame() {
                *count.dropped.entry(reason.to_owned()).or_default() += 1;
            }
        }
        let parcel = Parcel {
            lane: Lane::Disk,
            device: item.stream.device.clone(),
            boot: item.stream.boot.clone(),
            items: vec![item.clone()],
        };
        let mut line = parcel
            .batch(&BTreeMap::new())
            .to_json()
            .map_err(io::Error::other)?;
        line.push(b'\n');
        let name = format!("{QUARANTINE}/refused-{}.jsonl", item.stream.boot);
        self.check_quarantine_room(line.len())?;
        self.disk.append(&name, &line)?;
        self.disk.sync(&name)?;
        self.disk.sync_folder()
    }

    /// The accounts of a run that is over, by sensor; `None` for the run that goes on.
    #[must_use]
    pub fn ended_accounts(&self, boot: &str) -> Option<BTreeMap<String, Account>> {
        let run = self.runs.iter().find(|run| run.boot == boot)?;
        let account = |(sensor, count): (&String, &Count)| {
            let id = stream_of(run, sensor);
            let waiting = self.waiting.get(&id).copied().unwrap_or_default();
            (sensor.clone(), count.of_ended(waiting.frames))
        };
        Some(run.sensors.iter().map(account).collect())
    }

    /// An empty parcel of a run that is over, has nothing on disk, and has not been told of yet.
    #[must_use]
    pub fn ended_run(&self) -> Option<Parcel> {
        if !self.unread.is_empty() {
            return None;
        }
        let run = self.runs.iter().find(|run| !self.holds_any_of(run))?;
        Some(Parcel {
            lane: Lane::Disk,
            device: run.device.clone(),
            boot: run.boot.clone(),
            items: Vec::new(),
        })
    }

    /// Forgets a run: the collector knows that it is over.
    pub fn told(&mut self, boot: &str) {
        self.runs.retain(|run| run.boot != boot);
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

    /// Removes the segments that nothing refers to: no backlog, and no record in memory that believes to be in it. The
    /// one that is being written stays if `keeps_writing`.
    ///
    /// # Errors
    /// What the disk said; nothing is lost by it.
    pub fn tidy(&mut self, in_memory: &BTreeSet<Place>, keeps_writing: bool) -> io::Result<()> {
        let mut needed: BTreeSet<u64> = self.backlog.keys().map(|(segment, _)| *segment).collect();
        needed.extend(in_memory.iter().map(|place| place.segment));
        needed.extend(&self.unread);
        let writing = self.writing.as_ref().map(|(number, _)| *number);
        needed.extend(writing.filter(|_| keeps_writing));
        let finished: Vec<u64> = self
            .segments
            .keys()
            .copied()
            .filter(|number| !needed.contains(number))
            .collect();
        if finished.is_empty() {
            return Ok(());
        }
        if writing.is_some_and(|writing| finished.contains(&writing)) {
            self.writing = None;
        }
        self.move_cursor(in_memory);
        self.save()?;
        for number in finished {
            self.remove(number)?;
        }
        self.disk.sync_folder()
    }

    /// Writes down where the backlog begins and what the runs' counts are, so that the next start sends nothing twice.
    ///
    /// # Errors
    /// What the disk said.
    pub fn checkpoint(
        &mut self,
        in_memory: &BTreeSet<Place>,
        accounts: &[(Arc<StreamId>, Account)],
    ) -> io::Result<()> {
        for (id, account) in accounts {
            if let Some(count) = self.own_run.sensors.get_mut(&id.sensor) {
                count.renew(account);
            }
        }
        self.move_cursor(in_memory);
        self.save()
    }

    /// Like [`Spool::checkpoint`], for a run that ends with everything delivered: the next start need not speak for it.
    ///
    /// # Errors
    /// What the disk said.
    pub fn close(
        &mut self,
        in_memory: &BTreeSet<Place>,
        accounts: &[(Arc<StreamId>, Account)],
    ) -> io::Result<()> {
        let is_delivered = accounts.iter().all(|(_, account)| account.spooled == 0);
        if is_delivered {
            self.own_run.sensors.clear();
        }
        self.checkpoint(in_memory, accounts)
    }

    fn say(&mut self, message: &str) {
        /// Messages that wait to be logged.
        const MESSAGES_MAX: usize = 100;
        if self.messages.len() < MESSAGES_MAX {
            self.messages.push(format!("spool: {message}"));
        }
    }

    // ---- writing -------------------------------------------------------------------------------------------------

    /// Writes as many records as go into one segment.
    fn write_some(
        &mut self,
        records: &[(Arc<StreamId>, Record)],
        accounts: &[(Arc<StreamId>, Account)],
    ) -> io::Result<Vec<Place>> {
        let (number, mut writing) = match self.writing.take() {
            Some((number, writing)) if writing.end < self.limits.segment_bytes => (number, writing),
            _ => self.begin(),
        };
        let begin = writing.end;
        let (bytes, places) = self.encode(number, &mut writing, records, accounts);
        let length = u64::try_from(bytes.len()).unwrap_or(u64::MAX);
        self.make_room(number, length)?;
        let segment = self.segments.entry(number).or_default();
        segment.bytes = begin + length;
        let name = name_of(number);
        self.disk.append(&name, &bytes)?;
        self.disk.sync(&name)?;
        if !writing.is_named_on_disk {
            self.disk.sync_folder()?;
            writing.is_named_on_disk = true;
        }
        segment.streams = writing.encoder.streams().to_vec();
        writing.end = begin + length;
        self.writing = Some((number, writing));
        Ok(places)
    }

    fn begin(&mut self) -> (u64, Writing) {
        let number = self.next_number;
        self.next_number += 1;
        let writing = Writing {
            encoder: Encoder::new(number),
            end: 0,
            is_named_on_disk: false,
        };
        (number, writing)
    }

    fn encode(
        &self,
        number: u64,
        writing: &mut Writing,
        records: &[(Arc<StreamId>, Record)],
        accounts: &[(Arc<StreamId>, Account)],
    ) -> (Vec<u8>, Vec<Place>) {
        let begin = writing.end;
        let at = |bytes: &Vec<u8>| begin + u64::try_from(bytes.len()).unwrap_or(u64::MAX);
        let mut bytes = if begin == 0 {
            writing.encoder.header()
        } else {
            Vec::new()
        };
        // In front of the frames, so that there is no frame on disk that no account knows of.
        for (id, account) in accounts {
            writing.encoder.account(&mut bytes, id, account);
        }
        let mut places = Vec::new();
        // The first record's place takes in what stands before it, so that the places of two groups adjoin.
        let mut from = begin.max(segment::HEADER_BYTES_U64);
        for (id, record) in records {
            let (_, stream) = writing.encoder.record(&mut bytes, id, record);
            let to = at(&bytes);
            places.push(Place {
                segment: number,
                from,
                to,
                stream,
            });
            from = to;
            if to >= self.limits.segment_bytes {
                break;
            }
        }
        (bytes, places)
    }

    /// Gives up the segment that was being written: what of it was not synced is not known to be there.
    fn abandon(&mut self) {
        self.writing = None;
    }

    /// Drops the oldest backlog until there is room, but never the segment of this number.
    fn make_room(&mut self, writing: u64, length: u64) -> io::Result<()> {
        loop {
            let fits = self.bytes().saturating_add(length) <= self.limits.bytes_max;
            let free = self.disk.free_bytes()?;
            let wanted = self.limits.free_bytes_min.saturating_add(length);
            if fits && free >= wanted {
                return Ok(());
            }
            // Where others have filled the disk, giving up the backlog would not make the room.
            if free.saturating_add(self.bytes()) < wanted {
                let what = format!("{free} bytes are free on the disk, and {wanted} are wanted");
                return Err(io::Error::new(io::ErrorKind::StorageFull, what));
            }
            let oldest = self
                .segments
                .keys()
                .copied()
                .find(|number| *number != writing);
            let Some(oldest) = oldest else {
                return Err(io::Error::new(io::ErrorKind::StorageFull, "no room"));
            };
            while self.unread.front() == Some(&oldest) {
                self.recover();
            }
            self.drop_segment(oldest, SPOOL_FULL)?;
        }
    }

    /// The cursor first, so that a crash in between leaves a segment too many and not one too few.
    fn drop_segment(&mut self, number: u64, reason: &'static str) -> io::Result<()> {
        self.drop_backlog_of(number, reason);
        if self.segments.contains_key(&number) {
            self.cursor = self.cursor.max(Cursor {
                segment: number + 1,
                offset: 0,
            });
            // On a disk without a free byte the state cannot be written either, and removing is what makes room.
            let saved = self.save();
            self.remove(number)?;
            saved.or_else(|_full| self.save())?;
            self.disk.sync_folder()?;
        }
        Ok(())
    }

    fn drop_backlog_of(&mut self, number: u64, reason: &'static str) {
        let keys: Vec<(u64, u64)> = self
            .backlog
            .range((number, 0)..=(number, u64::MAX))
            .map(|(key, _)| *key)
            .collect();
        for key in keys {
            let Some(extent) = self.backlog.remove(&key) else {
                continue;
            };
            for (stream, content) in extent.content {
                let Some(id) = self.stream(number, stream) else {
                    continue;
                };
                self.count_dropped(&id, content, reason);
            }
        }
    }

    fn count_dropped(&mut self, id: &Arc<StreamId>, content: Content, reason: &'static str) {
        if let Some(waiting) = self.waiting.get_mut(id) {
            waiting.frames = waiting.frames.saturating_sub(content.frames);
            waiting.rows = waiting.rows.saturating_sub(content.rows);
        }
        if let Some(count) = self.run_of(id) {
            *count.dropped.entry(reason.to_owned()).or_default() += content.frames;
        }
        self.dropped.push(Dropped {
            stream: Arc::clone(id),
            content,
            reason,
        });
    }

    /// The count of a run that is over; that of the run that goes on is the ring's.
    fn run_of(&mut self, id: &StreamId) -> Option<&mut Count> {
        let run = self.runs.iter_mut().find(|run| run.boot == id.boot)?;
        run.sensors.get_mut(&id.sensor)
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

    // ---- backlog -------------------------------------------------------------------------------------------------

    fn enqueue(&mut self, place: Place, is_frame: bool) {
        let before = self
            .backlog
            .range_mut(..(place.segment, place.from))
            .next_back();
        let adjoining = before
            .filter(|((segment, _), extent)| *segment == place.segment && extent.to == place.from);
        let extent = match adjoining {
            Some((_, extent)) => extent,
            None => self.backlog.entry((place.segment, place.from)).or_default(),
        };
        extent.to = place.to;
        extent
            .content
            .entry(place.stream)
            .or_default()
            .add(is_frame);
        if let Some(id) = self.stream(place.segment, place.stream) {
            self.waiting.entry(id).or_default().add(is_frame);
        }
    }

    /// Takes one record out of the backlog, from the front of its run of records; false if it is not there.
    fn dequeue(&mut self, place: Place, is_frame: bool) -> bool {
        let key = (place.segment, place.from);
        let Some(mut extent) = self.backlog.remove(&key) else {
            return false;
        };
        if let Some(content) = extent.content.get_mut(&place.stream) {
            content.take(is_frame);
        }
        if extent.to > place.to {
            self.backlog.insert((place.segment, place.to), extent);
        }
        if let Some(id) = self.stream(place.segment, place.stream) {
            if let Some(waiting) = self.waiting.get_mut(&id) {
                waiting.take(is_frame);
            }
        }
        true
    }

    fn stream(&self, segment: u64, index: u16) -> Option<Arc<StreamId>> {
        let streams = &self.segments.get(&segment)?.streams;
        streams.get(usize::from(index)).map(Arc::clone)
    }

    /// The records in these bytes, from byte `from` of the segment on, up to the first of another run or the first that
    /// is damaged.
    fn items(&self, number: u64, from: u64, bytes: &[u8], records_max: usize) -> Vec<Item> {
        let mut items: Vec<Item> = Vec::new();
        let Some(segment) = self.segments.get(&number) else {
            return items;
        };
        let declared = u16::try_from(segment.streams.len()).unwrap_or(u16::MAX);
        let mut at = from;
        for entry in Entries::within(number, bytes, 0, declared).map_while(Result::ok) {
            let (end, Entry::Record { stream, record }) = entry else {
                continue;
            };
            let Some(id) = segment.streams.get(usize::from(stream)) else {
                break;
            };
            if items.len() >= records_max
                || items
                    .first()
                    .is_some_and(|first| first.stream.boot != id.boot)
            {
                break;
            }
            let to = from + u64::try_from(end).unwrap_or(u64::MAX);
            let place = Place {
                segment: number,
                from: at,
                to,
                stream,
            };
            at = to;
            items.push(Item {
                stream: Arc::clone(id),
                record,
                place: Some(place),
            });
        }
        items
    }

    fn failed_read(&mut self, segment: u64, error: &io::Error) {
        let failed = self.segments.get_mut(&segment).map(|segment| {
            segment.failed_reads += 1;
            segment.failed_reads
        });
        if failed.is_some_and(|failed| failed >= READS_MAX) {
            self.give_up(segment, &error.to_string());
        }
    }

    /// Sets a segment aside that cannot be read, so that the rest goes on.
    fn give_up(&mut self, number: u64, why: &str) {
        self.drop_backlog_of(number, SPOOL_DAMAGED);
        let name = name_of(number);
        let aside = format!("{QUARANTINE}/{name}");
        let moved = self
            .disk
            .rename(&name, &aside)
            .and_then(|()| self.disk.sync_folder());
        self.segments.remove(&number);
        self.removed.insert(number);
        if self
            .writing
            .as_ref()
            .is_some_and(|(writing, _)| *writing == number)
        {
            self.abandon();
        }
        let what = match moved {
            Ok(()) => format!("set aside as {aside}"),
            Err(error) => format!("and it cannot be set aside: {error}"),
        };
        self.say(&format!(
            "{name} cannot be read ({why}), {what}; its frames are counted as {SPOOL_DAMAGED}"
        ));
    }

    fn check_quarantine_room(&mut self, length: usize) -> io::Result<()> {
        let length = u64::try_from(length).unwrap_or(u64::MAX);
        if self.quarantine_bytes.saturating_add(length) > QUARANTINE_BYTES_MAX {
            let full = "the quarantine is full: what is set aside is counted and not kept\nhint: look at it, then empty the folder";
            return Err(io::Error::new(io::ErrorKind::StorageFull, full));
        }
        self.quarantine_bytes += length;
        Ok(())
    }

    // ---- runs and state ------------------------------------------------------------------------------------------

    fn holds_any_of(&self, run: &Run) -> bool {
        let of_run = |id: &Arc<StreamId>| id.boot == run.boot && id.device == run.device;
        self.waiting
            .iter()
            .any(|(id, content)| of_run(id) && *content != Content::default())
    }

    /// A run whose last records were just acknowledged has been told of with them.
    fn forget_told_run(&mut self, boot: &str) {
        let run = self.runs.iter().find(|run| run.boot == boot);
        if run.is_some_and(|run| !self.holds_any_of(run)) {
            self.waiting.retain(|id, _| id.boot != boot);
            self.told(boot);
        }
    }

    fn move_cursor(&mut self, in_memory: &BTreeSet<Place>) {
        let of_place = |place: &Place| (place.segment, place.from);
        let first_unread = self.unread.front().map(|number| (*number, 0));
        let here = self
            .backlog
            .first_key_value()
            .map(|(key, _)| *key)
            .into_iter()
            .chain(in_memory.first().map(of_place))
            .chain(first_unread)
            .min();
        let end = self
            .writing
            .as_ref()
            .map(|(number, writing)| (*number, writing.end));
        let (segment, offset) = here.or(end).unwrap_or((self.next_number, 0));
        self.cursor = self.cursor.max(Cursor { segment, offset });
    }

    fn save(&mut self) -> io::Result<()> {
        let mut runs = self.runs.clone();
        if !self.own_run.sensors.is_empty() {
            runs.push(self.own_run.clone());
        }
        let state = State {
            cursor: self.cursor,
            runs,
        };
        replace(self.disk.as_mut(), STATE, &state.to_bytes())
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

fn stream_of(run: &Run, sensor: &str) -> Arc<StreamId> {
    Arc::new(StreamId {
        device: run.device.clone(),
        sensor: sensor.to_owned(),
        boot: run.boot.clone(),
    })
}

/// How many runs of records without a gap these are.
fn runs_in(items: &[(Place, bool)]) -> usize {
    let breaks = items
        .windows(2)
        .filter(|pair| pair[0].0.segment != pair[1].0.segment || pair[0].0.to != pair[1].0.from);
    breaks.count() + 1
}
