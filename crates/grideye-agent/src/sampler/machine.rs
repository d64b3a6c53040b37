//! The sampler's state: what is due, how each outcome changes it, and one record per sensor frame.

use super::content::{Content, Pending, Read, Seen, implausible};
use super::event::{
    BUS_HUNG, COUNT_ESTIMATED, Checked, Due, Event, FAULTS_BEFORE_SET_UP, FROZEN_FRAMES,
    GAP_NOT_LISTED, GLITCH_PIXEL, GUARD, LATENESS_READS, LIVELY_FRAMES, NARROW, PROBE_EVERY,
    PROBE_LEAD, RETRIES_PER_FRAME, RETRY_PAUSE_MAX, ROWS_PER_GAP_MAX, SET_UP_PAUSE,
    SET_UP_PAUSE_MAX, SETTINGS_EVERY, Span, THERMISTOR_LATE, Task,
};
use super::phase::{Ns, Phase};
use crate::clock::{duration, signed_ns};
use grideye_frame::{NoData, RawFrame, Reading, ThermistorWord};
use std::collections::VecDeque;
use std::time::Duration;
#[derive(Debug, Default)]
pub(crate) struct Sampler {
    pub(super) nominal: Ns,
    pub(super) frames_limit: Option<u64>,
    pub(super) state: State,
    pub(super) next_at: Ns,
    pub(super) settings_due: Option<Ns>,
    pub(super) settings_checked: Ns,
    pub(super) set_up_pause: Ns,
    pub(super) events: VecDeque<Event>,

    pub(super) phase: Option<Phase>,
    pub(super) next_seq: u64,
    /// Missing frames have been listed up to this time while nothing was read.
    pub(super) listed_until: Ns,
    pub(super) frames_read: u64,
    pub(super) last: Option<Seen>,
    pub(super) pending: Option<Pending>,
    /// A read after the window that showed nothing new: it is the next frame if that one is equal and not late.
    pub(super) unmoved: Option<Read>,
    /// Minimum bus time of a read; zero if unknown.
    pub(super) transfer_min: Ns,
    /// The quickest read so far. Good for planning but no proof, because the host may have been late every time.
    pub(super) quickest_read: Ns,
    pub(super) is_estimated: bool,
    pub(super) lateness: Ns,
    pub(super) thermistor: Option<ThermistorWord>,
    /// The previous frame, when its read ended, and a time before which the next update cannot have come.
    pub(super) thermistor_unproved: Option<(u64, Ns, Ns)>,
    pub(super) recorded: Option<Content>,
    pub(super) repeats: u32,
    /// Whether the interrupt flag was clear when the settings were last written or checked.
    pub(super) is_flag_clear: bool,
    /// Whether the sensor was measuring before the last check.
    pub(super) measures: bool,
    pub(super) changes_in_a_row: u32,
    pub(super) frames_unproved: u32,
    pub(super) late_reads: u32,
    pub(super) retries: u32,
    pub(super) faults_in_a_row: u32,
    pub(super) excuse: Option<NoData>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum State {
    #[default]
    SetUp,
    /// Set up at this time; no frame since.
    Settle(Ns),
    Follow,
    Done,
}

impl Sampler {
    /// A sampler that sets its sensor up at `now` and ends after `frames_limit` frames read.
    pub(crate) fn new(nominal_period: Duration, now: Duration, frames_limit: Option<u64>) -> Self {
        let is_done = frames_limit == Some(0);
        Self {
            nominal: signed_ns(nominal_period),
            frames_limit,
            state: if is_done { State::Done } else { State::SetUp },
            next_at: signed_ns(now),
            set_up_pause: signed_ns(SET_UP_PAUSE),
            quickest_read: Ns::MAX,
            changes_in_a_row: LIVELY_FRAMES,
            ..Self::default()
        }
    }

    /// On this bus, no read takes less from the START that copies the registers to its end.
    pub(crate) fn set_transfer_min(&mut self, transfer_min: Duration) {
        self.transfer_min = signed_ns(transfer_min);
    }

    /// The next task and its time; `None` at the frame limit.
    pub(crate) fn due(&self) -> Option<Due> {
        let (at, task) = match (self.state, self.settings_due) {
            (State::Done, _) => return None,
            (State::SetUp, _) => (self.next_at, Task::SetUp),
            (_, Some(at)) => (at, Task::CheckSettings),
            (_, None) => (self.next_at, Task::ReadFrame),
        };
        let at = duration(at);
        Some(Due { at, task })
    }
    pub(crate) fn next_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    /// The sensor's period and its uncertainty, ±; `None` before the first frame.
    pub(crate) fn period(&self) -> Option<(Duration, Duration)> {
        let period = self.phase.as_ref()?.period;
        let error = (period.max - period.min) / 2;
        Some((duration(period.middle()), duration(error)))
    }
    pub(crate) fn set_up(&mut self, span: Span, outcome: Result<(), NoData>) {
        let now = signed_ns(span.after);
        match outcome {
            Ok(()) => {
                self.excuse.get_or_insert(NoData::NotReady);
                self.reckon(now);
                self.state = State::Settle(now);
                self.last = None;
                self.settings_due = None;
                self.settings_checked = now;
                // The reset cleared the flag.
                (self.is_flag_clear, self.measures) = (true, false);
                self.faults_in_a_row = 0;
                self.next_at = now + self.nominal / 10;
            }
            Err(reason) => {
                self.fault(now, reason);
                self.set_up_again(now);
            }
        }
    }

    pub(crate) fn settings_checked(&mut self, span: Span, outcome: Result<Checked, NoData>) {
        let now = signed_ns(span.after);
        match outcome {
            Ok(Checked::AsConfigured {
                has_measured,
                is_cleared,
            }) => {
                self.measures = has_measured && self.is_flag_clear;
                self.is_flag_clear = is_cleared;
                self.settings_checked = now;
                self.settings_due = None;
            }
            Ok(Checked::OtherSettings) => {
                self.wrong_configuration(now);
                self.state = State::SetUp;
                self.next_at = now;
            }
            Err(reason) => self.failed(now, reason),
        }
    }
    pub(crate) fn frame_read(&mut self, span: Span, outcome: Result<RawFrame, NoData>) {
        let (before, after) = (signed_ns(span.before), signed_ns(span.after));
        let frame = match outcome {
            Ok(frame) => frame,
            Err(reason) => return self.failed(after, reason),
        };
        self.quickest_read = self.quickest_read.min(after - before);
        // A read quicker than the assumed minimum shows that the bus is faster.
        self.transfer_min = self.transfer_min.min(after - before);
        let latched_until = (after - self.transfer_min).max(before + 1);
        let read = Read {
            before,
            latched_until,
            after,
            frame,
            content: Content::of(&frame),
        };
        let late = (before - self.next_at).clamp(0, self.nominal / 2);
        self.lateness += (late - self.lateness) / LATENESS_READS;
        let thermistor_before = self.thermistor.replace(frame.thermistor);
        if before < self.listed_until {
            // Its frames were listed as missing while it was under way.
            self.last = Some(Seen::by(&read, None));
            self.settings_due = Some(after);
            self.next_at = after;
            return;
        }
        match (self.state, implausible(&frame, thermistor_before)) {
            (State::Settle(since), Some(NoData::AllZero)) => {
                // What comes after empty registers was measured, also if it equals what was there before.
                self.measures = true;
                self.still_zero(since, &read);
            }
            (_, Some(reason)) => self.failed(after, reason),
            (State::Settle(since), None) => self.settle(since, &read),
            (State::Follow, None) => self.follow(&read),
            (State::SetUp | State::Done, None) => {}
        }
    }

    /// The bus could not be opened or is gone; retry at `retry_at`.
    pub(crate) fn bus_lost(&mut self, now: Duration, reason: NoData, retry_at: Duration) {
        if self.state == State::Done {
            return;
        }
        self.fault(signed_ns(now), reason);
        self.next_at = signed_ns(retry_at);
        self.settings_due = Some(self.next_at);
    }

    /// The current operation hangs. Its frames are missing, listed by [`catch_up`](Self::catch_up), and its late result
    /// is not a frame of its time.
    pub(crate) fn hung(&mut self, now: Duration) {
        if self.state == State::Done {
            return;
        }
        self.pending = None;
        self.excuse = Some(NoData::BusTimeout);
        self.events.push_back(Event::Fault(BUS_HUNG));
        self.reckon(signed_ns(now));
    }

    /// Counts frames that passed unread until `now`, so that a long outage shows while it lasts.
    pub(crate) fn catch_up(&mut self, now: Duration) {
        if self.excuse.is_some() {
            self.reckon(signed_ns(now));
        }
    }

    pub(super) fn record(&mut self, seq: u64, read: &Read) {
        if self.state == State::Done {
            return;
        }
        self.unmoved = None;
        self.prove_thermistor(seq);
        let next = self.phase.as_ref().map(|phase| phase.window(seq + 1));
        self.thermistor_unproved = next.map(|next| (seq, read.after, next.after));
        let before = self.recorded.replace(read.content);
        let repeats = self.repeats.saturating_add(1);
        self.repeats = if before == Some(read.content) {
            repeats
        } else {
            0
        };
        self.last = Some(Seen::by(read, Some(seq)));
        self.next_seq = seq + 1;
        self.faults_in_a_row = 0;
        self.set_up_pause = signed_ns(SET_UP_PAUSE);
        self.excuse = None;
        let at = duration(read.before);
        if self.repeats >= FROZEN_FRAMES && !self.measures {
            return self.frozen(seq, at, read.after);
        }
        self.frames_read += 1;
        if read.content.has_glitch() {
            self.events.push_back(Event::Fault(GLITCH_PIXEL));
        }
        let reading = Reading::Frame(read.frame);
        self.events.push_back(Event::Record { seq, at, reading });
        if self.frames_limit == Some(self.frames_read) {
            self.prove_thermistor(seq);
            self.state = State::Done;
            return;
        }
        self.check_or_plan(read.after);
    }

    /// The next task: twice within [`FROZEN_FRAMES`] equal frames, a check, so that both lie within what stood still.
    fn check_or_plan(&mut self, now: Ns) {
        let is_still = self.repeats % (FROZEN_FRAMES / 2) == FROZEN_FRAMES / 2 - 1;
        if is_still || now - self.settings_checked >= signed_ns(SETTINGS_EVERY) {
            self.settings_due = Some(now);
        }
        self.plan(now);
    }

    /// Counts the previous frame if its read may have ended after the next update; the newer frame bounds that time
    /// better. An equal one hides the update, so that its bounds, ever wider, say nothing of a read.
    pub(super) fn prove_thermistor(&mut self, seq: u64) {
        let Some((before, read_until, predicted)) = self.thermistor_unproved.take() else {
            return;
        };
        let known = match &self.phase {
            Some(phase) if seq == before + 1 && phase.seq == seq => phase.window(seq).after,
            _ => predicted,
        };
        if self.changes_in_a_row > 0 && read_until > known.max(predicted) {
            self.events.push_back(Event::Fault(THERMISTOR_LATE));
        }
    }

    /// Nothing shows that the sensor measures. Record that, and set it up again as often as this is noticed.
    pub(super) fn frozen(&mut self, seq: u64, at: Duration, now: Ns) {
        let reading = Reading::NoData(NoData::Frozen);
        self.events.push_back(Event::Record { seq, at, reading });
        if self.repeats % FROZEN_FRAMES == 0 {
            self.events.push_back(Event::Fault(NoData::Frozen.name()));
            self.excuse = Some(NoData::Frozen);
            self.state = State::SetUp;
            self.next_at = now;
        } else {
            self.check_or_plan(now);
        }
    }

    pub(super) fn estimated(&mut self) {
        if !std::mem::replace(&mut self.is_estimated, true) {
            self.events.push_back(Event::Fault(COUNT_ESTIMATED));
        }
    }

    pub(super) fn fault(&mut self, now: Ns, reason: NoData) {
        self.events.push_back(Event::Fault(reason.name()));
        self.excuse = Some(reason);
        self.reckon(now);
    }

    /// Registers that all read zero are no settings, so keep the earlier reason.
    pub(super) fn wrong_configuration(&mut self, now: Ns) {
        if self.excuse != Some(NoData::AllZero) {
            self.excuse = Some(NoData::WrongConfiguration);
        }
        let kind = NoData::WrongConfiguration.name();
        self.events.push_back(Event::Fault(kind));
        self.reckon(now);
    }

    /// Lists the unread frames that have surely been replaced.
    pub(super) fn reckon(&mut self, now: Ns) {
        if self.phase.is_some() {
            self.listed_until = now;
            self.miss_until(self.surely_passed(now), now);
        }
    }

    /// The latest frame with a surely passed update, or the next one if there is none.
    pub(super) fn surely_passed(&self, now: Ns) -> u64 {
        let mut seq = self.next_seq;
        if let Some(phase) = &self.phase {
            while phase.window(seq + 1).until <= now {
                seq += 1;
            }
        }
        seq
    }
    pub(super) fn miss_until(&mut self, seq: u64, now: Ns) {
        if let Some(read) = self.unmoved.take().filter(|_| self.next_seq < seq) {
            self.record(self.next_seq, &read);
        }
        if self.state == State::Done {
            return;
        }
        let reason = self.excuse.unwrap_or(NoData::HostStalled);
        let listed_from = seq.saturating_sub(ROWS_PER_GAP_MAX);
        if listed_from > self.next_seq {
            self.events.push_back(Event::Fault(GAP_NOT_LISTED));
            self.next_seq = listed_from;
        }
        let (at, reading) = (duration(now), Reading::NoData(reason));
        let rows = (self.next_seq..seq).map(|seq| Event::Record { seq, at, reading });
        self.events.extend(rows);
        self.next_seq = self.next_seq.max(seq);
    }
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

    /// The width at which halving stops: a read cannot locate an update better than the host's own delay in it.
    pub(super) fn narrow(&self) -> Ns {
        NARROW + 2 * (self.quickest_read - self.transfer_min)
    }

    /// A failed read or check: retry within this frame, then from the next frame on, or set up again.
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

    /// The pause: an eighth of a period a few times within one frame, then until the next frame, then ever longer.
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
