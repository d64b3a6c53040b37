//! What the preloaded library and the emulator say to each other: one source for both, so that they cannot differ.
//!
//! ```text
//!  a token: what the program holds as its open file           a channel: what carries the calls of one process
//!  library ── Hello(bus, access) ──▶ emulator                 library ── Hello ──▶ emulator
//!          ◀── errno or 0 ─────────                                   ◀── errno or 0 ──
//!  nothing more; when its last copy in the last process        library ── Request, memory that it will need ──▶ emulator
//!  closes, the file is closed                                          ◀── Peek: what is at this address? ── (seldom)
//!                                                                      ── 1 and the bytes, or 0 ──────────▶
//!                                                                      ◀── Poke…, Done ──
//! ```
//!
//! Both are connections to one socket without a path. A token's own name is the socket's name, `/t` and 16 digits; they
//! are the file's number in every request. So a token is known again after fork, exec and dup by asking for its name.
//! Numbers have the machine's byte order: both ends are on one machine.

/// The environment variable: the socket's name, the secret and the buses, `NAME:SECRET:1,3`.
pub(crate) const ENVIRONMENT: &str = "I2C_EMULATION_PRELOAD";
/// If this variable is `0`, no memory is sent along with a request: for measuring what that saves.
pub(crate) const ENVIRONMENT_PREFETCH: &str = "I2C_EMULATION_PREFETCH";
/// What the name of a token has between the socket's name and its digits.
pub(crate) const TOKEN_MARK: &[u8] = b"/t";
/// The same of a channel.
pub(crate) const CHANNEL_MARK: &[u8] = b"/c";
/// Hexadecimal digits after the mark.
pub(crate) const NUMBER_DIGITS: usize = 16;
/// Most bytes of the socket's name.
pub(crate) const NAME_BYTES_MAX: usize = 48;
/// Bytes of the secret; it is written as twice as many digits.
pub(crate) const SECRET_BYTES: usize = 16;
/// Most buses that the library knows.
pub(crate) const BUSES_MAX: usize = 64;

/// First number of a [`Hello`]; it changes with this protocol.
pub(crate) const VERSION: u32 = 0x6932_6301;
/// Bytes of a [`Hello`].
pub(crate) const HELLO_BYTES: usize = 32;
/// Bytes of the answer to a [`Hello`]: an errno, or 0.
pub(crate) const WELCOME_BYTES: usize = 4;
/// Bytes of a [`Request`] without the memory that follows it.
pub(crate) const REQUEST_BYTES: usize = 40;
/// Bytes in front of each piece of memory: its address and its length.
pub(crate) const REGION_BYTES: usize = 16;
/// Most bytes of a request with all memory that goes with it.
pub(crate) const REQUEST_BYTES_MAX: usize = 4096;
/// Bytes in front of each piece of an answer.
pub(crate) const ANSWER_BYTES: usize = 16;
/// Most bytes that one Peek asks for or one Poke carries.
pub(crate) const CHUNK_BYTES_MAX: usize = 2048;

/// What a connection is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// Calls.
    Channel,
    /// An open file of this bus, with these flags of open().
    Token { bus: u32, flags: u32 },
}

/// First words of a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Hello {
    pub(crate) purpose: Purpose,
    /// Bytes of a pointer.
    pub(crate) pointer_bytes: u8,
    pub(crate) secret: [u8; SECRET_BYTES],
}

impl Hello {
    pub(crate) fn to_bytes(self) -> [u8; HELLO_BYTES] {
        let mut bytes = [0; HELLO_BYTES];
        let (kind, bus, flags) = match self.purpose {
            Purpose::Channel => (0, 0, 0),
            Purpose::Token { bus, flags } => (1, bus, flags),
        };
        put(&mut bytes, 0, &VERSION.to_ne_bytes());
        put(&mut bytes, 4, &[kind, self.pointer_bytes]);
        put(&mut bytes, 8, &self.secret);
        put(&mut bytes, 24, &bus.to_ne_bytes());
        put(&mut bytes, 28, &flags.to_ne_bytes());
        bytes
    }

    /// `None` for another version, an unknown purpose or a pointer of another size than 4 or 8.
    pub(crate) fn parse(bytes: &[u8; HELLO_BYTES]) -> Option<Self> {
        let [.., kind, pointer_bytes] = array::<6>(bytes, 0);
        let purpose = match kind {
            0 => Purpose::Channel,
            1 => Purpose::Token {
                bus: u32_at(bytes, 24),
                flags: u32_at(bytes, 28),
            },
            _ => return None,
        };
        let known = u32_at(bytes, 0) == VERSION && matches!(pointer_bytes, 4 | 8);
        known.then_some(Self {
            purpose,
            pointer_bytes,
            secret: array(bytes, 8),
        })
    }
}

/// Which system call it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Call {
    /// ioctl(): request number and argument.
    Ioctl { request: u32, argument: u64 },
    /// read(): buffer and length.
    Read { buffer: u64, length: u64 },
    /// write(): buffer and length.
    Write { buffer: u64, length: u64 },
}

/// One call on an open file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Request {
    /// The digits of the token's name.
    pub(crate) file: u64,
    pub(crate) call: Call,
    /// Bytes of memory that follow, headers included.
    pub(crate) memory_bytes: u32,
}

impl Request {
    pub(crate) fn to_bytes(self) -> [u8; REQUEST_BYTES] {
        let mut bytes = [0; REQUEST_BYTES];
        let (kind, request, first, second) = match self.call {
            Call::Ioctl { request, argument } => (1u32, request, argument, 0),
            Call::Read { buffer, length } => (2, 0, buffer, length),
            Call::Write { buffer, length } => (3, 0, buffer, length),
        };
        put(&mut bytes, 0, &self.file.to_ne_bytes());
        put(&mut bytes, 8, &kind.to_ne_bytes());
        put(&mut bytes, 12, &request.to_ne_bytes());
        put(&mut bytes, 16, &first.to_ne_bytes());
        put(&mut bytes, 24, &second.to_ne_bytes());
        put(&mut bytes, 32, &self.memory_bytes.to_ne_bytes());
        bytes
    }

    /// `None` for an unknown call or more memory than there may be.
    pub(crate) fn parse(bytes: &[u8; REQUEST_BYTES]) -> Option<Self> {
        let (first, second) = (u64_at(bytes, 16), u64_at(bytes, 24));
        let call = match u32_at(bytes, 8) {
            1 => Call::Ioctl {
                request: u32_at(bytes, 12),
                argument: first,
            },
            2 => Call::Read {
                buffer: first,
                length: second,
            },
            3 => Call::Write {
                buffer: first,
                length: second,
            },
            _ => return None,
        };
        let memory_bytes = u32_at(bytes, 32);
        let fits = usize::try_from(memory_bytes)
            .is_ok_and(|length| length <= REQUEST_BYTES_MAX - REQUEST_BYTES);
        fits.then_some(Self {
            file: u64_at(bytes, 0),
            call,
            memory_bytes,
        })
    }
}

/// A piece of an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Answer {
    /// Send what is at this address.
    Peek { address: u64, length: u32 },
    /// Put the bytes that follow at this address.
    Poke { address: u64, length: u32 },
    /// The call is over: its result, or an errno as a negative number.
    Done(i64),
}

impl Answer {
    pub(crate) fn to_bytes(self) -> [u8; ANSWER_BYTES] {
        let mut bytes = [0; ANSWER_BYTES];
        let (kind, length, value) = match self {
            Self::Peek { address, length } => (1u32, length, address.to_ne_bytes()),
            Self::Poke { address, length } => (2, length, address.to_ne_bytes()),
            Self::Done(result) => (3, 0, result.to_ne_bytes()),
        };
        put(&mut bytes, 0, &kind.to_ne_bytes());
        put(&mut bytes, 4, &length.to_ne_bytes());
        put(&mut bytes, 8, &value);
        bytes
    }

    /// `None` for an unknown kind or a piece that is too long.
    pub(crate) fn parse(bytes: &[u8; ANSWER_BYTES]) -> Option<Self> {
        let (length, address) = (u32_at(bytes, 4), u64_at(bytes, 8));
        let fits = usize::try_from(length).is_ok_and(|length| length <= CHUNK_BYTES_MAX);
        match u32_at(bytes, 0) {
            1 if fits => Some(Self::Peek { address, length }),
            2 if fits => Some(Self::Poke { address, length }),
            3 => Some(Self::Done(i64::from_ne_bytes(array(bytes, 8)))),
            _ => None,
        }
    }
}

/// In front of a piece of memory that goes with a request.
pub(crate) fn region_header(address: u64, length: u64) -> [u8; REGION_BYTES] {
    let mut bytes = [0; REGION_BYTES];
    put(&mut bytes, 0, &address.to_ne_bytes());
    put(&mut bytes, 8, &length.to_ne_bytes());
    bytes
}

/// The number that the name of a token or channel ends in, if it is one of this socket's.
pub(crate) fn number_of(name: &[u8], socket: &[u8], mark: &[u8]) -> Option<u64> {
    let digits = name.strip_prefix(socket)?.strip_prefix(mark)?;
    if digits.len() != NUMBER_DIGITS {
        return None;
    }
    digits.iter().try_fold(0, |number, digit| {
        Some(number << 4 | u64::from(value_of_digit(*digit)?))
    })
}

/// The digits of a token's or channel's number.
pub(crate) fn digits_of(number: u64) -> [u8; NUMBER_DIGITS] {
    let mut digits = [b'0'; NUMBER_DIGITS];
    let halves = number
        .to_be_bytes()
        .into_iter()
        .flat_map(|byte| [byte >> 4, byte & 0xF]);
    for (digit, half) in digits.iter_mut().zip(halves) {
        *digit = if half < 10 {
            b'0' + half
        } else {
            b'a' + half - 10
        };
    }
    digits
}

/// The value of a hexadecimal digit in lower case.
pub(crate) fn value_of_digit(digit: u8) -> Option<u8> {
    match digit {
        b'0'..=b'9' => Some(digit - b'0'),
        b'a'..=b'f' => Some(digit - b'a' + 10),
        _ => None,
    }
}

/// Four bytes as a number; what lies beyond the end counts as zero.
pub(crate) fn u32_at(bytes: &[u8], offset: usize) -> u32 {
    u32::from_ne_bytes(array(bytes, offset))
}

/// Eight bytes as a number; what lies beyond the end counts as zero.
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

fn put(bytes: &mut [u8], offset: usize, what: &[u8]) {
    for (to, from) in bytes.iter_mut().skip(offset).zip(what) {
        *to = *from;
    }
}
