//! The packets of `PROTOCOL.md`: their numbers, their limits, and how they are taken apart and put together.

use crate::adapter::Fault;
use crate::ioctl::{MESSAGE_BYTES_MAX, RDWR_MESSAGES_MAX};

/// The version of the protocol that this library speaks.
pub const VERSION: u16 = 1;
/// Most bytes of a packet after its length, both ways: 42 messages of 8192 bytes and their headers.
pub const PACKET_BYTES_MAX: usize =
    TRANSFER_HEAD_BYTES + RDWR_MESSAGES_MAX * (MESSAGE_HEAD_BYTES + MESSAGE_BYTES_MAX);

/// The first bytes of both hellos.
pub(super) const MAGIC: [u8; 4] = *b"i2ce";
/// Bytes of a packet's length.
pub(super) const LENGTH_BYTES: usize = 4;
/// Bytes of `union i2c_smbus_data`.
pub(super) const SMBUS_DATA_BYTES: usize = 34;
const TRANSFER_HEAD_BYTES: usize = 8;
const MESSAGE_HEAD_BYTES: usize = 6;

/// The first byte of a packet.
pub(super) mod kind {
    pub(crate) const HELLO: u8 = 1;
    pub(crate) const TRANSFER: u8 = 2;
    pub(crate) const SMBUS: u8 = 3;
    pub(crate) const WELCOME: u8 = 0x81;
    pub(crate) const DONE: u8 = 0x82;
    pub(crate) const FAULT: u8 = 0x83;
    pub(crate) const REFUSED: u8 = 0x84;
    pub(crate) const BYE: u8 = 0x85;
}

/// Who judges a transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Judge {
    /// Nobody: the messages go to the bus as they are.
    Bus,
    /// The adapter, as it does for I2C_RDWR.
    Rdwr,
    /// The adapter, as it does for I2C_SLAVE and one read() or write().
    File,
}

/// Flags of an SMBus call.
pub(super) mod smbus_flag {
    pub(crate) const FORCE: u16 = 0x0001;
    pub(crate) const PEC: u16 = 0x0004;
    pub(crate) const TEN_BIT: u16 = 0x0010;
    pub(crate) const ALL: u16 = FORCE | PEC | TEN_BIT;
}

/// Why the server ends a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ByeReason {
    /// A packet that the protocol does not know.
    Malformed,
    /// The client speaks another version.
    Version,
    /// As many clients as the server takes are connected.
    TooManyClients,
    /// Nothing came for longer than the server waits.
    Idle,
    /// The server is stopping.
    Stopping,
    /// A number that this version of the protocol does not have.
    Unknown(u8),
}

impl ByeReason {
    /// The number on the wire.
    #[must_use]
    pub const fn number(self) -> u8 {
        match self {
            Self::Malformed => 1,
            Self::Version => 2,
            Self::TooManyClients => 3,
            Self::Idle => 4,
            Self::Stopping => 5,
            Self::Unknown(number) => number,
        }
    }

    pub(super) const fn from_number(number: u8) -> Self {
        match number {
            1 => Self::Malformed,
            2 => Self::Version,
            3 => Self::TooManyClients,
            4 => Self::Idle,
            5 => Self::Stopping,
            other => Self::Unknown(other),
        }
    }
}

pub(super) const fn fault_number(fault: Fault) -> u8 {
    match fault {
        Fault::NackAddress => 1,
        Fault::NackData => 2,
        Fault::Bus => 3,
        Fault::ArbitrationLost => 4,
        Fault::Timeout => 5,
        Fault::Gone => 6,
    }
}

/// A number that is not known is a fault without a name.
pub(super) const fn fault_from_number(number: u8) -> Fault {
    match number {
        1 => Fault::NackAddress,
        2 => Fault::NackData,
        4 => Fault::ArbitrationLost,
        5 => Fault::Timeout,
        6 => Fault::Gone,
        _ => Fault::Bus,
    }
}

/// One message of a transfer, as it stands in the packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct WireMessage<'a> {
    pub(super) address: u16,
    /// As `i2c_msg` of the kernel has them.
    pub(super) flags: u16,
    /// Bytes to read or to write.
    pub(super) length: usize,
    /// The bytes to write; none for a read.
    pub(super) bytes: &'a [u8],
}

/// One SMBus call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct SmbusCall {
    pub(super) address: u16,
    pub(super) flags: u16,
    pub(super) read_write: u8,
    pub(super) command: u8,
    pub(super) size: u8,
    pub(super) block: [u8; SMBUS_DATA_BYTES],
}

/// What a client asks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Request<'a> {
    Hello {
        version: u16,
    },
    Transfer {
        bus: u32,
        judge: Judge,
        messages: Vec<WireMessage<'a>>,
    },
    /// More messages than a transfer can have.
    TooManyMessages,
    Smbus {
        bus: u32,
        call: SmbusCall,
    },
}

/// A packet that breaks the protocol.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum Malformed {
    #[error("an empty packet")]
    Empty,
    #[error("no request of kind {0}")]
    Kind(u8),
    #[error("the packet ends before its {0}")]
    Short(&'static str),
    #[error("{0} bytes after the end of the request")]
    Long(usize),
    #[error("a hello that does not begin with \"i2ce\"")]
    Magic,
    #[error("no such flags: {0:#06x}")]
    Flags(u16),
    #[error("no such judge: {0}")]
    Judge(u8),
}

/// Takes a client's packet apart, its length already taken off.
pub(super) fn parse(packet: &[u8]) -> Result<Request<'_>, Malformed> {
    let mut cursor = Cursor(packet);
    let request = match cursor.u8("kind").or(Err(Malformed::Empty))? {
        kind::HELLO => parse_hello(&mut cursor)?,
        kind::TRANSFER => return parse_transfer(cursor),
        kind::SMBUS => parse_smbus(&mut cursor)?,
        other => return Err(Malformed::Kind(other)),
    };
    cursor.end()?;
    Ok(request)
}

fn parse_hello<'a>(cursor: &mut Cursor<'a>) -> Result<Request<'a>, Malformed> {
    if cursor.bytes(MAGIC.len(), "magic")? != MAGIC {
        return Err(Malformed::Magic);
    }
    let version = cursor.u16("version")?;
    if version != VERSION {
        // What else another version says in its hello is not ours to judge.
        cursor.0 = &[];
    }
    Ok(Request::Hello { version })
}

fn parse_transfer(mut cursor: Cursor<'_>) -> Result<Request<'_>, Malformed> {
    let bus = cursor.u32("bus")?;
    let judge = match cursor.u8("judge")? {
        0 => Judge::Bus,
        1 => Judge::Rdwr,
        2 => Judge::File,
        other => return Err(Malformed::Judge(other)),
    };
    let count = usize::from(cursor.u16("count")?);
    if count > RDWR_MESSAGES_MAX {
        return Ok(Request::TooManyMessages);
    }
    let mut messages = Vec::with_capacity(count);
    for _ in 0..count {
        messages.push(parse_message(&mut cursor)?);
    }
    cursor.end()?;
    Ok(Request::Transfer {
        bus,
        judge,
        messages,
    })
}

fn parse_message<'a>(cursor: &mut Cursor<'a>) -> Result<WireMessage<'a>, Malformed> {
    use crate::ioctl::message_flag;
    let address = cursor.u16("address")?;
    let flags = cursor.u16("flags")?;
    let unknown = flags & !(message_flag::READ | message_flag::TEN_BIT);
    if unknown != 0 {
        return Err(Malformed::Flags(unknown));
    }
    let length = usize::from(cursor.u16("length")?);
    let sent = if flags & message_flag::READ == 0 {
        length
    } else {
        0
    };
    let bytes = cursor.bytes(sent, "bytes to write")?;
    Ok(WireMessage {
        address,
        flags,
        length,
        bytes,
    })
}

fn parse_smbus<'a>(cursor: &mut Cursor<'a>) -> Result<Request<'a>, Malformed> {
    let bus = cursor.u32("bus")?;
    let address = cursor.u16("address")?;
    let flags = cursor.u16("flags")?;
    if flags & !smbus_flag::ALL != 0 {
        return Err(Malformed::Flags(flags & !smbus_flag::ALL));
    }
    let call = SmbusCall {
        address,
        flags,
        read_write: cursor.u8("direction")?,
        command: cursor.u8("command")?,
        size: cursor.u8("size")?,
        block: cursor.array("data")?,
    };
    Ok(Request::Smbus { bus, call })
}

/// What is left of a packet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cursor<'a>(pub(super) &'a [u8]);

impl<'a> Cursor<'a> {
    pub(super) fn bytes(
        &mut self,
        length: usize,
        what: &'static str,
    ) -> Result<&'a [u8], Malformed> {
        let (head, rest) = self
            .0
            .split_at_checked(length)
            .ok_or(Malformed::Short(what))?;
        self.0 = rest;
        Ok(head)
    }

    pub(super) fn array<const N: usize>(
        &mut self,
        what: &'static str,
    ) -> Result<[u8; N], Malformed> {
        let (head, rest) = self
            .0
            .split_first_chunk::<N>()
            .ok_or(Malformed::Short(what))?;
        self.0 = rest;
        Ok(*head)
    }

    pub(super) fn u8(&mut self, what: &'static str) -> Result<u8, Malformed> {
        Ok(u8::from_le_bytes(self.array(what)?))
    }

    pub(super) fn u16(&mut self, what: &'static str) -> Result<u16, Malformed> {
        Ok(u16::from_le_bytes(self.array(what)?))
    }

    pub(super) fn u32(&mut self, what: &'static str) -> Result<u32, Malformed> {
        Ok(u32::from_le_bytes(self.array(what)?))
    }

    fn end(&self) -> Result<(), Malformed> {
        match self.0.len() {
            0 => Ok(()),
            left => Err(Malformed::Long(left)),
        }
    }
}

/// Appends a packet of one kind to `out`; `fill` appends what follows the kind.
pub(super) fn append_packet(out: &mut Vec<u8>, kind: u8, fill: impl FnOnce(&mut Vec<u8>)) {
    let start = out.len();
    out.extend_from_slice(&[0; LENGTH_BYTES]);
    out.push(kind);
    fill(out);
    // Answers hold at most what one transfer reads, which is less than 4 GiB by far.
    let length = u32::try_from(out.len() - start - LENGTH_BYTES).unwrap_or(u32::MAX);
    if let Some(place) = out.get_mut(start..start + LENGTH_BYTES) {
        place.copy_from_slice(&length.to_le_bytes());
    }
}

/// Appends a `BYE` with a reason for programs and one for people.
pub(super) fn append_bye(out: &mut Vec<u8>, reason: ByeReason, text: &str) {
    append_packet(out, kind::BYE, |out| {
        out.push(reason.number());
        out.extend_from_slice(text.as_bytes());
    });
}
