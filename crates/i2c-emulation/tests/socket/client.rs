//! A client of the socket for tests, written from PROTOCOL.md and not from the library.

use embedded_hal::i2c::{self, ErrorKind, I2c, Operation};
use std::io::{self, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::Duration;

/// Longer than the server waits for anything.
const WAIT_MAX: Duration = Duration::from_secs(30);

/// One bus of a server; the bus alone judges, unless `judge` says otherwise.
#[derive(Debug)]
pub(crate) struct Client {
    stream: UnixStream,
    bus: u32,
    pub(crate) judge: u8,
}

/// An answer other than DONE with all messages, or none. `Bye` has its reason, `Refused` its errno.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Failure {
    Fault {
        fault: u8,
        errno: u16,
        completed: u16,
    },
    Refused(u16, String),
    Short(u16),
    Bye(u8, String),
    Lost(io::ErrorKind),
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        Self::Lost(error.kind())
    }
}

impl i2c::Error for Failure {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

impl Client {
    pub(crate) fn connect(path: impl AsRef<Path>, bus: u32) -> Result<Self, Failure> {
        Self::connect_within(path, bus, WAIT_MAX)
    }

    /// Each answer is waited for so long.
    pub(crate) fn connect_within(
        path: impl AsRef<Path>,
        bus: u32,
        wait: Duration,
    ) -> Result<Self, Failure> {
        let stream = UnixStream::connect(path)?;
        stream.set_read_timeout(Some(wait))?;
        let mut client = Self {
            stream,
            bus,
            judge: 0,
        };
        let (_, welcome) = client.ask(b"\x01i2ce\x01\x00")?;
        let buses = welcome[11 + usize::from(welcome[10]) + 2..].chunks(4);
        if !buses.into_iter().any(|number| number == bus.to_le_bytes()) {
            return Err(Failure::Refused(19, format!("no bus {bus}")));
        }
        Ok(client)
    }

    /// The answer's kind and body.
    fn ask(&mut self, request: &[u8]) -> Result<(u8, Vec<u8>), Failure> {
        let length = u32::try_from(request.len()).unwrap().to_le_bytes();
        // The reason of a server that has closed the connection may be there still.
        let _ = self.stream.write_all(&[&length, request].concat());
        let mut head = [0; 5];
        self.stream.read_exact(&mut head)?;
        let [length @ .., kind] = head;
        let mut body = vec![0; usize::try_from(u32::from_le_bytes(length)).unwrap() - 1];
        self.stream.read_exact(&mut body)?;
        let text = |at: usize| String::from_utf8(body[at..].to_vec()).unwrap();
        match kind {
            0x84 => Err(Failure::Refused(number(&body, 0), text(2))),
            0x85 => Err(Failure::Bye(body[0], text(1))),
            _ => Ok((kind, body)),
        }
    }

    /// Messages with their addresses and flags. What was read before a fault is in its buffers.
    pub(crate) fn transfer(
        &mut self,
        messages: &mut [(u16, u16, Operation<'_>)],
    ) -> Result<(), Failure> {
        let count = u16::try_from(messages.len()).unwrap();
        let mut request = vec![2];
        request.extend(self.bus.to_le_bytes());
        request.push(self.judge);
        request.extend(count.to_le_bytes());
        for (address, flags, operation) in &*messages {
            let (read, length, bytes) = match operation {
                Operation::Read(buffer) => (1, buffer.len(), &[][..]),
                Operation::Write(bytes) => (0, bytes.len(), *bytes),
            };
            let length = u16::try_from(length).unwrap();
            let head = [*address, flags | read, length].map(u16::to_le_bytes);
            request.extend(head.as_flattened());
            request.extend(bytes);
        }
        let (kind, body) = self.ask(&request)?;
        let (completed, bytes, outcome) = match kind {
            0x83 => {
                let (fault, errno, completed) = (body[0], number(&body, 1), number(&body, 3));
                let failure = Failure::Fault {
                    fault,
                    errno,
                    completed,
                };
                (completed, &body[5..], Err(failure))
            }
            _ if number(&body, 0) < count => {
                let completed = number(&body, 0);
                (completed, &body[2..], Err(Failure::Short(completed)))
            }
            _ => (count, &body[2..], Ok(())),
        };
        let mut arrived = bytes.iter();
        for (_, _, operation) in messages.iter_mut().take(completed.into()) {
            if let Operation::Read(buffer) = operation {
                buffer.fill_with(|| *arrived.next().unwrap());
            }
        }
        outcome
    }
}

fn number(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes([bytes[at], bytes[at + 1]])
}

impl i2c::ErrorType for Client {
    type Error = Failure;
}

impl I2c for Client {
    fn transaction(
        &mut self,
        address: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), Failure> {
        let mut messages: Vec<_> = operations
            .iter_mut()
            .map(|operation| {
                let operation = match operation {
                    Operation::Read(buffer) => Operation::Read(buffer),
                    Operation::Write(bytes) => Operation::Write(bytes),
                };
                (address.into(), 0, operation)
            })
            .collect();
        self.transfer(&mut messages)
    }
}
