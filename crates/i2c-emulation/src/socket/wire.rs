//! The packets of `PROTOCOL.md`: their numbers and limits, parsing and building.

use crate::adapter::Fault;
use crate::ioctl::{
    MESSAGE_BYTES_MAX, RDWR_MESSAGES_MAX, SMBUS_DATA_BYTES, Segment, SmbusArgument, message_flag,
};
use crate::rack::Awaited;
use crate::socket::conversation::Step;
use std::time::Duration;

/// The protocol version of this library.
pub const VERSION: u16 = 1;
/// The longest packet after its length, both ways: 42 messages of 8192 bytes and their headers.
pub const PACKET_BYTES_MAX: usize =
    TRANSFER_HEAD_BYTES + RDWR_MESSAGES_MAX * (MESSAGE_HEAD_BYTES + MESSAGE_BYTES_MAX);

pub(super) const MAGIC: [u8; 4] = *b"i2ce";
pub(super) const LENGTH_BYTES: usize = 4;
/// In place of a pin: the time alone.
const NO_PIN: u16 = u16::MAX;
const TRANSFER_HEAD_BYTES: usize = 8;
const MESSAGE_HEAD_BYTES: usize = 6;

pub(super) mod kind {
    pub(crate) const HELLO: u8 = 1;
    pub(crate) const TRANSFER: u8 = 2;
    pub(crate) const SMBUS: u8 = 3;
    pub(crate) const STEP: u8 = 4;
    pub(crate) const STOP: u8 = 5;
    pub(crate) const PASS: u8 = 6;
    pub(crate) const WELCOME: u8 = 0x81;
    pub(crate) const DONE: u8 = 0x82;
    pub(crate) const FAULT: u8 = 0x83;
    pub(crate) const REFUSED: u8 = 0x84;
    pub(crate) const BYE: u8 = 0x85;
    pub(crate) const PASSED: u8 = 0x86;
}

/// How a transfer is checked, by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Judge {
    /// Not at all: the messages go to the bus unchanged.
    Bus = 0,
    /// By the adapter, as for I2C_RDWR.
    Rdwr = 1,
    /// By the adapter, as for I2C_SLAVE and one read() or write().
    File = 2,
}

pub(super) mod smbus_flag {
    pub(crate) const FORCE: u16 = 0x0001;
    pub(crate) const PEC: u16 = 0x0004;
    pub(crate) const TEN_BIT: u16 = 0x0010;
    pub(crate) const ALL: u16 = FORCE | PEC | TEN_BIT;
}

/// Why the server ends a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ByeReason {
    Malformed,
    Version,
    TooManyClients,
    Idle,
    Stopping,
}

impl ByeReason {
    const ALL: [Self; 5] = [
        Self::Malformed,
        Self::Version,
        Self::TooManyClients,
        Self::Idle,
        Self::Stopping,
    ];
}

const FAULTS: [Fault; 6] = [
    Fault::NackAddress,
    Fault::NackData,
    Fault::Bus,
    Fault::ArbitrationLost,
    Fault::Timeout,
    Fault::Gone,
];

pub(super) fn fault_number(fault: Fault) -> u8 {
    number_in(&FAULTS, &fault)
}

/// The position in a list, counted from 1.
fn number_in<T: PartialEq>(list: &[T], wanted: &T) -> u8 {
    let place = list.iter().position(|known| known == wanted);
    place.map_or(0, |place| u8::try_from(place + 1).unwrap_or(0))
}

#[derive(Debug)]
pub(super) enum Request {
    Hello {
        version: u16,
    },
    Transfer {
        bus: u32,
        judge: Judge,
        messages: Vec<Segment>,
    },
    /// More messages than a transfer may have.
    TooManyMessages,
    Smbus {
        bus: u32,
        address: u16,
        flags: u16,
        call: SmbusArgument,
        data: [u8; SMBUS_DATA_BYTES],
    },
    Step {
        bus: u32,
        address: u16,
        step: Step,
    },
    Stop,
    Pass {
        most: Duration,
        awaited: Option<Awaited>,
    },
}

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
    #[error("no such level: {0}")]
    Level(u8),
}

/// Parses a client's packet (without its length).
pub(super) fn parse(packet: &[u8]) -> Result<Request, Malformed> {
    let mut cursor = Cursor(packet);
    let request = match cursor.u8("kind").or(Err(Malformed::Empty))? {
        kind::HELLO => parse_hello(&mut cursor)?,
        kind::TRANSFER => return parse_transfer(cursor),
        kind::SMBUS => parse_smbus(&mut cursor)?,
        kind::STEP => parse_step(&mut cursor)?,
        kind::STOP => Request::Stop,
        kind::PASS => parse_pass(&mut cursor)?,
        other => return Err(Malformed::Kind(other)),
    };
    cursor.end()?;
    Ok(request)
}

fn parse_hello(cursor: &mut Cursor<'_>) -> Result<Request, Malformed> {
    if cursor.bytes(MAGIC.len(), "magic")? != MAGIC {
        return Err(Malformed::Magic);
    }
    let version = cursor.u16("version")?;
    if version != VERSION {
        // The rest of another version's hello is not ours to check.
        cursor.0 = &[];
    }
    Ok(Request::Hello { version })
}

fn parse_transfer(mut cursor: Cursor<'_>) -> Result<Request, Malformed> {
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
    let messages = (0..count).map(|_| parse_message(&mut cursor));
    let messages = messages.collect::<Result<_, _>>()?;
    cursor.end()?;
    Ok(Request::Transfer {
        bus,
        judge,
        messages,
    })
}

fn parse_message(cursor: &mut Cursor<'_>) -> Result<Segment, Malformed> {
    let address = cursor.u16("address")?;
    let flags = cursor.flags(message_flag::READ | message_flag::TEN_BIT)?;
    let length = usize::from(cursor.u16("length")?);
    let read = flags & message_flag::READ != 0;
    let bytes = match read {
        true => vec![0; length],
        false => cursor.bytes(length, "bytes to write")?.to_vec(),
    };
    let ten_bit = flags & message_flag::TEN_BIT != 0;
    Ok(Segment::new(address, ten_bit, read, bytes))
}

fn parse_smbus(cursor: &mut Cursor<'_>) -> Result<Request, Malformed> {
    Ok(Request::Smbus {
        bus: cursor.u32("bus")?,
        address: cursor.u16("address")?,
        flags: cursor.flags(smbus_flag::ALL)?,
        call: SmbusArgument {
            read_write: cursor.u8("direction")?,
            command: cursor.u8("command")?,
            size: cursor.u8("size")?.into(),
            data: 0,
        },
        data: cursor.array("data")?,
    })
}

fn parse_step(cursor: &mut Cursor<'_>) -> Result<Request, Malformed> {
    let (bus, address) = (cursor.u32("bus")?, cursor.u16("address")?);
    let flags = cursor.flags(message_flag::READ)?;
    let length = usize::from(cursor.u16("length")?);
    let step = match flags & message_flag::READ {
        0 => Step::Write(cursor.bytes(length, "bytes to write")?.to_vec()),
        _ => Step::Read(length),
    };
    Ok(Request::Step { bus, address, step })
}

fn parse_pass(cursor: &mut Cursor<'_>) -> Result<Request, Malformed> {
    let most = Duration::from_nanos(u64::from_le_bytes(cursor.array("time")?));
    let (pin, level) = (cursor.u16("pin")?, cursor.u8("level")?);
    let high = match level {
        0 | 1 => level == 1,
        other => return Err(Malformed::Level(other)),
    };
    let pin = (pin != NO_PIN).then_some(usize::from(pin));
    let awaited = pin.map(|pin| Awaited { pin, high });
    Ok(Request::Pass { most, awaited })
}

type What = &'static str;

#[derive(Clone, Copy, Debug)]
pub(super) struct Cursor<'a>(pub(super) &'a [u8]);

impl<'a> Cursor<'a> {
    pub(super) fn bytes(&mut self, count: usize, what: What) -> Result<&'a [u8], Malformed> {
        let parts = self.0.split_at_checked(count);
        let (head, rest) = parts.ok_or(Malformed::Short(what))?;
        self.0 = rest;
        Ok(head)
    }

    fn array<const N: usize>(&mut self, what: What) -> Result<[u8; N], Malformed> {
        let bytes = self.bytes(N, what)?;
        bytes.try_into().or(Err(Malformed::Short(what)))
    }

    fn flags(&mut self, known: u16) -> Result<u16, Malformed> {
        match self.u16("flags")? {
            flags if flags & !known != 0 => Err(Malformed::Flags(flags & !known)),
            flags => Ok(flags),
        }
    }

    pub(super) fn u8(&mut self, what: What) -> Result<u8, Malformed> {
        Ok(u8::from_le_bytes(self.array(what)?))
    }

    pub(super) fn u16(&mut self, what: What) -> Result<u16, Malformed> {
        Ok(u16::from_le_bytes(self.array(what)?))
    }

    pub(super) fn u32(&mut self, what: What) -> Result<u32, Malformed> {
        Ok(u32::from_le_bytes(self.array(what)?))
    }

    pub(super) fn end(&self) -> Result<(), Malformed> {
        match self.0.len() {
            0 => Ok(()),
            left => Err(Malformed::Long(left)),
        }
    }
}

pub(super) fn put_u16(out: &mut Vec<u8>, value: usize) {
    // Values were checked against limits far below.
    out.extend_from_slice(&u16::try_from(value).unwrap_or(u16::MAX).to_le_bytes());
}

/// Appends a packet of one kind to `out`; `fill` appends its content after the kind.
pub(super) fn append_packet(out: &mut Vec<u8>, kind: u8, fill: impl FnOnce(&mut Vec<u8>)) {
    let start = out.len();
    out.extend_from_slice(&[0; LENGTH_BYTES]);
    out.push(kind);
    fill(out);
    // Answers hold at most what one transfer reads, far below 4 GiB.
    let length = u32::try_from(out.len() - start - LENGTH_BYTES).unwrap_or(u32::MAX);
    if let Some(place) = out.get_mut(start..start + LENGTH_BYTES) {
        place.copy_from_slice(&length.to_le_bytes());
    }
}

/// Appends a `BYE` with a reason for programs and a text for people.
pub(super) fn append_bye(out: &mut Vec<u8>, reason: ByeReason, text: &str) {
    append_packet(out, kind::BYE, |out| {
        out.push(number_in(&ByeReason::ALL, &reason));
        out.extend_from_slice(text.as_bytes());
    });
}
