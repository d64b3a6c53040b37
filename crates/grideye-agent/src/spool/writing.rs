//! Writes records into the current segment, and makes room for them.

use super::index::Spool;
use super::limits::SPOOL_FULL;
use super::name::name_of;
use super::segment::Encoder;
use super::state::Cursor;
use super::types::{Segment, Writing, Written};
use crate::batch::Item;
use grideye_recording::StreamId;
use grideye_recording::wire::Account;
use std::io;
use std::sync::Arc;

impl Spool {
    /// Writes records, oldest first, after the accounts of their streams, and syncs them.
    ///
    /// If there is no room, drops the oldest backlog; see [`Spool::take_dropped`].
    pub fn write(&mut self, records: &[Item], accounts: &[(Arc<StreamId>, Account)]) -> Written {
        self.renew_own_run(accounts);
        let mut written = Written::default();
        while written.records < records.len() {
            match self.write_some(&records[written.records..], accounts) {
                Ok(records) => written.records += records,
                Err(error) => {
                    // Unsynced bytes of the segment may be missing, so the next write starts another segment.
                    self.writing = None;
                    written.error = Some(error);
                    break;
                }
            }
        }
        written
    }

    /// Writes as many records as fit into one segment.
    fn write_some(
        &mut self,
        records: &[Item],
        accounts: &[(Arc<StreamId>, Account)],
    ) -> io::Result<usize> {
        let (number, mut writing) = match self.writing.take() {
            Some((number, writing)) if writing.end < self.limits.segment_bytes => (number, writing),
            _ => self.begin(),
        };
        let begin = writing.end;
        let (bytes, written) = self.encode(&mut writing, records, accounts);
        let length = u64::try_from(bytes.len()).unwrap_or(u64::MAX);
        self.make_room(number, length)?;
        let segment = self.segments.entry(number);
        let segment = segment.or_insert_with(|| Segment::new(0));
        segment.bytes = begin + length;
        let name = name_of(number);
        self.disk.append(&name, &bytes)?;
        self.disk.sync(&name)?;
        if !writing.is_named_on_disk {
            self.disk.sync_folder()?;
            writing.is_named_on_disk = true;
        }
        segment.streams = writing.encoder.streams().to_vec();
        for item in &records[..written] {
            segment.push(item.position, &item.stream, item.is_frame(), true);
        }
        writing.end = begin + length;
        segment.end = writing.end;
        self.writing = Some((number, writing));
        Ok(written)
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

    /// The next bytes of the segment, and how many records they contain.
    fn encode(
        &self,
        writing: &mut Writing,
        records: &[Item],
        accounts: &[(Arc<StreamId>, Account)],
    ) -> (Vec<u8>, usize) {
        let mut bytes = if writing.end == 0 {
            writing.encoder.header()
        } else {
            Vec::new()
        };
        // Before the frames, so that every frame on disk is in an account.
        for (id, account) in accounts {
            writing.encoder.account(&mut bytes, id, account);
        }
        let mut written = 0;
        for item in records {
            let length = u64::try_from(bytes.len()).unwrap_or(u64::MAX);
            if written > 0 && writing.end + length >= self.limits.segment_bytes {
                break;
            }
            writing
                .encoder
                .record(&mut bytes, &item.stream, &item.record);
            written += 1;
        }
        (bytes, written)
    }

    /// Drops the oldest backlog until there is room, but never this segment.
    fn make_room(&mut self, writing: u64, length: u64) -> io::Result<()> {
        loop {
            let fits = self.bytes().saturating_add(length) <= self.limits.bytes_max;
            let free = self.disk.free_bytes()?;
            let wanted = self.limits.free_bytes_min.saturating_add(length);
            if fits && free >= wanted {
                return Ok(());
            }
            // If other files filled the disk, dropping the backlog would not make enough room.
            if free.saturating_add(self.bytes()) < wanted {
                let what = format!("{free} bytes are free on the disk, and {wanted} are wanted");
                return Err(io::Error::new(io::ErrorKind::StorageFull, what));
            }
            let mut numbers = self.segments.keys().copied();
            let Some(oldest) = numbers.find(|number| *number != writing) else {
                return Err(io::Error::new(io::ErrorKind::StorageFull, "no room"));
            };
            while self.unread.front() == Some(&oldest) {
                self.recover();
            }
            self.drop_segment(oldest)?;
        }
    }

    /// Save the cursor first, so that a crash in between leaves one segment too many, not one too few.
    fn drop_segment(&mut self, number: u64) -> io::Result<()> {
        self.drop_waiting(number, SPOOL_FULL);
        if !self.segments.contains_key(&number) {
            return Ok(());
        }
        let (segment, offset) = (number + 1, 0);
        self.cursor = self.cursor.max(Cursor { segment, offset });
        // On a disk without a free byte the state cannot be written either; removing the segment makes room for it.
        let saved = self.save();
        self.remove(number)?;
        saved.or_else(|_full| self.save())?;
        self.disk.sync_folder()
    }
}
