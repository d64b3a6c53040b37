//! The sensors of one bus with what is broken about them: what falls due comes in order of time.

use crate::bus::wire::Target;
use crate::device::Device;
use crate::fault::active::{Condition, Faults, Plan};
use crate::fault::{Chance, Fault, FaultKind, FaultSet};
use crate::signal::{Ack, Address};
use crate::source::FrameSource;
use core::time::Duration;

/// The most events of a script and frames of sensors that are gone through one by one at once, when nobody has looked
/// for long. What is older than that comes in one step: no spoilt frames, and a script goes on where it then is.
pub const STEPS_MAX: u32 = 1_000_000;
/// What falls on the very time of an event comes after it.
const INSTANT: Duration = Duration::from_nanos(1);

#[derive(Debug)]
pub(crate) struct Sensors<S> {
    pub(crate) devices: [Option<Device<S>>; 2],
    pub(crate) faults: Faults,
    #[cfg(feature = "alloc")]
    pub(crate) script: Option<alloc::boxed::Box<crate::script::Running>>,
}

impl<S> Sensors<S> {
    pub(crate) fn device(&self, address: Address) -> Option<&Device<S>> {
        self.devices[address.place()].as_ref()
    }

    pub(crate) fn device_mut(&mut self, address: Address) -> Option<&mut Device<S>> {
        self.devices[address.place()].as_mut()
    }
}

impl<S: FrameSource> Sensors<S> {
    pub(crate) const fn new() -> Self {
        Self {
            devices: [const { None }; 2],
            faults: Faults::new(),
            #[cfg(feature = "alloc")]
            script: None,
        }
    }

    /// Lets everything happen that is due by this time, if it matters in which order.
    pub(crate) fn catch_up(&mut self, now: Duration) {
        if !self.is_stepwise() {
            return;
        }
        let mut steps = 0;
        while let Some(at) = self.next_step(now) {
            steps += 1;
            if steps > STEPS_MAX || !self.step(at) {
                self.jump(now);
                break;
            }
        }
        self.advance(now);
    }

    /// Lets the sensors do what is due by this time.
    pub(crate) fn advance(&mut self, now: Duration) {
        for device in self.devices.iter_mut().flatten() {
            device.advance(now);
        }
    }

    /// STOP, for the sensor at this address.
    pub(crate) fn stop(&mut self, address: Address, now: Duration) {
        let stepwise = self.is_stepwise();
        if let Some(device) = self.device_mut(address) {
            if stepwise {
                device.close(now);
            } else {
                device.stop(now);
            }
        }
        self.catch_up(now);
    }

    pub(crate) fn plug(
        &mut self,
        address: Address,
        device: Device<S>,
        now: Duration,
    ) -> Option<Device<S>> {
        self.catch_up(now);
        self.note_leaving(address);
        let before = self.devices[address.place()].replace(device);
        self.apply_conditions(now);
        before.map(mended)
    }

    pub(crate) fn unplug(&mut self, address: Address, now: Duration) -> Option<Device<S>> {
        self.catch_up(now);
        self.faults.clear(Some(address));
        self.note_leaving(address);
        let device = self.devices[address.place()].take();
        self.apply_conditions(now);
        device.map(mended)
    }

    pub(crate) fn set_fault(
        &mut self,
        fault: Fault,
        target: Option<Address>,
        chance: Chance,
        now: Duration,
    ) -> bool {
        self.catch_up(now);
        self.advance(now);
        if fault == Fault::BrownOut {
            self.brown_out(target, now);
            return true;
        }
        let set = self.faults.set(fault, target, chance);
        self.apply_conditions(now);
        set
    }

    pub(crate) fn clear_faults(&mut self, target: Option<Address>, now: Duration) {
        self.catch_up(now);
        self.advance(now);
        self.faults.clear(target);
        self.apply_conditions(now);
    }

    /// Tells each sensor what is lasting about its faults.
    pub(crate) fn apply_conditions(&mut self, now: Duration) {
        for address in Address::ALL {
            let condition = self.faults.condition(address);
            if let Some(device) = self.device_mut(address) {
                device.set_condition(condition, now);
                device.set_spoil(None);
            }
        }
    }

    /// The supply of these sensors fails for a moment.
    pub(crate) fn brown_out(&mut self, target: Option<Address>, now: Duration) {
        self.faults.happen(FaultKind::BrownOut);
        for address in Address::ALL {
            let hit = target.is_none() || target == Some(address);
            if let Some(device) = self.device_mut(address).filter(|_| hit) {
                device.power_cycle(now);
            }
        }
    }

    /// The sensor at this address, as a transaction of this number meets it.
    pub(crate) fn line(&mut self, address: Address, number: u64) -> Option<Line<'_, S>> {
        let device = self.devices[address.place()].as_mut()?;
        let plan = self.faults.plan(address, number);
        Some(Line {
            device,
            faults: &mut self.faults,
            address,
            plan,
            bytes: 0,
            written: 0,
            cut: false,
            told: FaultSet::EMPTY,
            struck: FaultSet::EMPTY,
        })
    }

    /// Whether it matters in which order things fall due.
    fn is_stepwise(&self) -> bool {
        #[cfg(feature = "alloc")]
        if self.script.is_some() {
            return true;
        }
        self.faults.spoils_frames()
    }

    /// When the next thing happens that has to be gone through by itself, if it is due.
    fn next_step(&self, now: Duration) -> Option<Duration> {
        let tick = if self.counts_frames() {
            self.next_tick()
        } else {
            None
        };
        let event = self.next_event();
        let next = match (tick, event) {
            (Some(tick), Some(event)) => tick.min(event),
            (tick, event) => tick.or(event)?,
        };
        (next <= now).then_some(next)
    }

    fn counts_frames(&self) -> bool {
        #[cfg(feature = "alloc")]
        if self
            .script
            .as_ref()
            .is_some_and(|script| script.counts_frames())
        {
            return true;
        }
        self.faults.spoils_frames()
    }

    fn next_tick(&self) -> Option<Duration> {
        let devices = self.devices.iter().flatten();
        devices
            .filter(|device| !device.is_addressed())
            .filter_map(Device::next_tick_at)
            .min()
    }

    fn next_event(&self) -> Option<Duration> {
        #[cfg(feature = "alloc")]
        if let Some(script) = &self.script {
            return script.next_event();
        }
        None
    }

    /// What is due at this time; `false` when that does not bring it any further.
    fn step(&mut self, at: Duration) -> bool {
        if self.next_event() == Some(at) {
            self.advance(at.saturating_sub(INSTANT));
            self.follow(at);
            return true;
        }
        for address in Address::ALL {
            self.tick(address, at);
        }
        self.follow_frames(at);
        self.next_tick().is_none_or(|next| next > at)
    }

    /// Lets the sensor at this address measure what is due by this time, with the faults of its next frame.
    fn tick(&mut self, address: Address, at: Duration) {
        let number = self.device(address).map_or(0, |device| device.frames() + 1);
        let spoil = self.faults.spoil(address, number);
        let Some(device) = self.device_mut(address) else {
            return;
        };
        device.set_spoil(spoil);
        device.advance(at);
        device.set_spoil(None);
        let came = device.frames() >= number;
        if came && spoil.is_some() {
            self.faults.settle_frame(address, number);
        }
    }

    #[cfg(feature = "alloc")]
    fn note_leaving(&mut self, address: Address) {
        let frames = self.device(address).map_or(0, Device::frames);
        if let Some(script) = &mut self.script {
            script.left(address, frames);
        }
    }

    #[cfg(not(feature = "alloc"))]
    fn note_leaving(&mut self, _address: Address) {}

    #[cfg(feature = "alloc")]
    fn follow(&mut self, at: Duration) {
        if let Some(mut script) = self.script.take() {
            script.follow(self, at);
            self.script = Some(script);
        }
    }

    #[cfg(feature = "alloc")]
    fn follow_frames(&mut self, at: Duration) {
        if let Some(mut script) = self.script.take() {
            script.follow_frames(self, at);
            self.script = Some(script);
        }
    }

    #[cfg(feature = "alloc")]
    fn jump(&mut self, now: Duration) {
        self.advance(now);
        if let Some(mut script) = self.script.take() {
            script.jump(self, now);
            self.script = Some(script);
        }
    }

    #[cfg(not(feature = "alloc"))]
    fn follow(&mut self, _at: Duration) {}

    #[cfg(not(feature = "alloc"))]
    fn follow_frames(&mut self, _at: Duration) {}

    #[cfg(not(feature = "alloc"))]
    fn jump(&mut self, now: Duration) {
        self.advance(now);
    }
}

#[cfg(feature = "alloc")]
impl<S: FrameSource> Sensors<S> {
    pub(crate) fn set_script(&mut self, script: Option<crate::script::Script>, now: Duration) {
        self.faults.by_rule.clear();
        self.apply_conditions(now);
        self.script = None;
        if let Some(script) = script {
            self.faults.seed = script.seed_here();
            let running = crate::script::Running::new(script, now, self);
            self.script = Some(alloc::boxed::Box::new(running));
            self.follow_frames(now);
            self.catch_up(now);
        }
    }
}

#[cfg(feature = "alloc")]
impl<S: FrameSource> crate::script::Breakable for Sensors<S> {
    fn faults(&mut self) -> &mut Faults {
        &mut self.faults
    }

    fn frames(&self, address: Address) -> Option<u64> {
        self.device(address).map(Device::frames)
    }

    fn apply_conditions(&mut self, now: Duration) {
        Self::apply_conditions(self, now);
    }

    fn brown_out(&mut self, target: Option<Address>, now: Duration) {
        Self::brown_out(self, target, now);
    }
}

/// A sensor that leaves the bus leaves its faults there.
fn mended<S: FrameSource>(mut device: Device<S>) -> Device<S> {
    let now = device.latest();
    device.set_condition(Condition::SOUND, now);
    device.set_spoil(None);
    device
}

/// One sensor for the length of one transaction, with what is broken about it.
pub(crate) struct Line<'a, S> {
    device: &'a mut Device<S>,
    faults: &'a mut Faults,
    address: Address,
    plan: Plan,
    /// Bytes of data so far.
    bytes: u16,
    /// Of those, the written ones.
    written: u16,
    /// Whether the sensor took a lost clock pulse for the end.
    cut: bool,
    /// What struck and was told.
    told: FaultSet,
    /// What struck since.
    struck: FaultSet,
}

impl<S: FrameSource> Line<'_, S> {
    /// What struck in the whole of the transaction.
    pub(crate) fn struck(&self) -> FaultSet {
        let mut all = self.told;
        all.join(self.struck);
        all
    }

    /// Bits turned over and pulses lost: what happens to a byte on its way.
    fn byte_on_its_way(&mut self, byte: &mut u8, register: Option<u8>) {
        let place = self.bytes;
        self.bytes = self.bytes.saturating_add(1);
        self.faults.pass_byte();
        if self.plan.flips && self.faults.flip(byte, self.address, register, place) {
            self.struck.insert(FaultKind::BitFlip);
        }
    }

    /// The bit whose pulse the next byte loses.
    fn lost_pulse(&self) -> Option<u8> {
        let (byte, bit) = self.plan.short_clock?;
        (byte == self.bytes).then_some(bit)
    }

    fn is_refused(&self) -> bool {
        self.plan.nack_byte == Some(self.written)
    }

    fn broken_read(&mut self, now: Duration) -> u8 {
        let register = self.device.next_register();
        let lost = self.lost_pulse();
        let mut byte = if self.cut {
            0xFF
        } else {
            self.device.read(now)
        };
        if self.device.take_tore() {
            self.struck.insert(FaultKind::Torn);
        }
        if let Some(bit) = lost.filter(|_| !self.cut) {
            let late = (1_u8 << bit) - 1;
            byte = (byte & !late) | (byte >> 1 & late);
            self.cut = true;
            self.struck.insert(FaultKind::ShortClock);
        }
        self.byte_on_its_way(&mut byte, register);
        if self.plan.stuck_high {
            byte = 0xFF;
            self.struck.insert(FaultKind::StuckHigh);
        }
        if self.plan.all_zero {
            byte = 0x00;
            self.struck.insert(FaultKind::AllZero);
        }
        byte
    }

    fn broken_write(&mut self, mut byte: u8, now: Duration) -> Ack {
        if self.is_refused() {
            self.struck.insert(FaultKind::NackByte);
            return self.device.refuse_byte();
        }
        if self.lost_pulse().is_some() {
            self.struck.insert(FaultKind::ShortClock);
            return self.device.refuse_byte();
        }
        let register = self.device.next_register();
        self.byte_on_its_way(&mut byte, register);
        self.written = self.written.saturating_add(1);
        self.device.write(byte, now)
    }
}

impl<S: FrameSource> Target for Line<'_, S> {
    fn start(&mut self, reads: bool, now: Duration) -> Ack {
        self.cut = false;
        if let Some(silent) = self.plan.silent {
            self.struck.insert(silent);
            return self.device.refuse_address();
        }
        let ack = if reads {
            self.device.start_read(now)
        } else {
            self.device.start_write(now)
        };
        if self.plan.torn.is_some() {
            self.device.set_tear(self.plan.torn);
        }
        ack
    }

    fn write(&mut self, byte: u8, now: Duration) -> Ack {
        if self.plan.any {
            self.broken_write(byte, now)
        } else {
            self.device.write(byte, now)
        }
    }

    fn read(&mut self, now: Duration) -> u8 {
        if self.plan.any {
            self.broken_read(now)
        } else {
            self.device.read(now)
        }
    }

    fn take_struck(&mut self) -> FaultSet {
        let mut faults = core::mem::take(&mut self.struck);
        self.told.join(faults);
        faults.join(self.plan.lasting);
        faults.join(self.device.spoiled());
        faults
    }
}
