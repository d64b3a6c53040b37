//! The start of the backlog, saved on the disk before anything ahead of it is removed.

use super::disk::replace;
use super::index::Spool;
use super::state::{Cursor, STATE, State};
use super::types::Segment;
use grideye_recording::StreamId;
use grideye_recording::wire::Account;
use std::io;
use std::sync::Arc;

impl Spool {
    /// Removes segments in which nothing waits. Keeps the one being written if `keeps_writing`.
    ///
    /// # Errors
    /// Disk errors; they lose nothing.
    pub fn tidy(&mut self, keeps_writing: bool) -> io::Result<()> {
        let writing = self.writing.as_ref().map(|(number, _)| *number);
        let is_finished = |(number, segment): &(&u64, &Segment)| {
            let is_kept = keeps_writing && writing == Some(**number);
            segment.waiting.is_empty() && !self.unread.contains(number) && !is_kept
        };
        let finished = self.segments.iter().filter(is_finished);
        let finished: Vec<u64> = finished.map(|(number, _)| *number).collect();
        if finished.is_empty() {
            return Ok(());
        }
        if writing.is_some_and(|writing| finished.contains(&writing)) {
            self.writing = None;
        }
        self.move_cursor();
        self.save()?;
        for number in finished {
            self.remove(number)?;
        }
        self.disk.sync_folder()
    }

    /// Saves the start of the backlog and each boot's counts, so that the next start sends nothing twice.
    ///
    /// # Errors
    /// Disk errors.
    pub fn checkpoint(&mut self, accounts: &[(Arc<StreamId>, Account)]) -> io::Result<()> {
        self.renew_own_run(accounts);
        self.move_cursor();
        self.save()
    }

    fn move_cursor(&mut self) {
        let waiting = self
            .segments
            .iter()
            .find(|(_, segment)| !segment.waiting.is_empty());
        let number = waiting.map(|(number, _)| *number);
        // Those at its front that were acknowledged from memory need not be sent again.
        let skipped = number.map(|number| self.read(number, 0, u64::MAX));
        drop(skipped);
        let here = number.and_then(|number| Some((number, self.segments.get(&number)?.from)));
        let first_unread = self.unread.front().map(|number| (*number, 0));
        let here = [here, first_unread].into_iter().flatten().min();
        let writing = self.writing.as_ref();
        let end = writing.map(|(number, writing)| (*number, writing.end));
        let (segment, offset) = here.or(end).unwrap_or((self.next_number, 0));
        self.cursor = self.cursor.max(Cursor { segment, offset });
    }

    pub(super) fn save(&mut self) -> io::Result<()> {
        let mut runs = self.runs.clone();
        runs.push(self.own_run.clone());
        let cursor = self.cursor;
        let state = State { cursor, runs };
        replace(self.disk.as_mut(), STATE, &state.to_bytes())
    }
}
