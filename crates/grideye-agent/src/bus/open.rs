//! How a bus is opened, and what its errors mean for the frame that was being read.

use super::errno::by_errno;
use embedded_hal::i2c::{Error as _, ErrorKind, ErrorType, I2c};
use grideye_frame::NoData;
use std::io;
use std::num::NonZeroU32;

/// Opens a bus, and opens it again after it was unplugged. What an error of the bus means is for its opener to say,
/// because an error type alone often does not know (a Raspberry Pi's errno 121 is `ErrorKind::Other`).
pub trait OpenBus {
    /// The open bus.
    type Bus: I2c;

    /// Opens the bus.
    ///
    /// # Errors
    /// [`OpenError`], with the reason and what to do about it.
    fn open(&mut self) -> Result<Self::Bus, OpenError>;

    /// The bus' name for the log.
    fn name(&self) -> String {
        "the bus".to_owned()
    }

    /// The fastest that the bus' clock can be, if that is known: how long a transfer takes at least tells how late in it
    /// the sensor's registers can have been copied.
    fn scl_hz_max(&self) -> Option<NonZeroU32> {
        None
    }

    /// What this error means for the frame that was being read.
    fn classify(&self, error: &<Self::Bus as ErrorType>::Error) -> NoData {
        by_kind(error.kind())
    }

    /// The error in words, for a person who looks for its cause.
    fn describe(&self, error: &<Self::Bus as ErrorType>::Error) -> String {
        format!("{error:?}")
    }
}

/// What an error means of which only embedded-hal's kind is known.
#[must_use]
pub fn by_kind(kind: ErrorKind) -> NoData {
    match kind {
        ErrorKind::NoAcknowledge(_) => NoData::Nack,
        ErrorKind::Overrun => NoData::ShortTransfer,
        _ => NoData::BusError,
    }
}

/// Why a bus cannot be opened or used, and what to do about it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OpenError {
    /// There is no such device file.
    #[error(
        "{path}: no such bus\nhint: enable I2C with `sudo raspi-config nonint do_i2c 0`, or add dtparam=i2c_arm=on to \
         /boot/firmware/config.txt and restart; `ls /dev/i2c-*` lists the buses"
    )]
    NoSuchBus {
        /// The device file.
        path: String,
    },
    /// The user may not open the device file.
    #[error(
        "{path}: permission denied\nhint: add the user to the group with `sudo usermod -aG i2c $USER` and log in again, or \
         install 99-grideye-i2c.rules"
    )]
    PermissionDenied {
        /// The device file.
        path: String,
    },
    /// A driver of the kernel has the sensor.
    #[error(
        "{path}: a kernel driver owns address {address:#04x}\nhint: unbind it (`ls /sys/bus/i2c/devices/` shows it; video-i2c \
         is the usual one) and remove its dtoverlay"
    )]
    AddressInUse {
        /// The device file.
        path: String,
        /// The address of the sensor.
        address: u8,
    },
    /// The file is there, but is no I2C bus, or the system refused it for another reason.
    #[error(
        "{path}: cannot be used as an I2C bus: {source}\nhint: is this the right device file? `i2cdetect -l` lists the buses"
    )]
    Unusable {
        /// The device file.
        path: String,
        /// What the system said.
        source: io::Error,
    },
}

impl OpenError {
    /// What a frame is missing for while the bus cannot be opened.
    #[must_use]
    pub fn reason(&self) -> NoData {
        match self {
            Self::NoSuchBus { .. } => NoData::Unplugged,
            Self::Unusable { source, .. } => {
                source.raw_os_error().map_or(NoData::BusError, by_errno)
            }
            Self::PermissionDenied { .. } | Self::AddressInUse { .. } => NoData::BusError,
        }
    }
}
