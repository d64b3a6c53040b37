//! A bus with up to two sensors, as a controller sees it.

pub(crate) mod sensors;
pub(crate) mod wire;

use crate::bus::sensors::Sensors;
use crate::bus::wire::{Nobody, Wire, is_read};
use crate::clock::Clock;
use crate::device::Device;
use crate::device::options::Options;
use crate::fault::active::controller_error;
use crate::fault::{Chance, Fault, FaultCounts, FaultKind, FaultSet};
use crate::signal::{Address, BusError, InterruptPin, Traffic};
use crate::source::FrameSource;
use core::num::NonZeroU32;
use embedded_hal::i2c::{ErrorType, I2c, Operation};

pub use sensors::STEPS_MAX;

/// A bus with up to two sensors behind `embedded_hal::i2c::I2c`.
///
/// Without an SCL frequency, transactions take no time. With one, every bit is handed to [`Clock::pass`], so that a
/// frame can fall due within a transaction, or between two.
///
/// Faults come to pass between transactions: one that falls due within one comes with its STOP. A sensor that is
/// let on through [`device_mut`](Self::device_mut) with a time of one's own knows nothing of the faults that fall due
/// meanwhile; [`advance`](Self::advance) keeps all in order.
#[derive(Debug)]
pub struct Bus<C, S> {
    pub(crate) wire: Wire<C>,
    pub(crate) sensors: Sensors<S>,
}

impl<C: Clock, S: FrameSource> Bus<C, S> {
    /// A bus without devices.
    pub const fn new(clock: C) -> Self {
        Self {
            wire: Wire::new(clock),
            sensors: Sensors::new(),
        }
    }

    /// A bus with one sensor that is powered on now and behaves as [`Options::default`] says.
    pub fn with_sensor(clock: C, address: Address, source: S) -> Self {
        let mut bus = Self::new(clock);
        bus.plug(address, source, Options::default());
        bus
    }

    /// The same bus with bits that take their time. The sensor is specified for up to 400,000 Hz (AMG88 spec §4-6-2).
    #[must_use]
    pub fn with_scl_hz(mut self, scl_hz: NonZeroU32) -> Self {
        self.wire.set_scl_hz(scl_hz);
        self
    }

    /// Connects a sensor and powers it on now; hands back the one that was there. Faults of this address and of the
    /// whole bus are the new one's too.
    pub fn plug(&mut self, address: Address, source: S, options: Options) -> Option<Device<S>> {
        let now = self.wire.clock.now();
        let device = Device::new(source, options, now);
        self.sensors.plug(address, device, now)
    }

    /// Takes the sensor off the bus, and with it the faults that were set on it by call.
    pub fn unplug(&mut self, address: Address) -> Option<Device<S>> {
        let now = self.wire.clock.now();
        self.sensors.unplug(address, now)
    }

    /// Breaks the sensor at this address now, beside whatever else is broken; a fault of the same kind is replaced.
    /// `false` when there is no sensor, or [`FAULTS_MAX`](crate::FAULTS_MAX) faults are set.
    pub fn set_fault(&mut self, address: Address, fault: Fault) -> bool {
        self.set_fault_with_chance(address, fault, Chance::ALWAYS)
    }

    /// As [`set_fault`](Self::set_fault), with a fault that strikes by chance at each of its occasions; those that are
    /// drawn by the stretch of time, once, now.
    pub fn set_fault_with_chance(
        &mut self,
        address: Address,
        fault: Fault,
        chance: Chance,
    ) -> bool {
        let now = self.wire.clock.now();
        self.device(address).is_some() && self.sensors.set_fault(fault, Some(address), chance, now)
    }

    /// Breaks the whole bus with all its sensors now. `false` when [`FAULTS_MAX`](crate::FAULTS_MAX) faults are set.
    pub fn set_bus_fault(&mut self, fault: Fault) -> bool {
        self.set_bus_fault_with_chance(fault, Chance::ALWAYS)
    }

    /// As [`set_bus_fault`](Self::set_bus_fault), by chance.
    pub fn set_bus_fault_with_chance(&mut self, fault: Fault, chance: Chance) -> bool {
        let now = self.wire.clock.now();
        self.sensors.set_fault(fault, None, chance, now)
    }

    /// Mends what was set by call on the sensor at this address; `false` when there is none. After
    /// [`Fault::Unplugged`] and [`Fault::AdapterGone`] it powers on.
    pub fn clear_fault(&mut self, address: Address) -> bool {
        let now = self.wire.clock.now();
        self.sensors.clear_faults(Some(address), now);
        self.device(address).is_some()
    }

    /// Mends what was set by call on the whole bus.
    pub fn clear_bus_faults(&mut self) {
        let now = self.wire.clock.now();
        self.sensors.clear_faults(None, now);
    }

    /// Lets the script and the sensors do what is due by now, without any traffic: for whoever looks at sensors that
    /// nobody reads.
    pub fn advance(&mut self) {
        let now = self.wire.clock.now();
        self.sensors.catch_up(now);
        self.sensors.advance(now);
    }

    /// The INT pin of the sensor at this address, now.
    pub fn interrupt_pin(&mut self, address: Address) -> Option<InterruptPin> {
        let now = self.wire.clock.now();
        self.sensors.catch_up(now);
        let device = self.device_mut(address)?;
        device.advance(now);
        Some(device.interrupt_pin())
    }

    /// What breaks a transaction of this number, and what it shows besides.
    fn blocked(&mut self, address: Option<Address>, number: u64) -> Option<FaultKind> {
        let kind = self.sensors.faults.blocking(address, number)?;
        let struck = FaultSet::from_iter([kind]);
        self.sensors.faults.settle(address, number, struck);
        Some(kind)
    }

    /// Reports to the controller what keeps it from reaching anybody.
    pub(crate) fn refuse(
        &mut self,
        address: u8,
        operations: &[Operation<'_>],
        kind: FaultKind,
    ) -> Result<(), BusError> {
        let error = controller_error(kind);
        let mut faults = core::mem::take(&mut self.sensors.faults.happened);
        faults.insert(kind);
        let reads = operations.first().is_some_and(is_read);
        self.wire.fail(address, reads, error, faults);
        Err(error)
    }

    /// What is due by now, and the number of the transaction that begins.
    pub(crate) fn open(&mut self) -> u64 {
        let now = self.wire.clock.now();
        self.sensors.catch_up(now);
        let imposed = self.sensors.faults.scl_hz();
        self.wire.impose(imposed);
        self.sensors.faults.begin()
    }

    fn reach(
        &mut self,
        address: Address,
        number: u64,
        operations: &mut [Operation<'_>],
    ) -> Result<(), BusError> {
        let happened = core::mem::take(&mut self.sensors.faults.happened);
        let Some(mut line) = self.sensors.line(address, number) else {
            let wire = &mut self.wire;
            return wire.carry(address.bits(), &mut Nobody, operations, happened);
        };
        let bits = address.bits();
        let result = self.wire.carry(bits, &mut line, operations, happened);
        let struck = line.struck();
        self.close(address, number, struck);
        result
    }

    /// STOP, and what struck up to it.
    pub(crate) fn close(&mut self, address: Address, number: u64, struck: FaultSet) {
        self.sensors.faults.settle(Some(address), number, struck);
        let now = self.wire.clock.now();
        self.sensors.stop(address, now);
    }
}

impl<C, S> Bus<C, S> {
    /// The sensor at this address.
    pub fn device(&self, address: Address) -> Option<&Device<S>> {
        self.sensors.device(address)
    }

    /// The sensor at this address.
    pub fn device_mut(&mut self, address: Address) -> Option<&mut Device<S>> {
        self.sensors.device_mut(address)
    }

    /// The faults that a transaction to this address meets: the sensor's and the whole bus's, set by call or by script.
    pub fn faults(&self, address: Address) -> FaultSet {
        self.sensors.faults.at(Some(address))
    }

    /// How often each kind of fault struck since the bus was made.
    pub fn fault_counts(&self) -> FaultCounts {
        self.sensors.faults.counts
    }

    /// What all chances of faults that are set by call are drawn from. Default 0; a script brings its own.
    pub fn set_seed(&mut self, seed: u64) {
        self.sensors.faults.seed = seed;
    }

    /// The clock that the bus was given.
    pub fn clock(&self) -> &C {
        &self.wire.clock
    }

    /// What went over the bus so far.
    pub fn traffic(&self) -> Traffic {
        self.wire.traffic
    }
}

#[cfg(feature = "alloc")]
impl<C: Clock, S: FrameSource> Bus<C, S> {
    /// Runs this script of faults from now on, instead of the one before; its times count from now. Faults that were set
    /// by call stay beside it.
    pub fn set_script(&mut self, script: crate::script::Script) {
        let now = self.wire.clock.now();
        self.advance();
        self.sensors.set_script(Some(script), now);
    }

    /// Ends the script: what it broke is mended now.
    pub fn clear_script(&mut self) {
        let now = self.wire.clock.now();
        self.advance();
        self.sensors.set_script(None, now);
    }

    /// Tells this of every message on the bus, faults included, instead of whoever was told before. Called within the
    /// transaction, so it should be quick.
    pub fn set_trace(&mut self, trace: impl FnMut(&crate::trace::Transfer<'_>) + Send + 'static) {
        self.wire.log.set(Some(alloc::boxed::Box::new(trace)));
    }

    /// Traces the bus no longer.
    pub fn clear_trace(&mut self) {
        self.wire.log.set(None);
    }
}

impl<C, S> ErrorType for Bus<C, S> {
    type Error = BusError;
}

impl<C: Clock, S: FrameSource> I2c for Bus<C, S> {
    /// One START, the operations with a repeated START wherever the direction changes, one STOP. No operations, no
    /// traffic. Empty reads and writes are the address alone.
    fn transaction(
        &mut self,
        address: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), BusError> {
        let number = self.open();
        let place = Address::from_bits(address);
        if operations.is_empty() {
            let gone = self.sensors.faults.blocking(place, number) == Some(FaultKind::AdapterGone);
            return if gone { Err(BusError::Gone) } else { Ok(()) };
        }
        if let Some(kind) = self.blocked(place, number) {
            return self.refuse(address, operations, kind);
        }
        match place {
            Some(place) => self.reach(place, number, operations),
            None => {
                let happened = core::mem::take(&mut self.sensors.faults.happened);
                self.wire.carry(address, &mut Nobody, operations, happened)
            }
        }
    }
}
