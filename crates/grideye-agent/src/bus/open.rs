//! Opens a bus, `/dev/i2c-N` or another, and translates its errors into reasons for a missing frame.

use embedded_hal::i2c::{Error as _, ErrorKind, ErrorType, I2c, Operation};
use grideye_frame::NoData;
use i2cdev::core::{I2CMessage as _, I2CTransfer as _};
use i2cdev::linux::{LinuxI2CError, LinuxI2CMessage};
use linux_embedded_hal::I2cdev;
use rustix::io::Errno;
use std::io;
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};

/// Opens a bus, again after it was unplugged, and interprets its errors: a Raspberry Pi's errno 121 is only
/// `ErrorKind::Other` to embedded-hal.
pub trait OpenBus {
    /// The open bus.
    type Bus: I2c;

    /// Opens the bus.
    ///
    /// # Errors
    /// [`OpenError`].
    fn open(&mut self) -> Result<Self::Bus, OpenError>;

    /// The bus's name for the log.
    fn name(&self) -> String {
        "the bus".to_owned()
    }

    /// The fastest possible bus clock, if known. It limits how late in a transfer the sensor can have copied its
    /// registers.
    fn scl_hz_max(&self) -> Option<NonZeroU32> {
        None
    }

    /// The reason that this error gives to the frame being read.
    fn classify(&self, error: &<Self::Bus as ErrorType>::Error) -> NoData {
        by_kind(error.kind())
    }

    /// The error in words, for finding its cause.
    fn describe(&self, error: &<Self::Bus as ErrorType>::Error) -> String {
        format!("{error:?}")
    }
}

/// The reason behind an error of which only embedded-hal's kind is known.
#[must_use]
pub fn by_kind(kind: ErrorKind) -> NoData {
    match kind {
        ErrorKind::NoAcknowledge(_) => NoData::Nack,
        ErrorKind::Overrun => NoData::ShortTransfer,
        _ => NoData::BusError,
    }
}

/// Why a bus cannot be opened or used, and how to fix it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OpenError {
    /// No device file has this name.
    #[error(
        "{0}: no such bus\nhint: enable I2C with `sudo raspi-config nonint do_i2c 0`, or add dtparam=i2c_arm=on to \
         /boot/firmware/config.txt and restart; `ls /dev/i2c-*` lists the buses"
    )]
    NoSuchBus(String),
    /// The user may not open the device file.
    #[error(
        "{0}: permission denied\nhint: add the user to the group with `sudo usermod -aG i2c $USER` and log in again, or \
         install 99-grideye-i2c.rules"
    )]
    PermissionDenied(String),
    /// A kernel driver uses this address.
    #[error(
        "{0}: a kernel driver owns address {1:#04x}\nhint: unbind it (`ls /sys/bus/i2c/devices/` shows it; video-i2c \
         is the usual one) and remove its dtoverlay"
    )]
    AddressInUse(String, u8),
    /// The file is no I2C bus, or the system rejected it for another reason.
    #[error(
        "{0}: cannot be used as an I2C bus: {1}\nhint: is this the right device file? `i2cdetect -l` lists the buses"
    )]
    Unusable(String, io::Error),
}

impl OpenError {
    /// The reason for frames missed while the bus cannot be opened.
    #[must_use]
    pub fn reason(&self) -> NoData {
        match self {
            Self::NoSuchBus(_) => NoData::Unplugged,
            Self::Unusable(_, source) => by_error(source),
            Self::PermissionDenied(_) | Self::AddressInUse(..) => NoData::BusError,
        }
    }
}

/// The kernel's list of adapters, each under its device file's name.
const ADAPTERS: &str = "/sys/class/i2c-adapter";
/// How much faster than the device tree states the clock may be.
const SCL_MARGIN: u32 = 2;

/// Opens `/dev/i2c-N`.
#[derive(Debug, Clone)]
pub struct LinuxBus {
    path: PathBuf,
    addresses: Vec<u8>,
}

impl LinuxBus {
    /// The bus with this device file, for sensors at these 7-bit addresses.
    pub fn new(path: impl Into<PathBuf>, addresses: impl IntoIterator<Item = u8>) -> Self {
        Self {
            path: path.into(),
            addresses: addresses.into_iter().collect(),
        }
    }
}

impl OpenBus for LinuxBus {
    type Bus = LinuxI2c;

    fn open(&mut self) -> Result<LinuxI2c, OpenError> {
        let mut devices = Vec::new();
        for address in &self.addresses {
            let refused = |error| open_error(&self.path, *address, error);
            let mut device = I2cdev::new(&self.path).map_err(refused)?;
            let named = device.set_slave_address(u16::from(*address));
            named.map_err(refused)?;
            devices.push((*address, device));
        }
        Ok(LinuxI2c { devices })
    }

    fn name(&self) -> String {
        self.path.display().to_string()
    }

    /// Twice the device tree's frequency: after the divider was set, a Raspberry Pi may raise the clock that SCL is
    /// divided from.
    fn scl_hz_max(&self) -> Option<NonZeroU32> {
        let name = self.path.file_name()?.to_str()?;
        let hz = scl_hz_in(Path::new(ADAPTERS), name)?.get();
        NonZeroU32::new(hz.saturating_mul(SCL_MARGIN))
    }

    /// A USB adapter that was pulled out fails with EIO; the missing device file distinguishes it from a faulty bus.
    /// The bus must then be closed at once, because until then the kernel registers no other USB device.
    fn classify(&self, error: &LinuxError) -> NoData {
        match error.reason() {
            NoData::BusError if !self.path.exists() => NoData::Unplugged,
            reason => reason,
        }
    }

    fn describe(&self, error: &LinuxError) -> String {
        error.to_string()
    }
}

/// An open `/dev/i2c-N`: one file handle per address, as the kernel requires.
///
/// Transfers bypass [`I2cdev`]'s own `I2c`, which drops the number of messages transferred, so that a stale buffer
/// passes as a frame, and reopens the file whenever the address changes.
pub struct LinuxI2c {
    devices: Vec<(u8, I2cdev)>,
}

/// Why a transfer on `/dev/i2c-N` failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LinuxError {
    /// The system call failed.
    #[error("{0}")]
    System(io::Error),
    /// Fewer messages were transferred than expected; virtio's adapter does this if no device answers.
    #[error("short transfer: expected {0} messages, found {1}")]
    ShortTransfer(usize, u32),
    /// The bus was not opened for this address.
    #[error("bus not opened for address {0:#04x}")]
    UnknownAddress(u8),
}

impl LinuxError {
    fn reason(&self) -> NoData {
        match self {
            Self::System(error) => by_error(error),
            Self::ShortTransfer(..) => NoData::ShortTransfer,
            Self::UnknownAddress(_) => NoData::BusError,
        }
    }
}

impl embedded_hal::i2c::Error for LinuxError {
    fn kind(&self) -> ErrorKind {
        use embedded_hal::i2c::NoAcknowledgeSource::Unknown;
        match self.reason() {
            NoData::Nack => ErrorKind::NoAcknowledge(Unknown),
            NoData::ShortTransfer => ErrorKind::Overrun,
            NoData::BusError => ErrorKind::Bus,
            _ => ErrorKind::Other,
        }
    }
}

impl ErrorType for LinuxI2c {
    type Error = LinuxError;
}

impl I2c for LinuxI2c {
    fn transaction(
        &mut self,
        address: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), LinuxError> {
        let device = self.devices.iter_mut().find(|(of, _)| *of == address);
        let Some((_, device)) = device else {
            return Err(LinuxError::UnknownAddress(address));
        };
        let messages = operations.iter_mut().map(|operation| match operation {
            Operation::Write(bytes) => LinuxI2CMessage::write(bytes),
            Operation::Read(bytes) => LinuxI2CMessage::read(bytes),
        });
        let mut messages: Vec<_> = messages.collect();
        let expected = messages.len();
        let found = device.transfer(&mut messages);
        let found = found.map_err(|error| LinuxError::System(error.into()))?;
        if usize::try_from(found) == Ok(expected) {
            return Ok(());
        }
        Err(LinuxError::ShortTransfer(expected, found))
    }
}

/// SCL's frequency from the adapter's device tree node: one big-endian cell.
fn scl_hz_in(adapters: &Path, name: &str) -> Option<NonZeroU32> {
    let cell = std::fs::read(adapters.join(name).join("of_node/clock-frequency")).ok()?;
    NonZeroU32::new(u32::from_be_bytes(cell.try_into().ok()?))
}

fn open_error(path: &Path, address: u8, error: LinuxI2CError) -> OpenError {
    let path = path.display().to_string();
    let source = io::Error::from(error);
    match source.kind() {
        io::ErrorKind::NotFound => OpenError::NoSuchBus(path),
        io::ErrorKind::PermissionDenied => OpenError::PermissionDenied(path),
        io::ErrorKind::ResourceBusy => OpenError::AddressInUse(path, address),
        _ => OpenError::Unusable(path, source),
    }
}

/// The reason behind an errno of these adapters: `i2c-bcm2835` (Raspberry Pi 0 to 4), `i2c-designware` (5), USB.
fn by_error(error: &io::Error) -> NoData {
    match Errno::from_io_error(error) {
        Some(Errno::NXIO | Errno::REMOTEIO) => NoData::Nack,
        Some(Errno::TIMEDOUT) => NoData::BusTimeout,
        Some(Errno::NODEV | Errno::NOTCONN | Errno::SHUTDOWN) => NoData::Unplugged,
        _ => NoData::BusError,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_reason_why_a_bus_does_not_open_has_its_own_hint() {
        let message = |errno| {
            let error = LinuxI2CError::from(io::Error::from_raw_os_error(errno));
            open_error(Path::new("/dev/i2c-1"), 0x69, error).to_string()
        };
        assert!(message(2).starts_with("/dev/i2c-1: no such bus\nhint: enable I2C"));
        assert!(message(13).contains("permission denied\nhint: add the user to the group"));
        assert!(message(16).contains("a kernel driver owns address 0x69\nhint: unbind it"));
        assert!(message(25).contains("cannot be used as an I2C bus: Inappropriate ioctl"));
    }

    #[test]
    fn a_bus_clock_is_read_from_the_device_tree_or_unknown() {
        let adapters = tempfile::tempdir().unwrap();
        let node = adapters.path().join("i2c-1/of_node");
        std::fs::create_dir_all(&node).unwrap();
        let found = || scl_hz_in(adapters.path(), "i2c-1").map(NonZeroU32::get);
        assert_eq!(found(), None);
        for (cell, expected) in [
            (&[0, 0x01, 0x86, 0xA0][..], Some(100_000)),
            (&[0; 4], None),
            (&[1; 5], None),
        ] {
            std::fs::write(node.join("clock-frequency"), cell).unwrap();
            assert_eq!(found(), expected, "{cell:?}");
        }
    }
}
