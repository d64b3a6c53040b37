//! The kernel's virtual USB host controller, through its files in sysfs.

use super::device::Device;
use super::error::{UsbipError, check_number};
use super::session::{self, SessionError};
use super::wire::{BUS_NUMBER, Identity, SPEED_LOW};
use crate::rack::{Rack, SharedAdapter};
use std::fs::{self, OpenOptions};
use std::io::{self, Write as _};
use std::net::Shutdown;
use std::os::fd::AsRawFd as _;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::thread::{self, JoinHandle};
use std::time::Duration;

const LOOK_EVERY: Duration = Duration::from_millis(20);
/// A free port (`usbip_common.h`, VDEV_ST_NULL).
const PORT_FREE: u32 = 4;
/// The hub for devices of USB 2 and slower.
const HIGH_SPEED_HUB: &str = "hs";

/// The kernel's paths and time limits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// The mount point of sysfs, `/sys`.
    pub sysfs: PathBuf,
    /// The folder of device files, `/dev`.
    pub dev: PathBuf,
    /// The longest wait for the kernel to turn a USB device into an adapter, per bus.
    pub driver_wait: Duration,
    /// The longest wait for the kernel to release an unplugged device, per bus.
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

/// One bus attached as an adapter of this machine's kernel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AttachedBus {
    /// Its number in the [`Rack`].
    pub bus: u32,
    /// Its vhci_hcd port.
    pub port: u32,
    /// The N of `/dev/i2c-N`, chosen by the kernel.
    pub adapter: u32,
    /// `/dev/i2c-N`.
    pub device: PathBuf,
}

/// Buses attached as adapters of this machine's kernel until this is dropped.
#[derive(Debug)]
pub struct Attached {
    buses: Vec<AttachedBus>,
    plugs: Vec<Plug>,
}

/// Attaches every bus of the rack as an adapter of this machine's kernel, each served by its own thread.
/// # Errors
/// No bus or too many, a missing module, no root, no free port, or no adapter from the kernel. Then none is attached.
pub fn attach(rack: &Rack, options: &Options) -> Result<Attached, UsbipError> {
    check_number(rack.iter().count())?;
    let controller = Controller::find(options)?;
    let mut attached = Attached {
        buses: Vec::new(),
        plugs: Vec::new(),
    };
    for (index, (number, bus)) in rack.iter().enumerate() {
        let (plug, kernels_end) = controller.plug_in(bus, Identity::new(number, index))?;
        let port = plug.port;
        attached.plugs.push(plug);
        let (adapter, device) = controller.wait_for_adapter(port)?;
        // The kernel holds its own reference, so the device is now unplugged when this process ends.
        drop(kernels_end);
        attached.buses.push(AttachedBus {
            bus: number,
            port,
            adapter,
            device,
        });
    }
    Ok(attached)
}

impl Attached {
    /// The attached buses, in the order of the rack.
    #[must_use]
    pub fn buses(&self) -> &[AttachedBus] {
        &self.buses
    }

    /// Waits until the other side has unplugged all devices, for example with `usbip detach`.
    /// # Errors
    /// The first connection that ended any other way.
    pub fn wait(&mut self) -> Result<(), SessionError> {
        let outcomes: Vec<_> = self.plugs.iter_mut().map(Plug::join).collect();
        outcomes.into_iter().collect()
    }

    /// Unplugs all devices and waits until the kernel has released them. Dropping does the same, but reports no error.
    /// # Errors
    /// [`UsbipError::StillAttached`] if the kernel does not release one in time.
    pub fn stop(mut self) -> Result<(), UsbipError> {
        self.unplug()
    }

    fn unplug(&mut self) -> Result<(), UsbipError> {
        let outcomes: Vec<_> = self.plugs.drain(..).map(|mut plug| plug.pull()).collect();
        outcomes.into_iter().collect()
    }
}

impl Drop for Attached {
    fn drop(&mut self) {
        // `stop` reports errors; the sockets are closed either way.
        let _ = self.unplug();
    }
}

/// One device at one port, and the thread that serves it.
#[derive(Debug)]
struct Plug {
    controller: Controller,
    port: u32,
    socket: UnixStream,
    thread: Option<JoinHandle<Result<(), SessionError>>>,
}

impl Plug {
    fn join(&mut self) -> Result<(), SessionError> {
        match self.thread.take().map(JoinHandle::join) {
            Some(Ok(outcome)) => outcome,
            // A panic of the bus was reported by its own thread.
            Some(Err(_)) | None => Ok(()),
        }
    }

    fn pull(&mut self) -> Result<(), UsbipError> {
        // The socket may already be closed by the other side.
        let _ = self.socket.shutdown(Shutdown::Both);
        // The connection was just cut, so its error means nothing.
        let _ = self.join();
        self.controller.wait_for_free(self.port)
    }
}

/// `vhci_hcd` in sysfs.
#[derive(Clone, Debug)]
struct Controller {
    folder: PathBuf,
    options: Options,
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct PortLine {
    high_speed: bool,
    port: u32,
    state: u32,
    /// The name of the USB device at the port, if any.
    usb_device: String,
}

impl Controller {
    fn find(options: &Options) -> Result<Self, UsbipError> {
        let folder = options.sysfs.join("devices/platform/vhci_hcd.0");
        if !folder.is_dir() {
            return Err(UsbipError::NoController(folder));
        }
        let i2c_dev = options.sysfs.join("class/i2c-dev");
        if !i2c_dev.is_dir() {
            return Err(UsbipError::NoI2cDev(i2c_dev));
        }
        Ok(Self {
            folder,
            options: options.clone(),
        })
    }

    /// Attaches a device to the first port that accepts it. The second value is the kernel's end of the connection.
    fn plug_in(
        &self,
        bus: SharedAdapter,
        identity: Identity,
    ) -> Result<(Plug, UnixStream), UsbipError> {
        let (ours, kernels) = UnixStream::pair().map_err(resources("make a pair of sockets"))?;
        let port = self.give_to_a_free_port(&kernels, &identity)?;
        let stream = ours.try_clone().map_err(resources("duplicate a socket"))?;
        let mut device = Device::new(bus, identity);
        let thread = thread::Builder::new()
            .name(format!("usbip port {port}"))
            .spawn(move || session::serve(&stream, &stream, &mut device))
            .map_err(resources("start a thread"))?;
        let plug = Plug {
            controller: self.clone(),
            port,
            socket: ours,
            thread: Some(thread),
        };
        Ok((plug, kernels))
    }

    fn give_to_a_free_port(&self, end: &UnixStream, own: &Identity) -> Result<u32, UsbipError> {
        let lines = self.ports()?;
        let of_our_speed = || lines.iter().filter(|line| line.high_speed);
        for line in of_our_speed().filter(|line| line.state == PORT_FREE) {
            match self.give(line.port, end, own) {
                // Another program was faster.
                Err(UsbipError::Refused(_, source))
                    if source.kind() == io::ErrorKind::ResourceBusy => {}
                outcome => return outcome.map(|()| line.port),
            }
        }
        Err(UsbipError::NoFreePort(of_our_speed().count()))
    }

    fn give(&self, port: u32, kernels: &UnixStream, identity: &Identity) -> Result<(), UsbipError> {
        let path = self.folder.join("attach");
        let opened = OpenOptions::new().write(true).open(&path);
        let mut file = opened.map_err(|source| match source.kind() {
            io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
                UsbipError::NotRoot(path)
            }
            _ => UsbipError::Sysfs(path, source),
        })?;
        let device_id = u32::from(BUS_NUMBER) << 16 | u32::from(identity.device_number);
        let line = format!("{port} {} {device_id} {SPEED_LOW}", kernels.as_raw_fd());
        file.write_all(line.as_bytes())
            .map_err(|source| UsbipError::Refused(port, source))
    }

    /// The lines of `status`, and of `status.1` and so on with several controllers.
    fn ports(&self) -> Result<Vec<PortLine>, UsbipError> {
        let mut lines = self.ports_of("status")?;
        for further in 1.. {
            let name = format!("status.{further}");
            if !self.folder.join(&name).exists() {
                break;
            }
            lines.extend(self.ports_of(&name)?);
        }
        Ok(lines)
    }

    fn ports_of(&self, name: &str) -> Result<Vec<PortLine>, UsbipError> {
        let path = self.folder.join(name);
        let parse = |line: &str| {
            let unknown = || io::Error::other(format!("not a line of ports: {line:?}"));
            PortLine::parse(line).ok_or_else(unknown)
        };
        fs::read_to_string(&path)
            .and_then(|text| text.lines().skip(1).map(parse).collect())
            .map_err(|source| UsbipError::Sysfs(path, source))
    }

    fn line_of(&self, port: u32) -> Result<Option<PortLine>, UsbipError> {
        Ok(self.ports()?.into_iter().find(|line| line.port == port))
    }

    /// Waits for the kernel's adapter for the device at this port.
    fn wait_for_adapter(&self, port: u32) -> Result<(u32, PathBuf), UsbipError> {
        let waited = self.options.driver_wait;
        look_until(waited, || {
            let Some(line) = self.line_of(port)? else {
                return Ok(None);
            };
            let adapter = adapter_of(&self.options.sysfs, &line.usb_device);
            Ok(adapter.and_then(|number| {
                let device = self.options.dev.join(format!("i2c-{number}"));
                device.exists().then_some((number, device))
            }))
        })?
        .ok_or(UsbipError::NoAdapter(port, waited))
    }

    fn wait_for_free(&self, port: u32) -> Result<(), UsbipError> {
        let waited = self.options.detach_wait;
        let is_free = || {
            let line = self.line_of(port)?;
            let adapter = |line: &PortLine| adapter_of(&self.options.sysfs, &line.usb_device);
            let free = line.is_none_or(|line| line.state == PORT_FREE && adapter(&line).is_none());
            Ok(free.then_some(()))
        };
        look_until(waited, is_free)?.ok_or(UsbipError::StillAttached(port, waited))
    }
}

impl PortLine {
    /// `hub port sta spd dev sockfd local_busid`, as `vhci_sysfs.c` prints it.
    fn parse(line: &str) -> Option<Self> {
        let mut words = line.split_ascii_whitespace();
        let hub = words.next()?;
        let port = words.next()?.parse().ok()?;
        let state = words.next()?.parse().ok()?;
        let usb_device = words.nth(3)?.to_owned();
        Some(Self {
            high_speed: hub == HIGH_SPEED_HUB,
            port,
            state,
            usb_device,
        })
    }
}

/// The N of the folder `i2c-N` in the device's only interface.
fn adapter_of(sysfs: &Path, usb_device: &str) -> Option<u32> {
    let interface = sysfs.join(format!("bus/usb/devices/{usb_device}/{usb_device}:1.0"));
    fs::read_dir(interface).ok()?.find_map(|entry| {
        let name = entry.ok()?.file_name();
        name.to_str()?.strip_prefix("i2c-")?.parse().ok()
    })
}

/// Looks repeatedly for up to `longest`; `None` if nothing appeared.
fn look_until<T>(
    longest: Duration,
    mut look: impl FnMut() -> Result<Option<T>, UsbipError>,
) -> Result<Option<T>, UsbipError> {
    let looks = longest.as_millis() / LOOK_EVERY.as_millis();
    for _ in 0..looks {
        if let Some(seen) = look()? {
            return Ok(Some(seen));
        }
        thread::sleep(LOOK_EVERY);
    }
    look()
}

fn resources(step: &'static str) -> impl FnOnce(io::Error) -> UsbipError {
    move |source| UsbipError::Resources(step, source)
}
