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
//!   passed. Where a change may be either of two frames, the next read decides before anything is recorded.
//! * The count of frames runs with the sensor's period through every fault, so `seq` shows what was missed.
//!
//! The sampler touches no bus and no clock. It says what is due, is told what came of it, and answers with events.

use crate::clock::signed_ns;
use crate::phase::{Ns, OutOfStep, Period, Phase, Window};
use grideye_frame::{NoData, PIXELS, PixelWord, RawFrame, Reading, ThermistorWord};
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
    frames_read: u64,
    last: Option<Seen>,
    pending: Option<Pending>,
    /// A read behind the window that brought nothing new: the next frame, if it is an equal one and not late.
    unmoved: Option<Read>,
    quickest_read: Ns,
    /// How late the host wakes up, on average.
    lateness: Ns,

    /// The thermistor as last read.
    thermistor: Option<ThermistorWord>,
    recorded: Option<[PixelWord; PIXELS]>,
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
    pixels: [PixelWord; PIXELS],
}

impl Seen {
    fn by(read: &Read) -> Self {
        Self {
            before: read.before,
            pixels: read.frame.pixels,
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
            frames_read: 0,
            last: None,
            pending: None,
            unmoved: None,
            quickest_read: Ns::MAX,
            lateness: 0,
            thermistor: None,
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
                self.fault(now, NoData::WrongConfiguration);
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
        let latched_until = (after - self.quickest_read).max(before + 1);
        let read = Read {
            before,
            latched_until,
            after,
            frame,
        };
        let late = (before - self.next_at).clamp(0, self.nominal / 2);
        self.lateness += (late - self.lateness) / LATENESS_READS;
        let thermistor_before = self.thermistor.replace(frame.thermistor);
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

    /// Counts the frames that have passed unread until `now`, so that a long outage shows while it lasts.
    pub fn catch_up(&mut self, now: Duration) {
        if self.excuse.is_some() {
            self.reckon(signed_ns(now));
        }
    }

    fn still_zero(&mut self, since: Ns, read: &Read) {
        self.last = Some(Seen::by(read));
        if read.before > since + Ns::from(FIRST_FRAME_PERIODS) * self.nominal {
            self.fault(read.after, NoData::AllZero);
            self.set_up_again(read.after);
        } else {
            self.reckon(read.after);
            self.next_at = read.after + self.nominal / 10;
        }
    }

    /// Looks for the first frame after a set-up. Content that was there before two frames have passed may be old.
    fn settle(&mut self, since: Ns, read: &Read) {
        let longest = Period::nominal(self.nominal).max;
        let has_settled = read.before >= since + 2 * longest;
        // Zeros that last longer are those of a dead link, and say nothing of an update.
        let is_starting = read.before < since + 4 * longest;
        let update_after = match &self.last {
            Some(seen) if is_zero(&seen.pixels) && is_starting => Some(seen.before),
            Some(seen)
                if has_settled && !is_zero(&seen.pixels) && seen.pixels != read.frame.pixels =>
            {
                Some(seen.before)
            }
            _ => has_settled.then(|| read.before - longest),
        };
        if let Some(after) = update_after {
            self.start(
                read,
                Window {
                    after,
                    until: read.latched_until,
                },
            );
        } else {
            self.last = Some(Seen::by(read));
            self.reckon(read.after);
            self.next_at = read.after + self.nominal / 10;
        }
    }

    /// Begins to follow from this frame on; how many have passed since the last one is an estimate.
    fn start(&mut self, read: &Read, window: Window) {
        if let Some(phase) = &self.phase {
            let half = phase.period().middle() / 2;
            let mut seq = self.next_seq;
            while phase.window(seq).middle() + half <= window.middle() {
                seq += 1;
            }
            self.miss_until(seq, read.before);
        }
        self.phase = Some(Phase::new(self.nominal, self.next_seq, window));
        self.state = State::Follow;
        self.record(self.next_seq, read);
    }

    fn follow(&mut self, read: &Read) {
        if let Some(pending) = self.pending.take() {
            self.resolve(&pending, Some(read));
        }
        let (Some(phase), Some(seen)) = (&self.phase, self.last) else {
            return self.start(read, self.unseen(read));
        };
        if self.state == State::Done {
            return;
        }
        let is_lost =
            self.excuse.is_some() && phase.window(self.next_seq).width() >= phase.period().min;
        if is_lost {
            self.start(read, self.unseen(read));
        } else if seen.pixels == read.frame.pixels {
            self.unchanged(read);
        } else {
            self.changed(read, &seen);
        }
    }

    /// New content: which frame is it?
    fn changed(&mut self, read: &Read, seen: &Seen) {
        let Some(phase) = &self.phase else { return };
        let low = self.surely_passed(read.before);
        let mut high = low;
        while phase.window(high + 1).after < read.latched_until {
            high += 1;
        }
        let is_early = phase.window(self.next_seq).after >= read.latched_until;
        let update = Window {
            after: seen.before,
            until: read.latched_until,
        };
        if is_early {
            self.restart(self.next_seq, read, update);
        } else if low == high {
            self.accept(low, read, update);
        } else {
            self.next_at = read.after.max(phase.window(high).until + GUARD);
            self.pending = Some(Pending {
                read: *read,
                seen_before: seen.before,
                low,
                high,
            });
            self.last = Some(Seen::by(read));
        }
    }

    /// Decides which frame the pending one is, with the help of the read after it if there is one.
    fn resolve(&mut self, pending: &Pending, next: Option<&Read>) {
        let Some(phase) = &self.phase else { return };
        let window = phase.window(pending.high);
        let in_step = |read: &&Read| {
            read.before >= window.until
                && read.latched_until <= phase.window(pending.high + 1).after
        };
        let is_last = match next.filter(in_step) {
            Some(read) if read.frame.pixels != pending.read.frame.pixels => false,
            Some(_) => self.is_lively(),
            None => pending.read.before > window.middle(),
        };
        let seq = if is_last {
            pending.high
        } else {
            pending.high - 1
        };
        let update = Window {
            after: pending.seen_before,
            until: pending.read.latched_until,
        };
        self.accept(seq.max(pending.low), &pending.read, update);
    }

    /// The content of the frame before: too early, or an equal frame.
    fn unchanged(&mut self, read: &Read) {
        self.last = Some(Seen::by(read));
        self.frames_unproved = 0;
        let Some(phase) = &self.phase else { return };
        let window = phase.window(self.next_seq);
        let mut passed = window.until;
        if self.repeats >= STILL_FRAMES {
            passed = passed.min(window.middle() + phase.period().middle() / 2);
        }
        if read.before < passed {
            let left = passed - read.after;
            let at = if left > NARROW {
                read.after + left / 2 - self.lateness
            } else {
                passed + GUARD
            };
            self.next_at = at.max(read.after);
        } else if self.is_lively() && self.late_reads < LATE_READS {
            self.late_reads += 1;
            self.unmoved.get_or_insert(*read);
            self.next_at = read.after + self.nominal / 8;
        } else {
            self.repeat(read);
        }
    }

    /// An equal frame: its update has passed and nothing changed.
    fn repeat(&mut self, read: &Read) {
        let seq = self.surely_passed(read.before);
        self.miss_until(seq, read.before);
        self.changes_in_a_row = 0;
        let advanced = self.phase.as_mut().map(|phase| phase.advance(seq, None));
        if let Some(Err(OutOfStep)) = advanced {
            self.events.push_back(Event::Fault(OUT_OF_STEP));
        }
        self.record(seq, read);
    }

    /// Content that is new and whose place in the count is known.
    fn accept(&mut self, seq: u64, read: &Read, update: Window) {
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
        self.record(seq, read);
    }

    /// The sensor is not where it has to be: it restarted, or its clock jumped. Forget the phase and keep the count.
    fn restart(&mut self, seq: u64, read: &Read, update: Window) {
        self.events.push_back(Event::Fault(OUT_OF_STEP));
        self.settings_due = Some(read.after);
        self.miss_until(seq, read.before);
        self.phase = Some(Phase::new(self.nominal, seq, update));
        self.record(seq, read);
    }

    fn record(&mut self, seq: u64, read: &Read) {
        if self.state == State::Done {
            return;
        }
        self.unmoved = None;
        let is_equal = self.recorded == Some(read.frame.pixels);
        self.repeats = if is_equal {
            self.repeats.saturating_add(1)
        } else {
            0
        };
        self.recorded = Some(read.frame.pixels);
        self.last = Some(Seen::by(read));
        self.next_seq = seq + 1;
        self.faults_in_a_row = 0;
        self.set_up_pause = signed_ns(SET_UP_PAUSE);
        self.excuse = None;
        let at = duration(read.before);
        if self.repeats >= FROZEN_FRAMES {
            return self.frozen(seq, at, read.after);
        }
        self.frames_read += 1;
        self.events.push_back(Event::Record {
            seq,
            at,
            reading: Reading::Frame(read.frame),
        });
        if self.frames_limit == Some(self.frames_read) {
            self.state = State::Done;
            return;
        }
        if read.after - self.settings_checked >= signed_ns(SETTINGS_EVERY) {
            self.settings_due = Some(read.after);
        }
        self.plan(read.after);
    }

    /// The sensor measures no more; a set-up is all that can be tried, and not more often than this is noticed.
    fn frozen(&mut self, seq: u64, at: Duration, now: Ns) {
        let reading = Reading::NoData(NoData::Frozen);
        self.events.push_back(Event::Record { seq, at, reading });
        if self.repeats % FROZEN_FRAMES == 0 {
            self.events.push_back(Event::Fault(NoData::Frozen.name()));
            self.excuse = Some(NoData::Frozen);
            self.state = State::SetUp;
            self.next_at = now;
        } else {
            self.plan(now);
        }
    }

    /// Sets the first read of the next frame.
    fn plan(&mut self, now: Ns) {
        (self.retries, self.late_reads) = (0, 0);
        self.frames_unproved += 1;
        let Some(phase) = &self.phase else { return };
        let window = phase.window(self.next_seq);
        let at = if window.width() > NARROW {
            window.middle() - self.lateness
        } else if self.frames_unproved > PROBE_EVERY {
            window.after - PROBE_LEAD
        } else {
            window.until + GUARD
        };
        self.next_at = at.max(now);
    }

    /// A read or a check that failed: once more within this frame, or from the next frame on, or from the start.
    fn failed(&mut self, now: Ns, reason: NoData) {
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
    fn retry_pause(&mut self, now: Ns) -> Ns {
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

    fn fault(&mut self, now: Ns, reason: NoData) {
        self.events.push_back(Event::Fault(reason.name()));
        self.excuse = Some(reason);
        self.reckon(now);
    }

    fn set_up_again(&mut self, now: Ns) {
        self.state = State::SetUp;
        self.faults_in_a_row = self.faults_in_a_row.max(1);
        self.next_at = now + self.set_up_pause;
        self.set_up_pause = (2 * self.set_up_pause).min(signed_ns(SET_UP_PAUSE_MAX));
    }

    /// Lists the frames that surely have been replaced by now and were not read.
    fn reckon(&mut self, now: Ns) {
        let Some(phase) = &self.phase else { return };
        let mut seq = self.next_seq;
        while phase.window(seq + 1).until <= now {
            seq += 1;
        }
        self.miss_until(seq, now);
    }

    /// The latest frame whose update has surely passed, or the next one if none has.
    fn surely_passed(&self, now: Ns) -> u64 {
        let mut seq = self.next_seq;
        if let Some(phase) = &self.phase {
            while phase.window(seq + 1).until <= now {
                seq += 1;
            }
        }
        seq
    }

    /// Lists every frame before `seq` that was not read.
    fn miss_until(&mut self, seq: u64, now: Ns) {
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
        while self.next_seq < seq {
            let at = duration(now);
            let reading = Reading::NoData(reason);
            self.events.push_back(Event::Record {
                seq: self.next_seq,
                at,
                reading,
            });
            self.next_seq += 1;
        }
    }

    fn is_lively(&self) -> bool {
        self.changes_in_a_row >= LIVELY_FRAMES
    }

    /// Where the update of a frame lies of which nothing is known but that it was read.
    fn unseen(&self, read: &Read) -> Window {
        let longest = Period::nominal(self.nominal).max;
        Window {
            after: read.before - longest,
            until: read.latched_until,
        }
    }
}

/// What a dead or stuck link makes of a frame. The thermistor is read after the pixels: if it alone is suddenly all
/// zeros or all ones, the link died in between. If it stays so, it is the thermistor that failed, and the pixels count.
fn implausible(frame: &RawFrame, before: Option<ThermistorWord>) -> Option<NoData> {
    const ZEROS: u16 = 0;
    const ONES: u16 = u16::MAX;
    let all_pixels = |bits| frame.pixels.iter().all(|word| *word == PixelWord(bits));
    let thermistor_died =
        |bits| frame.thermistor == ThermistorWord(bits) && before.is_some_and(is_far_from_zero);
    if all_pixels(ZEROS) || thermistor_died(ZEROS) {
        Some(NoData::AllZero)
    } else if all_pixels(ONES) || thermistor_died(ONES) {
        Some(NoData::StuckHigh)
    } else {
        None
    }
}

/// Whether a thermistor that measured this cannot measure 0 °C in the next frame.
fn is_far_from_zero(thermistor: ThermistorWord) -> bool {
    amg8833::word::thermistor_celsius(thermistor).get().abs() > 1.0
        && thermistor != ThermistorWord(u16::MAX)
}

fn is_zero(pixels: &[PixelWord; PIXELS]) -> bool {
    pixels.iter().all(|word| *word == PixelWord(0))
}

fn duration(ns: Ns) -> Duration {
    Duration::from_nanos(u64::try_from(ns).unwrap_or(0))
}

#[cfg(test)]
mod tests;
