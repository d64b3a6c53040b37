//! When to read next.

use super::limits::{
    FAULTS_BEFORE_SET_UP, GUARD, NARROW, PROBE_EVERY, PROBE_LEAD, RETRIES_PER_FRAME,
    RETRY_PAUSE_MAX, SET_UP_PAUSE_MAX,
};
use super::machine::{Sampler, State};
use super::phase::Ns;
use crate::clock::signed_ns;
use grideye_frame::NoData;

impl Sampler {
    /// Sets the first read of the next frame.
    pub(super) fn plan(&mut self, now: Ns) {
        (self.retries, self.late_reads) = (0, 0);
        self.frames_unproved += 1;
        let Some(phase) = &self.phase else { return };
        let window = phase.window(self.next_seq);
        let at = if window.width() > self.narrow() {
            window.middle() - self.lateness
        } else if self.frames_unproved > PROBE_EVERY {
            window.after - PROBE_LEAD
        } else {
            window.until + GUARD
        };
        self.next_at = at.max(now);
    }

    /// How narrow a window need not be halved any more. A read tells of an update no better than to what it takes of
    /// the host beside the surely known time on the bus.
    pub(super) fn narrow(&self) -> Ns {
        NARROW + 2 * (self.quickest_read - self.transfer_min)
    }

    /// A read or a check that failed: once more within this frame, or from the next frame on, or from the start.
    pub(super) fn failed(&mut self, now: Ns, reason: NoData) {
        if let Some(pending) = self.pending.take() {
            self.resolve(&pending, None);
        }
        if self.state == State::Done {
            return;
        }
        self.fault(now, reason);
        self.faults_in_a_row += 1;
        let does_answer = matches!(reason, NoData::AllZero | NoData::StuckHigh);
        if does_answer && self.faults_in_a_row >= FAULTS_BEFORE_SET_UP {
            return self.set_up_again(now);
        }
        self.next_at = now + self.retry_pause(now);
        self.settings_due = Some(self.next_at);
    }

    /// An eighth of a period a few times within one frame, then from the next frame on, then ever longer.
    pub(super) fn retry_pause(&mut self, now: Ns) -> Ns {
        let soon = self.nominal / 8;
        if self.faults_in_a_row > FAULTS_BEFORE_SET_UP {
            let doublings = (self.faults_in_a_row - FAULTS_BEFORE_SET_UP).min(16);
            return (soon << doublings).min(signed_ns(RETRY_PAUSE_MAX).max(self.nominal));
        }
        self.retries += 1;
        match &self.phase {
            Some(phase) if self.retries > RETRIES_PER_FRAME => {
                self.retries = 0;
                let next_frame = phase.window(self.next_seq + 1).until + GUARD - now;
                next_frame.clamp(soon, 2 * self.nominal)
            }
            _ => soon,
        }
    }

    pub(super) fn set_up_again(&mut self, now: Ns) {
        self.state = State::SetUp;
        self.faults_in_a_row = self.faults_in_a_row.max(1);
        self.next_at = now + self.set_up_pause;
        self.set_up_pause = (2 * self.set_up_pause).min(signed_ns(SET_UP_PAUSE_MAX));
    }
}
