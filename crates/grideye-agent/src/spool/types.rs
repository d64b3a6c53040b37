//! The spool's data: segments, the records that wait in them, and what it dropped.

use super::segment::{Encoder, Entries, Entry, HEADER_BYTES};
use crate::batch::Item;
use crate::ranges::Ranges;
use grideye_recording::StreamId;
use std::collections::BTreeMap;
use std::io;
use std::ops::Range;
use std::sync::Arc;

/// Numbers of frames and of missing frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Content {
    /// Frames.
    pub frames: u64,
    /// Missing frames.
    pub rows: u64,
}

impl Content {
    fn of_kind(&mut self, is_frame: bool) -> &mut u64 {
        if is_frame {
            &mut self.frames
        } else {
            &mut self.rows
        }
    }

    pub(super) fn take(&mut self, is_frame: bool) -> bool {
        let count = self.of_kind(is_frame);
        let is_there = *count > 0;
        *count = count.saturating_sub(1);
        is_there
    }
}

/// Records that left the spool without reaching the collector.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Dropped {
    /// Their stream.
    pub stream: Arc<StreamId>,
    /// How much.
    pub content: Content,
    /// Why.
    pub reason: &'static str,
    /// The first position after them.
    pub(crate) before: u64,
}

/// The outcome of writing records.
#[derive(Debug, Default)]
pub struct Written {
    /// How many records, from the first on, are on the disk.
    pub records: usize,
    /// Why the others are not.
    pub error: Option<io::Error>,
}

/// A part of the log on the disk.
#[derive(Debug)]
pub(super) struct Segment {
    /// Bytes of its file.
    pub(super) bytes: u64,
    /// Where its whole records end.
    pub(super) end: u64,
    /// Where the first record starts that may still wait.
    pub(super) from: u64,
    pub(super) streams: Vec<Arc<StreamId>>,
    /// The positions of all its records, ascending as in the file.
    positions: Vec<Range<u64>>,
    /// How many records are before `from`.
    passed: usize,
    /// The records at earlier positions do not wait.
    begin: u64,
    /// Nor do these of the others.
    pub(super) done: Ranges,
    /// How much waits, of each stream that has something.
    pub(super) waiting: BTreeMap<Arc<StreamId>, Content>,
    pub(super) failed_reads: u32,
}

impl Segment {
    /// A segment whose file has this many bytes.
    pub(super) fn new(bytes: u64) -> Self {
        let header = offset(HEADER_BYTES);
        Self {
            bytes,
            end: header,
            from: header,
            streams: Vec::new(),
            positions: Vec::new(),
            passed: 0,
            begin: 0,
            done: Ranges::default(),
            waiting: BTreeMap::new(),
            failed_reads: 0,
        }
    }

    /// Adds the next record of the file, which waits if `is_waiting`.
    pub(super) fn push(
        &mut self,
        position: u64,
        id: &Arc<StreamId>,
        is_frame: bool,
        is_waiting: bool,
    ) {
        match self.positions.last_mut() {
            Some(last) if last.end == position => last.end += 1,
            _ => self.positions.push(position..position + 1),
        }
        if is_waiting {
            let content = self.waiting.entry(Arc::clone(id)).or_default();
            *content.of_kind(is_frame) += 1;
        } else {
            self.done.insert(position);
        }
    }

    /// Takes one record that waits; false if it does not wait here.
    pub(super) fn take(&mut self, item: &Item) -> bool {
        let position = item.position;
        let run = self.positions.partition_point(|run| run.end <= position);
        let run = self.positions.get(run);
        let is_here = position >= self.begin && run.is_some_and(|run| run.contains(&position));
        if !is_here || self.done.contains(position) {
            return false;
        }
        if let Some(content) = self.waiting.get_mut(&item.stream) {
            content.take(item.is_frame());
            if *content == Content::default() {
                self.waiting.remove(&item.stream);
            }
        }
        self.done.insert(position);
        if self.waiting.is_empty() {
            (self.from, self.begin, self.done) = (self.end, self.through(), Ranges::default());
            self.passed = self.ascending(0).count();
        }
        true
    }

    /// Lets those of the lost frames of a stream wait again that are here, and takes them out of `lost`. `bytes` are those
    /// of the whole segment behind its header.
    pub(super) fn wait_again(
        &mut self,
        number: u64,
        bytes: &[u8],
        id: &Arc<StreamId>,
        lost: &mut Ranges,
    ) {
        let declared = u16::try_from(self.streams.len()).unwrap_or(u16::MAX);
        let entries = Entries::within(number, bytes, 0, declared).map_while(Result::ok);
        let records = entries.filter_map(|(_, entry)| match entry {
            Entry::Record(stream, record) => Some((stream, record)),
            _ => None,
        });
        let (mut done, mut frames) = (Ranges::default(), 0);
        for (position, (stream, record)) in self.ascending(0).zip(records) {
            if position >= self.begin && !self.done.contains(position) {
                continue;
            }
            let is_of_stream = self.streams.get(usize::from(stream)) == Some(id);
            if is_of_stream && !lost.take(&(record.seq..record.seq + 1)).is_empty() {
                frames += 1;
            } else {
                done.insert(position);
            }
        }
        if frames > 0 {
            self.waiting.entry(Arc::clone(id)).or_default().frames += frames;
            (self.from, self.passed, self.begin) = (offset(HEADER_BYTES), 0, 0);
            self.done = done;
        }
    }

    /// The positions of all records but the first `skipped`.
    fn ascending(&self, skipped: usize) -> impl Iterator<Item = u64> + '_ {
        self.positions.iter().cloned().flatten().skip(skipped)
    }

    /// The oldest position that waits.
    pub(super) fn first(&self) -> Option<u64> {
        self.ascending(self.passed)
            .find(|position| !self.done.contains(*position))
    }

    /// One past the last position.
    pub(super) fn through(&self) -> u64 {
        self.positions.last().map_or(0, |run| run.end)
    }

    /// Forgets records at the front that do not wait.
    fn skip(&mut self, records: usize) {
        self.passed += records;
        let first = self.ascending(self.passed).next();
        if let Some(first) = first.filter(|first| !self.done.contains(*first)) {
            self.begin = first;
            self.done.forget_below(first);
        }
    }

    /// The records in `bytes`, which begin at `from`, that wait and have a position below `before`, up to the first
    /// damaged one.
    pub(super) fn items(
        &mut self,
        number: u64,
        bytes: &[u8],
        records_max: usize,
        before: u64,
    ) -> Vec<Item> {
        let declared = u16::try_from(self.streams.len()).unwrap_or(u16::MAX);
        let (begin, mut skipped) = (self.from, 0);
        let mut items: Vec<Item> = Vec::new();
        let mut positions = self.positions.iter().cloned().flatten().skip(self.passed);
        for entry in Entries::within(number, bytes, 0, declared).map_while(Result::ok) {
            let (end, Entry::Record(stream, record)) = entry else {
                continue;
            };
            let end = begin + offset(end);
            let id = self.streams.get(usize::from(stream));
            let (Some(position), Some(id)) = (positions.next(), id) else {
                break;
            };
            if self.done.contains(position) {
                if items.is_empty() {
                    (self.from, skipped) = (end, skipped + 1);
                }
                continue;
            }
            if position >= before || items.len() >= records_max {
                break;
            }
            items.push(Item::new(position, Arc::clone(id), record));
        }
        self.skip(skipped);
        items
    }
}

/// A number of bytes in a file.
pub(super) fn offset(bytes: usize) -> u64 {
    u64::try_from(bytes).unwrap_or(u64::MAX)
}

#[derive(Debug)]
pub(super) struct Writing {
    pub(super) encoder: Encoder,
    pub(super) end: u64,
    pub(super) is_named_on_disk: bool,
}
