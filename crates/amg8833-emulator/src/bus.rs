use crate::clock::Clock;
use crate::device::{Ack, Device, InterruptPin};
use crate::fault::Fault;
use crate::options::Options;
use crate::source::FrameSource;
use core::fmt;
use core::num::NonZeroU32;
use core::time::Duration;
use embedded_hal::i2c::{self, ErrorKind, ErrorType, I2c, NoAcknowledgeSource, Operation};

/// How long the controller waits for a bus that is held low, as Linux does by default.
pub const HANG_TIMEOUT: Duration = Duration::from_secs(1);
/// An address byte or a byte of data, with its acknowledge.
const BITS_PER_BYTE: u64 = 9;
const NANOSECONDS_PER_SECOND: u128 = 1_000_000_000;

/// The addresses that the sensor can have (AMG88 spec §4-8-2).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Address {
    /// 0x68: AD_SELECT at GND.
    Low,
    /// 0x69: AD_SELECT at VDD, as most boards have it.
    High,
}

impl Address {
    /// Both addresses.
    pub const ALL: [Self; 2] = [Self::Low, Self::High];

    /// The seven bits of the address.
    #[must_use]
    pub const fn bits(self) -> u8 {
        match self {
            Self::Low => 0x68,
            Self::High => 0x69,
        }
    }

    /// The address of these seven bits; `None` when the sensor cannot have it.
    #[must_use]
    pub const fn from_bits(bits: u8) -> Option<Self> {
        match bits {
            0x68 => Some(Self::Low),
            0x69 => Some(Self::High),
            _ => None,
        }
    }

    const fn place(self) -> usize {
        match self {
            Self::Low => 0,
            Self::High => 1,
        }
    }
}

/// What went wrong on the bus, as a controller would report it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BusError {
    /// The address or a byte was not acknowledged (EREMOTEIO or ENXIO).
    NoAcknowledge {
        /// The seven bits of the address.
        address: u8,
        /// Whether it was the address or a byte.
        source: NoAcknowledgeSource,
    },
    /// A START or STOP was misplaced (EIO).
    Bus,
    /// Another controller drove the bus (EAGAIN).
    ArbitrationLoss,
    /// The bus was held low for [`HANG_TIMEOUT`] (ETIMEDOUT).
    Timeout,
    /// The adapter is gone (ENODEV).
    Gone,
}

impl i2c::Error for BusError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::NoAcknowledge { source, .. } => ErrorKind::NoAcknowledge(*source),
            Self::Bus => ErrorKind::Bus,
            Self::ArbitrationLoss => ErrorKind::ArbitrationLoss,
            Self::Timeout | Self::Gone => ErrorKind::Other,
        }
    }
}

impl fmt::Display for BusError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoAcknowledge {
                address,
                source: NoAcknowledgeSource::Address,
            } => write!(formatter, "no device acknowledged address 0x{address:02x}"),
            Self::NoAcknowledge { address, .. } => {
                write!(
                    formatter,
                    "the device at 0x{address:02x} did not acknowledge a byte"
                )
            }
            Self::Bus => formatter.write_str("a START or STOP was misplaced on the bus"),
            Self::ArbitrationLoss => formatter.write_str("another controller drove the bus"),
            Self::Timeout => write!(formatter, "the bus was held low for {HANG_TIMEOUT:?}"),
            Self::Gone => formatter.write_str("the bus adapter is gone"),
        }
    }
}

impl core::error::Error for BusError {}

/// What went over the bus since it was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Traffic {
    /// From START to STOP each.
    pub transactions: u64,
    /// Address bytes and bytes of data, acknowledged or not.
    pub bytes: u64,
    /// Nine for a byte, one each for START, repeated START and STOP.
    pub bits: u64,
    /// Addresses and bytes that were not acknowledged.
    pub nacks: u64,
}

/// A bus with up to two sensors behind `embedded_hal::i2c::I2c`.
///
/// Without an SCL frequency, transactions take no time. With one, every bit is handed to [`Clock::pass`], so that a
/// frame can fall due in the midst of a transaction, or between two.
#[derive(Debug)]
pub struct Bus<C, S> {
    wire: Wire<C>,
    devices: [Option<Device<S>>; 2],
}

impl<C: Clock, S: FrameSource> Bus<C, S> {
    /// A bus without devices.
    pub const fn new(clock: C) -> Self {
        Self {
            wire: Wire {
                clock,
                scl_hz: None,
                traffic: Traffic {
                    transactions: 0,
                    bytes: 0,
                    bits: 0,
                    nacks: 0,
                },
            },
            devices: [const { None }; 2],
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
        self.wire.scl_hz = Some(scl_hz);
        self
    }

    /// Connects a sensor and powers it on now; hands back the one that was there.
    pub fn plug(&mut self, address: Address, source: S, options: Options) -> Option<Device<S>> {
        let device = Device::new(source, options, self.wire.clock.now());
        self.devices[address.place()].replace(device)
    }

    /// Takes the sensor off the bus.
    pub fn unplug(&mut self, address: Address) -> Option<Device<S>> {
        self.devices[address.place()].take()
    }

    /// Breaks the sensor at this address now; `false` when there is none.
    pub fn set_fault(&mut self, address: Address, fault: Fault) -> bool {
        let now = self.wire.clock.now();
        let device = self.device_mut(address);
        device.map(|device| device.set_fault(fault, now)).is_some()
    }

    /// Mends the sensor at this address now; `false` when there is none.
    pub fn clear_fault(&mut self, address: Address) -> bool {
        let now = self.wire.clock.now();
        let device = self.device_mut(address);
        device.map(|device| device.clear_fault(now)).is_some()
    }

    /// The INT pin of the sensor at this address, now.
    pub fn interrupt_pin(&mut self, address: Address) -> Option<InterruptPin> {
        let now = self.wire.clock.now();
        let device = self.device_mut(address)?;
        device.advance(now);
        Some(device.interrupt_pin())
    }
}

impl<C, S> Bus<C, S> {
    /// The sensor at this address.
    pub fn device(&self, address: Address) -> Option<&Device<S>> {
        self.devices[address.place()].as_ref()
    }

    /// The sensor at this address.
    pub fn device_mut(&mut self, address: Address) -> Option<&mut Device<S>> {
        self.devices[address.place()].as_mut()
    }

    /// The clock that the bus was given.
    pub fn clock(&self) -> &C {
        &self.wire.clock
    }

    /// What went over the bus so far.
    pub fn traffic(&self) -> Traffic {
        self.wire.traffic
    }

    /// What breaks a transfer to this address: a fault of the whole bus, whichever sensor brings it, before the
    /// sensor's own.
    fn fault_at(&self, address: Option<Address>) -> Option<Fault> {
        let faults = || self.devices.iter().flatten().filter_map(Device::fault);
        [Fault::Unplugged, Fault::Hang]
            .into_iter()
            .find(|of_the_bus| faults().any(|fault| fault == *of_the_bus))
            .or_else(|| self.device(address?)?.fault())
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
        let place = Address::from_bits(address);
        let fault = self.fault_at(place);
        let Self { wire, devices } = self;
        let device = place
            .and_then(|address| devices.get_mut(address.place()))
            .and_then(Option::as_mut);
        if fault == Some(Fault::Unplugged) {
            return Err(BusError::Gone);
        }
        if operations.is_empty() {
            return Ok(());
        }
        wire.traffic.transactions += 1;
        if let Some(broken) = fault.and_then(controller_error) {
            wire.break_off(broken);
            return Err(broken);
        }
        let Some(device) = device else {
            wire.address_nobody();
            return Err(no_acknowledge(address, NoAcknowledgeSource::Address));
        };
        let result = wire.exchange(device, operations);
        wire.condition();
        device.stop(wire.clock.now());
        result.map_err(|source| no_acknowledge(address, source))
    }
}

/// The errors that the controller finds out before a device answers.
fn controller_error(fault: Fault) -> Option<BusError> {
    match fault {
        Fault::BusError => Some(BusError::Bus),
        Fault::ArbitrationLoss => Some(BusError::ArbitrationLoss),
        Fault::Hang => Some(BusError::Timeout),
        _ => None,
    }
}

fn no_acknowledge(address: u8, source: NoAcknowledgeSource) -> BusError {
    BusError::NoAcknowledge { address, source }
}

fn is_read(operation: &Operation<'_>) -> bool {
    matches!(operation, Operation::Read(_))
}

/// The two lines with their clock: counts what passes, and lets it take its time.
#[derive(Debug)]
struct Wire<C> {
    clock: C,
    scl_hz: Option<NonZeroU32>,
    traffic: Traffic,
}

impl<C: Clock> Wire<C> {
    fn exchange<S: FrameSource>(
        &mut self,
        device: &mut Device<S>,
        operations: &mut [Operation<'_>],
    ) -> Result<(), NoAcknowledgeSource> {
        let mut reading = None;
        for operation in operations {
            let reads = is_read(operation);
            if reading.replace(reads) != Some(reads) {
                self.address(device, reads)?;
            }
            match operation {
                Operation::Read(bytes) => self.read(device, bytes),
                Operation::Write(bytes) => self.write(device, bytes)?,
            }
        }
        Ok(())
    }

    /// START or repeated START, at which the device's registers come to a stand, and the address byte.
    fn address<S: FrameSource>(
        &mut self,
        device: &mut Device<S>,
        reads: bool,
    ) -> Result<(), NoAcknowledgeSource> {
        let now = self.clock.now();
        let ack = if reads {
            device.start_read(now)
        } else {
            device.start_write(now)
        };
        self.condition();
        self.byte();
        self.acknowledged(ack, NoAcknowledgeSource::Address)
    }

    fn write<S: FrameSource>(
        &mut self,
        device: &mut Device<S>,
        bytes: &[u8],
    ) -> Result<(), NoAcknowledgeSource> {
        for byte in bytes {
            self.byte();
            let ack = device.write(*byte, self.clock.now());
            self.acknowledged(ack, NoAcknowledgeSource::Data)?;
        }
        Ok(())
    }

    fn read<S: FrameSource>(&mut self, device: &mut Device<S>, bytes: &mut [u8]) {
        for byte in bytes {
            *byte = device.read(self.clock.now());
            self.byte();
        }
    }

    fn acknowledged(
        &mut self,
        ack: Ack,
        source: NoAcknowledgeSource,
    ) -> Result<(), NoAcknowledgeSource> {
        match ack {
            Ack::Ack => Ok(()),
            Ack::Nack => {
                self.traffic.nacks += 1;
                Err(source)
            }
        }
    }

    fn address_nobody(&mut self) {
        self.condition();
        self.byte();
        self.traffic.nacks += 1;
        self.condition();
    }

    /// START and the address byte, and then no further.
    fn break_off(&mut self, error: BusError) {
        self.condition();
        self.byte();
        if error == BusError::Timeout {
            self.clock.pass(HANG_TIMEOUT);
        }
    }

    fn byte(&mut self) {
        self.traffic.bytes += 1;
        self.bits(BITS_PER_BYTE);
    }

    fn condition(&mut self) {
        self.bits(1);
    }

    /// Passes the time of these bits; what one call rounds off, a later one makes up for.
    fn bits(&mut self, count: u64) {
        let before = self.bus_time();
        self.traffic.bits += count;
        let after = self.bus_time();
        if after > before {
            self.clock.pass(after.saturating_sub(before));
        }
    }

    /// The time of all bits so far.
    fn bus_time(&self) -> Duration {
        let Some(scl_hz) = self.scl_hz else {
            return Duration::ZERO;
        };
        let bits = u128::from(self.traffic.bits);
        let nanoseconds = bits * NANOSECONDS_PER_SECOND / u128::from(scl_hz.get());
        Duration::from_nanos(u64::try_from(nanoseconds).unwrap_or(u64::MAX))
    }
}
