//! A bus with up to two sensors, as a controller sees it.

pub(crate) mod line;
mod sensors;
pub(crate) mod wire;

use crate::bus::line::{Control, Course, Line, Wires};
use crate::bus::sensors::Sensors;
use crate::bus::wire::{Acknowledged, Talk, Wire, is_read, known};
use crate::clock::Clock;
use crate::device::Device;
use crate::device::options::Options;
use crate::fault::active::CONTROLLER;
use crate::fault::{Chance, Fault, FaultCounts, FaultKind, FaultSet};
use crate::signal::{Address, BusError, InterruptPin, Outcome, Traffic};
use crate::source::FrameSource;
use core::num::NonZeroU32;
use embedded_hal::i2c::{ErrorType, I2c, NoAcknowledgeSource, Operation};

pub use sensors::STEPS_MAX;
pub use wire::{Carry, SCL_HZ};

/// A transaction that a controller holds open between calls: from [`Bus::start`] to [`Bus::stop`].
#[derive(Debug)]
#[must_use = "the sensor's registers stand still until Bus::stop"]
pub struct Open {
    address: u8,
    number: u64,
    reading: Option<bool>,
    outcome: Acknowledged,
    course: Option<Course>,
}

impl Open {
    /// The seven bits of the address.
    #[must_use]
    pub const fn address(&self) -> u8 {
        self.address
    }

    /// Lets the next operation begin with a repeated START, whatever its direction.
    pub const fn restart(&mut self) {
        self.reading = None;
    }
}

/// A bus with up to two sensors behind `embedded_hal::i2c::I2c`.
///
/// Each bit passes its time at the SCL frequency, by default [`SCL_HZ`], to [`Clock::pass`]: a frame read takes 12.3 ms, and
/// one in several transactions may mix two frames, as on a board. A fault due during a transaction strikes at its STOP. A
/// sensor advanced through [`device_mut`](Self::device_mut) misses faults; use [`advance`](Self::advance) to get them.
#[derive(Debug)]
pub struct Bus<C, S> {
    wire: Wire<C>,
    sensors: Sensors<S>,
}

impl<C: Clock, S: FrameSource> Bus<C, S> {
    /// A bus without devices.
    pub fn new(clock: C) -> Self {
        Self {
            wire: Wire::new(clock),
            sensors: Sensors::new(),
        }
    }

    /// A bus with one sensor that powers on now, with [`Options::default`].
    pub fn with_sensor(clock: C, address: Address, source: S) -> Self {
        let mut bus = Self::new(clock);
        bus.plug(address, source, Options::default());
        bus
    }

    /// Makes each bit take time at this SCL frequency; the sensor is specified for up to 400,000 Hz (AMG88 spec
    /// §4-6-2).
    #[must_use]
    pub fn with_scl_hz(mut self, scl_hz: NonZeroU32) -> Self {
        self.wire.scl_hz = Some(scl_hz);
        self
    }

    /// Lets transactions take no time, for a test that sets every instant itself. No way of reading then mixes two frames.
    /// Otherwise a driver that reads a frame in parts now and then mixes two, which frames that are each of one temperature
    /// show:
    ///
    /// ```rust
    /// use amg8833_emulator::{Address, Bus, ManualClock};
    /// use core::time::Duration;
    /// use embedded_hal::i2c::I2c;
    /// use grideye_frame::{Celsius, Frame};
    ///
    /// /// A quarter of a degree more with every frame.
    /// fn steps(t: Duration) -> Frame {
    ///     Frame::uniform(Celsius::new((t.as_millis() / 100 % 400) as f32 / 4.0))
    /// }
    ///
    /// let mixed = |mut bus: Bus<ManualClock, fn(Duration) -> Frame>| {
    ///     let mut frames = 0;
    ///     for _ in 0..200 {
    ///         let mut pixels = [0; 128];
    ///         for (register, part) in [0x80, 0xA0, 0xC0, 0xE0].into_iter().zip(pixels.chunks_mut(32)) {
    ///             bus.write_read(0x69, &[register], part).unwrap();
    ///         }
    ///         frames += u32::from(pixels.chunks(2).any(|pixel| *pixel != pixels[..2]));
    ///         bus.clock().advance(Duration::from_millis(100));
    ///     }
    ///     frames
    /// };
    /// let bus = || Bus::with_sensor(ManualClock::new(), Address::High, steps as fn(Duration) -> Frame);
    /// assert!(mixed(bus()) > 10);
    /// assert_eq!(mixed(bus().with_instant_transactions()), 0); // for a test that sets every instant itself
    /// ```
    #[must_use]
    pub fn with_instant_transactions(mut self) -> Self {
        self.wire.scl_hz = None;
        self
    }

    /// Connects a sensor and powers it on now; returns the one it replaces. Faults set for this address apply to it.
    pub fn plug(&mut self, address: Address, source: S, options: Options) -> Option<Device<S>> {
        let now = self.wire.clock.now();
        let device = Device::new(source, options, now);
        self.sensors.plug(address, device, now)
    }

    /// Removes the sensor, with the faults set on it by call.
    pub fn unplug(&mut self, address: Address) -> Option<Device<S>> {
        let now = self.wire.clock.now();
        self.sensors.unplug(address, now)
    }

    /// Injects a fault now, at this address or on the whole bus; replaces a fault of the same kind. `false` if there is
    /// no such sensor or [`FAULTS_MAX`](crate::FAULTS_MAX) faults are set.
    pub fn set_fault(&mut self, address: impl Into<Option<Address>>, fault: Fault) -> bool {
        self.set_fault_with_chance(address, fault, Chance::ALWAYS)
    }

    /// As [`set_fault`](Self::set_fault), with a chance at each occasion; a fault that lasts is drawn once, now.
    pub fn set_fault_with_chance(
        &mut self,
        address: impl Into<Option<Address>>,
        fault: Fault,
        chance: Chance,
    ) -> bool {
        let (now, address) = (self.wire.clock.now(), address.into());
        let is_there = address.is_none_or(|address| self.device(address).is_some());
        is_there && self.sensors.set_fault(fault, address, chance, now)
    }

    /// Clears the faults set by call on the sensor at this address, or on the whole bus; `false` without such a sensor.
    pub fn clear_fault(&mut self, address: impl Into<Option<Address>>) -> bool {
        let (now, address) = (self.wire.clock.now(), address.into());
        self.sensors.clear_faults(address, now);
        address.is_none_or(|address| self.device(address).is_some())
    }

    /// Lets the script and the sensors do what is due by now, without traffic.
    pub fn advance(&mut self) {
        let now = self.wire.clock.now();
        self.sensors.look(now);
    }

    /// The current level of the INT pin of the sensor at this address.
    pub fn interrupt_pin(&mut self, address: Address) -> Option<InterruptPin> {
        let now = self.wire.clock.now();
        self.sensors.catch_up(now);
        let device = self.device_mut(address)?;
        device.advance(now);
        Some(device.interrupt_pin())
    }

    /// Runs one transaction whose operations `talk` decides while it is open, as a microcontroller's hardware does byte by
    /// byte; `reads` is the direction of the first. It stops when `talk` returns.
    /// # Errors
    /// What [`I2c::transaction`] returns: the first byte that was not acknowledged, which `talk` has been told too, or a fault of the
    /// bus, without a call of `talk`.
    pub fn converse(
        &mut self,
        address: u8,
        reads: bool,
        talk: &mut dyn FnMut(Carry<'_>),
    ) -> Result<(), BusError> {
        let control = &mut Control::default();
        self.transact::<1>(&mut [], control, address, Some(reads), talk)
    }

    /// Opens a transaction that goes on by [`step`](Self::step), for a controller whose state is outside, such as a simulated
    /// microcontroller's. `reads` is the direction of its first operation, which sends the address.
    /// # Errors
    /// A fault of the bus; then there is no transaction.
    pub fn start(&mut self, address: u8, reads: bool) -> Result<Open, BusError> {
        let number = self.open();
        let place = Address::from_bits(address);
        if let Some(blocked) = self.sensors.faults.blocking(place, number) {
            let (kind, error) = CONTROLLER[blocked];
            let struck = FaultSet::from_iter([kind]);
            self.sensors.faults.settle(place, number, struck);
            self.refuse(address, reads, kind, error)?;
        }
        let happened = core::mem::take(&mut self.sensors.faults.happened);
        self.wire.begin(happened);
        let line = place.and_then(|place| self.sensors.line(place, number));
        Ok(Open {
            address,
            number,
            reading: None,
            outcome: Ok(()),
            course: line.map(|line| line.course),
        })
    }

    /// The next operation of an open transaction, with a START where the direction changes. An empty one sends the address
    /// alone.
    /// # Errors
    /// Which byte was not acknowledged.
    pub fn step(
        &mut self,
        open: &mut Open,
        operation: &mut Operation<'_>,
    ) -> Result<(), NoAcknowledgeSource> {
        let lines = [open.course.and_then(|course| self.sensors.resume(course))];
        let control = &mut Control::default();
        let mut wires = Wires { control, lines };
        let reading = &mut open.reading;
        let outcome = (self.wire).operation(open.address, &mut wires, reading, operation);
        let [line] = wires.lines;
        open.course = line.map(|line| line.course);
        open.outcome = open.outcome.and(outcome);
        outcome
    }

    /// STOP.
    /// # Errors
    /// The first byte that was not acknowledged.
    #[expect(clippy::needless_pass_by_value, reason = "a transaction stops once")]
    pub fn stop(&mut self, open: Open) -> Result<(), BusError> {
        let lines = [open.course.and_then(|course| self.sensors.resume(course))];
        let control = &mut Control::default();
        let mut wires = Wires { control, lines };
        let result = self.wire.end(open.address, &mut wires, open.outcome);
        let [line] = wires.lines;
        if let Some((place, struck)) = line.map(|line| (line.course.address, line.struck())) {
            self.settle(place, open.number, struck);
        }
        result
    }

    /// What a sensor does at the STOP.
    fn settle(&mut self, place: Address, number: u64, struck: FaultSet) {
        self.sensors.faults.settle(Some(place), number, struck);
        let now = self.wire.clock.now();
        self.sensors.stop(place, now);
    }

    /// Reports to the controller the error that blocks the whole transaction.
    fn refuse(&mut self, address: u8, reads: bool, kind: FaultKind, error: BusError) -> Outcome {
        let mut faults = core::mem::take(&mut self.sensors.faults.happened);
        faults.insert(kind);
        self.wire.fail(address, reads, error, faults);
        Err(error)
    }

    /// Does what is due by now and returns the number of the new transaction.
    fn open(&mut self) -> u64 {
        let now = self.wire.clock.now();
        self.sensors.catch_up(now);
        let imposed = self.sensors.faults.scl_hz();
        self.wire.impose(imposed);
        self.sensors.faults.begin()
    }

    /// Runs one transaction on wires shared with the selected channels of a multiplexer: at most `N` buses. `first` is the
    /// direction of its first operation, if it has one.
    pub(crate) fn transact<const N: usize>(
        &mut self,
        channels: &mut [Self],
        control: &mut Control,
        address: u8,
        first: Option<bool>,
        talk: Talk<'_>,
    ) -> Outcome {
        let selected = control.selected;
        let mut numbers = [0; N];
        for (number, bus) in numbers.iter_mut().zip(connected(self, channels, selected)) {
            *number = bus.open();
        }
        let place = Address::from_bits(address);
        let buses = numbers.iter().zip(connected(self, channels, selected));
        let blocking =
            buses.filter_map(|(number, bus)| bus.sensors.faults.blocking(place, *number));
        let blocked = blocking.min().map(|place| CONTROLLER[place]);
        let Some(reads) = first else {
            let gone = blocked.filter(|(_, error)| *error == BusError::Gone);
            return gone.map_or(Ok(()), |(_, error)| Err(error));
        };
        let before = self.wire.traffic;
        #[cfg(feature = "alloc")]
        if connected(self, channels, selected)
            .skip(1)
            .any(|bus| bus.wire.log.is_on())
        {
            self.wire.log.keep();
        }
        let result = match blocked {
            Some((kind, error)) => {
                let struck = FaultSet::from_iter([kind]);
                for (number, bus) in numbers.iter().zip(connected(self, channels, selected)) {
                    bus.sensors.faults.settle(place, *number, struck);
                }
                self.refuse(address, reads, kind, error)
            }
            None => self.carry(channels, control, address, &numbers, talk),
        };
        let passed = self.wire.traffic.since(before);
        #[cfg(feature = "alloc")]
        let kept = self.wire.log.take_kept();
        for channel in active(channels, selected) {
            channel.wire.traffic += passed;
            #[cfg(feature = "alloc")]
            channel.wire.log.tell(&kept);
        }
        result
    }

    fn carry<const N: usize>(
        &mut self,
        channels: &mut [Self],
        control: &mut Control,
        address: u8,
        numbers: &[u64; N],
        talk: Talk<'_>,
    ) -> Outcome {
        let place = Address::from_bits(address);
        let selected = control.selected;
        let mut happened = FaultSet::EMPTY;
        let lines = [const { None }; N];
        let mut wires = Wires { control, lines };
        let behind = active(channels, selected).map(|channel| &mut channel.sensors);
        let sensors = core::iter::once(&mut self.sensors).chain(behind);
        for ((line, number), sensors) in wires.lines.iter_mut().zip(numbers).zip(sensors) {
            happened.join(core::mem::take(&mut sensors.faults.happened));
            *line = place.and_then(|place| sensors.line(place, *number));
        }
        let result = self.wire.carry(address, &mut wires, talk, happened);
        let struck = wires.lines.map(|line| line.as_ref().map(Line::struck));
        let buses = connected(self, channels, selected);
        for ((number, struck), bus) in numbers.iter().zip(struck).zip(buses) {
            if let (Some(place), Some(struck)) = (place, struck) {
                bus.settle(place, *number, struck);
            }
        }
        result
    }
}

fn active<C, S>(channels: &mut [Bus<C, S>], selected: u8) -> impl Iterator<Item = &mut Bus<C, S>> {
    let numbered = (0..).zip(channels);
    numbered.filter_map(move |(number, channel)| (selected >> number & 1 != 0).then_some(channel))
}

fn connected<'b, C, S>(
    trunk: &'b mut Bus<C, S>,
    channels: &'b mut [Bus<C, S>],
    selected: u8,
) -> impl Iterator<Item = &'b mut Bus<C, S>> {
    core::iter::once(trunk).chain(active(channels, selected))
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

    /// The faults that a transaction to this address meets, set by call or script.
    pub fn faults(&self, address: Address) -> FaultSet {
        self.sensors.faults.at(Some(address))
    }

    /// How often each kind of fault struck since this bus was created.
    pub fn fault_counts(&self) -> FaultCounts {
        self.sensors.faults.counts
    }

    /// Sets the seed for faults set by call. Default 0; a script brings its own.
    pub fn set_seed(&mut self, seed: u64) {
        self.sensors.faults.seed = seed;
    }

    /// The clock this bus runs on.
    pub fn clock(&self) -> &C {
        &self.wire.clock
    }

    /// The traffic so far.
    pub fn traffic(&self) -> Traffic {
        self.wire.traffic
    }
}

#[cfg(feature = "alloc")]
impl<C: Clock, S: FrameSource> Bus<C, S> {
    /// Runs this fault script in place of the previous one; its times count from now. Faults set by call stay.
    pub fn set_script(&mut self, script: crate::script::Script) {
        let now = self.wire.clock.now();
        self.advance();
        self.sensors.set_script(Some(script), now);
    }

    /// Ends the script and clears its faults now.
    pub fn clear_script(&mut self) {
        let now = self.wire.clock.now();
        self.advance();
        self.sensors.set_script(None, now);
    }

    /// Calls `trace` with every message, within the transaction, in place of the previous trace.
    pub fn set_trace(&mut self, trace: impl FnMut(&crate::trace::Transfer<'_>) + Send + 'static) {
        self.wire.log.observer = Some(alloc::boxed::Box::new(trace));
    }

    /// Stops tracing the bus.
    pub fn clear_trace(&mut self) {
        self.wire.log.observer = None;
    }
}

impl<C, S> ErrorType for Bus<C, S> {
    type Error = BusError;
}

impl<C: Clock, S: FrameSource> I2c for Bus<C, S> {
    /// No operations cause no traffic. An empty read or write sends only the address.
    fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Outcome {
        let first = operations.first().map(is_read);
        let (control, talk) = (&mut Control::default(), &mut known(operations));
        self.transact::<1>(&mut [], control, address, first, talk)
    }
}
