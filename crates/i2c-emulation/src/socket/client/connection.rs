//! A client's stream: questions put into packets, and answers taken apart.

use std::io::{self, ErrorKind as IoErrorKind, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::Duration;

use embedded_hal::i2c::Operation;

use super::error::ClientError;
use crate::adapter::Message;
use crate::ioctl::message_flag;
use crate::socket::inbox::{Inbox, NoPacket, Patience};
use crate::socket::place;
use crate::socket::wire::{
    ByeReason, Cursor, Judge, MAGIC, Malformed, VERSION, append_packet, fault_from_number, kind,
};

/// What the server tells of itself in its hello.
#[derive(Debug)]
pub(super) struct AdapterFacts {
    pub(super) functionality: u32,
    pub(super) mode: String,
    pub(super) buses: Vec<u32>,
}

/// A stream on which questions and answers alternate.
pub(super) struct Connection {
    stream: UnixStream,
    inbox: Inbox,
    question: Vec<u8>,
}

impl std::fmt::Debug for Connection {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.stream.fmt(formatter)
    }
}

impl Connection {
    pub(super) fn open(
        path: &Path,
        wait_max: Duration,
    ) -> Result<(Self, AdapterFacts), ClientError> {
        let no_server = |source| ClientError::NoServer {
            path: path.to_owned(),
            source,
        };
        let stream = place::connect(path, wait_max).map_err(no_server)?;
        stream
            .set_write_timeout(Some(wait_max.max(Duration::from_millis(1))))
            .map_err(no_server)?;
        let mut connection = Self {
            stream,
            inbox: Inbox::new(),
            question: Vec::new(),
        };
        append_packet(&mut connection.question, kind::HELLO, |out| {
            out.extend_from_slice(&MAGIC);
            out.extend_from_slice(&VERSION.to_le_bytes());
        });
        let packet = connection
            .ask(wait_max)
            .map_err(|end| end.of(path, wait_max))?;
        let facts = take_welcome(packet, path)?;
        Ok((connection, facts))
    }

    pub(super) fn put_transfer(&mut self, bus: u32, judge: Judge, messages: &[Message<'_>]) {
        append_packet(&mut self.question, kind::TRANSFER, |out| {
            out.extend_from_slice(&bus.to_le_bytes());
            out.push(match judge {
                Judge::Bus => 0,
                Judge::Rdwr => 1,
                Judge::File => 2,
            });
            put_u16(out, messages.len());
            for message in messages {
                put_message(out, message);
            }
        });
    }

    /// Sends the question and waits for the answer.
    pub(super) fn ask(&mut self, wait_max: Duration) -> Result<&[u8], NoAnswer> {
        let sent = (&self.stream).write_all(&self.question);
        self.question.clear();
        if let Err(error) = sent {
            match error.kind() {
                // The server may have said why it closed the connection before it was asked.
                IoErrorKind::BrokenPipe | IoErrorKind::ConnectionReset => {}
                _ => return Err(NoAnswer::from(error)),
            }
        }
        let patience = Patience {
            first: wait_max,
            rest: wait_max,
        };
        self.inbox
            .receive(&self.stream, patience)
            .map_err(NoAnswer::from)
    }
}

/// Why no packet came back.
#[derive(Debug)]
pub(super) enum NoAnswer {
    Late,
    Gone,
    Nonsense(String),
}

impl NoAnswer {
    pub(super) fn of(self, path: &Path, waited: Duration) -> ClientError {
        let path = path.to_owned();
        match self {
            Self::Late => ClientError::Timeout { path, waited },
            Self::Gone => ClientError::ServerGone { path, said: None },
            Self::Nonsense(what) => ClientError::NotOurs { path, what },
        }
    }
}

impl From<NoPacket> for NoAnswer {
    fn from(end: NoPacket) -> Self {
        match end {
            NoPacket::Idle | NoPacket::Slow => Self::Late,
            NoPacket::Closed | NoPacket::CutShort => Self::Gone,
            NoPacket::TooLong(bytes) => Self::Nonsense(format!("a packet of {bytes} bytes")),
            NoPacket::Broken(error) => Self::from(error),
        }
    }
}

impl From<io::Error> for NoAnswer {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            IoErrorKind::WouldBlock | IoErrorKind::TimedOut => Self::Late,
            _ => Self::Gone,
        }
    }
}

fn put_u16(out: &mut Vec<u8>, value: usize) {
    // What is put has been checked against limits that are far below.
    out.extend_from_slice(&u16::try_from(value).unwrap_or(u16::MAX).to_le_bytes());
}

fn put_message(out: &mut Vec<u8>, message: &Message<'_>) {
    out.extend_from_slice(&message.address.to_le_bytes());
    let ten_bit = if message.ten_bit {
        message_flag::TEN_BIT
    } else {
        0
    };
    match &message.operation {
        Operation::Read(buffer) => {
            out.extend_from_slice(&(ten_bit | message_flag::READ).to_le_bytes());
            put_u16(out, buffer.len());
        }
        Operation::Write(bytes) => {
            out.extend_from_slice(&ten_bit.to_le_bytes());
            put_u16(out, bytes.len());
            out.extend_from_slice(bytes);
        }
    }
}

fn take_welcome(packet: &[u8], path: &Path) -> Result<AdapterFacts, ClientError> {
    let mut cursor = Cursor(packet);
    let nonsense = |malformed: Malformed| not_ours(path, malformed);
    match cursor.u8("kind").map_err(nonsense)? {
        kind::WELCOME => parse_welcome(cursor).map_err(nonsense),
        kind::BYE => Err(turned_away(cursor, path)),
        other => Err(not_ours(path, Malformed::Kind(other))),
    }
}

fn parse_welcome(mut cursor: Cursor<'_>) -> Result<AdapterFacts, Malformed> {
    if cursor.bytes(MAGIC.len(), "magic")? != MAGIC {
        return Err(Malformed::Magic);
    }
    // The server has accepted the client's version; its own is for people.
    let _ = cursor.u16("version")?;
    let functionality = cursor.u32("functionality")?;
    let name_bytes = usize::from(cursor.u8("mode")?);
    let mode = String::from_utf8_lossy(cursor.bytes(name_bytes, "mode")?).into_owned();
    let count = cursor.u16("number of buses")?;
    let buses = (0..count)
        .map(|_| cursor.u32("bus"))
        .collect::<Result<_, _>>()?;
    Ok(AdapterFacts {
        functionality,
        mode,
        buses,
    })
}

fn turned_away(mut cursor: Cursor<'_>, path: &Path) -> ClientError {
    match cursor.u8("reason") {
        Ok(number) => ClientError::TurnedAway {
            path: path.to_owned(),
            reason: ByeReason::from_number(number),
            text: String::from_utf8_lossy(cursor.0).into_owned(),
        },
        Err(malformed) => not_ours(path, malformed),
    }
}

fn not_ours(path: &Path, malformed: Malformed) -> ClientError {
    ClientError::NotOurs {
        path: path.to_owned(),
        what: malformed.to_string(),
    }
}

pub(super) fn take_answer(
    packet: &[u8],
    messages: &mut [Message<'_>],
    path: &Path,
) -> Result<(), ClientError> {
    let mut cursor = Cursor(packet);
    let nonsense = |malformed: Malformed| not_ours(path, malformed);
    match cursor.u8("kind").map_err(nonsense)? {
        kind::DONE => {
            let completed = usize::from(cursor.u16("completed").map_err(nonsense)?);
            fill(cursor, completed, messages).map_err(nonsense)?;
            if completed < messages.len() {
                let messages = messages.len();
                return Err(ClientError::Short {
                    completed,
                    messages,
                });
            }
            Ok(())
        }
        kind::FAULT => {
            let error = take_fault(&mut cursor, messages).map_err(nonsense)?;
            Err(error)
        }
        kind::REFUSED => {
            let errno = i32::from(cursor.u16("errno").map_err(nonsense)?);
            let text = String::from_utf8_lossy(cursor.0).into_owned();
            Err(ClientError::Refused { errno, text })
        }
        kind::BYE => {
            let text = match turned_away(cursor, path) {
                ClientError::TurnedAway { text, .. } => Some(text),
                _ => None,
            };
            Err(ClientError::ServerGone {
                path: path.to_owned(),
                said: text,
            })
        }
        other => Err(not_ours(path, Malformed::Kind(other))),
    }
}

fn take_fault(
    cursor: &mut Cursor<'_>,
    messages: &mut [Message<'_>],
) -> Result<ClientError, Malformed> {
    let fault = fault_from_number(cursor.u8("fault")?);
    let errno = cursor.u16("errno")?;
    let completed = usize::from(cursor.u16("completed")?);
    // Asked as an adapter the server tells no bytes with a fault, since the kernel has none to give.
    if !cursor.0.is_empty() {
        fill(*cursor, completed, messages)?;
    }
    Ok(ClientError::Fault {
        fault,
        completed,
        errno: (errno != 0).then_some(i32::from(errno)),
    })
}

/// Puts what was read into the buffers of the first messages.
fn fill(
    mut cursor: Cursor<'_>,
    completed: usize,
    messages: &mut [Message<'_>],
) -> Result<(), Malformed> {
    for message in messages.iter_mut().take(completed) {
        if let Operation::Read(buffer) = &mut message.operation {
            buffer.copy_from_slice(cursor.bytes(buffer.len(), "bytes that were read")?);
        }
    }
    match cursor.0.len() {
        0 => Ok(()),
        left => Err(Malformed::Long(left)),
    }
}
