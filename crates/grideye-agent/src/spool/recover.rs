//! Recovers what earlier boots left on the disk.

use super::disk::{OpenError, QUARANTINE};
use super::index::Spool;
use super::limits::{RUNS_MAX, SEGMENT_READ_MAX};
use super::name::{name_of, number_of};
use super::segment::{Entries, Entry, Fault, HEADER_BYTES, VERSION, check_header};
use super::state::{Count, Run, STATE, STATE_BYTES_MAX, STATE_VERSION, State};
use super::types::{Segment, offset};
use grideye_recording::StreamId;
use std::sync::Arc;

impl Spool {
    /// Reads the next segment of an earlier boot: adds its records to the backlog up to the first incomplete one, and
    /// sets the rest aside. False when none is left.
    pub fn recover(&mut self) -> bool {
        let Some(number) = self.unread.pop_front() else {
            return false;
        };
        let name = name_of(number);
        match self.disk.read(&name, 0, SEGMENT_READ_MAX) {
            Ok(bytes) => {
                // An earlier boot may have written bytes without syncing them: they are readable but can still be lost.
                // If it then wrote them again, the synced copy is dropped in favor of this one, so sync it now.
                if let Err(error) = self.disk.sync(&name) {
                    self.say(&format!("{name} cannot be synced: {error}"));
                }
                self.look_at(number, &bytes);
            }
            Err(error) => {
                self.segments.remove(&number);
                self.say(&format!(
                    "{name} cannot be read ({error}) and stays in place"
                ));
            }
        }
        if self.unread.is_empty() {
            self.found_through.clear();
        }
        true
    }

    /// Reads the names and the state.
    pub(super) fn load(&mut self) -> Result<(), OpenError> {
        let names = self.disk.list()?;
        let mut numbers: Vec<u64> = names.iter().filter_map(|name| number_of(name)).collect();
        numbers.sort_unstable();
        self.refuse_newer(&numbers)?;
        let quarantined = names.iter().filter(|name| name.starts_with(QUARANTINE));
        self.quarantine_bytes = quarantined
            .map(|name| self.disk.size(name).unwrap_or(0))
            .sum();
        if names.iter().any(|name| name == STATE) {
            self.load_state();
        }
        let next = numbers.last().map_or(1, |last| last + 1);
        self.next_number = next.max(self.cursor.segment).max(1);
        for number in numbers {
            if number < self.cursor.segment {
                // A crash came between saving the cursor and removing the segment.
                let _ = self.disk.remove(&name_of(number));
                continue;
            }
            let bytes = self.disk.size(&name_of(number)).unwrap_or(0);
            self.segments.insert(number, Segment::new(bytes));
            self.unread.push_back(number);
        }
        Ok(())
    }

    /// Runs before any change, because a later version's files must not be overwritten. Unreadable files are reported
    /// later.
    fn refuse_newer(&self, numbers: &[u64]) -> Result<(), OpenError> {
        let check = |name: String, found: Option<u32>, known: u32| match found {
            Some(found) if found > known => Err(OpenError::Newer(name, found, known)),
            _ => Ok(()),
        };
        let state = self.disk.read(STATE, 0, STATE_BYTES_MAX).ok();
        let found = state.and_then(|state| State::version(&state));
        check(STATE.to_owned(), found, STATE_VERSION)?;
        for number in numbers {
            let name = name_of(*number);
            let header = self.disk.read(&name, 0, HEADER_BYTES).unwrap_or_default();
            let found = match check_header(*number, &header) {
                Err(Fault::OtherVersion(found)) => Some(found),
                _ => None,
            };
            check(name, found, VERSION)?;
        }
        Ok(())
    }

    fn load_state(&mut self) {
        let bytes = self.disk.read(STATE, 0, STATE_BYTES_MAX);
        let state = bytes.ok().and_then(|bytes| State::from_bytes(&bytes));
        if let Some(state) = state {
            self.cursor = state.cursor;
            self.runs = state.runs;
            self.forget_runs_beyond_the_limit();
            return;
        }
        let aside = format!("{QUARANTINE}/{STATE}");
        let moved = self.disk.rename(STATE, &aside);
        let what = moved.map_or("left where it is".to_owned(), |()| {
            format!("set aside as {aside}")
        });
        self.say(&format!(
            "state is damaged: {what}; some frames may be sent again, which is harmless"
        ));
    }

    fn forget_runs_beyond_the_limit(&mut self) {
        let surplus = (self.runs.len() + 1).saturating_sub(RUNS_MAX);
        if surplus > 0 {
            self.runs.drain(..surplus);
            self.say(&format!(
                "more than {RUNS_MAX} boots ended without a report to the collector; the oldest {surplus} are forgotten, and their losses stay uncounted"
            ));
        }
    }

    fn look_at(&mut self, number: u64, bytes: &[u8]) {
        let entries = match Entries::of_segment(number, bytes) {
            Ok(entries) => entries,
            // The power failed before any of it was on the disk.
            Err(Fault::NoHeader)
                if bytes.len() < HEADER_BYTES || bytes.iter().all(|byte| *byte == 0) =>
            {
                self.segments.remove(&number);
                let _ = self.disk.remove(&name_of(number));
                return;
            }
            Err(fault) => {
                let (name, what) = self.set_aside(number);
                return self.say(&format!("{name}: {fault}; {what}"));
            }
        };
        let mut whole = HEADER_BYTES;
        for entry in entries {
            match entry {
                Ok((end, entry)) => {
                    whole = end;
                    self.take_in(number, offset(end), entry);
                }
                Err(fault) => {
                    self.quarantine_rest(number, whole, &bytes[whole..], &fault);
                    break;
                }
            }
        }
        if let Some(segment) = self.segments.get_mut(&number) {
            segment.end = offset(whole);
        }
    }

    /// Takes in an entry that ends at byte `end` of a segment.
    fn take_in(&mut self, number: u64, end: u64, entry: Entry) {
        let stream = match &entry {
            Entry::Stream(index, _) | Entry::Record(index, _) | Entry::Account(index, _) => *index,
        };
        let streams = self.segments.get(&number).map(|segment| &segment.streams);
        let id = streams.and_then(|streams| streams.get(usize::from(stream)).map(Arc::clone));
        match (entry, id) {
            (Entry::Stream(_, id), _) => self.declare(number, stream, id),
            (Entry::Account(_, account), Some(id)) => {
                if let Some(count) = self.run_of(&id) {
                    count.take_in(&account);
                }
            }
            (Entry::Record(_, record), Some(id)) => {
                // An unsynced record was written again.
                let through = self.found_through.get(&id);
                let is_new = through.is_none_or(|through| record.seq > *through);
                if is_new {
                    self.found_through.insert(Arc::clone(&id), record.seq);
                }
                let is_needed = number != self.cursor.segment || end > self.cursor.offset;
                let Some(segment) = self.segments.get_mut(&number) else {
                    return;
                };
                let is_frame = record.reading.frame().is_some();
                segment.push(self.next_found, &id, is_frame, is_new && is_needed);
                self.next_found += 1;
            }
            (_, None) => {}
        }
    }

    fn declare(&mut self, number: u64, index: u16, id: Arc<StreamId>) {
        self.note_run(&id);
        if let Some(segment) = self.segments.get_mut(&number) {
            if usize::from(index) == segment.streams.len() {
                segment.streams.push(id);
            }
        }
    }

    /// A boot missing from the state is reconstructed from its records.
    fn note_run(&mut self, id: &StreamId) {
        let known = self.runs.iter_mut().find(|run| run.boot == id.boot);
        if let Some(run) = known {
            run.sensors.entry(id.sensor.clone()).or_default();
            return;
        }
        self.runs.push(Run {
            device: id.device.clone(),
            boot: id.boot.clone(),
            sensors: [(id.sensor.clone(), Count::default())].into(),
            is_told: false,
        });
    }

    /// The name includes the place, so setting the rest aside twice is harmless.
    fn quarantine_rest(&mut self, number: u64, whole: usize, rest: &[u8], fault: &Fault) {
        let name = name_of(number);
        let aside = format!("{QUARANTINE}/{name}-from-byte-{whole}");
        let kept = self.check_quarantine_room(rest.len()).and_then(|()| {
            self.disk.write(&aside, rest)?;
            self.disk.sync(&aside)?;
            self.disk.sync_folder()
        });
        let what = match kept {
            Ok(()) => format!("set aside as {aside}"),
            Err(error) => format!("not kept: {error}"),
        };
        self.say(&format!(
            "{name}: {fault}, as after a power cut; the last {} bytes are {what}, and everything before them is delivered",
            rest.len()
        ));
    }
}
