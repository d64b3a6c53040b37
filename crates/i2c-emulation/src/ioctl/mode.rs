//! The real adapter that the emulated one imitates.

use super::uapi::functionality as func;
use crate::adapter::{Fault, Message, is_read};
use core::fmt;
use core::str::FromStr;
use embedded_hal::i2c::Operation;
use rustix::io::Errno;

/// A kind of adapter: what it offers, what it rejects, and its errno for each fault.
///
/// | mode | offers | rejects | no answer | timeout | arbitration lost | other |
/// |---|---|---|---|---|---|---|
/// | `pi` | I2C, emulated SMBus | a read that is not the last message (EOPNOTSUPP 95) | EREMOTEIO 121 | ETIMEDOUT 110 | EIO 5 | EIO 5 |
/// | `pi5` | I2C, 10-bit, SMBus with block reads | | EREMOTEIO 121 | ETIMEDOUT 110 | EAGAIN 11, after 3 retries | EIO 5 |
/// | `usb` | I2C, emulated SMBus | a read of no bytes (EOPNOTSUPP 95) | ENXIO 6 | EIO 5 | EIO 5 | EIO 5 |
/// | `smbus-only` | SMBus with block reads | I2C_RDWR, read(), write() (EOPNOTSUPP 95) | ENXIO 6 | ETIMEDOUT 110 | EAGAIN 11 | EIO 5 |
/// | `busy` | as `pi` | I2C_SLAVE at every address (EBUSY 16) | as `pi` | | | |
/// | `gone` | as `pi` | every transfer (ENODEV 19) | | | | |
/// | `virtio` | I2C, emulated SMBus | | **fewer messages than requested, no errno** | the same | the same | the same |
///
/// A bus that reports [`Fault::Gone`] returns ENODEV 19 in every mode. Sources: the kernel's drivers i2c-bcm2835,
/// i2c-designware, i2c-tiny-usb, i2c-i801 and i2c-virtio.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum AdapterMode {
    /// Raspberry Pi 0 to 4 (i2c-bcm2835).
    #[default]
    Pi,
    /// Raspberry Pi 5 (i2c-designware).
    Pi5,
    /// A USB adapter (i2c-tiny-usb).
    Usb,
    /// A PC chipset's SMBus controller (i2c-i801).
    SmbusOnly,
    /// As [`Pi`](Self::Pi), with a kernel driver bound to every address.
    Busy,
    /// An adapter that was unplugged while the file was open.
    Gone,
    /// A virtual machine's adapter (i2c-virtio), which hides faults in the message count.
    Virtio,
}

impl AdapterMode {
    /// All modes, in the order of the table.
    pub const ALL: [Self; 7] = [
        Self::Pi,
        Self::Pi5,
        Self::Usb,
        Self::SmbusOnly,
        Self::Busy,
        Self::Gone,
        Self::Virtio,
    ];

    /// The name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pi => "pi",
            Self::Pi5 => "pi5",
            Self::Usb => "usb",
            Self::SmbusOnly => "smbus-only",
            Self::Busy => "busy",
            Self::Gone => "gone",
            Self::Virtio => "virtio",
        }
    }

    /// The adapter's I2C_FUNCS bits.
    #[must_use]
    pub const fn functionality(self) -> u32 {
        match self {
            Self::Pi | Self::Busy | Self::Gone | Self::Usb | Self::Virtio => {
                func::I2C | func::SMBUS_EMULATED
            }
            Self::Pi5 => func::I2C | func::TEN_BIT | func::SMBUS_WITH_BLOCK_READ,
            Self::SmbusOnly => func::SMBUS_WITH_BLOCK_READ | func::SMBUS_PEC,
        }
    }

    /// The errno of a fault; `None` if the adapter only returns a smaller message count.
    #[must_use]
    pub const fn errno(self, fault: Fault) -> Option<Errno> {
        Some(match (self, fault) {
            (_, Fault::Gone) | (Self::Gone, _) => Errno::NODEV,
            (Self::Virtio, _) => return None,
            (Self::Usb | Self::SmbusOnly, Fault::NackAddress)
            | (Self::SmbusOnly, Fault::NackData) => Errno::NXIO,
            (Self::Usb, _) => Errno::IO,
            (_, Fault::NackAddress | Fault::NackData) => Errno::REMOTEIO,
            (_, Fault::Timeout) => Errno::TIMEDOUT,
            (Self::Pi5 | Self::SmbusOnly, Fault::ArbitrationLost) => Errno::AGAIN,
            (_, Fault::Bus | Fault::ArbitrationLost) => Errno::IO,
        })
    }

    pub(super) const fn offers(self, bits: u32) -> bool {
        self.functionality() & bits == bits
    }

    pub(super) const fn retries_at_first(self) -> u32 {
        match self {
            Self::Pi5 => 3,
            _ => 0,
        }
    }

    /// Rejects what the adapter's driver rejects before anything reaches the bus.
    pub(super) fn check(self, messages: &[Message<'_>]) -> Result<(), Errno> {
        let refused = match self {
            Self::Gone => return Err(Errno::NODEV),
            Self::Pi | Self::Busy => {
                let mut before = messages.iter().rev().skip(1);
                before.any(|message| is_read(&message.operation))
            }
            Self::Usb => messages.iter().any(|message| {
                matches!(&message.operation, Operation::Read(buffer) if buffer.is_empty())
            }),
            Self::Pi5 | Self::SmbusOnly | Self::Virtio => false,
        };
        (!refused).then_some(()).ok_or(Errno::OPNOTSUPP)
    }
}

impl fmt::Display for AdapterMode {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(self.name())
    }
}

/// A name that is no mode's.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown adapter mode {found:?}\nhint: one of {known}")]
pub struct UnknownName {
    found: String,
    known: String,
}

impl FromStr for AdapterMode {
    type Err = UnknownName;

    fn from_str(name: &str) -> Result<Self, UnknownName> {
        let found = Self::ALL.into_iter().find(|mode| mode.name() == name);
        found.ok_or_else(|| UnknownName {
            found: name.to_owned(),
            known: Self::ALL.map(Self::name).join(", "),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_leads_back_to_its_mode() {
        let error = "pi4".parse::<AdapterMode>().unwrap_err().to_string();
        for mode in AdapterMode::ALL {
            assert_eq!(mode.to_string().parse().as_ref(), Ok(&mode));
            assert!(error.contains(&mode.to_string()), "{error}");
        }
    }

    /// The numbers of the real drivers, written out so that a slip in the table shows.
    #[test]
    fn each_mode_names_each_fault_as_its_driver_does() {
        use Fault::{ArbitrationLost, Bus, Gone, NackAddress, NackData, Timeout};
        for (mode, expected) in [
            (AdapterMode::Pi, [121, 121, 5, 5, 110, 19]),
            (AdapterMode::Pi5, [121, 121, 5, 11, 110, 19]),
            (AdapterMode::Usb, [6, 5, 5, 5, 5, 19]),
            (AdapterMode::SmbusOnly, [6, 6, 5, 11, 110, 19]),
            (AdapterMode::Busy, [121, 121, 5, 5, 110, 19]),
            (AdapterMode::Gone, [19; 6]),
            (AdapterMode::Virtio, [0, 0, 0, 0, 0, 19]),
        ] {
            let numbers = [NackAddress, NackData, Bus, ArbitrationLost, Timeout, Gone]
                .map(|fault| mode.errno(fault).map_or(0, Errno::raw_os_error));
            assert_eq!(numbers, expected, "{mode}, 0 for none");
        }
    }

    /// `0x0EFF_0009` is the output of `i2cdetect -F` on a Raspberry Pi: I2C_FUNC_I2C | I2C_FUNC_SMBUS_EMUL of
    /// linux/i2c.h.
    #[test]
    fn functionality_is_that_of_the_driver() {
        assert_eq!(AdapterMode::Pi.functionality(), 0x0EFF_0009);
        assert_eq!(AdapterMode::Virtio.functionality(), 0x0EFF_0009);
        assert_eq!(AdapterMode::Pi5.functionality(), 0x0F7F_0003);
        assert_eq!(AdapterMode::SmbusOnly.functionality() & 1, 0);
    }
}
