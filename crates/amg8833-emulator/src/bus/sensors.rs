//! The sensors of one bus with their faults, which take effect in order of time.

use crate::bus::line::{Course, Line};
use crate::device::Device;
use crate::fault::active::{Condition, Faults};
use crate::fault::{Chance, Fault, FaultKind};
#[cfg(feature = "alloc")]
use crate::script::{Changes, Running, Script};
use crate::signal::Address;
use crate::source::FrameSource;
use core::time::Duration;

/// The most due events and frames that one call handles one by one, oldest first. The rest come in one step, without
/// frame faults, and each rule begins at most once.
pub const STEPS_MAX: u32 = 1_000_000;
/// Whatever falls on the exact time of an event comes after it.
const INSTANT: Duration = Duration::from_nanos(1);

#[derive(Debug)]
pub(crate) struct Sensors<S> {
    pub(crate) devices: [Option<Device<S>>; 2],
    pub(crate) faults: Faults,
    #[cfg(feature = "alloc")]
    pub(crate) script: Option<alloc::boxed::Box<Running>>,
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
    pub(crate) fn new() -> Self {
        Self {
            devices: [const { None }; 2],
            faults: Faults::default(),
            #[cfg(feature = "alloc")]
            script: None,
        }
    }

    /// Does everything due by this time in order, if the order matters.
    pub(crate) fn catch_up(&mut self, now: Duration) {
        if !self.is_stepwise() {
            return;
        }
        let mut steps = 0;
        while let Some(at) = self.next_step(now) {
            steps += 1;
            if steps > STEPS_MAX || !self.step(at) {
                self.advance(now);
                #[cfg(feature = "alloc")]
                self.follow(now, Running::jump);
                break;
            }
        }
        self.advance(now);
    }

    pub(crate) fn look(&mut self, now: Duration) {
        self.catch_up(now);
        self.advance(now);
    }

    fn advance(&mut self, now: Duration) {
        for device in self.devices.iter_mut().flatten() {
            device.advance(now);
        }
    }

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
        self.look(now);
        if fault == Fault::BrownOut {
            self.brown_out(target, now);
            return true;
        }
        let set = self.faults.set(fault, target, chance);
        self.apply_conditions(now);
        set
    }

    pub(crate) fn clear_faults(&mut self, target: Option<Address>, now: Duration) {
        self.look(now);
        self.faults.clear(target);
        self.apply_conditions(now);
    }

    pub(crate) fn apply_conditions(&mut self, now: Duration) {
        for address in Address::ALL {
            let condition = self.faults.condition(address);
            if let Some(device) = self.device_mut(address) {
                device.set_condition(condition, now);
                device.set_spoil(None);
            }
        }
    }

    pub(crate) fn brown_out(&mut self, target: Option<Address>, now: Duration) {
        self.faults.happen(FaultKind::BrownOut);
        for address in Address::ALL {
            let hit = target.is_none() || target == Some(address);
            if let Some(device) = self.device_mut(address).filter(|_| hit) {
                device.power_cycle(now);
            }
        }
    }

    /// The sensor at this address with its faults in this transaction.
    pub(crate) fn line(&mut self, address: Address, number: u64) -> Option<Line<'_, S>> {
        let device = self.devices[address.place()].as_mut()?;
        Some(Line::new(device, &mut self.faults, address, number))
    }

    /// The line of a transaction that has come this far.
    pub(crate) fn resume(&mut self, course: Course) -> Option<Line<'_, S>> {
        let device = self.devices[course.address.place()].as_mut()?;
        let faults = &mut self.faults;
        Some(Line {
            device,
            faults,
            course,
        })
    }

    /// Whether the order of due events matters.
    fn is_stepwise(&self) -> bool {
        #[cfg(feature = "alloc")]
        if self.script.is_some() {
            return true;
        }
        self.faults.spoils_frames()
    }

    /// The next event or tick that must be handled by itself, if it is due.
    fn next_step(&self, now: Duration) -> Option<Duration> {
        let tick = self.counts_frames().then(|| self.next_tick()).flatten();
        let next = tick.into_iter().chain(self.next_event()).min();
        next.filter(|next| *next <= now)
    }

    fn counts_frames(&self) -> bool {
        #[cfg(feature = "alloc")]
        if let Some(true) = self.script.as_ref().map(|script| script.counts_frames) {
            return true;
        }
        self.faults.spoils_frames()
    }

    fn next_tick(&self) -> Option<Duration> {
        let devices = self.devices.iter().flatten();
        let free = devices.filter(|device| !device.is_addressed());
        free.filter_map(Device::next_tick_at).min()
    }

    fn next_event(&self) -> Option<Duration> {
        #[cfg(feature = "alloc")]
        if let Some(script) = &self.script {
            return script.next_event();
        }
        None
    }

    /// Does what is due at this time; `false` if that makes no progress.
    fn step(&mut self, at: Duration) -> bool {
        if self.next_event() == Some(at) {
            self.advance(at.saturating_sub(INSTANT));
            #[cfg(feature = "alloc")]
            self.follow(at, Running::follow);
            return true;
        }
        for address in Address::ALL {
            self.tick(address, at);
        }
        #[cfg(feature = "alloc")]
        self.follow(at, Running::follow_frames);
        self.next_tick().is_none_or(|next| next > at)
    }

    /// Lets the sensor at this address measure what is due, with the faults of its next frame.
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

    /// Makes the script continue this sensor's frame count with the next sensor at this address.
    fn note_leaving(&mut self, address: Address) {
        #[cfg(feature = "alloc")]
        if let Some(script) = &mut self.script {
            let frames = self.devices[address.place()].as_ref().map(Device::frames);
            script.left(address, frames.unwrap_or(0));
        }
        #[cfg(not(feature = "alloc"))]
        let _ = address;
    }
}

#[cfg(feature = "alloc")]
impl<S: FrameSource> Sensors<S> {
    pub(crate) fn set_script(&mut self, script: Option<Script>, now: Duration) {
        self.faults.by_rule.clear();
        self.apply_conditions(now);
        self.script = None;
        if let Some(script) = script {
            self.faults.seed = script.seed_here();
            let frames = self.frames();
            let running = Running::new(script, &mut self.faults, frames, now);
            self.script = Some(alloc::boxed::Box::new(running));
            self.follow(now, Running::follow_frames);
            self.catch_up(now);
        }
    }

    fn follow(
        &mut self,
        now: Duration,
        go_on: fn(&mut Running, &mut Faults, [Option<u64>; 2], Duration) -> Changes,
    ) {
        let frames = self.frames();
        let Some(script) = &mut self.script else {
            return;
        };
        let changes = go_on(script, &mut self.faults, frames, now);
        for target in changes.brown_outs {
            self.brown_out(target, now);
        }
        if changes.any {
            self.apply_conditions(now);
        }
    }

    fn frames(&self) -> [Option<u64>; 2] {
        let frames = |device: &Option<Device<S>>| device.as_ref().map(Device::frames);
        self.devices.each_ref().map(frames)
    }
}

/// A sensor that leaves the bus loses its faults.
fn mended<S: FrameSource>(mut device: Device<S>) -> Device<S> {
    let now = device.latest();
    device.set_condition(Condition::default(), now);
    device.set_spoil(None);
    device
}
