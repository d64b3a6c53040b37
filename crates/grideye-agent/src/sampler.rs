//! One sensor frame becomes one record: none twice, none missed without a row that says why.
//!
//! The sensor has no data-ready bit and no frame counter, and its clock is its own (9.57 Hz was measured on a "10 Hz"
//! part). So the sampler learns the moments of update from what it reads:
//!
//! ```text
//!   update n          update n+1                     update n+2
//!   ────┃─────────────────┃─────────────────────────────┃────▶ sensor's clock
//!           ▲        ▲ ▲      ▲                    ▲        ▲
//!         read n   old new  = n+1                 old     new = n+2
//!                  └─┴ the update lies between: the window of the next one is known the better
//! ```
//!
//! * A read within the window of an update tells on which side of it the update was; the window is halved until it is
//!   narrower than 2 ms, and from then on one read a frame, just behind the window, suffices. Now and then one
//!   read just before the window proves that the sensor has not become faster.
//! * A frame is new because its content changed, or, in a scene without noise, because its update has surely
//!   passed. Where a change may be either of two frames, the next read decides before anything is recorded; if the host
//!   is late for that one as well, both are missing, since a frame under a wrong number would be worse.
//! * The count of frames runs with the sensor's period through every fault, so `seq` shows what was missed. After a
//!   set-up, or so long without frames that the bounds are wider than a period, it is an estimate, which
//!   [`COUNT_ESTIMATED`] says.
//! * Nothing is taken from how long a read took but what the bus' clock makes it take at least: a starved host can be
//!   held up at any point of it.
//!
//! The sampler touches no bus and no clock. It says what is due, is told what came of it, and answers with events.

mod content;
mod count;
mod follow;
mod pace;

use self::content::{Content, implausible};
use crate::clock::signed_ns;
use crate::phase::{Ns, Phase};
use grideye_frame::{NoData, RawFrame, Reading, ThermistorWord};
use std::collections::VecDeque;
use std::time::Duration;

/// Content that stays the same for so many frames is that of a sensor which has stopped measuring.
///
/// With the noise of a real sensor two equal frames in a row are already a rarity at 10 Hz; a scene without noise may
/// stand still for a while, as may a replayed recording, and ten seconds of it are believed.
pub const FROZEN_FRAMES: u32 = 100;
/// Attempts at one frame after a fault, beside the first.
pub const RETRIES_PER_FRAME: u32 = 3;
/// Faults in a row, without a good frame between them, after which a sensor that answers is set up again, and one that
/// does not is asked less often.
pub const FAULTS_BEFORE_SET_UP: u32 = 8;
/// The longest pause between two attempts at a sensor that does not answer.
pub const RETRY_PAUSE_MAX: Duration = Duration::from_secs(1);
/// Frame periods after a set-up within which a frame must have come; registers that are still zero then are a fault.
pub const FIRST_FRAME_PERIODS: u32 = 10;
/// How often the settings are read back. A sensor that lost its supply for a moment comes back with others.
pub const SETTINGS_EVERY: Duration = Duration::from_secs(5);
/// The pause before the second attempt to set the sensor up; it doubles up to [`SET_UP_PAUSE_MAX`].
pub const SET_UP_PAUSE: Duration = Duration::from_millis(200);
/// The longest pause between two attempts to set the sensor up.
pub const SET_UP_PAUSE_MAX: Duration = Duration::from_secs(2);
/// Missing frames that are listed row by row at once: an hour at 10 Hz. Beyond, the gap shows in `seq` alone.
pub const ROWS_PER_GAP_MAX: u64 = 36_000;

/// A window narrower than this is not halved any more: at 100 kHz a read takes 12.3 ms of the bus.
const NARROW: Ns = 2_000_000;
/// How far behind a window the read is set.
const GUARD: Ns = 500_000;
/// How far before a window the read is set that proves its lower bound.
const PROBE_LEAD: Ns = 1_000_000;
/// Frames after which the lower bound is proved again.
const PROBE_EVERY: u32 = 16;
/// Frames in a row whose content changed, after an equal one, until an unchanged one is taken for a late one at first.
const LIVELY_FRAMES: u32 = 16;
/// Reads over which the host's lateness is averaged.
const LATENESS_READS: Ns = 8;
/// Reads that wait for a late frame.
const LATE_READS: u32 = 2;
/// Equal frames in a row after which the estimate counts them, when the bounds have become wider than a period.
const STILL_FRAMES: u32 = 5;

/// What the sampler wants done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Task {
    /// Wake, reset and configure the sensor; answer with [`Sampler::set_up`].
    SetUp,
    /// Read the settings back; answer with [`Sampler::settings_checked`].
    CheckSettings,
    /// Read a frame; answer with [`Sampler::frame_read`].
    ReadFrame,
}

/// A task and the moment for it on the boot clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Due {
    /// Not before this.
    pub at: Duration,
    /// What to do.
    pub task: Task,
}

/// The boot clock right before and right after an operation on the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Span {
    /// Before the operation.
    pub before: Duration,
    /// After it.
    pub after: Duration,
}

/// What came of an operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// One sensor frame, read or missing.
    Record {
        /// Which frame, from 0.
        seq: u64,
        /// When it was read, or found to be missing.
        at: Duration,
        /// The frame, or why there is none.
        reading: Reading<RawFrame>,
    },
    /// A fault, by the name under which it is counted.
    Fault(&'static str),
}

/// The count of moments at which the sensor's updates did not come where they had to.
pub const OUT_OF_STEP: &str = "out-of-step";
/// The count of moments at which the number of frames since the last one had to be estimated: after a set-up, or after
/// so long a time without frames that the sensor's period is not known well enough. `seq` may be off from there on.
pub const COUNT_ESTIMATED: &str = "count-estimated";
/// The count of frames whose thermistor, a transfer of its own, may be that of the frame after, because the read was
/// that late.
pub const THERMISTOR_LATE: &str = "thermistor-late";
/// The count of frames with a pixel that reads what a failed one does, far from all around it. They are recorded as
/// they are.
pub const GLITCH_PIXEL: &str = "glitch-pixel";
/// The count of transfers that did not come back.
pub const BUS_HUNG: &str = "bus-hung";
/// The count of gaps that were too long to be listed row by row.
pub const GAP_NOT_LISTED: &str = "gap-not-listed";

/// Turns one sensor into records.
#[derive(Debug)]
pub struct Sampler {
    nominal: Ns,
    frames_limit: Option<u64>,
    state: State,
    next_at: Ns,
    settings_due: Option<Ns>,
    settings_checked: Ns,
    set_up_pause: Ns,
    events: VecDeque<Event>,

    phase: Option<Phase>,
    next_seq: u64,
    /// Up to when missing frames have been listed while nothing was read.
    listed_until: Ns,
    frames_read: u64,
    last: Option<Seen>,
    pending: Option<Pending>,
    /// A read behind the window that brought nothing new: the next frame, if it is an equal one and not late.
    unmoved: Option<Read>,
    /// What a read surely takes of the bus; zero where that is not known.
    transfer_min: Ns,
    /// The quickest read so far. A host that was late in every one of them makes it longer than the transfer, so it is
    /// good for plans and proves nothing.
    quickest_read: Ns,
    /// Whether the count has been estimated since it was last proved.
    is_estimated: bool,
    /// How late the host wakes up, on average.
    lateness: Ns,

    /// The thermistor as last read.
    thermistor: Option<ThermistorWord>,
    /// The frame before, when its read ended, and before when its successor cannot have come.
    thermistor_unproved: Option<(u64, Ns, Ns)>,
    recorded: Option<Content>,
    repeats: u32,
    changes_in_a_row: u32,
    frames_unproved: u32,
    late_reads: u32,
    retries: u32,
    faults_in_a_row: u32,
    excuse: Option<NoData>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    SetUp,
    /// Set up at this moment; no frame since.
    Settle(Ns),
    Follow,
    Done,
}

/// What the registers held when they were last read.
#[derive(Debug, Clone, Copy)]
struct Seen {
    /// Right before that read.
    before: Ns,
    content: Content,
    /// Which frame it is, where that is known.
    seq: Option<u64>,
}

impl Seen {
    fn by(read: &Read, seq: Option<u64>) -> Self {
        Self {
            seq,
            before: read.before,
            content: read.content,
        }
    }
}

/// One read: the registers were copied after `before` and at `latched_until` at the latest.
#[derive(Debug, Clone, Copy)]
struct Read {
    before: Ns,
    latched_until: Ns,
    after: Ns,
    frame: RawFrame,
    content: Content,
}

/// A new frame that may be any from `low` to `high`.
#[derive(Debug, Clone, Copy)]
struct Pending {
    read: Read,
    seen_before: Ns,
    low: u64,
    high: u64,
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

fn duration(ns: Ns) -> Duration {
    Duration::from_nanos(u64::try_from(ns).unwrap_or(0))
}

#[cfg(test)]
mod tests;
