//! The log on the disk: reading what waits, oldest first, and taking off what need not be sent again.

use super::index::Spool;
use super::limits::{READS_MAX, SEGMENT_READ_MAX, SPOOL_FULL};
use super::name::name_of;
use super::types::{Dropped, Segment};
use crate::batch::{Batch, Item};
use std::io;
use std::sync::Arc;

impl Spool {
    /// The oldest records that wait at positions below `before`, all of one boot, at most `records_max`.
    ///
    /// # Errors
    /// Disk errors. After [`READS_MAX`] of them the segment is set aside and its frames count as
    /// [`SPOOL_DAMAGED`](super::SPOOL_DAMAGED), so that the rest goes on.
    pub fn next_batch(&mut self, records_max: usize, before: u64) -> io::Result<Option<Batch>> {
        if !self.unread.is_empty() {
            return Ok(None);
        }
        while let Some(number) = self.first_to_send(before) {
            let items = self.read(number, records_max, before);
            let items = items.inspect_err(|error| self.failed_read(number, error))?;
            if let Some(first) = items.first().map(|item| Arc::clone(&item.stream)) {
                return Ok(Some(Batch::of_backlog(&first.device, &first.boot, items)));
            }
            self.quarantine_unreadable(number, "its bytes changed on the disk");
        }
        Ok(None)
    }

    /// Takes acknowledged records off the log, or rejected ones for this reason. Returns those that waited, and those
    /// counted as dropped meanwhile.
    pub fn release(&mut self, items: Vec<Item>, reason: Option<&str>) -> (Vec<Item>, Vec<Item>) {
        let boot = items.first().map(|item| item.stream.boot.clone());
        let (here, gone): (Vec<Item>, Vec<Item>) =
            items.into_iter().partition(|item| self.take(item));
        for item in here.iter().filter(|item| item.is_frame()) {
            match (self.run_of(&item.stream), reason) {
                (None, _) => {}
                (Some(count), Some(reason)) => {
                    *count.dropped.entry(reason.to_owned()).or_default() += 1;
                }
                (Some(count), None) => count.acknowledged.insert(item.record.seq),
            }
        }
        for item in gone.iter().filter(|item| item.is_frame()) {
            let count = self.run_of(&item.stream);
            if let Some(dropped) = count.and_then(|count| count.dropped.get_mut(SPOOL_FULL)) {
                *dropped = dropped.saturating_sub(1);
            }
        }
        // If some had counted as dropped, the account sent with them is not the final one.
        if let Some(boot) = boot.filter(|_| gone.is_empty() && reason.is_none()) {
            self.forget_told_run(&boot);
        }
        (here, gone)
    }

    /// Takes records off the log that were settled in memory.
    pub(crate) fn settle(&mut self, items: Vec<Item>) {
        for item in items {
            self.take(&item);
        }
    }

    /// Takes one record off the log. If it was dropped and [`Spool::take_dropped`] has not told so, it counts as taken.
    fn take(&mut self, item: &Item) -> bool {
        let mut segments = self.segments.values_mut();
        let segment = segments.find(|segment| item.position < segment.through());
        if segment.is_some_and(|segment| segment.take(item)) {
            return true;
        }
        let mut dropped = self.dropped.iter_mut();
        let untold =
            dropped.find(|dropped| dropped.stream == item.stream && item.position < dropped.before);
        untold.is_some_and(|dropped| {
            self.own_run.boot == item.stream.boot && dropped.content.take(item.is_frame())
        })
    }

    /// The oldest segment that may be sent and has something below this position.
    fn first_to_send(&self, before: u64) -> Option<u64> {
        let may_be_sent = |segment: &Segment| {
            let mut waiting = segment.waiting.keys();
            waiting
                .next()
                .is_some_and(|id| !self.held.contains(&id.boot))
        };
        let (number, segment) = self
            .segments
            .iter()
            .find(|(_, segment)| may_be_sent(segment))?;
        (segment.first()? < before).then_some(*number)
    }

    /// Reads on where a segment's records wait.
    pub(super) fn read(
        &mut self,
        number: u64,
        records_max: usize,
        before: u64,
    ) -> io::Result<Vec<Item>> {
        let Some(segment) = self.segments.get_mut(&number) else {
            return Ok(Vec::new());
        };
        let length = usize::try_from(segment.end - segment.from).unwrap_or(SEGMENT_READ_MAX);
        let length = length.min(SEGMENT_READ_MAX);
        let bytes = self.disk.read(&name_of(number), segment.from, length)?;
        Ok(segment.items(number, &bytes, records_max, before))
    }

    /// Looks whether every segment can be read, so that a loss is counted before its turn to be sent: after [`READS_MAX`] of
    /// these looks, if none succeeds.
    pub fn look(&mut self) {
        let ends = self
            .segments
            .iter()
            .map(|(number, segment)| (*number, segment.end));
        for (number, end) in Vec::from_iter(ends) {
            let found = self.disk.read(&name_of(number), end.saturating_sub(1), 1);
            match (found, self.segments.get_mut(&number)) {
                (Ok(_), Some(segment)) => segment.failed_reads = 0,
                (Err(error), Some(_)) if !self.unread.contains(&number) => {
                    self.failed_read(number, &error);
                }
                _ => {}
            }
        }
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

    /// Counts what waits in a segment as dropped.
    pub(super) fn drop_waiting(&mut self, number: u64, reason: &'static str) {
        let Some(segment) = self.segments.get_mut(&number) else {
            return;
        };
        let before = segment.through();
        for (stream, content) in std::mem::take(&mut segment.waiting) {
            if let Some(count) = self.run_of(&stream) {
                *count.dropped.entry(reason.to_owned()).or_default() += content.frames;
            }
            self.dropped.push(Dropped {
                stream,
                content,
                reason,
                before,
            });
        }
    }
}
