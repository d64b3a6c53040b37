//! Why the buses did not become adapters, and what to do about it.

use super::limits::{BUSES_MAX, PORT_DEFAULT};
use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

const HINT_MODULES: &str = "load them with `modprobe -a vhci-hcd i2c-tiny-usb i2c-dev`; every full Debian kernel has them, cloud kernels (linux-image-cloud-*) and many containers do not";

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
    /// The kernel did not release a device that was unplugged.
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
