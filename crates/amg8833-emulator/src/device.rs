use crate::fault::Fault;
use crate::measurement::{Averaging, Degrees, Progress};
use crate::options::Options;
use crate::registers::{Effect, Mode, Refusal, Registers};
use crate::source::FrameSource;
use core::time::Duration;

/// How long the sensor does not answer after power-on with [`Options::silent_start`] (AMG88 spec §4-4, "typ.").
pub const SILENT_START: Duration = Duration::from_millis(50);
/// How long the sensor has to have slept before it is woken, with [`Options::freezes_on_fast_wake`] (the wait of the
/// Linux driver).
pub const SLEEP_MIN: Duration = Duration::from_millis(100);
/// The most frames that are made up for at once, a little more than a day's. When nobody looks for longer, only the
/// newest of the missed frames are measured.
pub const CATCH_UP_FRAMES_MAX: u64 = 1_000_000;
/// The latest time that counts, 584 years from the clock's origin: the most that [`ManualClock`](crate::ManualClock)
/// can show.
const TIME_MAX: Duration = Duration::from_nanos(u64::MAX);
/// Ticks after an initial reset that yield no frame: the first one is there after two (AMG88 spec §4-11-2).
const WARM_UP_TICKS: u64 = 1;

/// Whether a byte on the bus was acknowledged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ack {
    /// SDA was pulled low in the ninth bit.
    Ack,
    /// SDA was left high in the ninth bit.
    Nack,
}

/// The level of the INT pin: an open drain (AMG88 spec §4-7).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InterruptPin {
    /// Pulled low: an interrupt.
    Low,
    /// Released; the board's pull-up takes it high.
    HighZ,
}

/// How often the sensor refused something, since it was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Refusals {
    /// Addresses and bytes that were not acknowledged.
    pub nacks: u64,
    /// Bytes written in sleep mode, other than the one that wakes it (AMG88 spec §4-11-1).
    pub asleep: u64,
    /// Bytes written to registers that can only be read.
    pub read_only: u64,
    /// Bytes written to reserved or undocumented registers.
    pub reserved: u64,
    /// Bytes written to the moving average register without its key (AMG88 spec §4-11-7).
    pub without_key: u64,
    /// Unknown commands in the power control and reset registers.
    pub unknown_commands: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Transfer {
    /// Addressed for writing; the next byte is a register address.
    Pointer,
    /// Addressed for writing; the next byte goes to the register under the pointer.
    Write,
    Read,
}

/// One AMG8833 at the level of bytes on its bus. Every call says what time it is.
///
/// The registers stand still from START over repeated STARTs to STOP; what falls due in between comes after STOP
/// (AMG88 spec §4-11-11). Times that lie before an earlier one count as that one; those beyond 584 years, as 584 years.
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
    fault: Option<Fault>,
    latest: Duration,
    refusals: Refusals,
    frames: u64,
}

impl<S: FrameSource> Device<S> {
    /// A sensor that is powered on at this time.
    pub fn new(source: S, options: Options, powered_on_at: Duration) -> Self {
        let mut device = Self {
            source,
            options,
            registers: Registers::new(),
            averaging: Averaging::new(),
            progress: Progress::new(powered_on_at, 0),
            pointer: 0,
            transfer: None,
            powered_at: powered_on_at,
            asleep_since: Duration::ZERO,
            woken_too_fast: false,
            fault: None,
            latest: powered_on_at,
            refusals: Refusals::default(),
            frames: 0,
        };
        device.power_cycle(powered_on_at);
        device
    }

    /// START, or repeated START, and the address byte for writing.
    pub fn start_write(&mut self, now: Duration) -> Ack {
        self.start(Transfer::Pointer, now)
    }

    /// START, or repeated START, and the address byte for reading.
    pub fn start_read(&mut self, now: Duration) -> Ack {
        self.start(Transfer::Read, now)
    }

    /// One byte to the sensor: a register address first, then bytes for it and the ones behind it. Past 0xFF comes
    /// 0x00. Not acknowledged when the sensor was not addressed for writing.
    pub fn write(&mut self, byte: u8, now: Duration) -> Ack {
        let now = self.at_last(now);
        match self.transfer {
            Some(Transfer::Pointer | Transfer::Write) if self.fault == Some(Fault::NackData) => {
                self.nack()
            }
            Some(Transfer::Pointer) => {
                self.pointer = byte;
                self.transfer = Some(Transfer::Write);
                Ack::Ack
            }
            Some(Transfer::Write) => {
                let register = self.step();
                let effect = self.registers.write(register, byte, &self.options);
                self.take_effect(effect, now);
                Ack::Ack
            }
            Some(Transfer::Read) | None => self.nack(),
        }
    }

    /// One byte from the register under the pointer, which moves on. 0xFF, the released line, when the sensor was not
    /// addressed for reading.
    pub fn read(&mut self, now: Duration) -> u8 {
        self.at_last(now);
        if self.transfer != Some(Transfer::Read) {
            return 0xFF;
        }
        let register = self.step();
        match self.fault {
            Some(Fault::StuckHigh) => 0xFF,
            Some(Fault::AllZero) => 0x00,
            _ => self.registers.read(register, &self.options),
        }
    }

    /// STOP: what fell due since START comes into the registers now. The pointer stays.
    pub fn stop(&mut self, now: Duration) {
        self.transfer = None;
        self.advance(now);
    }

    /// Lets the sensor do what is due by this time. Every call on the bus does so itself; this one is for looking at
    /// [`interrupt_pin`](Self::interrupt_pin) and [`frames`](Self::frames) in between.
    pub fn advance(&mut self, now: Duration) {
        let now = self.at_last(now);
        if self.transfer.is_none() {
            self.catch_up(now);
        }
    }

    /// Takes the supply away and gives it back: every register as after power-on. Faults stay.
    pub fn power_cycle(&mut self, now: Duration) {
        self.advance(now);
        let now = self.latest;
        self.registers = Registers::new();
        self.averaging = Averaging::new();
        let origin = now.saturating_add(self.options.phase);
        self.progress = Progress::new(origin, self.options.clock_error_ppm);
        self.pointer = 0;
        self.transfer = None;
        self.powered_at = now;
        self.woken_too_fast = false;
        self.announce();
    }

    /// Breaks the sensor in this way from now on, instead of the way before.
    pub fn set_fault(&mut self, fault: Fault, now: Duration) {
        self.advance(now);
        if fault == Fault::BrownOut {
            self.power_cycle(now);
        } else {
            self.clear_fault(now);
            self.fault = Some(fault);
        }
    }

    /// Mends the sensor. After [`Fault::Unplugged`] it powers on.
    pub fn clear_fault(&mut self, now: Duration) {
        self.advance(now);
        if self.fault.take() == Some(Fault::Unplugged) {
            self.power_cycle(now);
        }
    }

    /// Sets the sensor's clock to another error, in parts per million as in [`Options::clock_error_ppm`], without a
    /// jump of its phase: called again and again, a drift.
    pub fn set_clock_error_ppm(&mut self, clock_error_ppm: i32, now: Duration) {
        self.advance(now);
        self.options.clock_error_ppm = clock_error_ppm;
        self.progress.ticks.set_error(clock_error_ppm, self.latest);
    }
}

impl<S> Device<S> {
    /// When the next tick comes that the sensor measures at, on the host's clock; `None` while it does not measure. At
    /// 1 fps, ten of them make a frame.
    #[must_use]
    pub fn next_tick_at(&self) -> Option<Duration> {
        let tick = self.progress.next(self.registers.mode().stand_by_ticks());
        self.measures().then(|| self.progress.ticks.time(tick))
    }

    /// The fault that was set and not cleared.
    #[must_use]
    pub fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// The INT pin as of the last call that told the time.
    #[must_use]
    pub fn interrupt_pin(&self) -> InterruptPin {
        let powered = self.fault != Some(Fault::Unplugged);
        if powered && self.registers.interrupt_asserted() {
            InterruptPin::Low
        } else {
            InterruptPin::HighZ
        }
    }

    /// How many frames came into the registers since the sensor was made: the count that nothing on the bus tells.
    #[must_use]
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// What the sensor refused so far.
    #[must_use]
    pub fn refusals(&self) -> Refusals {
        self.refusals
    }

    /// How this specimen behaves.
    #[must_use]
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// The source of its frames.
    #[must_use]
    pub fn source(&self) -> &S {
        &self.source
    }

    /// The source of its frames, to change what it sees from the next tick on.
    pub fn source_mut(&mut self) -> &mut S {
        &mut self.source
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
        let silent =
            self.options.silent_start && self.latest < self.powered_at.saturating_add(SILENT_START);
        let broken = matches!(
            self.fault,
            Some(
                Fault::NackAddress
                    | Fault::BusError
                    | Fault::ArbitrationLoss
                    | Fault::Hang
                    | Fault::Unplugged
            )
        );
        !silent && !broken
    }

    /// Measures what is due, tick by tick, as the mode asks for.
    fn catch_up(&mut self, now: Duration) {
        let due = self.progress.ticks.count(now);
        if self.measures() {
            let every = self.registers.mode().stand_by_ticks();
            let spared = CATCH_UP_FRAMES_MAX.saturating_mul(every.unwrap_or(1));
            self.progress.last = self.progress.last.max(due.saturating_sub(spared));
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
        let frame = self.source.frame_at(self.progress.ticks.time(tick));
        let measured = Degrees::of(&frame);
        let output = if self.registers.mode() == Mode::Normal && self.registers.one_fps() {
            self.averaging.one_of_ten(&measured)
        } else {
            Some(measured)
        };
        if let Some(output) = output {
            let words = self
                .averaging
                .output(output, self.registers.moving_average());
            self.registers.publish(&words, &self.options);
            self.frames += 1;
        }
    }

    fn take_effect(&mut self, effect: Effect, now: Duration) {
        match effect {
            Effect::Stored => {}
            Effect::RateChanged => self.averaging = Averaging::new(),
            Effect::ModeChanged(before) => self.change_mode(before, now),
            Effect::InitialReset => {
                self.averaging = Averaging::new();
                self.progress.restart(now, WARM_UP_TICKS);
                self.announce();
            }
            Effect::Refused(refusal) => self.count(refusal),
        }
    }

    fn change_mode(&mut self, before: Mode, now: Duration) {
        if self.registers.mode() == Mode::Sleep {
            self.asleep_since = now;
            return;
        }
        if before == Mode::Sleep {
            self.registers.forget_predecessor();
            self.woken_too_fast = self.options.freezes_on_fast_wake
                && now.saturating_sub(self.asleep_since) < SLEEP_MIN;
        }
        self.averaging = Averaging::new();
        self.progress.restart(now, 0);
    }

    fn announce(&mut self) {
        let first = self.progress.next(self.registers.mode().stand_by_ticks());
        self.source.measuring_from(self.progress.ticks.time(first));
    }
}

impl<S> Device<S> {
    fn measures(&self) -> bool {
        let stopped = matches!(self.fault, Some(Fault::Freeze | Fault::Unplugged));
        self.registers.mode() != Mode::Sleep && !self.woken_too_fast && !stopped
    }

    /// The register under the pointer, which then moves on.
    fn step(&mut self) -> u8 {
        let register = self.pointer;
        self.pointer = register.wrapping_add(1);
        register
    }

    fn nack(&mut self) -> Ack {
        self.refusals.nacks += 1;
        Ack::Nack
    }

    fn count(&mut self, refusal: Refusal) {
        let refusals = &mut self.refusals;
        *match refusal {
            Refusal::Asleep => &mut refusals.asleep,
            Refusal::ReadOnly => &mut refusals.read_only,
            Refusal::Reserved => &mut refusals.reserved,
            Refusal::WithoutKey => &mut refusals.without_key,
            Refusal::UnknownCommand => &mut refusals.unknown_commands,
        } += 1;
    }

    /// The time, which never runs backwards here.
    fn at_last(&mut self, now: Duration) -> Duration {
        self.latest = self.latest.max(now.min(TIME_MAX));
        self.latest
    }
}
