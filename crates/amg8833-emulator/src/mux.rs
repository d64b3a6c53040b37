//! A TCA9548A multiplexer: one bus in, eight out.

use crate::bus::line::Control;
use crate::bus::wire::{Talk, is_read, known};
use crate::bus::{Bus, Carry};
use crate::clock::Clock;
use crate::signal::{BusError, Outcome};
use crate::source::FrameSource;
use core::fmt;
use embedded_hal::i2c::{ErrorType, I2c, Operation};

/// The number of buses after a multiplexer.
pub const CHANNELS: usize = 8;
const BUSES: usize = CHANNELS + 1;

/// The address of a multiplexer: 0x70 to 0x77, set by pins A2 to A0 (TI SCPS207, "Device Address").
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MuxAddress(u8);

impl MuxAddress {
    /// All three pins low: 0x70.
    pub const FIRST: Self = Self(0x70);

    /// The address of these seven bits; `None` if no multiplexer can have it.
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

/// A TCA9548A with one bus before it, the trunk, and eight after it, the channels.
///
/// ```text
///                       ┌─ channel 0: Bus ─ 0x68, 0x69
///  I2c ─ trunk: Bus ─ Mux (0x70: one bit a channel)
///         0x68, 0x69    └─ channel 7: Bus ─ 0x68, 0x69
/// ```
///
/// - The last byte written to the multiplexer's address selects channels, effective at the STOP; reading returns it (TI
///   SCPS207).
/// - Active channels and the trunk are one pair of wires: devices with the same address acknowledge together, and their
///   bytes are ANDed. A line held low on an active channel holds the trunk until [`reset`](Self::reset).
/// - Bits take the trunk's time. A channel's trace and traffic cover only messages that reached it.
#[derive(Debug)]
pub struct Mux<C, S> {
    trunk: Bus<C, S>,
    channels: [Bus<C, S>; CHANNELS],
    address: MuxAddress,
    control: u8,
    held_in_reset: bool,
}

impl<C: Clock, S: FrameSource> Mux<C, S> {
    /// A multiplexer that powers on now, with no channel selected.
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

    /// The bus on channel 0 to 7.
    pub fn channel(&self, channel: usize) -> Option<&Bus<C, S>> {
        self.channels.get(channel)
    }

    /// The bus on channel 0 to 7.
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

    /// Pulses the RESET pin: deselects all channels.
    pub const fn reset(&mut self) {
        self.control = 0;
    }

    /// Sets the RESET pin: while low, no channel is selected and the multiplexer does not answer.
    pub const fn hold_in_reset(&mut self, low: bool) {
        self.held_in_reset = low;
        if low {
            self.control = 0;
        }
    }

    /// Cuts and restores the multiplexer's supply: deselects all channels. The sensors keep theirs.
    pub const fn power_cycle(&mut self) {
        self.control = 0;
    }

    /// Lets the scripts and sensors of all buses do what is due by now.
    pub fn advance(&mut self) {
        self.buses_mut().for_each(Bus::advance);
    }

    /// As [`Bus::converse`].
    /// # Errors
    /// As [`Bus::converse`].
    pub fn converse(
        &mut self,
        address: u8,
        reads: bool,
        talk: &mut dyn FnMut(Carry<'_>),
    ) -> Result<(), BusError> {
        self.transact(address, Some(reads), talk)
    }

    fn transact(&mut self, address: u8, first: Option<bool>, talk: Talk<'_>) -> Outcome {
        let mut control = Control {
            selected: self.control,
            answers: address == self.address.bits() && !self.held_in_reset,
            written: None,
        };
        let Self {
            trunk, channels, ..
        } = self;
        let result = trunk.transact::<BUSES>(channels, &mut control, address, first, talk);
        self.control = control.written.unwrap_or(self.control);
        result
    }
}

impl<C, S> ErrorType for Mux<C, S> {
    type Error = BusError;
}

impl<C: Clock, S: FrameSource> I2c for Mux<C, S> {
    /// As on a single bus; bytes written to the multiplexer's own address take effect at the STOP.
    fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Outcome {
        let first = operations.first().map(is_read);
        self.transact(address, first, &mut known(operations))
    }
}

impl fmt::Display for MuxAddress {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "0x{:02x}", self.0)
    }
}
