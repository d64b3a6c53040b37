//! One connection to the broker. Nothing is queued: a write that exceeds its time limit ends the connection.

use crate::broker::{Broker, SettingNames};
use crate::fault::Fault;
use crate::packet::{self, Heard, Hello, Message};
use std::io;
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncReadExt as _, AsyncWrite, AsyncWriteExt as _};
use tokio::net::TcpStream;
use tokio::time::timeout;
use tokio_rustls::TlsConnector;

/// Time from opening the connection to the broker's acceptance.
pub(crate) const CONNECT_TIME_MAX: Duration = Duration::from_secs(10);
/// Maximum time for writing one packet.
pub(crate) const WRITE_TIME_MAX: Duration = Duration::from_secs(10);
/// The broker drops this client and publishes its last will after 1.5 times this (mqtt-v3.1.1, §3.1.2.10).
const KEEP_ALIVE_S: u16 = 30;
const READ_BYTES: usize = 4096;

pub(crate) struct Connection {
    stream: Box<dyn Stream>,
    inbox: Vec<u8>,
    names: SettingNames,
}

trait Stream: AsyncRead + AsyncWrite + Unpin + Send {}
impl<S: AsyncRead + AsyncWrite + Unpin + Send> Stream for S {}

impl Connection {
    /// Connects; any other connection with this client id ends. The broker publishes the will if the connection is
    /// lost.
    pub(crate) async fn open(
        broker: &Broker,
        client_id: &str,
        will: Option<&Message>,
    ) -> Result<Self, Fault> {
        let connecting = Self::connect(broker, client_id, will);
        let connected = timeout(CONNECT_TIME_MAX, connecting).await;
        connected.unwrap_or_else(|_elapsed| Err(Fault::silent(CONNECT_TIME_MAX)))
    }

    async fn connect(
        broker: &Broker,
        client_id: &str,
        will: Option<&Message>,
    ) -> Result<Self, Fault> {
        let mut connection = Self {
            stream: stream(broker).await?,
            inbox: Vec::new(),
            names: broker.names,
        };
        let password = broker.password.as_ref();
        let hello = packet::connect(&Hello {
            client_id,
            user: broker.user.as_deref(),
            password: password.map(|password| password.0.as_slice()),
            will,
            keep_alive_s: KEEP_ALIVE_S,
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

    pub(crate) async fn subscribe(&mut self, filters: &[String]) -> Result<(), Fault> {
        self.write(&packet::subscribe(filters)).await
    }

    pub(crate) async fn ping(&mut self) -> Result<(), Fault> {
        self.write(&packet::PING).await
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
            let taken = packet::take(&mut self.inbox);
            if let Some(heard) = taken.map_err(|garbled| Fault::garbled(&garbled))? {
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
