//! USB/IP over TCP: another machine or guest fetches the adapters with `usbip attach`.

use super::device::Device;
use super::error::UsbipError;
use super::identity::{check_number, identity};
use super::session::{self, SessionError};
use super::sys;
use super::wire::{self, BUS_ID_BYTES, Described, OP_BYTES, Refusal, Request};
use crate::rack::{Rack, SharedAdapter};
use std::io::{self, Read as _, Write as _};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::os::fd::OwnedFd;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// Most connections at a time. One more is closed at once.
pub const CONNECTIONS_MAX: usize = 32;
/// Longest wait for a client to say what it wants, and for it to take an answer.
pub const FIRST_PHASE_MAX: Duration = Duration::from_secs(5);

/// Pause after the kernel could not accept a connection, for want of files for example.
const ACCEPT_AGAIN: Duration = Duration::from_millis(50);

/// The adapters of a rack, offered over TCP until this is dropped.
///
/// Each adapter has one user at a time, as a device at a cable has. There is no password: whoever reaches the address has
/// the emulated sensors, so keep to loopback, which QEMU's guests reach as 10.0.2.2.
#[derive(Debug)]
pub struct Server {
    address: SocketAddr,
    listener: TcpListener,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Server {
    /// Listens, and serves each connection by a thread.
    ///
    /// # Errors
    /// No bus or too many, or an address that this machine cannot listen on.
    pub fn bind(address: SocketAddr, rack: &Rack) -> Result<Self, UsbipError> {
        Self::bind_with(address, rack, FIRST_PHASE_MAX)
    }

    pub(super) fn bind_with(
        address: SocketAddr,
        rack: &Rack,
        first_phase_max: Duration,
    ) -> Result<Self, UsbipError> {
        let buses: Vec<(u32, SharedAdapter)> = rack.iter().collect();
        check_number(buses.len())?;
        let cannot = |source: io::Error| match source.kind() {
            io::ErrorKind::AddrInUse => UsbipError::AddressInUse { address },
            _ => UsbipError::CannotListen { address, source },
        };
        let listener = TcpListener::bind(address).map_err(cannot)?;
        let address = listener.local_addr().map_err(cannot)?;
        let shared = Arc::new(Shared::new(buses, first_phase_max));
        let accepting = listener.try_clone().map_err(cannot)?;
        let for_thread = Arc::clone(&shared);
        let thread = thread::Builder::new()
            .name("usbip accept".to_owned())
            .spawn(move || accept(&accepting, &for_thread))
            .map_err(|source| UsbipError::Resources {
                step: "start a thread",
                source,
            })?;
        Ok(Self {
            address,
            listener,
            shared,
            thread: Some(thread),
        })
    }

    /// Where it listens, with the port that the kernel chose if 0 was asked for.
    #[must_use]
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// The number in the rack and the name for `usbip attach -b` of each adapter.
    pub fn bus_ids(&self) -> impl Iterator<Item = (u32, &str)> {
        self.shared
            .exports
            .iter()
            .map(|export| (export.bus, export.described.bus_id.as_str()))
    }

    /// Stops listening and ends all connections: the adapters of the clients are unplugged. Dropping does the same.
    pub fn stop(self) {
        drop(self);
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.shared.stopping.store(true, Ordering::SeqCst);
        // Shutting the socket down wakes the thread that waits in accept(); std offers it for streams only.
        if let Ok(duplicate) = self.listener.try_clone() {
            let _ = TcpStream::from(OwnedFd::from(duplicate)).shutdown(Shutdown::Both);
        }
        if let Some(thread) = self.thread.take() {
            // It returns no value, and a panic has been reported.
            let _ = thread.join();
        }
        self.shared.hang_up();
    }
}

/// One adapter on offer.
struct Export {
    bus: u32,
    described: Described,
    adapter: SharedAdapter,
    taken: AtomicBool,
}

#[derive(Debug)]
struct Connection {
    stream: TcpStream,
    thread: JoinHandle<()>,
}

struct Shared {
    exports: Vec<Export>,
    first_phase_max: Duration,
    connections: Mutex<Vec<Connection>>,
    stopping: AtomicBool,
}

impl std::fmt::Debug for Shared {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let names: Vec<_> = self
            .exports
            .iter()
            .map(|export| &export.described.bus_id)
            .collect();
        formatter
            .debug_struct("Shared")
            .field("exports", &names)
            .finish_non_exhaustive()
    }
}

impl Shared {
    fn new(buses: Vec<(u32, SharedAdapter)>, first_phase_max: Duration) -> Self {
        let export = |(index, (bus, adapter)): (usize, (u32, SharedAdapter))| Export {
            bus,
            described: identity(bus, index),
            adapter,
            taken: AtomicBool::new(false),
        };
        Self {
            exports: buses.into_iter().enumerate().map(export).collect(),
            first_phase_max,
            connections: Mutex::new(Vec::new()),
            stopping: AtomicBool::new(false),
        }
    }

    /// Serves a connection in a thread of its own, unless there are too many.
    fn take_on(self: &Arc<Self>, stream: TcpStream) -> io::Result<()> {
        let mut connections = self
            .connections
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        connections.retain(|connection| !connection.thread.is_finished());
        if connections.len() >= CONNECTIONS_MAX {
            return stream.shutdown(Shutdown::Both);
        }
        let shared = Arc::clone(self);
        let served = stream.try_clone()?;
        let thread = thread::Builder::new()
            .name("usbip connection".to_owned())
            .spawn(move || {
                // What a client does wrong ends its connection, and is nobody else's business.
                let _ = shared.converse(&served);
                let _ = served.shutdown(Shutdown::Both);
            })?;
        connections.push(Connection { stream, thread });
        Ok(())
    }

    fn hang_up(&self) {
        let connections: Vec<_> = self
            .connections
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .drain(..)
            .collect();
        for connection in &connections {
            // It may have ended already.
            let _ = connection.stream.shutdown(Shutdown::Both);
        }
        for connection in connections {
            let _ = connection.thread.join();
        }
    }

    fn converse(&self, mut stream: &TcpStream) -> Result<(), SessionError> {
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(self.first_phase_max))?;
        stream.set_write_timeout(Some(self.first_phase_max))?;
        sys::keep_alive(stream)?;
        let mut header = [0; OP_BYTES];
        stream.read_exact(&mut header)?;
        match Request::parse(&header)? {
            Request::DeviceList => {
                let devices: Vec<_> = self
                    .exports
                    .iter()
                    .map(|export| export.described.clone())
                    .collect();
                Ok(stream.write_all(&wire::device_list(&devices))?)
            }
            Request::Import => {
                let mut name = [0; BUS_ID_BYTES];
                stream.read_exact(&mut name)?;
                match self.take(&wire::unpadded(&name)) {
                    Ok(taken) => {
                        stream.write_all(&wire::imported(Ok(&taken.0.described)))?;
                        stream.set_read_timeout(None)?;
                        let mut device =
                            Device::new(taken.0.adapter.clone(), taken.0.described.clone());
                        session::serve(&mut stream, &mut device)
                    }
                    Err(refusal) => Ok(stream.write_all(&wire::imported(Err(refusal)))?),
                }
            }
        }
    }

    fn take(&self, bus_id: &str) -> Result<Taken<'_>, Refusal> {
        let export = self
            .exports
            .iter()
            .find(|export| export.described.bus_id == bus_id)
            .ok_or(Refusal::NoSuchDevice)?;
        if export.taken.swap(true, Ordering::SeqCst) {
            return Err(Refusal::Busy);
        }
        Ok(Taken(export))
    }
}

/// An adapter that has a user. It is free again when this is dropped.
struct Taken<'a>(&'a Export);

impl Drop for Taken<'_> {
    fn drop(&mut self) {
        self.0.taken.store(false, Ordering::SeqCst);
    }
}

fn accept(listener: &TcpListener, shared: &Arc<Shared>) {
    while !shared.stopping.load(Ordering::SeqCst) {
        let accepted = listener.accept();
        if shared.stopping.load(Ordering::SeqCst) {
            return;
        }
        let outcome = accepted.and_then(|(stream, _from)| shared.take_on(stream));
        if outcome.is_err() {
            thread::sleep(ACCEPT_AGAIN);
        }
    }
}
