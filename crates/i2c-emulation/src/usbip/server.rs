//! USB/IP over TCP: another machine or guest attaches the adapters with `usbip attach`.

use super::device::Device;
use super::error::{UsbipError, check_number};
use super::session::{self, SessionError};
use super::wire::{self, BUS_ID_BYTES, Identity, OP_BYTES, Request};
use crate::guests::Guests;
use crate::rack::{Rack, SharedAdapter};
use rustix::net::sockopt::{
    set_socket_keepalive, set_tcp_keepcnt, set_tcp_keepidle, set_tcp_keepintvl,
};
use rustix::net::{Shutdown, shutdown};
use std::fmt;
use std::io::{self, Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// The most connections at once; one more is closed immediately.
pub const CONNECTIONS_MAX: usize = 32;
/// The longest wait for a client's request, and for it to take an answer.
pub const FIRST_PHASE_MAX: Duration = Duration::from_secs(5);

/// The pause after the kernel could not accept a connection, for example for lack of descriptors.
const ACCEPT_AGAIN: Duration = Duration::from_millis(50);
/// The interval and number of keep-alive probes to a silent client.
const ASK_EVERY: Duration = Duration::from_secs(5);
const ASK_MAX: u32 = 3;

/// The adapters of a rack, each for one user at a time, offered over TCP until this is dropped. There is no password:
/// use loopback only, which QEMU guests reach as 10.0.2.2.
pub struct Server {
    address: SocketAddr,
    listener: Arc<TcpListener>,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl fmt::Debug for Server {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "Server({})", self.address)
    }
}

impl Server {
    /// Listens, and serves each connection in its own thread.
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
        check_number(rack.iter().count())?;
        let cannot = |source: io::Error| match source.kind() {
            io::ErrorKind::AddrInUse => UsbipError::AddressInUse(address),
            _ => UsbipError::CannotListen(address, source),
        };
        let listener = Arc::new(TcpListener::bind(address).map_err(cannot)?);
        let address = listener.local_addr().map_err(cannot)?;
        let export = |(index, (bus, adapter))| Export {
            bus,
            identity: Identity::new(bus, index),
            adapter,
            taken: AtomicBool::new(false),
        };
        let shared = Arc::new(Shared {
            exports: rack.iter().enumerate().map(export).collect(),
            first_phase_max,
            guests: Guests::new(),
        });
        let (accepting, for_thread) = (Arc::clone(&listener), Arc::clone(&shared));
        let thread = thread::Builder::new()
            .name("usbip accept".to_owned())
            .spawn(move || accept(&accepting, &for_thread))
            .map_err(|source| UsbipError::Resources("start a thread", source))?;
        Ok(Self {
            address,
            listener,
            shared,
            thread: Some(thread),
        })
    }

    /// The address it listens on, with the port the kernel chose if 0 was requested.
    #[must_use]
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// Each adapter's number in the rack and its name for `usbip attach -b`.
    pub fn bus_ids(&self) -> impl Iterator<Item = (u32, &str)> {
        self.shared
            .exports
            .iter()
            .map(|export| (export.bus, export.identity.bus_id.as_str()))
    }

    /// Stops listening and ends all connections, which unplugs the clients' adapters. Dropping does the same.
    pub fn stop(self) {
        drop(self);
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.shared.guests.stop(Shutdown::Both);
        // Shutting down a listening socket wakes the thread in accept().
        let _ = shutdown(&self.listener, Shutdown::Both);
        if let Some(thread) = self.thread.take() {
            // The thread returns no value, and a panic was already reported.
            let _ = thread.join();
        }
        self.shared.guests.wait(Duration::MAX);
    }
}

struct Export {
    bus: u32,
    identity: Identity,
    adapter: SharedAdapter,
    taken: AtomicBool,
}

struct Shared {
    exports: Vec<Export>,
    first_phase_max: Duration,
    guests: Arc<Guests<TcpStream>>,
}

impl Shared {
    /// Serves a connection in its own thread. With too many connections, drops it instead, which closes it.
    fn take_on(self: &Arc<Self>, stream: TcpStream) -> io::Result<()> {
        let stream = Arc::new(stream);
        let Ok(guest) = self.guests.admit(&stream, CONNECTIONS_MAX) else {
            return Ok(());
        };
        let shared = Arc::clone(self);
        let serve = move || {
            let _guest = guest;
            // A client's error ends only its own connection.
            let _ = shared.converse(&stream);
        };
        let thread = thread::Builder::new().name("usbip connection".to_owned());
        thread.spawn(serve).map(drop)
    }

    fn converse(&self, mut stream: &TcpStream) -> Result<(), SessionError> {
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(self.first_phase_max))?;
        stream.set_write_timeout(Some(self.first_phase_max))?;
        keep_alive(stream)?;
        let mut header = [0; OP_BYTES];
        stream.read_exact(&mut header)?;
        match Request::parse(&header)? {
            Request::DeviceList => {
                let devices = self.exports.iter().map(|export| &export.identity);
                Ok(stream.write_all(&wire::device_list(devices))?)
            }
            Request::Import => {
                let mut name = [0; BUS_ID_BYTES];
                stream.read_exact(&mut name)?;
                let taken = match self.take(&wire::unpadded(&name)) {
                    Ok(taken) => taken,
                    Err(status) => return Ok(stream.write_all(&wire::imported(Err(status)))?),
                };
                let export = taken.0;
                stream.write_all(&wire::imported(Ok(&export.identity)))?;
                stream.set_read_timeout(None)?;
                let mut device = Device::new(export.adapter.clone(), export.identity.clone());
                session::serve(stream, stream, &mut device)
            }
        }
    }

    /// Takes the adapter with this name, or returns the status to reply.
    fn take(&self, bus_id: &str) -> Result<Taken<'_>, u32> {
        let mut exports = self.exports.iter();
        let export = exports
            .find(|export| export.identity.bus_id == bus_id)
            .ok_or(wire::NO_SUCH_DEVICE)?;
        if export.taken.swap(true, Ordering::SeqCst) {
            return Err(wire::BUSY);
        }
        Ok(Taken(export))
    }
}

/// Makes the kernel end a connection with a vanished peer after twenty seconds.
fn keep_alive(stream: &TcpStream) -> io::Result<()> {
    set_socket_keepalive(stream, true)?;
    set_tcp_keepidle(stream, ASK_EVERY)?;
    set_tcp_keepintvl(stream, ASK_EVERY)?;
    Ok(set_tcp_keepcnt(stream, ASK_MAX)?)
}

/// An adapter in use; free again on drop.
struct Taken<'a>(&'a Export);

impl Drop for Taken<'_> {
    fn drop(&mut self) {
        self.0.taken.store(false, Ordering::SeqCst);
    }
}

fn accept(listener: &TcpListener, shared: &Arc<Shared>) {
    loop {
        let accepted = listener.accept();
        if shared.guests.is_stopping() {
            return;
        }
        let outcome = accepted.and_then(|(stream, _from)| shared.take_on(stream));
        if outcome.is_err() {
            thread::sleep(ACCEPT_AGAIN);
        }
    }
}
