//! One connection to the broker. Nothing is queued: a write that exceeds its time limit ends the connection.

use crate::broker::{Broker, SettingNames};
use crate::fault::Fault;
use crate::packet::{self, Heard, Hello, Message};
use std::io;
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncReadExt as _, AsyncWrite, AsyncWriteExt as _};
use tokio::net::TcpStream;
use tokio::time::{Instant, sleep, timeout};
use tokio_rustls::TlsConnector;

/// Time from opening the connection to the broker's acceptance.
pub(crate) const CONNECT_TIME_MAX: Duration = Duration::from_secs(10);
/// Maximum time for writing one packet.
pub(crate) const WRITE_TIME_MAX: Duration = Duration::from_secs(10);
/// The broker drops this client and publishes its last will after 1.5 times this (mqtt-v3.1.1, §3.1.2.10).
const KEEP_ALIVE_S: u16 = 30;
/// How often the broker is pinged, and how long it may take to answer.
const PING_EVERY: Duration = Duration::from_secs(10);
const PONG_TIME_MAX: Duration = Duration::from_secs(20);
const READ_BYTES: usize = 4096;

pub(crate) struct Connection {
    stream: Box<dyn Stream>,
    inbox: Vec<u8>,
    /// Bytes of a message that is too long, still to come.
    skipped: usize,
    bytes_max: usize,
    names: SettingNames,
    pinged_at: Instant,
    unanswered_since: Option<Instant>,
}

/// Who connects.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Client<'a> {
    /// Any other connection with this identifier ends.
    pub(crate) id: &'a str,
    /// The broker publishes it if the connection is lost.
    pub(crate) will: Option<&'a Message>,
    /// The broker keeps messages of quality of service 1 while this client is away.
    pub(crate) is_kept: bool,
    /// Maximum bytes of a message that it takes.
    pub(crate) bytes_max: usize,
}

/// Pauses between connections: doubled from the first to the last, and after a connection that lasted, the first again.
pub(crate) struct Pauses {
    next: Duration,
    began: Instant,
}

const PAUSE_FIRST: Duration = Duration::from_secs(1);
const PAUSE_LAST: Duration = Duration::from_secs(30);
const STEADY: Duration = Duration::from_secs(10);

impl Default for Pauses {
    fn default() -> Self {
        let (next, began) = (PAUSE_FIRST, Instant::now());
        Self { next, began }
    }
}

impl Pauses {
    pub(crate) async fn pause(&mut self) {
        if self.began.elapsed() >= STEADY + CONNECT_TIME_MAX {
            self.next = PAUSE_FIRST;
        }
        sleep(self.next).await;
        self.next = (2 * self.next).min(PAUSE_LAST);
        self.began = Instant::now();
    }
}

trait Stream: AsyncRead + AsyncWrite + Unpin + Send {}
impl<S: AsyncRead + AsyncWrite + Unpin + Send> Stream for S {}

impl Connection {
    pub(crate) async fn open(broker: &Broker, client: Client<'_>) -> Result<Self, Fault> {
        let connecting = Self::connect(broker, client);
        let connected = timeout(CONNECT_TIME_MAX, connecting).await;
        connected.unwrap_or_else(|_elapsed| Err(Fault::silent(CONNECT_TIME_MAX)))
    }

    async fn connect(broker: &Broker, client: Client<'_>) -> Result<Self, Fault> {
        let mut connection = Self {
            stream: stream(broker).await?,
            inbox: Vec::new(),
            skipped: 0,
            bytes_max: client.bytes_max,
            names: broker.names,
            pinged_at: Instant::now(),
            unanswered_since: None,
        };
        let password = broker.password.as_ref();
        let hello = packet::connect(&Hello {
            client_id: client.id,
            user: broker.user.as_deref(),
            password: password.map(|password| password.0.as_slice()),
            will: client.will,
            keep_alive_s: KEEP_ALIVE_S,
            is_kept: client.is_kept,
        });
        connection.write(&hello).await?;
        match connection.hear().await? {
            Heard::Connected(0) => Ok(connection),
            Heard::Connected(code) => Err(Fault::refused(code, password.is_some(), broker.names)),
            _ => Err(Fault::garbled(&"another packet than the answer to CONNECT")),
        }
    }

    pub(crate) async fn publish(&mut self, message: &Message) -> Result<(), Fault> {
        self.write(&packet::publish(message)).await
    }

    pub(crate) async fn subscribe(&mut self, filters: &[String], quality: u8) -> Result<(), Fault> {
        self.write(&packet::subscribe(filters, quality)).await
    }

    pub(crate) async fn acknowledge(&mut self, id: u16) -> Result<(), Fault> {
        self.write(&packet::acknowledge(id)).await
    }

    pub(crate) async fn ping(&mut self) -> Result<(), Fault> {
        self.pinged_at = Instant::now();
        self.unanswered_since.get_or_insert(self.pinged_at);
        self.write(&packet::PING).await
    }

    /// Pings when it is time, and ends a connection whose broker no longer answers.
    pub(crate) async fn keep_alive(&mut self) -> Result<(), Fault> {
        let unanswered_since = self.unanswered_since;
        if unanswered_since.is_some_and(|since| since.elapsed() > PONG_TIME_MAX) {
            return Err(Fault::silent(PONG_TIME_MAX));
        }
        if self.pinged_at.elapsed() >= PING_EVERY {
            self.ping().await?;
        }
        Ok(())
    }

    /// Closes the connection without publishing the last will.
    pub(crate) async fn close(mut self) -> Result<(), Fault> {
        self.write(&packet::DISCONNECT).await?;
        let ended = self.stream.shutdown().await;
        ended.map_err(|reason| Fault::broken(&reason, self.names))
    }

    /// The next packet. Safe to cancel: bytes of an incomplete packet are kept.
    pub(crate) async fn hear(&mut self) -> Result<Heard, Fault> {
        loop {
            if let Some(heard) = self.arrived()? {
                return Ok(heard);
            }
            let mut bytes = [0; READ_BYTES];
            let read = self.stream.read(&mut bytes).await;
            match read.map_err(|reason| Fault::broken(&reason, self.names))? {
                0 => return Err(Fault::closed(self.names)),
                count => self.inbox.extend(&bytes[..count]),
            }
        }
    }

    /// The next packet that has arrived whole.
    pub(crate) fn arrived(&mut self) -> Result<Option<Heard>, Fault> {
        let skipped = self.skipped.min(self.inbox.len());
        self.inbox.drain(..skipped);
        self.skipped -= skipped;
        let taken = packet::take(&mut self.inbox, self.bytes_max);
        let taken = taken.map_err(|garbled| Fault::garbled(&garbled))?;
        match &taken {
            Some(Heard::Pong) => self.unanswered_since = None,
            Some(Heard::TooLong(_topic, bytes, _id)) => self.skipped = *bytes,
            _ => {}
        }
        Ok(taken)
    }

    async fn write(&mut self, bytes: &[u8]) -> Result<(), Fault> {
        let written = async {
            self.stream.write_all(bytes).await?;
            self.stream.flush().await
        };
        let written = timeout(WRITE_TIME_MAX, written).await;
        let written = written.map_err(|_elapsed| Fault::silent(WRITE_TIME_MAX))?;
        written.map_err(|reason| Fault::broken(&reason, self.names))
    }
}

async fn stream(broker: &Broker) -> Result<Box<dyn Stream>, Fault> {
    let plain = TcpStream::connect((broker.host.as_str(), broker.port)).await;
    let plain = plain.map_err(|reason| Fault::unreachable(&reason))?;
    // Small packets go out at once. On a dead socket this may fail, which the next read will notice.
    let _ = plain.set_nodelay(true);
    let Some(encryption) = &broker.encryption else {
        return Ok(Box::new(plain));
    };
    let connector = TlsConnector::from(encryption.config.clone());
    let encrypted = connector.connect(encryption.name.clone(), plain).await;
    let trusted = |reason: io::Error| Fault::encryption(&reason, broker.names);
    Ok(Box::new(encrypted.map_err(trusted)?))
}
