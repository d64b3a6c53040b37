//! Signals between sensor, wires and controller: addresses, acknowledgments, the INT pin, errors, traffic.

use core::fmt;
use core::time::Duration;
use embedded_hal::i2c::{self, ErrorKind, NoAcknowledgeSource};

/// The sensor's possible addresses (AMG88 spec §4-8-2).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Address {
    /// 0x68: AD_SELECT at GND.
    Low,
    /// 0x69: AD_SELECT at VDD, as on most boards.
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

    /// The address of these seven bits; `None` if no sensor can have it.
    #[must_use]
    pub fn from_bits(bits: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|address| address.bits() == bits)
    }

    pub(crate) const fn place(self) -> usize {
        match self {
            Self::Low => 0,
            Self::High => 1,
        }
    }
}

/// A bus error, as a controller reports it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BusError {
    /// The address or a byte was not acknowledged (EREMOTEIO or ENXIO).
    NoAcknowledge {
        /// The seven bits of the address.
        address: u8,
        /// Whether the address or a byte was not acknowledged.
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
            Self::NoAcknowledge { address, source } => match source {
                NoAcknowledgeSource::Address => {
                    write!(formatter, "no device acknowledged address 0x{address:02x}")
                }
                _ => write!(
                    formatter,
                    "the device at 0x{address:02x} did not acknowledge a byte"
                ),
            },
            Self::Bus => formatter.write_str("a START or STOP was misplaced on the bus"),
            Self::ArbitrationLoss => formatter.write_str("another controller drove the bus"),
            Self::Timeout => write!(formatter, "the bus was held low for {HANG_TIMEOUT:?}"),
            Self::Gone => formatter.write_str("the bus adapter is gone"),
        }
    }
}

impl core::error::Error for BusError {}

/// Traffic on the bus since its creation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Traffic {
    /// Transactions, each from START to STOP.
    pub transactions: u64,
    /// Address and data bytes, acknowledged or not.
    pub bytes: u64,
    /// Nine per byte, one for each START, repeated START and STOP.
    pub bits: u64,
    /// Addresses and bytes that were not acknowledged.
    pub nacks: u64,
}

impl Traffic {
    /// The traffic since an earlier count.
    #[must_use]
    pub const fn since(self, earlier: Self) -> Self {
        Self {
            transactions: self.transactions.saturating_sub(earlier.transactions),
            bytes: self.bytes.saturating_sub(earlier.bytes),
            bits: self.bits.saturating_sub(earlier.bits),
            nacks: self.nacks.saturating_sub(earlier.nacks),
        }
    }
}

impl core::ops::AddAssign for Traffic {
    fn add_assign(&mut self, more: Self) {
        self.transactions += more.transactions;
        self.bytes += more.bytes;
        self.bits += more.bits;
        self.nacks += more.nacks;
    }
}

pub(crate) type Outcome = Result<(), BusError>;

/// Whether a byte on the bus was acknowledged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ack {
    /// SDA was pulled low in the ninth bit.
    Ack,
    /// SDA was left high in the ninth bit.
    Nack,
}

/// How much of a message was acknowledged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Acknowledge {
    /// The address, and every byte that was written.
    All,
    /// The address was not.
    NotAddress,
    /// The last written byte was not.
    NotLastByte,
}

/// The level of the INT pin, an open drain (AMG88 spec §4-7).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InterruptPin {
    /// Pulled low: an interrupt.
    Low,
    /// Released; the board's pull-up takes it high.
    HighZ,
    /// Driven to the supply, with [`InterruptOutput::PushPull`](crate::InterruptOutput::PushPull) only.
    High,
}

/// How long the controller waits for a bus held low, as on Linux.
pub const HANG_TIMEOUT: Duration = Duration::from_secs(1);
