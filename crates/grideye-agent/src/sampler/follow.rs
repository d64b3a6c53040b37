//! Decides which frame a read shows: the previous one, or which new one.

use super::content::{Pending, Read, Seen};
use super::event::{Event, OUT_OF_STEP};
use super::event::{FIRST_FRAME_PERIODS, GUARD, LATE_READS, LIVELY_FRAMES, STILL_FRAMES};
use super::machine::{Sampler, State};
use super::phase::{Ns, OutOfStep, Period, Phase, Window};
use grideye_frame::NoData;

impl Sampler {
    pub(super) fn still_zero(&mut self, since: Ns, read: &Read) {
        self.last = Some(Seen::by(read, None));
        if read.before > since + Ns::from(FIRST_FRAME_PERIODS) * self.nominal {
            self.fault(read.after, NoData::AllZero);
            self.set_up_again(read.after);
        } else {
            self.reckon(read.after);
            self.next_at = read.after + self.nominal / 10;
        }
    }

    /// Looks for the first frame after a set-up. Content from before two frames have passed may be old.
    pub(super) fn settle(&mut self, since: Ns, read: &Read) {
        let longest = Period::nominal(self.nominal).max;
        let has_settled = read.before >= since + 2 * longest;
        // Longer-lasting zeros come from a dead link and reveal no update.
        let is_starting = read.before < since + 4 * longest;
        let update_after = match &self.last {
            Some(seen) if seen.content.is_zero() && is_starting => Some(seen.before),
            Some(seen)
                if has_settled && !seen.content.is_zero() && seen.content != read.content =>
            {
                Some(seen.before)
            }
            _ => has_settled.then(|| read.before - longest),
        };
        if let Some(after) = update_after {
            self.start(read, Window::new(after, read.latched_until));
        } else {
            self.last = Some(Seen::by(read, None));
            self.reckon(read.after);
            self.next_at = read.after + self.nominal / 10;
        }
    }

    /// Follows the sensor from this frame on; the number of frames since the last one is an estimate.
    pub(super) fn start(&mut self, read: &Read, window: Window) {
        if let Some(phase) = &self.phase {
            let half = phase.period.middle() / 2;
            let mut seq = self.next_seq;
            while phase.window(seq).middle() + half <= window.middle() {
                seq += 1;
            }
            self.is_estimated = false;
            self.estimated();
            self.miss_until(seq, read.before);
        }
        self.phase = Some(Phase::new(self.nominal, self.next_seq, window));
        self.state = State::Follow;
        self.record(self.next_seq, read);
    }

    pub(super) fn follow(&mut self, read: &Read) {
        if let Some(pending) = self.pending.take() {
            self.resolve(&pending, Some(read));
        }
        let (Some(_), Some(seen)) = (&self.phase, self.last) else {
            return self.start(read, self.unseen(read));
        };
        if self.state == State::Done {
            return;
        }
        if seen.content == read.content {
            self.last = Some(Seen::by(read, seen.seq));
            self.unchanged(read);
        } else {
            self.changed(read, &seen);
        }
    }

    /// Whether the bounds of the update of frame `seq` are so wide that no read fits between it and the next.
    pub(super) fn is_lost(&self, seq: u64) -> bool {
        self.phase.as_ref().is_none_or(|phase| {
            phase.window(seq).width() + self.quickest_read + 2 * GUARD >= phase.period.min
        })
    }

    /// Whether a read after the window of frame `seq` surely ends before the next update.
    pub(super) fn is_before_next(&self, seq: u64, read: &Read) -> bool {
        let next = self.phase.as_ref().map(|phase| phase.window(seq + 1));
        next.is_some_and(|next| read.latched_until <= next.after)
    }
    pub(super) fn changed(&mut self, read: &Read, seen: &Seen) {
        let Some(phase) = &self.phase else { return };
        let low = self.surely_passed(read.before);
        // In a lively scene, the content already in the registers was not an equal frame.
        let known = seen.seq.filter(|_| self.is_lively());
        let next_not_yet = known.map_or((low, Ns::MIN), |seq| (seq + 1, seen.before));
        let mut high = low;
        while phase.earliest(high + 1, next_not_yet) < read.latched_until {
            high += 1;
        }
        let is_early = phase.window(self.next_seq).after >= read.latched_until;
        let update = Window::new(seen.before, read.latched_until);
        if is_early {
            self.restart(self.next_seq, read, update);
        } else if low == high {
            self.accept(low, read, update);
        } else if self.is_lost(high) {
            let after = update.after.max(self.unseen(read).after);
            self.start(read, Window::new(after, update.until));
        } else {
            self.next_at = read.after.max(phase.window(high).until + GUARD);
            self.pending = Some(Pending {
                read: *read,
                seen_before: seen.before,
                low,
                high,
            });
            self.last = Some(Seen::by(read, None));
        }
    }

    /// Decides the pending frame's number by a later read that surely shows frame `high`. Without such a read nothing
    /// decides, and all candidates are missing, because a frame under a wrong number would be worse.
    pub(super) fn resolve(&mut self, pending: &Pending, next: Option<&Read>) {
        let Some(phase) = &self.phase else { return };
        let window = phase.window(pending.high);
        let shows_high =
            |read: &&Read| read.before >= window.until && self.is_before_next(pending.high, read);
        let is_same = next
            .filter(shows_high)
            .map(|read| read.content == pending.read.content);
        let seq = match is_same {
            Some(true) if self.is_lively() => pending.high,
            Some(false) if pending.low + 1 == pending.high => pending.low,
            _ => return,
        };
        let update = Window::new(pending.seen_before, pending.read.latched_until);
        self.accept(seq, &pending.read, update);
    }

    /// Same content as the frame before: the read was too early, or the frames are equal.
    pub(super) fn unchanged(&mut self, read: &Read) {
        self.frames_unproved = 0;
        let Some(phase) = &self.phase else { return };
        let window = phase.window(self.next_seq);
        let mut passed = window.until;
        if self.repeats >= STILL_FRAMES && self.is_lost(self.next_seq) {
            passed = passed.min(window.middle() + phase.period.middle() / 2);
        }
        if read.before < passed {
            self.wait_for_update(read, passed);
        } else {
            self.passed_unchanged(read);
        }
    }

    /// The update comes between now and `passed`: wait for half of that time, or all of it if it is short.
    pub(super) fn wait_for_update(&mut self, read: &Read, passed: Ns) {
        let left = passed - read.after;
        let at = if left > self.narrow() {
            read.after + left / 2 - self.lateness
        } else {
            passed + GUARD
        };
        self.next_at = at.max(read.after);
    }

    /// The update's time has passed without a change: it is late, or its frame is equal.
    pub(super) fn passed_unchanged(&mut self, read: &Read) {
        let seq = self.surely_passed(read.before);
        let is_sure = self.is_before_next(seq, read);
        let may_be_late = seq == self.next_seq && self.is_lively() && self.late_reads < LATE_READS;
        if !is_sure && self.is_lost(seq) {
            if self.excuse.is_some() {
                return self.start(read, self.unseen(read));
            }
            self.estimated();
            self.repeat(seq, read);
        } else if may_be_late {
            self.late_reads += 1;
            if is_sure {
                self.unmoved.get_or_insert(*read);
            }
            self.next_at = read.after + self.nominal / 8;
        } else if is_sure {
            self.repeat(seq, read);
        } else if let Some(phase) = &self.phase {
            self.next_at = read.after.max(phase.window(seq + 1).until + GUARD);
        }
    }
    pub(super) fn repeat(&mut self, seq: u64, read: &Read) {
        self.miss_until(seq, read.before);
        self.changes_in_a_row = 0;
        let advanced = self.phase.as_mut().map(|phase| phase.advance(seq, None));
        if let Some(Err(OutOfStep)) = advanced {
            self.events.push_back(Event::Fault(OUT_OF_STEP));
        }
        self.record(seq, read);
    }

    /// New content with a known number.
    pub(super) fn accept(&mut self, seq: u64, read: &Read, update: Window) {
        let seq = seq.max(self.next_seq);
        let advanced = self
            .phase
            .as_mut()
            .map_or(Err(OutOfStep), |phase| phase.advance(seq, Some(update)));
        if advanced.is_err() {
            return self.restart(seq, read, update);
        }
        self.miss_until(seq, read.before);
        self.changes_in_a_row += 1;
        self.is_estimated = false;
        self.record(seq, read);
    }

    /// The sensor is out of step: it restarted, or its clock jumped. Drop the phase, keep the count.
    pub(super) fn restart(&mut self, seq: u64, read: &Read, update: Window) {
        self.events.push_back(Event::Fault(OUT_OF_STEP));
        self.settings_due = Some(read.after);
        self.miss_until(seq, read.before);
        self.phase = Some(Phase::new(self.nominal, seq, update));
        self.record(seq, read);
    }

    /// The update's window for a frame that was read but otherwise unknown.
    pub(super) fn unseen(&self, read: &Read) -> Window {
        let longest = Period::nominal(self.nominal).max;
        Window::new(read.before - longest, read.latched_until)
    }

    pub(super) fn is_lively(&self) -> bool {
        self.changes_in_a_row >= LIVELY_FRAMES
    }
}
