//! Way 4: a real `/dev/i2c-N` of the real kernel, by an emulated USB adapter.
//!
//! ```text
//!  this program                                  the kernel                                        any program
//!  ────────────                                  ──────────                                        ───────────
//!  rack ─▶ adapter ─▶ i2c-tiny-usb, emulated ──▶ vhci-hcd ─▶ i2c-tiny-usb ─▶ i2c-core ─▶ i2c-dev ─▶ /dev/i2c-N
//!                     (USB/IP, over a socketpair                             └▶ the kernel's own drivers
//!                      or over TCP)
//! ```
//!
//! The adapter is the classic i2c-tiny-usb (0403:c631), which knows control transfers only. [`attach`] hands it to this
//! machine's kernel; [`Server`] offers it to another machine or guest, where `usbip attach` fetches it.
//!
//! A transfer of several messages arrives message by message. Messages to a target are held until the read behind them,
//! or the end of the transfer, and are then carried out at once: a register's number and the read of its value are one
//! transaction on the emulated bus, as on a real one. What follows a read in the same transfer is a transaction of its own.
//!
//! Faults have the errno of the kernel's i2c-tiny-usb: a missing target ENXIO, everything else EIO.
//!
//! Nothing is left behind: the port is given up when [`Attached`] is dropped, and when the process dies in any other way,
//! because the kernel unplugs a device whose socket closes.

mod device;
mod server;
mod session;
mod sys;
mod vhci;
mod wire;

use crate::adapter::EmulatedAdapter;
use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

pub use device::HELD_MESSAGES_MAX;
pub use server::{CONNECTIONS_MAX, FIRST_PHASE_MAX, PORT_DEFAULT, Server};
pub use session::SessionError;
pub use vhci::{Attached, AttachedBus, attach};
pub use wire::{Malformed, TRANSFER_BYTES_MAX};

use device::{Device, SPEED_LOW, device_descriptor};
use wire::Described;

/// Most buses of one rack that become adapters: a usual vhci_hcd has eight ports.
pub const BUSES_MAX: usize = 8;

const HINT_MODULES: &str = "load them with `modprobe -a vhci-hcd i2c-tiny-usb i2c-dev`; every full Debian kernel has them, cloud kernels (linux-image-cloud-*) and many containers do not";

/// Where the kernel's files are, and how long to wait for it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// Where sysfs is mounted, `/sys`.
    pub sysfs: PathBuf,
    /// Where device files are, `/dev`.
    pub dev: PathBuf,
    /// Longest wait for the kernel to make an adapter out of the USB device, for each bus.
    pub driver_wait: Duration,
    /// Longest wait for the kernel to let go of a device that was unplugged, for each bus.
    pub detach_wait: Duration,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            sysfs: PathBuf::from("/sys"),
            dev: PathBuf::from("/dev"),
            driver_wait: Duration::from_secs(10),
            detach_wait: Duration::from_secs(2),
        }
    }
}

/// Why the buses did not become adapters of a kernel.
#[derive(Debug, thiserror::Error)]
pub enum UsbipError {
    /// There is no bus to attach.
    #[error("no bus to attach\nhint: put at least one bus into the rack")]
    NoBus,
    /// More buses than ports.
    #[error(
        "{found} buses, at most {BUSES_MAX} can be attached\nhint: start a second program for the rest"
    )]
    TooManyBuses {
        /// How many buses the rack has.
        found: usize,
    },
    /// The kernel has no virtual USB host controller.
    #[error("no virtual USB controller: there is no {}\nhint: the kernel modules vhci-hcd, i2c-tiny-usb and i2c-dev are needed; {HINT_MODULES}", path.display())]
    NoController {
        /// The folder that is missing.
        path: PathBuf,
    },
    /// Adapters would have no device files.
    #[error("the kernel module i2c-dev is not loaded: there is no {}\nhint: {HINT_MODULES}", path.display())]
    NoI2cDev {
        /// The folder that is missing.
        path: PathBuf,
    },
    /// Only root may attach devices.
    #[error("not permitted to write {}\nhint: run as root, for example with sudo; without root use `-- PROGRAM` or `--socket`", path.display())]
    NotRoot {
        /// The file that could not be opened.
        path: PathBuf,
    },
    /// All ports have a device already.
    #[error(
        "no free port: all {ports} of the virtual USB controller are in use\nhint: `usbip port` lists them, `usbip detach -p PORT` frees one"
    )]
    NoFreePort {
        /// How many ports there are.
        ports: usize,
    },
    /// The kernel refused the device.
    #[error("the kernel refused the device at port {port}: {source}\nhint: see its log (dmesg)")]
    Refused {
        /// The port that was asked for.
        port: u32,
        /// What the kernel said.
        source: io::Error,
    },
    /// The device was plugged in, but nothing made an adapter of it.
    #[error(
        "the kernel made no I2C adapter of the USB device at port {port} within {waited:?}\nhint: {HINT_MODULES}; a program that still holds the /dev/i2c-N of a USB adapter that was pulled out keeps the kernel from taking another one: end it"
    )]
    NoAdapter {
        /// The port at which the device is.
        port: u32,
        /// How long was waited.
        waited: Duration,
    },
    /// The kernel did not let go of a device that was unplugged.
    #[error(
        "port {port} is still in use {waited:?} after the device was unplugged\nhint: end the programs that hold the adapter open, then `usbip detach -p {port}`"
    )]
    StillAttached {
        /// The port.
        port: u32,
        /// How long was waited.
        waited: Duration,
    },
    /// A file of the kernel could not be read or understood.
    #[error("{}: {source}\nhint: this needs Linux 4.13 or newer with sysfs mounted at /sys", path.display())]
    Sysfs {
        /// The file.
        path: PathBuf,
        /// What the kernel said, or what was not understood.
        source: io::Error,
    },
    /// Another program listens there.
    #[error(
        "{address} is in use by another program\nhint: end usbipd or the other program, or choose another port"
    )]
    AddressInUse {
        /// The address that was asked for.
        address: SocketAddr,
    },
    /// This machine cannot listen there.
    #[error(
        "cannot listen on {address}: {source}\nhint: 127.0.0.1:{PORT_DEFAULT} is what QEMU guests reach as 10.0.2.2"
    )]
    CannotListen {
        /// The address that was asked for.
        address: SocketAddr,
        /// What the kernel said.
        source: io::Error,
    },
    /// A resource that every program needs ran out.
    #[error(
        "cannot {step}: {source}\nhint: the limit of open files or threads may be reached (ulimit -n, ulimit -u)"
    )]
    Resources {
        /// What was being done.
        step: &'static str,
        /// What the kernel said.
        source: io::Error,
    },
}

/// The name under which a bus is offered, as `usbip attach -b` wants it: `1-N` for bus N of the rack.
#[must_use]
pub fn bus_id(bus: u32) -> String {
    format!("1-{bus}")
}

/// The emulated adapter of one bus. `index` counts the buses of the rack from 0.
fn identity(bus: u32, index: usize) -> Described {
    Described {
        bus_id: bus_id(bus),
        bus_number: 1,
        device_number: u16::try_from(index + 1).unwrap_or(u16::MAX),
        speed: SPEED_LOW,
        descriptor: device_descriptor(),
    }
}

/// What [`Server`] and [`attach`] check before anything is started.
fn check_number(buses: usize) -> Result<(), UsbipError> {
    match buses {
        0 => Err(UsbipError::NoBus),
        found if found > BUSES_MAX => Err(UsbipError::TooManyBuses { found }),
        _ => Ok(()),
    }
}

fn device_of<A: EmulatedAdapter>(bus: A, described: &Described) -> Device<A> {
    Device::new(bus, described.clone())
}

#[cfg(test)]
mod tests;
