//! Why the buses did not become kernel adapters.

use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

/// The most buses of one rack that become adapters: a usual vhci_hcd has eight ports.
pub const BUSES_MAX: usize = 8;
/// The default port of `usbip`.
pub const PORT_DEFAULT: u16 = 3240;

const HINT_MODULES: &str = "load them with `modprobe -a vhci-hcd i2c-tiny-usb i2c-dev`; every full Debian kernel has them, cloud kernels (linux-image-cloud-*) and many containers do not";

/// Why the buses did not become kernel adapters.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what each is")]
pub enum UsbipError {
    #[error("no bus to attach\nhint: add at least one bus to the rack")]
    NoBus,
    #[error(
        "{0} buses, at most {BUSES_MAX} can be attached\nhint: start a second program for the rest"
    )]
    TooManyBuses(usize),
    #[error(
        "no virtual USB controller: there is no {0}\nhint: the kernel modules vhci-hcd, i2c-tiny-usb and i2c-dev are needed; {HINT_MODULES}"
    )]
    NoController(PathBuf),
    #[error("the kernel module i2c-dev is not loaded: there is no {0}\nhint: {HINT_MODULES}")]
    NoI2cDev(PathBuf),
    #[error(
        "not permitted to write {0}\nhint: run as root, for example with sudo; without root use `-- PROGRAM` or `--socket`"
    )]
    NotRoot(PathBuf),
    #[error(
        "no free port: all {0} of the virtual USB controller are in use\nhint: `usbip port` lists them, `usbip detach -p PORT` frees one"
    )]
    NoFreePort(usize),
    #[error("the kernel refused the device at port {0}: {1}\nhint: see its log (dmesg)")]
    Refused(u32, #[source] io::Error),
    #[error(
        "the kernel made no I2C adapter of the USB device at port {0} within {1:?}\nhint: {HINT_MODULES}; a program that still holds the /dev/i2c-N of an unplugged USB adapter blocks new ones: end it"
    )]
    NoAdapter(u32, Duration),
    #[error(
        "port {0} is still in use {1:?} after the device was unplugged\nhint: end the programs that hold the adapter open, then `usbip detach -p {0}`"
    )]
    StillAttached(u32, Duration),
    #[error("{0}: {1}\nhint: this needs Linux 4.13 or newer with sysfs mounted at /sys")]
    Sysfs(PathBuf, #[source] io::Error),
    #[error(
        "{0} is in use by another program\nhint: end usbipd or the other program, or choose another port"
    )]
    AddressInUse(SocketAddr),
    #[error(
        "cannot listen on {0}: {1}\nhint: 127.0.0.1:{PORT_DEFAULT} is what QEMU guests reach as 10.0.2.2"
    )]
    CannotListen(SocketAddr, #[source] io::Error),
    #[error(
        "cannot {0}: {1}\nhint: the limit of open files or threads may be reached (ulimit -n, ulimit -u)"
    )]
    Resources(&'static str, #[source] io::Error),
}

/// Checks the number of buses first, for both ways to a kernel.
pub(super) fn check_number(buses: usize) -> Result<(), UsbipError> {
    match buses {
        0 => Err(UsbipError::NoBus),
        found if found > BUSES_MAX => Err(UsbipError::TooManyBuses(found)),
        _ => Ok(()),
    }
}
