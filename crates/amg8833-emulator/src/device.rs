//! One sensor: its answers, its refusals, and its behavior over time.

pub(crate) mod edge;
pub(crate) mod measurement;
pub(crate) mod options;
pub(crate) mod registers;
pub(crate) mod ticks;

use crate::device::edge::{Edges, PinEdge};
use crate::device::measurement::{Averaging, Degrees, FRAMES_AT_ONE_FPS, Progress};
use crate::device::options::{CATCH_UP_FRAMES_MAX, Options, PastTheEnd, ThermistorUpdate, WarmUp};
use crate::device::registers::{Effect, Mode, Refusals, Registers};
use crate::device::ticks::Ticks;
use crate::fault::FaultSet;
use crate::fault::active::{Condition, Spoil};
use crate::signal::{Ack, InterruptPin};
use crate::source::FrameSource;
use crate::word;
use core::time::Duration;
use grideye_frame::{Frame, PixelIndex};

/// How long the sensor stays silent after power-on with [`Options::silent_start`] (AMG88 spec §4-4, "typ.").
pub const SILENT_START: Duration = Duration::from_millis(50);
/// The shortest sleep with [`Options::freezes_on_fast_wake`] (the wait of the Linux driver).
pub const SLEEP_MIN: Duration = Duration::from_millis(100);
/// The latest representable time: 584 years.
const TIME_MAX: Duration = Duration::from_nanos(u64::MAX);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Transfer {
    /// Addressed for writing; the next byte is a register address.
    Pointer,
    /// Addressed for writing; the next byte goes to the register under the pointer.
    Write,
    Read,
}

/// One AMG8833, driven byte by byte. Every call passes the current time.
///
/// The registers stand still from START to STOP (AMG88 spec §4-11-11). A time before an earlier call counts as that
/// call's.
#[derive(Debug, Clone)]
pub struct Device<S> {
    source: S,
    options: Options,
    registers: Registers,
    averaging: Averaging,
    progress: Progress,
    pointer: u8,
    transfer: Option<Transfer>,
    powered_at: Duration,
    asleep_since: Duration,
    woken_too_fast: bool,
    condition: Condition,
    spoil: Option<Spoil>,
    spoiled: FaultSet,
    /// How the current transaction is torn, and whether that has happened.
    tear: Option<Option<PixelIndex>>,
    tore: bool,
    latest: Duration,
    /// The last STOP: frames due during its transaction reached the registers then.
    stopped: Duration,
    /// A frame measured early for its thermistor, with its tick.
    early: Option<(u64, Frame)>,
    refusals: Refusals,
    frames: u64,
    edges: Edges,
}

impl<S: FrameSource> Device<S> {
    /// A sensor that powers on at this time.
    pub fn new(source: S, options: Options, powered_on_at: Duration) -> Self {
        let mut device = Self {
            source,
            options,
            registers: Registers::new(&options),
            averaging: Averaging::new(),
            progress: Progress::new(Ticks::new(powered_on_at, 0, options.clock_drift)),
            pointer: 0,
            transfer: None,
            powered_at: powered_on_at,
            asleep_since: Duration::ZERO,
            woken_too_fast: false,
            condition: Condition::default(),
            spoil: None,
            spoiled: FaultSet::EMPTY,
            tear: None,
            tore: false,
            latest: powered_on_at,
            stopped: powered_on_at,
            early: None,
            refusals: Refusals::default(),
            frames: 0,
            edges: Edges::default(),
        };
        device.power_cycle(powered_on_at);
        device
    }

    /// START, or repeated START, for writing.
    pub fn start_write(&mut self, now: Duration) -> Ack {
        self.start(Transfer::Pointer, now)
    }

    /// START, or repeated START, for reading.
    pub fn start_read(&mut self, now: Duration) -> Ack {
        self.start(Transfer::Read, now)
    }

    /// Sends one byte: first a register address, then values for that register and the following ones.
    pub fn write(&mut self, byte: u8, now: Duration) -> Ack {
        let now = self.at_last(now);
        match self.transfer {
            Some(Transfer::Pointer) => {
                self.pointer = byte;
                self.transfer = Some(Transfer::Write);
                Ack::Ack
            }
            Some(Transfer::Write) => {
                let register = self.step();
                let effect = self.registers.write(register, byte, &self.options);
                self.take_effect(effect, now);
                self.note_edge(now);
                Ack::Ack
            }
            Some(Transfer::Read) | None => self.nack(),
        }
    }

    /// Reads the register under the pointer and advances it; 0xFF if the sensor is not addressed for reading.
    pub fn read(&mut self, now: Duration) -> u8 {
        let now = self.at_last(now);
        if self.transfer != Some(Transfer::Read) {
            return 0xFF;
        }
        if self.options.thermistor_update == ThermistorUpdate::EveryTick {
            self.measure_thermistor(now);
        }
        if self.tear.is_some() {
            return self.read_torn(now);
        }
        let register = self.step();
        self.registers.read(register, &self.options)
    }

    /// STOP: frames due since START reach the registers now. The pointer stays.
    pub fn stop(&mut self, now: Duration) {
        self.close(now);
        self.advance(now);
    }

    /// Does what is due by this time, as every bus call does.
    pub fn advance(&mut self, now: Duration) {
        let now = self.at_last(now);
        if self.transfer.is_none() {
            self.catch_up(now);
        }
    }

    /// Cuts and restores the supply: every register returns to its power-on value. Bus faults stay.
    pub fn power_cycle(&mut self, now: Duration) {
        self.advance(now);
        let now = self.latest;
        self.registers = Registers::new(&self.options);
        self.averaging = Averaging::new();
        let origin = now.saturating_add(self.options.phase);
        let error = self.clock_error_ppm();
        self.progress = Progress::new(Ticks::new(origin, error, self.options.clock_drift));
        self.pointer = 0;
        self.transfer = None;
        self.powered_at = now;
        self.woken_too_fast = false;
        self.early = None;
        self.note_edge(now);
        self.announce();
    }

    /// Changes [`Options::clock_error_ppm`] without a phase jump. [`Options::clock_drift`] continues.
    pub fn set_clock_error_ppm(&mut self, clock_error_ppm: i32, now: Duration) {
        self.advance(now);
        self.options.clock_error_ppm = clock_error_ppm;
        let error = self.clock_error_ppm();
        self.progress.ticks.set_error(error, self.latest);
    }

    /// Takes the oldest untaken change of the INT pin, of the last [`EDGES_MAX`](crate::EDGES_MAX).
    pub fn take_edge(&mut self) -> Option<PinEdge> {
        self.edges.take()
    }
}

impl<S> Device<S> {
    /// When the sensor measures next, on the host's clock; `None` while it does not measure. At 1 fps, ten ticks make a
    /// frame.
    #[must_use]
    pub fn next_tick_at(&self) -> Option<Duration> {
        let tick = self.next_tick();
        self.measures().then(|| self.progress.ticks.time(tick))
    }

    /// When the next frame reaches the registers, unless an open transaction delays it; `None` if none is coming.
    #[must_use]
    pub fn next_frame_at(&self) -> Option<Duration> {
        let next = self.next_tick();
        let more = if self.takes_means() {
            self.averaging.missing() - 1
        } else {
            0
        };
        let tick = next.saturating_add(more);
        self.measures().then(|| self.progress.ticks.time(tick))
    }

    /// How often the INT pin fell and how often it was released, since the sensor was created.
    #[must_use]
    pub fn edge_counts(&self) -> (u64, u64) {
        self.edges.counts
    }

    /// How many INT pin changes were lost because nothing took them in time.
    #[must_use]
    pub fn edges_lost(&self) -> u64 {
        self.edges.lost
    }

    /// The INT pin as of the last call that passed a time.
    #[must_use]
    pub fn interrupt_pin(&self) -> InterruptPin {
        if self.condition.unpowered {
            return InterruptPin::HighZ;
        }
        self.registers.interrupt_pin(&self.options)
    }

    /// How many frames reached the registers since the sensor was created.
    #[must_use]
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// How often the sensor refused something.
    #[must_use]
    pub fn refusals(&self) -> Refusals {
        self.refusals
    }

    /// The options of this sensor.
    #[must_use]
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// The source of the sensor's frames.
    #[must_use]
    pub fn source(&self) -> &S {
        &self.source
    }
}

impl<S: FrameSource> Device<S> {
    fn start(&mut self, transfer: Transfer, now: Duration) -> Ack {
        self.advance(now);
        if self.answers() {
            self.transfer = Some(transfer);
            Ack::Ack
        } else {
            self.transfer = None;
            self.nack()
        }
    }

    fn answers(&self) -> bool {
        let starts = self.latest < self.powered_at.saturating_add(SILENT_START);
        let silent = self.options.silent_start && starts;
        !self.condition.unpowered && !silent
    }

    fn catch_up(&mut self, now: Duration) {
        self.progress.ticks.settle(now);
        let due = self.progress.ticks.count(now);
        if self.measures() {
            let every = self.registers.mode.stand_by_ticks();
            let mean = if self.takes_means() {
                FRAMES_AT_ONE_FPS
            } else {
                1
            };
            let frames = self
                .options
                .catch_up_frames_max
                .unwrap_or(CATCH_UP_FRAMES_MAX);
            let kept = frames.max(1).saturating_mul(every.unwrap_or(1));
            self.progress.skip(due, kept, mean.into());
            loop {
                let tick = self.progress.next(every);
                if tick > due {
                    break;
                }
                self.measure(tick);
                self.progress.last = tick;
            }
        }
        self.progress.last = self.progress.last.max(due);
    }

    fn measure(&mut self, tick: u64) {
        let time = self.progress.ticks.time(tick);
        let frame = self.frame(tick, time);
        let measured = Degrees::of(&frame);
        if self.options.thermistor_update == ThermistorUpdate::EveryTick {
            self.renew_thermistor(&frame);
        }
        let output = if self.takes_means() {
            self.averaging.one_of_ten(&measured)
        } else {
            Some(measured)
        };
        if let Some(output) = output {
            let average = self.registers.moving_average();
            let mut words = self.averaging.output(output, average);
            self.spoiled = FaultSet::EMPTY;
            if let Some(spoil) = &self.spoil {
                spoil.apply(&mut words);
                self.spoiled = spoil.kinds;
            }
            self.registers.publish(&words, &self.options);
            self.progress.reset = None;
            self.frames += 1;
            self.note_edge(time.max(self.stopped));
        }
    }

    /// The source's frame for this tick. Asks the source only once per tick.
    fn frame(&mut self, tick: u64, time: Duration) -> Frame {
        match self.early.take() {
            Some((early, frame)) if early == tick => frame,
            _ => self.source.frame_at(time),
        }
    }

    /// Measures the next tick early if it falls due in an open transaction, for its thermistor alone.
    fn measure_thermistor(&mut self, now: Duration) {
        if self.early.is_some() || !self.measures() {
            return;
        }
        let tick = self.next_tick();
        if tick <= self.progress.ticks.count(now) {
            let frame = self.source.frame_at(self.progress.ticks.time(tick));
            self.renew_thermistor(&frame);
            self.early = Some((tick, frame));
        }
    }

    fn renew_thermistor(&mut self, frame: &Frame) {
        let word = word::thermistor(f64::from(frame.thermistor.get()));
        let failed = self.spoil.as_ref().and_then(|spoil| spoil.thermistor);
        self.registers
            .set_thermistor(failed.unwrap_or(word.bits), word.overflow, &self.options);
    }

    fn take_effect(&mut self, effect: Effect, now: Duration) {
        match effect {
            Effect::Stored => {}
            Effect::RateChanged => {
                self.averaging = Averaging::new();
                self.leave_out();
            }
            Effect::ModeChanged(before) => self.change_mode(before, now),
            Effect::InitialReset => {
                self.averaging = Averaging::new();
                self.progress.reset(now, self.warm_up_ticks());
                self.announce();
            }
            Effect::Refused(counter) => *counter(&mut self.refusals) += 1,
        }
    }

    fn change_mode(&mut self, before: Mode, now: Duration) {
        if self.registers.mode == Mode::Sleep {
            self.asleep_since = now;
            return;
        }
        if before == Mode::Sleep {
            self.registers.wake(self.options.after_wake);
            let freezes = self.options.freezes_on_fast_wake || self.condition.fast_wake;
            self.woken_too_fast = freezes && now.saturating_sub(self.asleep_since) < SLEEP_MIN;
        }
        self.averaging = Averaging::new();
        self.progress.restart(now);
        self.leave_out();
    }

    /// With [`WarmUp::TwoFrames`], the ticks still omitted after an initial reset depend on rate and mode.
    fn leave_out(&mut self) {
        if self.options.warm_up == WarmUp::TwoFrames {
            self.progress.leave_out(self.warm_up_ticks());
        }
    }

    /// Ticks after an initial reset that yield no frame (AMG88 spec §4-11-2).
    fn warm_up_ticks(&self) -> u64 {
        match self.options.warm_up {
            WarmUp::TwoTicks => 1,
            WarmUp::TwoFrames if self.takes_means() => u64::from(FRAMES_AT_ONE_FPS),
            WarmUp::TwoFrames => self.registers.mode.stand_by_ticks().unwrap_or(1),
        }
    }

    fn announce(&mut self) {
        let first = self.next_tick();
        self.source.measuring_from(self.progress.ticks.time(first));
    }
}

/// How bus faults act on the sensor.
impl<S: FrameSource> Device<S> {
    /// Applies the lasting faults from this time on.
    pub(crate) fn set_condition(&mut self, condition: Condition, now: Duration) {
        if condition == self.condition {
            return;
        }
        let now = self.at_last(now);
        if self.condition.unpowered && !condition.unpowered {
            self.power_cycle(now);
        }
        let before = self.clock_error_ppm();
        self.condition = condition;
        let error = self.clock_error_ppm();
        if error != before {
            self.progress.ticks.set_error(error, now);
        }
        self.note_edge(now);
    }

    /// Reads a byte from registers that change within the transaction.
    #[cold]
    fn read_torn(&mut self, now: Duration) -> u8 {
        let frames = self.frames;
        if self.tear == Some(None) {
            self.catch_up(now);
        }
        self.tore |= self.frames != frames;
        let register = self.step();
        let pixel = self.tear.flatten();
        let older = pixel.and_then(|pixel| self.registers.read_previous(register, pixel));
        self.tore |= older.is_some();
        older.unwrap_or_else(|| self.registers.read(register, &self.options))
    }
}

impl<S> Device<S> {
    /// Sets what faults put into every frame from the next one on.
    pub(crate) fn set_spoil(&mut self, spoil: Option<Spoil>) {
        self.spoil = spoil;
    }

    pub(crate) fn spoiled(&self) -> FaultSet {
        self.spoiled
    }

    /// Tears the transaction that has just begun, as [`Fault::Torn`](crate::Fault::Torn) defines it.
    pub(crate) fn set_tear(&mut self, tear: Option<Option<PixelIndex>>) {
        self.tear = tear;
    }

    /// Whether a transaction was torn since the last call.
    pub(crate) fn take_tore(&mut self) -> bool {
        core::mem::take(&mut self.tore)
    }

    /// STOP without catching up: the caller does that.
    pub(crate) fn close(&mut self, now: Duration) {
        self.transfer = None;
        self.tear = None;
        self.stopped = self.at_last(now);
    }

    /// The time as of the last call that passed one.
    pub(crate) fn latest(&self) -> Duration {
        self.latest
    }

    pub(crate) fn is_addressed(&self) -> bool {
        self.transfer.is_some()
    }

    pub(crate) fn next_register(&self) -> Option<u8> {
        match self.transfer {
            Some(Transfer::Read | Transfer::Write) => Some(self.pointer),
            Some(Transfer::Pointer) | None => None,
        }
    }

    /// A fault keeps the sensor from acknowledging its address.
    pub(crate) fn refuse_address(&mut self) -> Ack {
        self.transfer = None;
        self.nack()
    }

    fn clock_error_ppm(&self) -> i32 {
        let imposed = self.condition.clock_error_ppm;
        imposed.unwrap_or(self.options.clock_error_ppm)
    }

    fn next_tick(&self) -> u64 {
        self.progress.next(self.registers.mode.stand_by_ticks())
    }

    fn measures(&self) -> bool {
        let stopped = self.condition.frozen || self.condition.unpowered;
        let asleep = self.registers.mode == Mode::Sleep || self.registers.undefined;
        !asleep && !self.woken_too_fast && !stopped
    }

    fn takes_means(&self) -> bool {
        self.registers.mode == Mode::Normal && self.registers.one_fps
    }

    fn note_edge(&mut self, at: Duration) {
        let low = self.interrupt_pin() == InterruptPin::Low;
        self.edges.note(low, at);
    }

    /// Returns the register under the pointer and advances the pointer.
    fn step(&mut self) -> u8 {
        let register = self.pointer;
        self.pointer = match self.options.past_the_end {
            PastTheEnd::Wraps => register.wrapping_add(1),
            PastTheEnd::Stays => register.saturating_add(1),
        };
        register
    }

    pub(crate) fn nack(&mut self) -> Ack {
        self.refusals.nacks += 1;
        Ack::Nack
    }

    /// Records the time, which never runs backwards here.
    fn at_last(&mut self, now: Duration) -> Duration {
        self.latest = self.latest.max(now.min(TIME_MAX));
        self.latest
    }
}
