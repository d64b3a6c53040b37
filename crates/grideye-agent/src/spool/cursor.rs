//! The start of the backlog, saved on the disk before anything ahead of it is removed.

use super::disk::replace;
use super::index::Spool;
use super::state::{Cursor, STATE, State};
use crate::batch::Place;
use grideye_recording::StreamId;
use grideye_recording::wire::Account;
use std::collections::BTreeSet;
use std::io;
use std::sync::Arc;

impl Spool {
    /// Removes segments that neither the backlog nor a record in memory refers to. Keeps the one being written if
    /// `keeps_writing`.
    ///
    /// # Errors
    /// Disk errors; they lose nothing.
    pub fn tidy(&mut self, in_memory: &BTreeSet<Place>, keeps_writing: bool) -> io::Result<()> {
        let mut needed: BTreeSet<u64> = self.backlog.keys().map(|(segment, _)| *segment).collect();
        needed.extend(in_memory.iter().map(|place| place.segment));
        needed.extend(&self.unread);
        let writing = self.writing.as_ref().map(|(number, _)| *number);
        needed.extend(writing.filter(|_| keeps_writing));
        let numbers = self.segments.keys().copied();
        let finished: Vec<u64> = numbers.filter(|number| !needed.contains(number)).collect();
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

    /// Saves the start of the backlog and each boot's counts, so that the next start sends nothing twice.
    ///
    /// # Errors
    /// Disk errors.
    pub fn checkpoint(
        &mut self,
        in_memory: &BTreeSet<Place>,
        accounts: &[(Arc<StreamId>, Account)],
    ) -> io::Result<()> {
        self.renew_own_run(accounts);
        self.move_cursor(in_memory);
        self.save()
    }

    /// Like [`Spool::checkpoint`], at the end of a boot. If everything was delivered, the next start need not report
    /// for it.
    ///
    /// # Errors
    /// Disk errors.
    pub fn close(
        &mut self,
        in_memory: &BTreeSet<Place>,
        accounts: &[(Arc<StreamId>, Account)],
    ) -> io::Result<()> {
        if accounts.iter().all(|(_, account)| account.spooled == 0) {
            self.own_run.sensors.clear();
        }
        self.checkpoint(in_memory, accounts)
    }

    fn move_cursor(&mut self, in_memory: &BTreeSet<Place>) {
        let of_place = |place: &Place| (place.segment, place.from);
        let first_unread = self.unread.front().map(|number| (*number, 0));
        let first_waiting = self.backlog.keys().next().copied();
        let firsts = [first_waiting, in_memory.first().map(of_place), first_unread];
        let here = firsts.into_iter().flatten().min();
        let writing = self.writing.as_ref();
        let end = writing.map(|(number, writing)| (*number, writing.end));
        let (segment, offset) = here.or(end).unwrap_or((self.next_number, 0));
        self.cursor = self.cursor.max(Cursor { segment, offset });
    }

    pub(super) fn save(&mut self) -> io::Result<()> {
        let mut runs = self.runs.clone();
        if !self.own_run.sensors.is_empty() {
            runs.push(self.own_run.clone());
        }
        let cursor = self.cursor;
        let state = State { cursor, runs };
        replace(self.disk.as_mut(), STATE, &state.to_bytes())
    }
}
