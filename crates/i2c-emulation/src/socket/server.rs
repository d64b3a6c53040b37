//! The server: one thread that accepts, and one for each client.

use std::collections::BTreeMap;
use std::fmt;
use std::io::{self, Write};
use std::net::Shutdown;
use std::os::fd::OwnedFd;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use super::error::SocketError;
use super::inbox::{Inbox, NoPacket, Patience};
use super::place::{self, Place};
use super::session::{Next, Session};
use super::wire::{ByeReason, PACKET_BYTES_MAX, append_bye};
use crate::ioctl::AdapterMode;
use crate::rack::Rack;

/// Most clients at once; one more is told so and turned away.
pub const CLIENTS_MAX: usize = 32;
/// How long a client may take from the first byte of a packet to its last, for its hello, and to take an answer.
pub const PACKET_WAIT_MAX: Duration = Duration::from_secs(5);
/// How long a client may be silent between two packets.
pub const IDLE_WAIT_MAX: Duration = Duration::from_secs(24 * 60 * 60);
/// How long a server that was stopped waits for transfers that are under way.
pub const STOP_WAIT_MAX: Duration = Duration::from_secs(2);

/// A pause after the system could not accept a client, for want of descriptors for instance.
const PAUSE_AFTER_FAILURE: Duration = Duration::from_millis(100);
/// An answer of the usual size; a larger buffer is given back after use.
const ANSWER_BYTES_KEPT: usize = 16 * 1024;
/// Bytes written at once: a client that takes them slowly is looked at after each such part.
const WRITE_BYTES: usize = 16 * 1024;
const STOPPING: &str = "the server is stopping";

/// How the server behaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Which adapter to be like for those who ask for the adapter and not for the bare bus.
    pub mode: AdapterMode,
    /// Most clients at once, at first [`CLIENTS_MAX`].
    pub clients_max: usize,
    /// See [`PACKET_WAIT_MAX`], its value at first.
    pub packet_wait_max: Duration,
    /// See [`IDLE_WAIT_MAX`], its value at first.
    pub idle_wait_max: Duration,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            mode: AdapterMode::default(),
            clients_max: CLIENTS_MAX,
            packet_wait_max: PACKET_WAIT_MAX,
            idle_wait_max: IDLE_WAIT_MAX,
        }
    }
}

/// The buses of one emulated machine on a Unix socket.
///
/// The socket's file is there, with mode 0600, from [`bind`](Self::bind) until the server is dropped or
/// [`serve`](Self::serve) returns. After SIGKILL it stays, and the next server takes it over.
pub struct Server {
    // Dropped first: a file whose server no longer listens would be another's to take.
    place: Place,
    listener: UnixListener,
    rack: Rack,
    options: Options,
    shared: Arc<Shared>,
}

impl Server {
    /// Listens at `path`. Clients can connect as soon as this has returned: it is the moment to say that the server is ready.
    ///
    /// # Errors
    /// Where another server answers, where something else than a socket is there, where the folder is missing or not
    /// for this user, where the path is longer than [`PATH_BYTES_MAX`](super::PATH_BYTES_MAX), and where there is no bus.
    pub fn bind(path: impl AsRef<Path>, rack: Rack, options: Options) -> Result<Self, SocketError> {
        let path = path.as_ref();
        if rack.iter().next().is_none() {
            return Err(SocketError::NoBus);
        }
        let (listener, place) = place::listen(path)?;
        let fail = |source| SocketError::Failed {
            path: path.to_owned(),
            source,
        };
        let waker = UnixStream::from(OwnedFd::from(listener.try_clone().map_err(fail)?));
        Ok(Self {
            listener,
            place,
            rack,
            options,
            shared: Arc::new(Shared {
                waker,
                clients: Mutex::default(),
                one_less: Condvar::new(),
            }),
        })
    }

    /// Where it listens.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.place.path()
    }

    /// One line for scripts and people: the path, the buses, the adapter's mode.
    #[must_use]
    pub fn ready_line(&self) -> String {
        let numbers: Vec<String> = self
            .rack
            .iter()
            .map(|(number, _)| number.to_string())
            .collect();
        let noun = if numbers.len() == 1 { "bus" } else { "buses" };
        format!(
            "listening on {} ({noun} {}, adapter mode {})",
            self.path().display(),
            numbers.join(", "),
            self.options.mode
        )
    }

    /// Ends [`serve`](Self::serve) from another thread.
    #[must_use]
    pub fn stop_handle(&self) -> StopHandle {
        StopHandle(Arc::clone(&self.shared))
    }

    /// Serves clients until it is stopped; then removes the socket's file.
    ///
    /// Returns at most [`STOP_WAIT_MAX`] after the stop, also while a bus is held up in a transfer.
    pub fn serve(self) {
        loop {
            let accepted = self.listener.accept();
            if self.shared.lock().stopping {
                break;
            }
            match accepted {
                Ok((stream, _)) => self.admit(stream),
                // The next accept() may find what this one lacked.
                Err(_) => thread::sleep(PAUSE_AFTER_FAILURE),
            }
        }
        drop(self.place);
        self.shared.wait_for_clients();
    }

    fn admit(&self, stream: UnixStream) {
        let stream = Arc::new(stream);
        let guest = match self
            .shared
            .admit(Arc::clone(&stream), self.options.clients_max)
        {
            Ok(guest) => guest,
            Err((reason, text)) => return say_bye(&stream, reason, &text),
        };
        let connection = Connection {
            stream,
            session: Session::new(self.rack.clone(), self.options.mode),
            options: self.options,
            guest,
        };
        // Without a thread the connection is dropped: the client sees its end.
        let _ = thread::Builder::new()
            .name("i2c socket client".to_owned())
            .spawn(move || connection.serve());
    }
}

impl fmt::Debug for Server {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_tuple("Server")
            .field(&self.ready_line())
            .finish()
    }
}

/// Stops a [`Server`]. It takes a lock: call it from a thread, not from a signal handler.
#[derive(Clone)]
pub struct StopHandle(Arc<Shared>);

impl StopHandle {
    /// Ends [`Server::serve`]. Transfers under way are carried out; each client is told and loses its connection.
    /// To stop twice, or before the server serves, is no error.
    pub fn stop(&self) {
        let mut clients = self.0.lock();
        clients.stopping = true;
        for stream in clients.streams.values() {
            // One that is not connected any more needs no end.
            let _ = stream.shutdown(Shutdown::Read);
        }
        drop(clients);
        // A listening socket that is shut down wakes the thread in accept() and takes no more clients.
        let _ = self.0.waker.shutdown(Shutdown::Both);
    }
}

impl fmt::Debug for StopHandle {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("StopHandle").finish_non_exhaustive()
    }
}

/// What the accepting thread, the clients' threads and the stop handles share.
#[derive(Debug)]
struct Shared {
    waker: UnixStream,
    clients: Mutex<Clients>,
    one_less: Condvar,
}

#[derive(Debug, Default)]
struct Clients {
    streams: BTreeMap<u64, Arc<UnixStream>>,
    next: u64,
    stopping: bool,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Clients> {
        self.clients.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn admit(
        self: &Arc<Self>,
        stream: Arc<UnixStream>,
        clients_max: usize,
    ) -> Result<Guest, (ByeReason, String)> {
        let mut clients = self.lock();
        if clients.stopping {
            return Err((ByeReason::Stopping, STOPPING.to_owned()));
        }
        if clients.streams.len() >= clients_max {
            let text = format!("{clients_max} clients are connected, and no more are taken");
            return Err((ByeReason::TooManyClients, text));
        }
        let number = clients.next;
        clients.next += 1;
        clients.streams.insert(number, stream);
        Ok(Guest {
            shared: Arc::clone(self),
            number,
        })
    }

    fn wait_for_clients(&self) {
        let clients = self.lock();
        // Whether all have gone or the time is up makes no difference to what follows.
        let _ = self
            .one_less
            .wait_timeout_while(clients, STOP_WAIT_MAX, |clients| {
                !clients.streams.is_empty()
            });
    }
}

/// One client's place among the clients, free again when this is dropped, also by a panic of the bus.
struct Guest {
    shared: Arc<Shared>,
    number: u64,
}

impl Drop for Guest {
    fn drop(&mut self) {
        self.shared.lock().streams.remove(&self.number);
        self.shared.one_less.notify_all();
    }
}

/// One client's thread.
struct Connection {
    stream: Arc<UnixStream>,
    session: Session,
    options: Options,
    guest: Guest,
}

impl Connection {
    fn serve(mut self) {
        let packet_wait = self.options.packet_wait_max;
        if self.stream.set_write_timeout(Some(packet_wait)).is_err() {
            return;
        }
        let mut inbox = Inbox::new();
        // Until its hello a client is a stranger, who may not wait.
        let mut patience = Patience {
            first: packet_wait,
            rest: packet_wait,
        };
        let mut answer = Vec::new();
        loop {
            let packet = match inbox.receive(&self.stream, patience) {
                Ok(packet) => packet,
                Err(end) => return self.part(&end, patience),
            };
            let next = self.session.answer(packet, &mut answer);
            if write_within(&self.stream, &answer, packet_wait).is_err() || next == Next::Close {
                return;
            }
            answer.clear();
            answer.shrink_to(ANSWER_BYTES_KEPT);
            patience.first = self.options.idle_wait_max;
        }
    }

    /// Tells the client why the connection ends, if it is still there to be told.
    fn part(&self, end: &NoPacket, patience: Patience) {
        let stopping = self.guest.shared.lock().stopping;
        let (reason, text) = match end {
            _ if stopping => (ByeReason::Stopping, STOPPING.to_owned()),
            NoPacket::Idle => (
                ByeReason::Idle,
                format!("nothing came for {:?}", patience.first),
            ),
            NoPacket::Slow => (
                ByeReason::Malformed,
                format!("a packet was not complete after {:?}", patience.rest),
            ),
            NoPacket::TooLong(bytes) => (
                ByeReason::Malformed,
                format!("a packet of {bytes} bytes, at most {PACKET_BYTES_MAX} are taken"),
            ),
            NoPacket::CutShort => (
                ByeReason::Malformed,
                "the stream ends within a packet".to_owned(),
            ),
            NoPacket::Closed | NoPacket::Broken(_) => return,
        };
        say_bye(&self.stream, reason, &text);
    }
}

fn say_bye(mut stream: &UnixStream, reason: ByeReason, text: &str) {
    let mut packet = Vec::new();
    append_bye(&mut packet, reason, text);
    // A client that takes no answers may not hold the server up: what does not fit at once is not sent.
    if stream.set_nonblocking(true).is_ok() {
        let _ = stream.write(&packet);
    }
}

/// Writes all, in at most `wait` as a whole: a client that takes a byte now and then gets no longer than one that takes none.
fn write_within(mut stream: &UnixStream, bytes: &[u8], wait: Duration) -> io::Result<()> {
    let begin = Instant::now();
    let mut rest = bytes;
    while !rest.is_empty() {
        // The kernel's time limit starts over with each part that finds room.
        let part = rest.get(..WRITE_BYTES).unwrap_or(rest);
        match stream.write(part) {
            Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
            Ok(written) => rest = rest.get(written..).unwrap_or_default(),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
        if !rest.is_empty() && begin.elapsed() > wait {
            return Err(io::ErrorKind::TimedOut.into());
        }
    }
    Ok(())
}
