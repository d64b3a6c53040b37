//! The client for Rust programs.

mod connection;
mod error;
mod joined;

use std::path::{Path, PathBuf};
use std::time::Duration;

use embedded_hal::i2c::{ErrorType, I2c, Operation, SevenBitAddress};

pub use error::ClientError;

use super::wire::Judge;
use crate::adapter::{BusFault, EmulatedAdapter, Message, TransferError};
use crate::ioctl::{MESSAGE_BYTES_MAX, RDWR_MESSAGES_MAX};
use connection::{AdapterFacts, Connection, take_answer};
use joined::{Joined, deal_out, join};

/// How a client behaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClientOptions {
    /// The longest wait for the server, to connect and for each answer; at first 10 seconds.
    pub wait_max: Duration,
    /// Whether to ask the adapter, which refuses what a real one refuses (a Raspberry Pi's a read that is not the last
    /// message, for instance), and not the bare bus. At first the bare bus.
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

/// One bus of a server, as [`I2c`] of embedded-hal and as [`EmulatedAdapter`].
///
/// Each transaction is atomic: other clients' transfers come before or after it. Neighbouring operations of one
/// direction are one message, as embedded-hal has it.
#[derive(Debug)]
pub struct Client {
    path: PathBuf,
    bus: u32,
    options: ClientOptions,
    adapter: AdapterFacts,
    /// Gone after the first answer that did not come.
    connection: Option<Connection>,
}

impl Client {
    /// Connects to one bus of the server at `path`.
    ///
    /// # Errors
    /// Where no server answers in time, where it speaks another protocol or version, and where it has no such bus.
    pub fn connect(path: impl AsRef<Path>, bus: u32) -> Result<Self, ClientError> {
        Self::connect_with(path, bus, ClientOptions::default())
    }

    /// As [`connect`](Self::connect), with options.
    ///
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

    /// The numbers of all buses that the server has.
    #[must_use]
    pub fn buses(&self) -> &[u32] {
        &self.adapter.buses
    }

    /// The name of the adapter's mode, such as `pi`.
    #[must_use]
    pub fn mode(&self) -> &str {
        &self.adapter.mode
    }

    /// What I2C_FUNCS tells of the adapter; see [`functionality`](crate::ioctl::functionality).
    #[must_use]
    pub fn functionality(&self) -> u32 {
        self.adapter.functionality
    }

    /// Carries out the messages of one transfer.
    ///
    /// # Errors
    /// [`ClientError::Fault`] where the bus failed, with the buffers of the messages before it filled;
    /// [`ClientError::Refused`] where nothing reached the bus; [`ClientError::ServerGone`] and
    /// [`ClientError::Timeout`] where no answer came, now and at every later call.
    pub fn transfer_messages(&mut self, messages: &mut [Message<'_>]) -> Result<(), ClientError> {
        let judge = if self.options.as_adapter {
            Judge::Rdwr
        } else {
            Judge::Bus
        };
        check_limits(messages)?;
        let gone = || ClientError::ServerGone {
            path: self.path.clone(),
            said: None,
        };
        let connection = self.connection.as_mut().ok_or_else(gone)?;
        connection.put_transfer(self.bus, judge, messages);
        let outcome = connection
            .ask(self.options.wait_max)
            .map_err(|end| end.of(&self.path, self.options.wait_max))
            .and_then(|packet| take_answer(packet, messages, &self.path));
        if outcome.as_ref().is_err_and(ClientError::ends_connection) {
            self.connection = None;
        }
        outcome
    }
}

impl EmulatedAdapter for Client {
    /// A transfer that a bus behind a socket cannot tell from one in its own process; a server that went away is
    /// [`Fault::Gone`](crate::adapter::Fault::Gone).
    fn transfer(&mut self, messages: &mut [Message<'_>]) -> Result<(), TransferError> {
        self.transfer_messages(messages)
            .map_err(|error| TransferError {
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
        let mut joined = join(operations);
        let outcome = {
            let mut messages: Vec<Message<'_>> = joined
                .iter_mut()
                .map(|operation| Message {
                    address: u16::from(address),
                    ten_bit: false,
                    operation: match operation {
                        Joined::Read(buffer) => Operation::Read(buffer),
                        Joined::Write(bytes) => Operation::Write(bytes),
                    },
                })
                .collect();
            self.transfer_messages(&mut messages)
        };
        let completed = match &outcome {
            Ok(()) => joined.len(),
            Err(ClientError::Fault { completed, .. }) => *completed,
            Err(_) => 0,
        };
        joined.truncate(completed);
        deal_out(&joined, operations);
        outcome
    }
}

fn check_limits(messages: &[Message<'_>]) -> Result<(), ClientError> {
    let check = |unit, found, most| {
        if found > most {
            Err(ClientError::TooLong { unit, found, most })
        } else {
            Ok(())
        }
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
