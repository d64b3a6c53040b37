//! What the ring holds of one sensor, and its account.

use crate::batch::{Lane, Place};
use crate::limits::LIVE_FOR;
use grideye_recording::wire::Account;
use grideye_recording::{Record, StreamId};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;
use std::time::Duration;

/// The reason under which frames are dropped because the ring was full.
pub const RING_FULL: &str = "ring-full";
/// The count of rows of missing frames that were dropped, which are no frames that were read.
pub const ROWS_DROPPED: &str = "missing-rows-dropped";
/// Kinds of faults that one account tells apart at most; the rest are counted together.
pub const FAULT_KINDS_MAX: usize = 32;
/// The count of faults beyond [`FAULT_KINDS_MAX`] kinds.
pub const OTHER_FAULTS: &str = "other";

/// One sensor of a ring.
#[derive(Debug)]
pub(super) struct Stream {
    pub(super) id: Arc<StreamId>,
    /// In ascending seq.
    pub(super) held: VecDeque<Held>,
    pub(super) account: Account,
    pub(super) acknowledged: u64,
    /// Numbers in a post whose fate is not known: the collector may have them.
    pub(super) in_doubt: BTreeSet<u64>,
    /// Those of them that were dropped and counted since.
    pub(super) dropped_in_doubt: BTreeSet<u64>,
}

#[derive(Debug)]
pub(super) struct Held {
    pub(super) arrival: u64,
    pub(super) at: Duration,
    pub(super) record: Record,
    pub(super) place: Option<Place>,
}

/// A record in memory that is on the disk as well.
#[derive(Debug, Clone)]
pub struct OnDisk {
    pub(super) id: Arc<StreamId>,
    pub(super) seq: u64,
    /// Where.
    pub place: Place,
    /// Whether it carries pixels.
    pub is_frame: bool,
}

impl Held {
    pub(super) fn is_frame(&self) -> bool {
        self.record.reading.frame().is_some()
    }
}

impl Stream {
    /// Counts what became of a record: acknowledged, or dropped for a reason.
    pub(super) fn settle(&mut self, is_frame: bool, reason: Option<&str>) {
        if is_frame {
            self.account.spooled = self.account.spooled.saturating_sub(1);
        }
        match (is_frame, reason) {
            (true, None) => self.acknowledged += 1,
            (true, Some(reason)) => {
                *self.account.dropped.entry(reason.to_owned()).or_default() += 1;
            }
            (false, None) => {}
            (false, Some(_)) => count(&mut self.account.errors, ROWS_DROPPED, 1),
        }
    }

    /// Counts as acknowledged what had been counted as dropped.
    pub(super) fn take_back(&mut self, is_frame: bool, reason: &str) {
        let counts = if is_frame {
            self.acknowledged += 1;
            &mut self.account.dropped
        } else {
            &mut self.account.errors
        };
        let reason = if is_frame { reason } else { ROWS_DROPPED };
        if let Some(dropped) = counts.get_mut(reason) {
            *dropped = dropped.saturating_sub(1);
            if *dropped == 0 {
                counts.remove(reason);
            }
        }
    }

    pub(super) fn index_of(&self, seq: u64) -> Option<usize> {
        self.held
            .binary_search_by_key(&seq, |held| held.record.seq)
            .ok()
    }

    /// The records of a lane, as a range of what is held.
    pub(super) fn range(&self, lane: Lane, now: Duration) -> std::ops::Range<usize> {
        let live_from = self.held.partition_point(|held| held.at + LIVE_FOR <= now);
        match lane {
            Lane::Live => live_from..self.held.len(),
            Lane::Late => 0..live_from,
            Lane::Disk => 0..0,
        }
    }
}

pub(super) fn count(counts: &mut BTreeMap<String, u64>, kind: &str, more: u64) {
    if more == 0 {
        return;
    }
    let is_known = counts.contains_key(kind) || counts.len() < FAULT_KINDS_MAX;
    let kind = if is_known { kind } else { OTHER_FAULTS };
    *counts.entry(kind.to_owned()).or_default() += more;
}
