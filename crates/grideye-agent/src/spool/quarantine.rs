//! Quarantine: records that the collector rejects, and unreadable segments.

use super::disk::{QUARANTINE, REFUSED};
use super::index::Spool;
use super::limits::{QUARANTINE_BYTES_MAX, SPOOL_DAMAGED};
use super::name::name_of;
use crate::batch::{Batch, Item};
use std::collections::BTreeMap;
use std::io;

impl Spool {
    /// Writes a rejected record to the quarantine, as one line of JSON ready to post.
    ///
    /// # Errors
    /// Disk errors, or that the quarantine is full.
    pub fn quarantine(&mut self, item: &Item) -> io::Result<()> {
        let boot = &item.stream.boot;
        let batch = Batch::of_backlog(&item.stream.device, boot, vec![item.clone()]);
        let line = batch.to_wire(&BTreeMap::new()).to_json();
        let mut line = line.map_err(io::Error::other)?;
        line.push(b'\n');
        let name = format!("{QUARANTINE}/{REFUSED}{boot}.jsonl");
        self.check_quarantine_room(line.len())?;
        self.disk.append(&name, &line)?;
        self.disk.sync(&name)?;
        self.disk.sync_folder()
    }

    /// Moves an unreadable segment to the quarantine, so that the rest goes on.
    pub(super) fn quarantine_unreadable(&mut self, number: u64, why: &str) {
        self.drop_waiting(number, SPOOL_DAMAGED);
        self.writing.take_if(|(writing, _)| *writing == number);
        let (name, what) = self.set_aside(number);
        self.say(&format!(
            "{name} cannot be read ({why}), {what}; its frames are counted as {SPOOL_DAMAGED}"
        ));
    }

    /// Moves a segment to the quarantine. Returns its name, and a phrase with the outcome.
    pub(super) fn set_aside(&mut self, number: u64) -> (String, String) {
        self.segments.remove(&number);
        let name = name_of(number);
        let aside = format!("{QUARANTINE}/{name}");
        let moved = self.disk.rename(&name, &aside);
        let what = match moved.and_then(|()| self.disk.sync_folder()) {
            Ok(()) => format!("set aside as {aside}"),
            Err(error) => format!("and it cannot be set aside: {error}"),
        };
        (name, what)
    }

    pub(super) fn check_quarantine_room(&mut self, length: usize) -> io::Result<()> {
        let length = u64::try_from(length).unwrap_or(u64::MAX);
        if self.quarantine_bytes.saturating_add(length) > QUARANTINE_BYTES_MAX {
            let full = "the quarantine is full: further data is counted but not stored\nhint: look at its files, then empty the folder";
            return Err(io::Error::new(io::ErrorKind::StorageFull, full));
        }
        self.quarantine_bytes += length;
        Ok(())
    }
}
