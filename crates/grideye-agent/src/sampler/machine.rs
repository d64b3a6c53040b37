//! The sampler's state: what is due, and what becomes of each answer.

use super::content::{Content, implausible};
use super::event::{BUS_HUNG, Due, Event, Span, Task};
use super::limits::{LATENESS_READS, LIVELY_FRAMES, SET_UP_PAUSE};
use super::phase::{Ns, Phase};
use super::read::{Pending, Read, Seen};
use crate::clock::{duration, signed_ns};
use grideye_frame::{NoData, RawFrame, ThermistorWord};
use std::collections::VecDeque;
use std::time::Duration;

/// Turns one sensor into records.
#[derive(Debug)]
pub struct Sampler {
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
    /// Up to when missing frames have been listed while nothing was read.
    pub(super) listed_until: Ns,
    pub(super) frames_read: u64,
    pub(super) last: Option<Seen>,
    pub(super) pending: Option<Pending>,
    /// A read behind the window that brought nothing new: the next frame, if it is an equal one and not late.
    pub(super) unmoved: Option<Read>,
    /// What a read surely takes of the bus; zero where that is not known.
    pub(super) transfer_min: Ns,
    /// The quickest read so far. A host that was late in every one of them makes it longer than the transfer, so it is
    /// good for plans and proves nothing.
    pub(super) quickest_read: Ns,
    /// Whether the count has been estimated since it was last proved.
    pub(super) is_estimated: bool,
    /// How late the host wakes up, on average.
    pub(super) lateness: Ns,

    /// The thermistor as last read.
    pub(super) thermistor: Option<ThermistorWord>,
    /// The frame before, when its read ended, and before when its successor cannot have come.
    pub(super) thermistor_unproved: Option<(u64, Ns, Ns)>,
    pub(super) recorded: Option<Content>,
    pub(super) repeats: u32,
    pub(super) changes_in_a_row: u32,
    pub(super) frames_unproved: u32,
    pub(super) late_reads: u32,
    pub(super) retries: u32,
    pub(super) faults_in_a_row: u32,
    pub(super) excuse: Option<NoData>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum State {
    SetUp,
    /// Set up at this moment; no frame since.
    Settle(Ns),
    Follow,
    Done,
}

impl Sampler {
    /// A sampler for a sensor of this nominal period, which wants to set it up at `now`; it ends after
    /// `frames_limit` frames read, if there is a limit.
    #[must_use]
    pub fn new(nominal_period: Duration, now: Duration, frames_limit: Option<u64>) -> Self {
        let is_done = frames_limit == Some(0);
        Self {
            nominal: signed_ns(nominal_period),
            frames_limit,
            state: if is_done { State::Done } else { State::SetUp },
            next_at: signed_ns(now),
            settings_due: None,
            settings_checked: 0,
            set_up_pause: signed_ns(SET_UP_PAUSE),
            events: VecDeque::new(),
            phase: None,
            next_seq: 0,
            listed_until: 0,
            frames_read: 0,
            last: None,
            pending: None,
            unmoved: None,
            transfer_min: 0,
            quickest_read: Ns::MAX,
            is_estimated: false,
            lateness: 0,
            thermistor: None,
            thermistor_unproved: None,
            recorded: None,
            repeats: 0,
            changes_in_a_row: LIVELY_FRAMES,
            frames_unproved: 0,
            late_reads: 0,
            retries: 0,
            faults_in_a_row: 0,
            excuse: None,
        }
    }

    /// On this bus no read is quicker than this, from the START at which the registers are copied to its end.
    pub fn set_transfer_min(&mut self, transfer_min: Duration) {
        self.transfer_min = signed_ns(transfer_min);
    }

    /// What to do next and when; `None` when the limit of frames has been reached.
    #[must_use]
    pub fn due(&self) -> Option<Due> {
        let (at, task) = match (self.state, self.settings_due) {
            (State::Done, _) => return None,
            (State::SetUp, _) => (self.next_at, Task::SetUp),
            (_, Some(at)) => (at, Task::CheckSettings),
            (_, None) => (self.next_at, Task::ReadFrame),
        };
        Some(Due {
            at: duration(at),
            task,
        })
    }

    /// The next event, oldest first.
    pub fn next_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    /// The sensor's period as far as it is known, and how far that may be off; `None` before the first frame.
    #[must_use]
    pub fn period(&self) -> Option<(Duration, Duration)> {
        let period = self.phase.as_ref()?.period();
        Some((
            duration(period.middle()),
            duration((period.max - period.min) / 2),
        ))
    }

    /// Whether the last operation brought a good frame or led towards one.
    #[must_use]
    pub fn is_healthy(&self) -> bool {
        self.faults_in_a_row == 0 && self.state != State::SetUp
    }

    /// The answer to [`Task::SetUp`].
    pub fn set_up(&mut self, span: Span, outcome: Result<(), NoData>) {
        let now = signed_ns(span.after);
        match outcome {
            Ok(()) => {
                self.excuse.get_or_insert(NoData::NotReady);
                self.reckon(now);
                self.state = State::Settle(now);
                self.last = None;
                self.settings_due = None;
                self.settings_checked = now;
                self.faults_in_a_row = 0;
                self.next_at = now + self.nominal / 10;
            }
            Err(reason) => {
                self.fault(now, reason);
                self.set_up_again(now);
            }
        }
    }

    /// The answer to [`Task::CheckSettings`]: whether the settings are the ones asked for.
    pub fn settings_checked(&mut self, span: Span, outcome: Result<bool, NoData>) {
        let now = signed_ns(span.after);
        match outcome {
            Ok(true) => {
                self.settings_checked = now;
                self.settings_due = None;
            }
            Ok(false) => {
                self.wrong_configuration(now);
                self.state = State::SetUp;
                self.next_at = now;
            }
            Err(reason) => self.failed(now, reason),
        }
    }

    /// The answer to [`Task::ReadFrame`].
    pub fn frame_read(&mut self, span: Span, outcome: Result<RawFrame, NoData>) {
        let (before, after) = (signed_ns(span.before), signed_ns(span.after));
        let frame = match outcome {
            Ok(frame) => frame,
            Err(reason) => return self.failed(after, reason),
        };
        self.quickest_read = self.quickest_read.min(after - before);
        // A read that is quicker than can be shows that the bus is.
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
            // Its frames have been listed as missing while it was under way.
            self.last = Some(Seen::by(&read, None));
            self.settings_due = Some(after);
            self.next_at = after;
            return;
        }
        match (self.state, implausible(&frame, thermistor_before)) {
            (State::Settle(since), Some(NoData::AllZero)) => self.still_zero(since, &read),
            (_, Some(reason)) => self.failed(after, reason),
            (State::Settle(since), None) => self.settle(since, &read),
            (State::Follow, None) => self.follow(&read),
            (State::SetUp | State::Done, None) => {}
        }
    }

    /// The bus could not be opened, or is gone; try again at `retry_at`.
    pub fn bus_lost(&mut self, now: Duration, reason: NoData, retry_at: Duration) {
        if self.state == State::Done {
            return;
        }
        self.fault(signed_ns(now), reason);
        self.next_at = signed_ns(retry_at);
        self.settings_due = Some(self.next_at);
    }

    /// The operation under way has not come back for so long that the bus hangs. Its frames are counted as missing
    /// with [`catch_up`](Self::catch_up), as long as that lasts, and what it brings in the end is no frame of its time.
    pub fn hung(&mut self, now: Duration) {
        if self.state == State::Done {
            return;
        }
        self.pending = None;
        self.excuse = Some(NoData::BusTimeout);
        self.events.push_back(Event::Fault(BUS_HUNG));
        self.reckon(signed_ns(now));
    }

    /// Counts the frames that have passed unread until `now`, so that a long outage shows while it lasts.
    pub fn catch_up(&mut self, now: Duration) {
        if self.excuse.is_some() {
            self.reckon(signed_ns(now));
        }
    }
}
