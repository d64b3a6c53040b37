//! Quarantine: records that the collector refuses, and segments that cannot be read.

use super::disk::QUARANTINE;
use super::index::Spool;
use super::limits::{QUARANTINE_BYTES_MAX, SPOOL_DAMAGED};
use super::name::name_of;
use crate::batch::{Batch, Item, Lane};
use std::collections::BTreeMap;
use std::io;

impl Spool {
    /// Moves a record that the collector refuses to the quarantine, where it can be posted from as it is, one line a
    /// record.
    ///
    /// # Errors
    /// What the disk said, or that the quarantine is full; the record leaves the spool all the same.
    pub fn quarantine(&mut self, item: &Item, reason: &str) -> io::Result<()> {
        if let Some(place) = item.place {
            self.dequeue(place, item.is_frame());
        }
        if let Some(count) = self.run_of(&item.stream) {
            if item.is_frame() {
                *count.dropped.entry(reason.to_owned()).or_default() += 1;
            }
        }
        let batch = Batch {
            lane: Lane::Disk,
            device: item.stream.device.clone(),
            boot: item.stream.boot.clone(),
            items: vec![item.clone()],
        };
        let mut line = batch
            .to_wire(&BTreeMap::new())
            .to_json()
            .map_err(io::Error::other)?;
        line.push(b'\n');
        let name = format!("{QUARANTINE}/refused-{}.jsonl", item.stream.boot);
        self.check_quarantine_room(line.len())?;
        self.disk.append(&name, &line)?;
        self.disk.sync(&name)?;
        self.disk.sync_folder()
    }

    /// Moves a segment that cannot be read to the quarantine, so that the rest goes on.
    pub(super) fn quarantine_unreadable(&mut self, number: u64, why: &str) {
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

    pub(super) fn check_quarantine_room(&mut self, length: usize) -> io::Result<()> {
        let length = u64::try_from(length).unwrap_or(u64::MAX);
        if self.quarantine_bytes.saturating_add(length) > QUARANTINE_BYTES_MAX {
            let full = "the quarantine is full: what is set aside is counted and not kept\nhint: look at it, then empty the folder";
            return Err(io::Error::new(io::ErrorKind::StorageFull, full));
        }
        self.quarantine_bytes += length;
        Ok(())
    }
}
