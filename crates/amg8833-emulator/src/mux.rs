//! A TCA9548A: one bus in, eight out.

use crate::bus::Bus;
use crate::bus::sensors::Line;
use crate::bus::wire::Target;
use crate::clock::Clock;
use crate::fault::active::stronger;
use crate::fault::{FaultKind, FaultSet};
use crate::signal::{Ack, Address, BusError};
use crate::source::FrameSource;
use core::fmt;
use core::time::Duration;
use embedded_hal::i2c::{ErrorType, I2c, Operation};

/// How many buses are behind a multiplexer.
pub const CHANNELS: usize = 8;
/// The trunk and all channels.
const BUSES: usize = CHANNELS + 1;

/// The address of a multiplexer: 0x70 to 0x77, as the pins A2 to A0 have it (TI SCPS207, "Device Address").
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MuxAddress(u8);

impl MuxAddress {
    /// All three pins low: 0x70.
    pub const FIRST: Self = Self(0x70);

    /// The address of these seven bits; `None` when the multiplexer cannot have it.
    #[must_use]
    pub const fn from_bits(bits: u8) -> Option<Self> {
        match bits {
            0x70..=0x77 => Some(Self(bits)),
            _ => None,
        }
    }

    /// The seven bits of the address.
    #[must_use]
    pub const fn bits(self) -> u8 {
        self.0
    }
}

/// A TCA9548A with a bus before it, the trunk, and eight behind it, the channels.
///
/// ```text
///                       ┌─ channel 0: Bus ─ 0x68, 0x69
///  I2c ─ trunk: Bus ─ Mux (0x70: one bit a channel)
///         0x68, 0x69    └─ channel 7: Bus ─ 0x68, 0x69
/// ```
///
/// - A byte written to its address selects channels, bit by bit; of several, the last. Channels become active with the
///   STOP. Reading returns the byte, again and again. Power-up and reset select none (TI SCPS207, "Control Register").
/// - Active channels and the trunk are one pair of wires: devices of one address acknowledge together, hear together, and
///   what they send together is ANDed, since any of them can pull SDA low.
/// - So a line that is held low on an active channel holds the trunk; [`reset`](Self::reset), which is a pin, frees it.
/// - Bits take the trunk's time, at the trunk's SCL frequency. The trunk's trace shows every message, a channel's trace
///   and traffic those that reached it.
/// - Several buses of one clock: `C` is a reference or a counted pointer to it, as a rule.
#[derive(Debug)]
pub struct Mux<C, S> {
    trunk: Bus<C, S>,
    channels: [Bus<C, S>; CHANNELS],
    address: MuxAddress,
    control: u8,
    held_in_reset: bool,
}

impl<C: Clock, S: FrameSource> Mux<C, S> {
    /// A multiplexer that is powered on now: no channel is selected.
    pub const fn new(
        trunk: Bus<C, S>,
        address: MuxAddress,
        channels: [Bus<C, S>; CHANNELS],
    ) -> Self {
        Self {
            trunk,
            channels,
            address,
            control: 0,
            held_in_reset: false,
        }
    }

    /// The bus before the multiplexer.
    pub const fn trunk(&self) -> &Bus<C, S> {
        &self.trunk
    }

    /// The bus before the multiplexer.
    pub const fn trunk_mut(&mut self) -> &mut Bus<C, S> {
        &mut self.trunk
    }

    /// The bus behind channel 0 to 7.
    pub fn channel(&self, channel: usize) -> Option<&Bus<C, S>> {
        self.channels.get(channel)
    }

    /// The bus behind channel 0 to 7.
    pub fn channel_mut(&mut self, channel: usize) -> Option<&mut Bus<C, S>> {
        self.channels.get_mut(channel)
    }

    /// The trunk, then channels 0 to 7.
    pub fn buses(&self) -> impl Iterator<Item = &Bus<C, S>> {
        core::iter::once(&self.trunk).chain(&self.channels)
    }

    /// The trunk, then channels 0 to 7.
    pub fn buses_mut(&mut self) -> impl Iterator<Item = &mut Bus<C, S>> {
        core::iter::once(&mut self.trunk).chain(&mut self.channels)
    }

    /// The address of the multiplexer.
    #[must_use]
    pub const fn address(&self) -> MuxAddress {
        self.address
    }

    /// The control register: bit n is channel n.
    #[must_use]
    pub const fn selected(&self) -> u8 {
        self.control
    }

    /// A pulse on the RESET pin: no channel is selected. The sensors know nothing of it.
    pub const fn reset(&mut self) {
        self.control = 0;
    }

    /// The RESET pin: while it is held low, no channel is selected, and the multiplexer does not answer.
    pub const fn hold_in_reset(&mut self, low: bool) {
        self.held_in_reset = low;
        if low {
            self.control = 0;
        }
    }

    /// Takes the multiplexer's supply away and gives it back: no channel is selected. The sensors keep theirs.
    pub const fn power_cycle(&mut self) {
        self.control = 0;
    }

    /// Lets scripts and sensors of all buses do what is due by now.
    pub fn advance(&mut self) {
        self.buses_mut().for_each(Bus::advance);
    }

    fn is_active(&self, channel: usize) -> bool {
        self.control >> channel & 1 != 0
    }

    /// Bus 0 is the trunk; the others are channels.
    fn is_connected(&self, bus: usize) -> bool {
        bus.checked_sub(1)
            .is_none_or(|channel| self.is_active(channel))
    }

    /// Opens a transaction on every connected bus; its number on each.
    fn open(&mut self) -> [Option<u64>; BUSES] {
        let connected = self.connected();
        let mut numbers = [None; BUSES];
        let buses = numbers.iter_mut().zip(self.buses_mut()).zip(connected);
        for ((number, bus), connected) in buses {
            *number = connected.then(|| bus.open());
        }
        numbers
    }

    fn connected(&self) -> [bool; BUSES] {
        core::array::from_fn(|bus| self.is_connected(bus))
    }

    /// What keeps the controller from reaching anybody, on whichever connected bus.
    fn blocked(
        &mut self,
        address: Option<Address>,
        numbers: &[Option<u64>; BUSES],
    ) -> Option<FaultKind> {
        let mut strongest = None;
        for (number, bus) in numbers.iter().zip(self.buses()) {
            let kind = number.and_then(|number| bus.sensors.faults.blocking(address, number));
            strongest = stronger(strongest, kind);
        }
        let struck: FaultSet = strongest.into_iter().collect();
        for (number, bus) in numbers.iter().zip(self.buses_mut()) {
            if let Some(number) = *number {
                bus.sensors.faults.settle(address, number, struck);
            }
        }
        strongest
    }

    fn carry(
        &mut self,
        address: u8,
        numbers: &[Option<u64>; BUSES],
        operations: &mut [Operation<'_>],
    ) -> Result<(), BusError> {
        let mut happened = FaultSet::EMPTY;
        for (number, bus) in numbers.iter().zip(self.buses_mut()) {
            if number.is_some() {
                happened.join(core::mem::take(&mut bus.sensors.faults.happened));
            }
        }
        let answers = address == self.address.bits() && !self.held_in_reset;
        let place = Address::from_bits(address);
        let Self {
            trunk, channels, ..
        } = self;
        let mut wires = Wires {
            control: answers.then_some(Control {
                selected: self.control,
                written: None,
            }),
            lines: [const { None }; BUSES],
        };
        let (wire, sensors) = (&mut trunk.wire, &mut trunk.sensors);
        let all = core::iter::once(sensors)
            .chain(channels.iter_mut().map(|channel| &mut channel.sensors));
        for ((slot, sensors), number) in wires.lines.iter_mut().zip(all).zip(numbers) {
            if let (Some(place), Some(number)) = (place, *number) {
                *slot = sensors.line(place, number);
            }
        }
        let result = wire.carry(address, &mut wires, operations, happened);
        let struck = wires.struck();
        let written = wires.control.and_then(|control| control.written);
        if let Some(place) = place {
            self.close(place, numbers, &struck);
        }
        self.control = written.unwrap_or(self.control);
        result
    }

    fn close(
        &mut self,
        address: Address,
        numbers: &[Option<u64>; BUSES],
        struck: &[FaultSet; BUSES],
    ) {
        let buses = self.buses_mut().zip(numbers).zip(struck);
        for ((bus, number), struck) in buses {
            if let Some(number) = *number {
                bus.close(address, number, *struck);
            }
        }
    }
}

impl<C, S> ErrorType for Mux<C, S> {
    type Error = BusError;
}

impl<C: Clock, S: FrameSource> I2c for Mux<C, S> {
    /// As on a single bus; what is written to the multiplexer's own address takes effect with the STOP.
    fn transaction(
        &mut self,
        address: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), BusError> {
        let connected = self.connected();
        let numbers = self.open();
        let before = self.trunk.wire.traffic;
        let place = Address::from_bits(address);
        #[cfg(feature = "alloc")]
        self.keep_messages();
        let blocked = self.blocked(place, &numbers);
        let result = match blocked {
            Some(FaultKind::AdapterGone) if operations.is_empty() => Err(BusError::Gone),
            _ if operations.is_empty() => Ok(()),
            Some(kind) => self.trunk.refuse(address, operations, kind),
            None => self.carry(address, &numbers, operations),
        };
        let passed = self.trunk.wire.traffic.since(before);
        for (channel, _) in self
            .channels
            .iter_mut()
            .zip(&connected[1..])
            .filter(|(_, connected)| **connected)
        {
            channel.wire.traffic += passed;
        }
        #[cfg(feature = "alloc")]
        self.tell_channels(&connected);
        result
    }
}

#[cfg(feature = "alloc")]
impl<C: Clock, S: FrameSource> Mux<C, S> {
    /// Keeps the trunk's messages if a channel wants them too.
    fn keep_messages(&mut self) {
        if self
            .channels
            .iter()
            .any(|channel| channel.wire.log.has_observer())
        {
            self.trunk.wire.log.keep();
        }
    }

    fn tell_channels(&mut self, connected: &[bool; BUSES]) {
        for (transfer, bytes) in self.trunk.wire.log.take_kept() {
            for (channel, connected) in self.channels.iter_mut().zip(&connected[1..]) {
                if *connected {
                    let bytes = &bytes;
                    let transfer = crate::trace::Transfer { bytes, ..transfer };
                    channel.wire.log.tell(&transfer);
                }
            }
        }
    }
}

/// The multiplexer's own register, for the length of a transaction.
#[derive(Debug, Clone, Copy)]
struct Control {
    selected: u8,
    written: Option<u8>,
}

/// All that hears a transaction: the multiplexer, and a sensor on each connected bus.
struct Wires<'a, S> {
    control: Option<Control>,
    lines: [Option<Line<'a, S>>; BUSES],
}

impl<S: FrameSource> Wires<'_, S> {
    fn struck(&self) -> [FaultSet; BUSES] {
        core::array::from_fn(|bus| {
            let line = self.lines.get(bus).and_then(Option::as_ref);
            line.map_or(FaultSet::EMPTY, Line::struck)
        })
    }

    /// Whether any of them acknowledges: SDA is low if one pulls it.
    fn any(&mut self, mut ack: impl FnMut(&mut Line<'_, S>) -> Ack) -> Ack {
        let mut any = Ack::Nack;
        for line in self.lines.iter_mut().flatten() {
            if ack(line) == Ack::Ack {
                any = Ack::Ack;
            }
        }
        any
    }
}

impl<S: FrameSource> Target for Wires<'_, S> {
    fn start(&mut self, reads: bool, now: Duration) -> Ack {
        let sensors = self.any(|line| line.start(reads, now));
        if self.control.is_some() {
            Ack::Ack
        } else {
            sensors
        }
    }

    fn write(&mut self, byte: u8, now: Duration) -> Ack {
        let sensors = self.any(|line| line.write(byte, now));
        match &mut self.control {
            Some(control) => {
                control.written = Some(byte);
                Ack::Ack
            }
            None => sensors,
        }
    }

    fn read(&mut self, now: Duration) -> u8 {
        let control = self.control.map_or(0xFF, |control| control.selected);
        let lines = self.lines.iter_mut().flatten();
        lines.fold(control, |byte, line| byte & line.read(now))
    }

    fn take_struck(&mut self) -> FaultSet {
        let mut all = FaultSet::EMPTY;
        for line in self.lines.iter_mut().flatten() {
            all.join(line.take_struck());
        }
        all
    }
}

impl fmt::Display for MuxAddress {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "0x{:02x}", self.0)
    }
}
