//! The client for Rust programs.

mod connection;
mod error;

use embedded_hal::i2c::{ErrorType, I2c, Operation, SevenBitAddress};
use std::path::{Path, PathBuf};
use std::time::Duration;

pub use error::ClientError;

use crate::adapter::{BusFault, EmulatedAdapter, Message, TransferError};
use crate::ioctl::{MESSAGE_BYTES_MAX, RDWR_MESSAGES_MAX, Segment};
use connection::{AdapterFacts, Connection, take_answer};

/// How a client behaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClientOptions {
    /// The longest wait for the server, to connect and for each answer. Default 10 s.
    pub wait_max: Duration,
    /// Whether to go through the adapter, which rejects what a real one rejects. Default: the bare bus.
    pub as_adapter: bool,
}

impl Default for ClientOptions {
    fn default() -> Self {
        Self {
            wait_max: Duration::from_secs(10),
            as_adapter: false,
        }
    }
}

/// One bus of a server, as embedded-hal [`I2c`] and as [`EmulatedAdapter`]. Each transaction is atomic.
#[derive(Debug)]
pub struct Client {
    path: PathBuf,
    bus: u32,
    options: ClientOptions,
    adapter: AdapterFacts,
    /// Dropped after the first missing answer.
    connection: Option<Connection>,
}

impl Client {
    /// Connects to one bus of the server at `path`.
    /// # Errors
    /// No server answers in time, it speaks another protocol or version, or it has no such bus.
    pub fn connect(path: impl AsRef<Path>, bus: u32) -> Result<Self, ClientError> {
        Self::connect_with(path, bus, ClientOptions::default())
    }

    /// As [`connect`](Self::connect), with options.
    /// # Errors
    /// As [`connect`](Self::connect).
    pub fn connect_with(
        path: impl AsRef<Path>,
        bus: u32,
        options: ClientOptions,
    ) -> Result<Self, ClientError> {
        let path = path.as_ref();
        let (connection, adapter) = Connection::open(path, options.wait_max)?;
        if !adapter.buses.contains(&bus) {
            return Err(ClientError::NoSuchBus {
                path: path.to_owned(),
                bus,
                buses: adapter.buses,
            });
        }
        Ok(Self {
            path: path.to_owned(),
            bus,
            options,
            adapter,
            connection: Some(connection),
        })
    }

    /// The numbers of the server's buses.
    #[must_use]
    pub fn buses(&self) -> &[u32] {
        &self.adapter.buses
    }

    /// The name of the adapter mode, such as `pi`.
    #[must_use]
    pub fn mode(&self) -> &str {
        &self.adapter.mode
    }

    /// The adapter's I2C_FUNCS bits; see [`functionality`](crate::ioctl::functionality).
    #[must_use]
    pub fn functionality(&self) -> u32 {
        self.adapter.functionality
    }

    /// Carries out the messages of one transfer.
    /// # Errors
    /// [`ClientError::Fault`] if the bus failed, with the buffers before the fault filled. [`ClientError::Refused`] if
    /// nothing reached the bus. [`ClientError::ServerGone`] or [`ClientError::Timeout`] if no answer came; later calls
    /// then return `ServerGone`.
    pub fn transfer_messages(&mut self, messages: &mut [Message<'_>]) -> Result<(), ClientError> {
        check_limits(messages)?;
        let gone = || ClientError::ServerGone(self.path.clone(), None);
        let connection = self.connection.as_mut().ok_or_else(gone)?;
        connection.put_transfer(self.bus, self.options.as_adapter, messages);
        let outcome = connection
            .ask(&self.path, self.options.wait_max)
            .and_then(|packet| take_answer(packet, messages, &self.path));
        if outcome.as_ref().is_err_and(ClientError::ends_connection) {
            self.connection = None;
        }
        outcome
    }
}

impl EmulatedAdapter for Client {
    /// Reports a lost server as [`Fault::Gone`](crate::adapter::Fault::Gone).
    fn transfer(&mut self, messages: &mut [Message<'_>]) -> Result<(), TransferError> {
        let outcome = self.transfer_messages(messages);
        outcome.map_err(|error| TransferError {
            completed: match error {
                ClientError::Fault { completed, .. } => completed,
                _ => 0,
            },
            fault: error.fault(),
        })
    }
}

impl ErrorType for Client {
    type Error = ClientError;
}

impl I2c for Client {
    fn transaction(
        &mut self,
        address: SevenBitAddress,
        operations: &mut [Operation<'_>],
    ) -> Result<(), ClientError> {
        let mut joined = join(address.into(), operations);
        let mut messages: Vec<Message<'_>> = joined.iter_mut().map(Segment::as_message).collect();
        let outcome = self.transfer_messages(&mut messages);
        let completed = match &outcome {
            Ok(()) => joined.len(),
            Err(ClientError::Fault { completed, .. }) => *completed,
            Err(_) => 0,
        };
        let arrived = joined.iter().take(completed).filter(|message| message.read);
        let places = operations.iter_mut().flat_map(|operation| match operation {
            Operation::Read(buffer) => buffer.iter_mut(),
            Operation::Write(_) => [].iter_mut(),
        });
        for (to, from) in places.zip(arrived.flat_map(|message| &message.bytes)) {
            *to = *from;
        }
        outcome
    }
}

fn check_limits(messages: &[Message<'_>]) -> Result<(), ClientError> {
    let check = |unit, found, most| match found > most {
        true => Err(ClientError::TooLong { unit, found, most }),
        false => Ok(()),
    };
    check("messages", messages.len(), RDWR_MESSAGES_MAX)?;
    for message in messages {
        let length = match &message.operation {
            Operation::Read(buffer) => buffer.len(),
            Operation::Write(bytes) => bytes.len(),
        };
        check("bytes in a message", length, MESSAGE_BYTES_MAX)?;
    }
    Ok(())
}

/// Merges adjacent operations of one direction into one message.
fn join(address: u16, operations: &[Operation<'_>]) -> Vec<Segment> {
    let mut joined: Vec<Segment> = Vec::new();
    for operation in operations {
        let (read, bytes) = match operation {
            Operation::Read(buffer) => (true, vec![0; buffer.len()]),
            Operation::Write(bytes) => (false, bytes.to_vec()),
        };
        match joined.last_mut() {
            Some(last) if last.read == read => last.bytes.extend(bytes),
            _ => joined.push(Segment::new(address, false, read, bytes)),
        }
    }
    joined
}
