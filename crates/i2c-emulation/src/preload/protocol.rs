//! The protocol between the preloaded library and the emulator, one source for both sides so that they cannot differ.
//!
//! A token is the descriptor that the program holds as its open file. Opening it sends a [`Hello`] with bus and access,
//! and the answer is an errno or 0. When the last copy in the last process closes, the file is closed. A channel
//! carries the calls of one process: a [`Hello`], then [`Request`]s, each with the memory that it will need. The
//! answers to a request are Peek (read this address: reply 1 and the bytes, or 0), Poke, and finally Done. Both are
//! connections to one abstract socket. A token's own name is the socket's name, `/t` and 16 digits, which are the
//! file's number in every request. The name identifies it after fork, exec and dup. Numbers have the machine's byte
//! order.

use core::ffi::CStr;

/// The environment variable: the socket's name, the secret and the buses, `NAME:SECRET:1,3`.
pub(crate) const ENVIRONMENT: &CStr = c"I2C_EMULATION_PRELOAD";
/// If this variable is `0`, requests carry no memory, to measure what that saves.
pub(crate) const ENVIRONMENT_PREFETCH: &CStr = c"I2C_EMULATION_PREFETCH";
/// The part of a token's name between the socket's name and its digits.
pub(crate) const TOKEN_MARK: &[u8] = b"/t";
/// The same part of a channel's name.
pub(crate) const CHANNEL_MARK: &[u8] = b"/c";
pub(crate) const NUMBER_DIGITS: usize = 16;
pub(crate) const NAME_BYTES_MAX: usize = 48;
pub(crate) const SECRET_DIGITS: usize = 32;
pub(crate) const BUSES_MAX: usize = 64;

/// The first number of a [`Hello`]; it changes with this protocol.
pub(crate) const VERSION: u32 = 0x6932_6302;
pub(crate) const HELLO_BYTES: usize = 32;
/// The size of the answer to a [`Hello`]: an errno or 0.
pub(crate) const WELCOME_BYTES: usize = 4;
pub(crate) const REQUEST_BYTES: usize = 40;
/// The size of the header of each piece of memory: its address and length.
pub(crate) const REGION_BYTES: usize = 16;
/// The largest request including its memory.
pub(crate) const REQUEST_BYTES_MAX: usize = 4096;
pub(crate) const ANSWER_BYTES: usize = 16;
/// The most bytes of one Peek or Poke.
pub(crate) const CHUNK_BYTES_MAX: usize = 2048;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    Channel,
    /// An open file of this bus, with these open() flags.
    Token {
        bus: u32,
        flags: u32,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Hello {
    pub(crate) purpose: Purpose,
    pub(crate) pointer_bytes: u8,
    pub(crate) secret: u128,
}

impl Hello {
    pub(crate) fn to_bytes(self) -> [u8; HELLO_BYTES] {
        let (kind, bus, flags) = match self.purpose {
            Purpose::Channel => (0, 0, 0),
            Purpose::Token { bus, flags } => (1, bus, flags),
        };
        let kind = kind | u32::from(self.pointer_bytes) << 8;
        let [low, high] = halves(self.secret);
        pack(&[joined(VERSION, kind), low, high, joined(bus, flags)])
    }

    /// `None` for another version, an unknown purpose, or a pointer size other than 4 or 8.
    pub(crate) fn parse(bytes: &[u8; HELLO_BYTES]) -> Option<Self> {
        let [version, kind] = parted(u64_at(bytes, 0));
        let [bus, flags] = parted(u64_at(bytes, 24));
        let purpose = match kind & 0xFF {
            0 => Purpose::Channel,
            1 => Purpose::Token { bus, flags },
            _ => return None,
        };
        let pointer_bytes = u8::try_from(kind >> 8).ok()?;
        let known = version == VERSION && matches!(pointer_bytes, 4 | 8);
        known.then_some(Self {
            purpose,
            pointer_bytes,
            secret: u128::from(u64_at(bytes, 8)) | u128::from(u64_at(bytes, 16)) << 64,
        })
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Call {
    Ioctl { request: u32, argument: u64 },
    Read { buffer: u64, length: u64 },
    Write { buffer: u64, length: u64 },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Request {
    pub(crate) file: u64,
    pub(crate) call: Call,
    /// The bytes of memory that follow, headers included.
    pub(crate) memory_bytes: u32,
}

impl Request {
    pub(crate) fn to_bytes(self) -> [u8; REQUEST_BYTES] {
        let (kind, first, second) = match self.call {
            Call::Ioctl { request, argument } => (joined(1, request), argument, 0),
            Call::Read { buffer, length } => (2, buffer, length),
            Call::Write { buffer, length } => (3, buffer, length),
        };
        pack(&[self.file, kind, first, second, self.memory_bytes.into()])
    }

    /// `None` for an unknown call or too much memory.
    pub(crate) fn parse(bytes: &[u8; REQUEST_BYTES]) -> Option<Self> {
        let [kind, request] = parted(u64_at(bytes, 8));
        let (buffer, length) = (u64_at(bytes, 16), u64_at(bytes, 24));
        let argument = buffer;
        let call = match kind {
            1 => Call::Ioctl { request, argument },
            2 => Call::Read { buffer, length },
            3 => Call::Write { buffer, length },
            _ => return None,
        };
        let memory_bytes = u32::try_from(u64_at(bytes, 32)).ok()?;
        let length = usize::try_from(memory_bytes).ok()?;
        (length <= REQUEST_BYTES_MAX - REQUEST_BYTES).then_some(Self {
            file: u64_at(bytes, 0),
            call,
            memory_bytes,
        })
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Answer {
    /// Asks for the bytes at this address.
    Peek { address: u64, length: u32 },
    /// Writes the following bytes to this address.
    Poke { address: u64, length: u32 },
    /// Ends the call with its result, or an errno as a negative number.
    Done(i64),
}

impl Answer {
    pub(crate) fn to_bytes(self) -> [u8; ANSWER_BYTES] {
        pack(&match self {
            Self::Peek { address, length } => [joined(1, length), address],
            Self::Poke { address, length } => [joined(2, length), address],
            Self::Done(result) => [3, u64::from_ne_bytes(result.to_ne_bytes())],
        })
    }

    /// `None` for an unknown kind or an oversized piece.
    pub(crate) fn parse(bytes: &[u8; ANSWER_BYTES]) -> Option<Self> {
        let ([kind, length], address) = (parted(u64_at(bytes, 0)), u64_at(bytes, 8));
        let fits = usize::try_from(length).is_ok_and(|length| length <= CHUNK_BYTES_MAX);
        match kind {
            1 if fits => Some(Self::Peek { address, length }),
            2 if fits => Some(Self::Poke { address, length }),
            3 => Some(Self::Done(i64::from_ne_bytes(address.to_ne_bytes()))),
            _ => None,
        }
    }
}

/// The header of a piece of memory that accompanies a request.
pub(crate) fn region_header(address: u64, length: u64) -> [u8; REGION_BYTES] {
    pack(&[address, length])
}

/// The number at the end of a token's or channel's name, if it belongs to this socket.
pub(crate) fn number_of(name: &[u8], socket: &[u8], mark: &[u8]) -> Option<u64> {
    let digits = name.strip_prefix(socket)?.strip_prefix(mark)?;
    u64::try_from(hexadecimal(digits, NUMBER_DIGITS)?).ok()
}

/// The value of exactly this many lower-case hexadecimal digits.
pub(crate) fn hexadecimal(digits: &[u8], count: usize) -> Option<u128> {
    if digits.len() != count {
        return None;
    }
    digits.iter().try_fold(0, |number, digit| {
        let value = match digit {
            b'0'..=b'9' => digit - b'0',
            b'a'..=b'f' => digit - b'a' + 10,
            _ => return None,
        };
        Some(number << 4 | u128::from(value))
    })
}

pub(crate) fn digits_of(number: u64) -> [u8; NUMBER_DIGITS] {
    let mut digits = [b'0'; NUMBER_DIGITS];
    let bytes = number.to_be_bytes().into_iter();
    let halves = bytes.flat_map(|byte| [byte >> 4, byte & 0xF]);
    for (digit, half) in digits.iter_mut().zip(halves) {
        *digit = half + if half < 10 { b'0' } else { b'a' - 10 };
    }
    digits
}

/// Four bytes as a number; bytes past the end count as zero.
pub(crate) fn u32_at(bytes: &[u8], offset: usize) -> u32 {
    u32::from_ne_bytes(array(bytes, offset))
}

/// Eight bytes as a number; bytes past the end count as zero.
pub(crate) fn u64_at(bytes: &[u8], offset: usize) -> u64 {
    u64::from_ne_bytes(array(bytes, offset))
}

fn array<const N: usize>(bytes: &[u8], offset: usize) -> [u8; N] {
    let mut array = [0; N];
    for (to, from) in array.iter_mut().zip(bytes.iter().skip(offset)) {
        *to = *from;
    }
    array
}

fn pack<const BYTES: usize>(words: &[u64]) -> [u8; BYTES] {
    let mut bytes = [0; BYTES];
    let from = words.iter().flat_map(|word| word.to_ne_bytes());
    for (to, from) in bytes.iter_mut().zip(from) {
        *to = from;
    }
    bytes
}

fn joined(low: u32, high: u32) -> u64 {
    u64::from(low) | u64::from(high) << 32
}

fn parted(word: u64) -> [u32; 2] {
    [word & 0xFFFF_FFFF, word >> 32].map(|half| u32::try_from(half).unwrap_or(0))
}

fn halves(number: u128) -> [u64; 2] {
    let low = u128::from(u64::MAX);
    [number & low, number >> 64].map(|half| u64::try_from(half).unwrap_or(0))
}
