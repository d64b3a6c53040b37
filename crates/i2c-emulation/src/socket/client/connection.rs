//! A client's stream: builds requests and parses answers.

use super::error::ClientError;
use crate::adapter::Message;
use crate::ioctl::message_flag;
use crate::socket::inbox::{Inbox, NoPacket, Patience};
use crate::socket::place;
use crate::socket::wire::{
    ByeReason, Cursor, MAGIC, Malformed, VERSION, append_packet, fault_from_number, kind, put_u16,
};
use embedded_hal::i2c::Operation;
use std::io::{ErrorKind, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::Duration;

#[derive(Debug)]
pub(super) struct AdapterFacts {
    pub(super) functionality: u32,
    pub(super) mode: String,
    pub(super) buses: Vec<u32>,
}

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
        let no_server = |source| ClientError::NoServer(path.to_owned(), source);
        let stream = place::connect(path, wait_max).map_err(no_server)?;
        let shortest = Duration::from_millis(1);
        let limited = stream.set_write_timeout(Some(wait_max.max(shortest)));
        limited.map_err(no_server)?;
        let mut connection = Self {
            stream,
            inbox: Inbox::new(),
            question: Vec::new(),
        };
        append_packet(&mut connection.question, kind::HELLO, |out| {
            out.extend_from_slice(&MAGIC);
            out.extend_from_slice(&VERSION.to_le_bytes());
        });
        let facts = take_welcome(connection.ask(path, wait_max)?, path)?;
        Ok((connection, facts))
    }

    /// Appends a transfer; `as_adapter` lets the adapter check the messages.
    pub(super) fn put_transfer(&mut self, bus: u32, as_adapter: bool, messages: &[Message<'_>]) {
        append_packet(&mut self.question, kind::TRANSFER, |out| {
            out.extend_from_slice(&bus.to_le_bytes());
            out.push(u8::from(as_adapter));
            put_u16(out, messages.len());
            for message in messages {
                put_message(out, message);
            }
        });
    }

    pub(super) fn ask(&mut self, path: &Path, wait_max: Duration) -> Result<&[u8], ClientError> {
        let sent = (&self.stream).write_all(&self.question);
        self.question.clear();
        let end = match sent.map_err(|error| error.kind()) {
            // The server may have sent a reason before it closed the connection.
            Ok(()) | Err(ErrorKind::BrokenPipe | ErrorKind::ConnectionReset) => {
                let (first, rest) = (wait_max, wait_max);
                let patience = Patience { first, rest };
                match self.inbox.receive(&self.stream, patience) {
                    Ok(packet) => return Ok(packet),
                    Err(end) => end,
                }
            }
            Err(ErrorKind::WouldBlock | ErrorKind::TimedOut) => NoPacket::Slow,
            Err(_) => NoPacket::Broken,
        };
        Err(no_answer(&end, path, wait_max))
    }
}

/// The client error for an answer that did not come.
fn no_answer(end: &NoPacket, path: &Path, waited: Duration) -> ClientError {
    let path = path.to_owned();
    match *end {
        NoPacket::Idle | NoPacket::Slow => ClientError::Timeout(path, waited),
        NoPacket::TooLong(bytes) => {
            ClientError::NotOurs(path, format!("a packet of {bytes} bytes"))
        }
        NoPacket::Closed | NoPacket::CutShort | NoPacket::Broken => {
            ClientError::ServerGone(path, None)
        }
    }
}

fn put_message(out: &mut Vec<u8>, message: &Message<'_>) {
    out.extend_from_slice(&message.address.to_le_bytes());
    let ten_bit = u16::from(message.ten_bit) * message_flag::TEN_BIT;
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
        kind::BYE => Err(ClientError::TurnedAway {
            path: path.to_owned(),
            reason: ByeReason::from_number(cursor.u8("reason").map_err(nonsense)?),
            text: cursor.text(),
        }),
        other => Err(not_ours(path, Malformed::Kind(other))),
    }
}

fn parse_welcome(mut cursor: Cursor<'_>) -> Result<AdapterFacts, Malformed> {
    if cursor.bytes(MAGIC.len(), "magic")? != MAGIC {
        return Err(Malformed::Magic);
    }
    // The server accepted the client's version; its own is only for people.
    let _ = cursor.u16("version")?;
    let functionality = cursor.u32("functionality")?;
    let name_bytes = usize::from(cursor.u8("mode")?);
    let mode = String::from_utf8_lossy(cursor.bytes(name_bytes, "mode")?).into_owned();
    let buses = (0..cursor.u16("number of buses")?).map(|_| cursor.u32("bus"));
    Ok(AdapterFacts {
        functionality,
        mode,
        buses: buses.collect::<Result<_, _>>()?,
    })
}

fn not_ours(path: &Path, malformed: Malformed) -> ClientError {
    ClientError::NotOurs(path.to_owned(), malformed.to_string())
}

/// Fills the messages' buffers from the answer, or returns its error.
pub(super) fn take_answer(
    packet: &[u8],
    messages: &mut [Message<'_>],
    path: &Path,
) -> Result<(), ClientError> {
    let parsed = parse_answer(Cursor(packet), messages, path);
    parsed.unwrap_or_else(|malformed| Err(not_ours(path, malformed)))
}

fn parse_answer(
    mut cursor: Cursor<'_>,
    messages: &mut [Message<'_>],
    path: &Path,
) -> Result<Result<(), ClientError>, Malformed> {
    Ok(match cursor.u8("kind")? {
        kind::DONE => {
            let completed = usize::from(cursor.u16("completed")?);
            fill(cursor, completed, messages)?;
            let messages = messages.len();
            let short = ClientError::Short {
                completed,
                messages,
            };
            (completed >= messages).then_some(()).ok_or(short)
        }
        kind::FAULT => {
            let fault = fault_from_number(cursor.u8("fault")?);
            let errno = cursor.u16("errno")?;
            let completed = usize::from(cursor.u16("completed")?);
            // As an adapter, the server returns no bytes with a fault, because the kernel has none to give.
            if !cursor.0.is_empty() {
                fill(cursor, completed, messages)?;
            }
            Err(ClientError::Fault {
                fault,
                completed,
                errno: (errno != 0).then_some(i32::from(errno)),
            })
        }
        kind::REFUSED => Err(ClientError::Refused {
            errno: cursor.u16("errno")?.into(),
            text: cursor.text(),
        }),
        kind::BYE => {
            let said = cursor.u8("reason").ok().map(|_reason| cursor.text());
            Err(ClientError::ServerGone(path.to_owned(), said))
        }
        other => return Err(Malformed::Kind(other)),
    })
}

/// Copies the bytes read into the buffers of the first messages.
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
    cursor.end()
}
