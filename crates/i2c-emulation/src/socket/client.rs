//! The client for Rust programs.

use std::io::{self, ErrorKind as IoErrorKind, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::Duration;

use embedded_hal::i2c::{
    self, ErrorKind, ErrorType, I2c, NoAcknowledgeSource, Operation, SevenBitAddress,
};

use super::inbox::{Inbox, NoPacket, Patience};
use super::place;
use super::wire::{
    ByeReason, Cursor, Judge, MAGIC, Malformed, VERSION, append_packet, fault_from_number, kind,
};
use crate::adapter::{BusFault, EmulatedAdapter, Fault, Message, TransferError, is_read};
use crate::ioctl::{MESSAGE_BYTES_MAX, RDWR_MESSAGES_MAX, message_flag};

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
    /// A transfer that a bus behind a socket cannot tell from one in its own process; a server that went away is [`Fault::Gone`].
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

/// Why a client has no answer, or not the one it hoped for.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// The bus failed.
    #[error("{}", fault_text(*fault))]
    Fault {
        /// What went wrong on the bus.
        fault: Fault,
        /// Messages that were carried out in full before.
        completed: usize,
        /// The errno that a program at `/dev/i2c-N` would see; `None` where the adapter hides the fault.
        errno: Option<i32>,
    },
    /// Nothing reached the bus: the adapter, or the server, refused the transfer.
    #[error("refused: {text}")]
    Refused {
        /// The errno that a program at `/dev/i2c-N` would see.
        errno: i32,
        /// The reason in words.
        text: String,
    },
    /// The adapter carried out fewer messages than asked, and calls that no error (mode `virtio`).
    #[error("the adapter carried out {completed} of {messages} messages")]
    Short {
        /// Messages that were carried out.
        completed: usize,
        /// Messages that were asked for.
        messages: usize,
    },
    /// A transfer of more messages or bytes than any adapter takes.
    #[error(
        "{found} {unit}, at most {most} are possible\nhint: cut the transfer into several, if the target allows it"
    )]
    TooLong {
        /// "messages" or "bytes in a message".
        unit: &'static str,
        /// How many there are.
        found: usize,
        /// How many there may be.
        most: usize,
    },
    /// No server answers at the path.
    #[error("cannot connect to {}: {source}\nhint: start the server first: grideye emulate --scene SCENE --socket {}", path.display(), path.display())]
    NoServer {
        /// The socket's path.
        path: PathBuf,
        /// What the kernel said.
        source: io::Error,
    },
    /// Whoever answers does not speak the protocol.
    #[error(
        "{} does not speak the protocol of i2c-emulation: {what}\nhint: is that the right socket?",
        path.display()
    )]
    NotOurs {
        /// The socket's path.
        path: PathBuf,
        /// What was wrong.
        what: String,
    },
    /// The server turned the client away.
    #[error("the server at {} turned this client away: {text}{}", path.display(), hint_of(*reason))]
    TurnedAway {
        /// The socket's path.
        path: PathBuf,
        /// The reason for programs.
        reason: ByeReason,
        /// The reason in words.
        text: String,
    },
    /// The server has no bus of this number.
    #[error("the server at {} has no bus {bus}\nhint: it has {}", path.display(), list(buses))]
    NoSuchBus {
        /// The socket's path.
        path: PathBuf,
        /// The bus that was asked for.
        bus: u32,
        /// The buses that are there.
        buses: Vec<u32>,
    },
    /// No answer came in time. The connection is given up: the answer may still come, and would be taken for another's.
    #[error(
        "no answer from {} within {waited:?}\nhint: is the server stopped, or the bus held by another client?",
        path.display()
    )]
    Timeout {
        /// The socket's path.
        path: PathBuf,
        /// How long the client waited.
        waited: Duration,
    },
    /// The connection has ended.
    #[error("the server at {} went away{}\nhint: start it again, and connect again", path.display(), said.as_ref().map(|text| format!(": {text}")).unwrap_or_default())]
    ServerGone {
        /// The socket's path.
        path: PathBuf,
        /// What the server said at the end, if it said something.
        said: Option<String>,
    },
}

impl ClientError {
    fn ends_connection(&self) -> bool {
        matches!(
            self,
            Self::NotOurs { .. } | Self::Timeout { .. } | Self::ServerGone { .. }
        )
    }
}

impl BusFault for ClientError {
    fn fault(&self) -> Fault {
        match self {
            Self::Fault { fault, .. } => *fault,
            Self::Timeout { .. } => Fault::Timeout,
            Self::Refused { .. } | Self::TooLong { .. } | Self::Short { .. } => Fault::Bus,
            _ => Fault::Gone,
        }
    }
}

impl i2c::Error for ClientError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::Fault { fault, .. } => match fault {
                Fault::NackAddress => ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address),
                Fault::NackData => ErrorKind::NoAcknowledge(NoAcknowledgeSource::Data),
                Fault::ArbitrationLost => ErrorKind::ArbitrationLoss,
                Fault::Bus => ErrorKind::Bus,
                Fault::Timeout | Fault::Gone => ErrorKind::Other,
            },
            _ => ErrorKind::Other,
        }
    }
}

/// What the server tells of itself in its hello.
#[derive(Debug)]
struct AdapterFacts {
    functionality: u32,
    mode: String,
    buses: Vec<u32>,
}

/// A stream on which questions and answers alternate.
struct Connection {
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
    fn open(path: &Path, wait_max: Duration) -> Result<(Self, AdapterFacts), ClientError> {
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

    fn put_transfer(&mut self, bus: u32, judge: Judge, messages: &[Message<'_>]) {
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
    fn ask(&mut self, wait_max: Duration) -> Result<&[u8], NoAnswer> {
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
enum NoAnswer {
    Late,
    Gone,
    Nonsense(String),
}

impl NoAnswer {
    fn of(self, path: &Path, waited: Duration) -> ClientError {
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

fn take_answer(
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

/// One message of a transaction: neighbouring operations of one direction.
enum Joined {
    Read(Vec<u8>),
    Write(Vec<u8>),
}

fn join(operations: &[Operation<'_>]) -> Vec<Joined> {
    let mut joined: Vec<Joined> = Vec::new();
    for operation in operations {
        match (operation, joined.last_mut()) {
            (Operation::Read(buffer), Some(Joined::Read(before))) => {
                before.resize(before.len() + buffer.len(), 0);
            }
            (Operation::Write(bytes), Some(Joined::Write(before))) => {
                before.extend_from_slice(bytes);
            }
            (Operation::Read(buffer), _) => joined.push(Joined::Read(vec![0; buffer.len()])),
            (Operation::Write(bytes), _) => joined.push(Joined::Write(bytes.to_vec())),
        }
    }
    joined
}

/// Deals what the messages read out to the operations that they were joined from.
fn deal_out(joined: &[Joined], operations: &mut [Operation<'_>]) {
    let mut rest = operations.iter_mut().peekable();
    for message in joined {
        let Joined::Read(read) = message else {
            while rest.next_if(|operation| !is_read(operation)).is_some() {}
            continue;
        };
        let mut cursor = read.as_slice();
        while let Some(operation) = rest.next_if(|operation| is_read(operation)) {
            if let Operation::Read(buffer) = operation {
                let (head, tail) = cursor.split_at_checked(buffer.len()).unwrap_or_default();
                if head.len() == buffer.len() {
                    buffer.copy_from_slice(head);
                }
                cursor = tail;
            }
        }
    }
}

const fn fault_text(fault: Fault) -> &'static str {
    match fault {
        Fault::NackAddress => "nobody acknowledged the address",
        Fault::NackData => "the target did not acknowledge a byte",
        Fault::Bus => "the bus failed",
        Fault::ArbitrationLost => "another controller won the bus",
        Fault::Timeout => "the bus was held for too long",
        Fault::Gone => "the adapter is gone",
    }
}

const fn hint_of(reason: ByeReason) -> &'static str {
    match reason {
        ByeReason::Version => "\nhint: take client and server of one release",
        ByeReason::TooManyClients => "\nhint: close clients that are no longer used",
        _ => "",
    }
}

fn list(buses: &[u32]) -> String {
    let numbers: Vec<String> = buses.iter().map(|number| format!("bus {number}")).collect();
    numbers.join(", ")
}
