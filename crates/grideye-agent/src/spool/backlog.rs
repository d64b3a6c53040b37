//! The backlog: which records wait on the disk, and how to read them back, oldest first.

use super::index::Spool;
use super::limits::{EXTENTS_MAX, READS_MAX, SEGMENT_READ_MAX, SPOOL_FULL};
use super::name::name_of;
use super::segment::{Entries, Entry};
use super::types::{Dropped, Extent};
use crate::batch::{Batch, Item, Place};
use std::io;
use std::sync::Arc;

impl Spool {
    /// Adds records that left memory to the backlog. If that would exceed [`EXTENTS_MAX`] extents, does nothing and
    /// returns false.
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

    /// The oldest records of the backlog, all of one boot, at most `records_max`.
    ///
    /// # Errors
    /// Disk errors. After [`READS_MAX`] of them the segment is set aside and its frames count as
    /// [`SPOOL_DAMAGED`](super::SPOOL_DAMAGED), so that the rest goes on.
    pub fn next_batch(&mut self, records_max: usize) -> io::Result<Option<Batch>> {
        if !self.unread.is_empty() {
            return Ok(None);
        }
        while let Some((segment, from, to)) = self.first_not_held() {
            let length = usize::try_from(to - from).unwrap_or(SEGMENT_READ_MAX);
            let length = length.min(SEGMENT_READ_MAX);
            let bytes = self.disk.read(&name_of(segment), from, length);
            let bytes = bytes.inspect_err(|error| self.failed_read(segment, error))?;
            let items = self.items(segment, from, &bytes, records_max);
            if let Some(first) = items.first().map(|item| Arc::clone(&item.stream)) {
                return Ok(Some(Batch::on_disk(&first.device, &first.boot, items)));
            }
            self.quarantine_unreadable(segment, "its bytes changed on the disk");
        }
        Ok(None)
    }

    /// Removes acknowledged records. Returns those found here, and those counted as dropped meanwhile, which now count
    /// as delivered.
    pub fn release(&mut self, items: Vec<Item>) -> (Vec<Item>, Vec<Item>) {
        let boot = items.first().map(|item| item.stream.boot.clone());
        let mut is_here = |item: &Item| {
            let is_frame = item.is_frame();
            item.place
                .is_some_and(|place| self.dequeue(place, is_frame))
        };
        let (delivered, returned) = items.into_iter().partition::<Vec<Item>, _>(&mut is_here);
        for item in returned.iter().filter(|item| item.is_frame()) {
            if let Some(count) = self.run_of(&item.stream) {
                if let Some(dropped) = count.dropped.get_mut(SPOOL_FULL) {
                    *dropped = dropped.saturating_sub(1);
                }
            }
        }
        // If some had counted as dropped, the account sent with them is not the final one.
        if let Some(boot) = boot.filter(|_| returned.is_empty()) {
            self.forget_told_run(&boot);
        }
        (delivered, returned)
    }

    /// Segment, start and end of the oldest extent that may be sent.
    fn first_not_held(&self) -> Option<(u64, u64, u64)> {
        let mut extents = self.backlog.iter();
        let found = extents.find(|((segment, _), _)| !self.is_held(*segment));
        found.map(|((segment, from), extent)| (*segment, *from, extent.to))
    }

    pub(super) fn enqueue(&mut self, place: Place, is_frame: bool) {
        let mut before = self.backlog.range_mut(..(place.segment, place.from));
        let adjoining = before
            .next_back()
            .filter(|((segment, _), extent)| *segment == place.segment && extent.to == place.from);
        let extent = match adjoining {
            Some((_, extent)) => extent,
            None => self.backlog.entry((place.segment, place.from)).or_default(),
        };
        extent.to = place.to;
        let content = extent.content.entry(place.stream).or_default();
        content.add(is_frame);
        if let Some(id) = self.stream(place.segment, place.stream) {
            self.waiting.entry(id).or_default().add(is_frame);
        }
    }

    /// Removes one record from the front of its extent in the backlog; false if it is not there.
    pub(super) fn dequeue(&mut self, place: Place, is_frame: bool) -> bool {
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

    /// The records in these bytes, which start at byte `from` of the segment, up to the first damaged one or one of
    /// another boot.
    fn items(&self, number: u64, from: u64, bytes: &[u8], records_max: usize) -> Vec<Item> {
        let mut items: Vec<Item> = Vec::new();
        let Some(segment) = self.segments.get(&number) else {
            return items;
        };
        let declared = u16::try_from(segment.streams.len()).unwrap_or(u16::MAX);
        let mut at = from;
        for entry in Entries::within(number, bytes, 0, declared).map_while(Result::ok) {
            let (end, Entry::Record(stream, record)) = entry else {
                continue;
            };
            let Some(id) = segment.streams.get(usize::from(stream)) else {
                break;
            };
            let is_of_another = |first: &Item| first.stream.boot != id.boot;
            if items.len() >= records_max || items.first().is_some_and(is_of_another) {
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

    fn failed_read(&mut self, number: u64, error: &io::Error) {
        let Some(segment) = self.segments.get_mut(&number) else {
            return;
        };
        segment.failed_reads += 1;
        if segment.failed_reads >= READS_MAX {
            self.quarantine_unreadable(number, &error.to_string());
        }
    }

    pub(super) fn drop_backlog_of(&mut self, number: u64, reason: &'static str) {
        let of_segment = self.backlog.range((number, 0)..=(number, u64::MAX));
        let gone: Vec<Extent> = of_segment.map(|(_, extent)| extent.clone()).collect();
        self.backlog.retain(|(segment, _), _| *segment != number);
        for (index, content) in gone.into_iter().flat_map(|extent| extent.content) {
            let Some(stream) = self.stream(number, index) else {
                continue;
            };
            if let Some(waiting) = self.waiting.get_mut(&stream) {
                waiting.frames = waiting.frames.saturating_sub(content.frames);
                waiting.rows = waiting.rows.saturating_sub(content.rows);
            }
            if let Some(count) = self.run_of(&stream) {
                *count.dropped.entry(reason.to_owned()).or_default() += content.frames;
            }
            self.dropped.push(Dropped {
                stream,
                content,
                reason,
            });
        }
    }
}

/// The number of extents, runs of records without a gap.
fn runs_in(items: &[(Place, bool)]) -> usize {
    let breaks = items
        .windows(2)
        .filter(|pair| pair[0].0.segment != pair[1].0.segment || pair[0].0.to != pair[1].0.from);
    breaks.count() + 1
}
