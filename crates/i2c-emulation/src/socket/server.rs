//! The server: one accepting thread, and one thread per client.

use super::error::SocketError;
use super::inbox::{Inbox, NoPacket, Patience};
use super::place::{self, Place};
use super::session::{Next, Session};
use super::wire::{ByeReason, PACKET_BYTES_MAX, append_bye};
use crate::guests::{Guest, Guests, TurnedAway};
use crate::ioctl::AdapterMode;
use crate::rack::Rack;
use rustix::net::{Shutdown, shutdown};
use std::fmt;
use std::io::{self, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

/// The most clients at once; the server turns one more away with a message.
pub const CLIENTS_MAX: usize = 32;
/// The longest time for a packet from first byte to last, for a client's hello, and for a client to take an answer.
pub const PACKET_WAIT_MAX: Duration = Duration::from_secs(5);
/// The longest silence between two packets of a client.
pub const IDLE_WAIT_MAX: Duration = Duration::from_secs(24 * 60 * 60);
/// How long a stopped server waits for transfers in progress.
pub const STOP_WAIT_MAX: Duration = Duration::from_secs(2);

/// The pause after the system could not accept a client, for example for lack of descriptors.
const PAUSE_AFTER_FAILURE: Duration = Duration::from_millis(100);
/// The size of a usual answer; larger buffers are freed after use.
const ANSWER_BYTES_KEPT: usize = 16 * 1024;
/// Bytes written at once; the time limit is checked after each part.
const WRITE_BYTES: usize = 16 * 1024;
const STOPPING: &str = "the server is stopping";

/// How the server behaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// The adapter to imitate for clients that ask for the adapter instead of the bare bus.
    pub mode: AdapterMode,
    /// The most clients at once. Default [`CLIENTS_MAX`].
    pub clients_max: usize,
    /// See [`PACKET_WAIT_MAX`], the default.
    pub packet_wait_max: Duration,
    /// See [`IDLE_WAIT_MAX`], the default.
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

/// The buses of one emulated machine on a Unix socket. The socket's file exists until the server is dropped or
/// [`serve`](Self::serve) returns. After SIGKILL it stays, and the next server takes it over.
pub struct Server {
    // Dropped first: another server could take over the file of a server that no longer listens.
    place: Place,
    listener: Arc<UnixListener>,
    rack: Rack,
    options: Options,
    guests: Arc<Guests<UnixStream>>,
}

impl Server {
    /// Listens at `path`. Clients can connect once this returns.
    /// # Errors
    /// There is no bus, or the path is in use, too long, in a missing folder or not permitted.
    pub fn bind(path: impl AsRef<Path>, rack: Rack, options: Options) -> Result<Self, SocketError> {
        let path = path.as_ref();
        if rack.iter().next().is_none() {
            return Err(SocketError::NoBus);
        }
        let (listener, place) = place::listen(path)?;
        Ok(Self {
            listener: Arc::new(listener),
            place,
            rack,
            options,
            guests: Guests::new(),
        })
    }

    /// The socket's path.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.place.path
    }

    /// One line for scripts and people: the path, the buses, the adapter mode.
    #[must_use]
    pub fn ready_line(&self) -> String {
        let buses = self.rack.iter();
        let numbers: Vec<String> = buses.map(|(number, _)| number.to_string()).collect();
        let noun = if numbers.len() == 1 { "bus" } else { "buses" };
        format!(
            "listening on {} ({noun} {}, adapter mode {})",
            self.path().display(),
            numbers.join(", "),
            self.options.mode
        )
    }

    /// A handle that ends [`serve`](Self::serve) from another thread.
    #[must_use]
    pub fn stop_handle(&self) -> StopHandle {
        StopHandle(Arc::clone(&self.guests), Arc::clone(&self.listener))
    }

    /// Serves clients until stopped and at most [`STOP_WAIT_MAX`] longer, then returns. Removes the socket's file
    /// first.
    pub fn serve(self) {
        loop {
            let accepted = self.listener.accept();
            if self.guests.is_stopping() {
                break;
            }
            match accepted {
                Ok((stream, _)) => self.admit(stream),
                // The resource that was missing may be there for the next accept().
                Err(_) => thread::sleep(PAUSE_AFTER_FAILURE),
            }
        }
        drop(self.place);
        self.guests.wait(STOP_WAIT_MAX);
    }

    fn admit(&self, stream: UnixStream) {
        let stream = Arc::new(stream);
        let most = self.options.clients_max;
        let guest = match self.guests.admit(&stream, most) {
            Ok(guest) => guest,
            Err(TurnedAway::Stopping) => return say_bye(&stream, ByeReason::Stopping, STOPPING),
            Err(TurnedAway::Full) => {
                let text = format!("{most} clients are connected, the limit");
                return say_bye(&stream, ByeReason::TooManyClients, &text);
            }
        };
        let connection = Connection {
            stream,
            session: Session::new(self.rack.clone(), self.options.mode),
            options: self.options,
            guests: Arc::clone(&self.guests),
            _guest: guest,
        };
        // If no thread starts, the connection is dropped, and the client sees its end.
        let _ = thread::Builder::new()
            .name("i2c socket client".to_owned())
            .spawn(move || connection.serve());
    }
}

impl fmt::Debug for Server {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "Server({:?})", self.ready_line())
    }
}

/// Stops a [`Server`]. Takes a lock: call it from a thread, not from a signal handler.
#[derive(Clone, Debug)]
pub struct StopHandle(Arc<Guests<UnixStream>>, Arc<UnixListener>);

impl StopHandle {
    /// Ends [`Server::serve`], even before it starts. Transfers in progress finish; each client gets a message.
    pub fn stop(&self) {
        self.0.stop(Shutdown::Read);
        // Shutting down a listening socket wakes the thread in accept() and accepts no more clients.
        let _ = shutdown(&self.1, Shutdown::Both);
    }
}

struct Connection {
    stream: Arc<UnixStream>,
    session: Session,
    options: Options,
    guests: Arc<Guests<UnixStream>>,
    _guest: Guest<UnixStream>,
}

impl Connection {
    fn serve(mut self) {
        let packet_wait = self.options.packet_wait_max;
        if self.stream.set_write_timeout(Some(packet_wait)).is_err() {
            return;
        }
        let mut inbox = Inbox::new();
        // Before its hello, a client is unknown and may not idle.
        let (first, rest) = (packet_wait, packet_wait);
        let mut patience = Patience { first, rest };
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

    /// Tells the client why the connection ends, if it is still there.
    fn part(&self, end: &NoPacket, patience: Patience) {
        let stopping = self.guests.is_stopping();
        let Patience { first, rest } = patience;
        let text = match end {
            _ if stopping => STOPPING.to_owned(),
            NoPacket::Idle => format!("nothing came for {first:?}"),
            NoPacket::Slow => format!("a packet was not complete after {rest:?}"),
            NoPacket::TooLong(bytes) => {
                format!("a packet of {bytes} bytes, at most {PACKET_BYTES_MAX} are taken")
            }
            NoPacket::CutShort => "the stream ends within a packet".to_owned(),
            NoPacket::Closed | NoPacket::Broken => return,
        };
        let reason = match end {
            _ if stopping => ByeReason::Stopping,
            NoPacket::Idle => ByeReason::Idle,
            _ => ByeReason::Malformed,
        };
        say_bye(&self.stream, reason, &text);
    }
}

fn say_bye(mut stream: &UnixStream, reason: ByeReason, text: &str) {
    let mut packet = Vec::new();
    append_bye(&mut packet, reason, text);
    // A client that reads no answers must not delay the server: whatever does not fit at once is not sent.
    if stream.set_nonblocking(true).is_ok() {
        let _ = stream.write(&packet);
    }
}

/// Writes everything within `wait` in total: a client that takes a byte now and then gets no more time than one that
/// takes none.
fn write_within(mut stream: &UnixStream, bytes: &[u8], wait: Duration) -> io::Result<()> {
    let begin = Instant::now();
    let mut rest = bytes;
    while !rest.is_empty() {
        // The kernel's time limit restarts with each part that finds room.
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
