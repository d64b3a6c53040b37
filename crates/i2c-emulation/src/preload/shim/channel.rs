//! The connections for calls; each call takes a free one. A holder is a process number: a child forked during another
//! thread's call finds its parent's mark and takes the slot over, with its own connection.

use super::super::protocol::{
    ANSWER_BYTES, Answer, CHANNEL_MARK, CHUNK_BYTES_MAX, Call, Hello, Purpose, REGION_BYTES,
    REQUEST_BYTES, REQUEST_BYTES_MAX, Request, TOKEN_MARK, WELCOME_BYTES, digits_of, number_of,
    region_header, u32_at, u64_at,
};
use super::setting::{self, Setting};
use super::system::{self, EADDRINUSE, EFAULT, EINVAL, ENOTCONN, Errno, SocketName};
use core::ffi::c_int;
use core::sync::atomic::{AtomicI32, AtomicU32, AtomicU64, Ordering};

/// The most calls of one process in progress at once; more wait.
const CHANNELS: usize = 8;
/// Channels avoid low descriptor numbers, which programs rely on.
const DESCRIPTOR_MIN: usize = 900;
const POINTER_BYTES: usize = size_of::<usize>();
/// The most messages of one I2C_RDWR to send along; beyond that, only the array is sent.
const MESSAGES_MAX: usize = 42;

const I2C_RDWR: u32 = 0x0707;
const I2C_SMBUS: u32 = 0x0720;
/// Bytes of `union i2c_smbus_data`.
const SMBUS_DATA_BYTES: usize = 34;
/// The most bytes of one write that reach the bus.
const WRITE_BYTES_MAX: u64 = 8192;

struct Channel {
    /// The process that uses it, or 0.
    holder: AtomicI32,
    /// The process that connected it.
    owner: AtomicI32,
    descriptor: AtomicI32,
    /// The number in its name, which shows whether its descriptor is still the same.
    number: AtomicU64,
}

static CHANNELS_OF_PROCESS: [Channel; CHANNELS] = [const {
    Channel {
        holder: AtomicI32::new(0),
        owner: AtomicI32::new(0),
        descriptor: AtomicI32::new(-1),
        number: AtomicU64::new(0),
    }
}; CHANNELS];

pub(super) fn open(bus: u32, flags: u32, close_on_exec: bool) -> Result<c_int, Errno> {
    let setting = setting::get().ok_or(ENOTCONN)?;
    let purpose = Purpose::Token { bus, flags };
    connect(setting, purpose, TOKEN_MARK, close_on_exec).map(|(token, _)| token)
}

/// Makes the emulator carry out a call on an open file. The result is not negative.
pub(super) fn perform(file: u64, call: Call) -> Result<usize, Errno> {
    let setting = setting::get().ok_or(ENOTCONN)?;
    let process = system::own_pid();
    let channel = take(process);
    let outcome = match channel.connected(setting, process) {
        Ok(descriptor) => {
            let outcome = converse(descriptor, setting.prefetch, file, call);
            if outcome.is_err() {
                // The channel may hold half a conversation.
                channel.discard(setting);
            }
            outcome
        }
        Err(errno) => Err(errno),
    };
    channel.holder.store(0, Ordering::Release);
    let result = outcome?;
    usize::try_from(result).map_err(|_negative| Errno::try_from(-result).unwrap_or(EINVAL))
}

fn take(process: i32) -> &'static Channel {
    loop {
        for channel in &CHANNELS_OF_PROCESS {
            let holder = channel.holder.load(Ordering::Relaxed);
            let (taken, not_taken) = (Ordering::Acquire, Ordering::Relaxed);
            let mark = &channel.holder;
            let take = || mark.compare_exchange(holder, process, taken, not_taken);
            if holder != process && take().is_ok() {
                return channel;
            }
        }
        system::give_way();
    }
}

impl Channel {
    fn connected(&self, setting: &Setting, process: i32) -> Result<c_int, Errno> {
        let descriptor = self.descriptor.load(Ordering::Relaxed);
        let own = self.owner.load(Ordering::Relaxed) == process;
        if own && self.is(setting, descriptor) {
            return Ok(descriptor);
        }
        self.discard(setting);
        let (socket, number) = connect(setting, Purpose::Channel, CHANNEL_MARK, true)?;
        let descriptor = system::move_up(socket, DESCRIPTOR_MIN);
        self.number.store(number, Ordering::Relaxed);
        self.descriptor.store(descriptor, Ordering::Relaxed);
        self.owner.store(process, Ordering::Relaxed);
        Ok(descriptor)
    }

    /// Whether the descriptor is still this channel's: the program may have closed it and opened something else there.
    fn is(&self, setting: &Setting, descriptor: c_int) -> bool {
        let named = |name: &[u8]| number_of(name, setting.socket(), CHANNEL_MARK);
        descriptor >= 0
            && system::with_own_name(descriptor, named) == Some(self.number.load(Ordering::Relaxed))
    }

    fn discard(&self, setting: &Setting) {
        let descriptor = self.descriptor.swap(-1, Ordering::Relaxed);
        if self.is(setting, descriptor) {
            system::close(descriptor);
        }
    }
}

fn connect(
    setting: &Setting,
    purpose: Purpose,
    mark: &[u8],
    close_on_exec: bool,
) -> Result<(c_int, u64), Errno> {
    let socket = system::socket(close_on_exec)?;
    let connected = name(socket, setting, mark).and_then(|number| {
        let greeted = greet(socket, setting, purpose);
        greeted.map_err(dead).map(|()| (socket, number))
    });
    connected.inspect_err(|_| system::close(socket))
}

fn name(socket: c_int, setting: &Setting, mark: &[u8]) -> Result<u64, Errno> {
    static NEXT: AtomicU32 = AtomicU32::new(0);
    /// A token outlives the process that opened it, and another process may then have the same number.
    const TRIES_MAX: u32 = 10_000;
    let process = u64::try_from(system::own_pid()).unwrap_or(0);
    for _ in 0..TRIES_MAX {
        let number = process << 32 | u64::from(NEXT.fetch_add(1, Ordering::Relaxed));
        let name = SocketName::new(&[setting.socket(), mark, &digits_of(number)]);
        match system::bind(socket, &name) {
            Err(EADDRINUSE) => {}
            outcome => return outcome.map(|()| number),
        }
    }
    Err(EADDRINUSE)
}

fn greet(socket: c_int, setting: &Setting, purpose: Purpose) -> Result<(), Errno> {
    system::connect(socket, &SocketName::new(&[setting.socket()]))?;
    let hello = Hello {
        purpose,
        pointer_bytes: u8::try_from(POINTER_BYTES).unwrap_or(0),
        secret: setting.secret,
    };
    system::send(socket, &hello.to_bytes())?;
    let mut welcome = [0; WELCOME_BYTES];
    let mut filled = 0;
    while let Some(rest) = welcome.get_mut(filled..).filter(|rest| !rest.is_empty()) {
        filled += system::receive(socket, rest)?;
    }
    match Errno::try_from(u32_at(&welcome, 0)) {
        Ok(0) => Ok(()),
        Ok(errno) => Err(errno),
        Err(_) => Err(EINVAL),
    }
}

/// Reports a lost emulator as a dead bus, as with FUSE. The emulator's own errors pass through.
fn dead(errno: Errno) -> Errno {
    const EPIPE: Errno = 32;
    const ECONNRESET: Errno = 104;
    const ECONNREFUSED: Errno = 111;
    match errno {
        EPIPE | ECONNRESET | ECONNREFUSED => ENOTCONN,
        other => other,
    }
}

fn converse(descriptor: c_int, prefetch: bool, file: u64, call: Call) -> Result<i64, Errno> {
    let mut buffer = [0; REQUEST_BYTES_MAX];
    let mut memory = Memory {
        buffer: &mut buffer,
        used: REQUEST_BYTES,
    };
    if prefetch {
        memory.add_for(call);
    }
    let used = memory.used;
    let request = Request {
        file,
        call,
        memory_bytes: u32::try_from(used - REQUEST_BYTES).unwrap_or(0),
    };
    if let Some(front) = buffer.first_chunk_mut() {
        *front = request.to_bytes();
    }
    system::send(descriptor, buffer.get(..used).unwrap_or(&[])).map_err(dead)?;
    listen(descriptor, &mut buffer).map_err(dead)
}

/// The memory that the emulator will ask for, as far as it is predictable and readable. Sending it along saves a round
/// trip per piece; only the emulator interprets it.
struct Memory<'a> {
    buffer: &'a mut [u8; REQUEST_BYTES_MAX],
    used: usize,
}

impl Memory<'_> {
    fn add_for(&mut self, call: Call) {
        match call {
            Call::Ioctl { request, argument } => match request {
                I2C_SMBUS => self.add_smbus(argument),
                I2C_RDWR => self.add_messages(argument),
                _ => {}
            },
            Call::Write { buffer, length } => {
                let length = usize::try_from(length.min(WRITE_BYTES_MAX)).unwrap_or(0);
                let _ = self.add(buffer, length);
            }
            Call::Read { .. } => {}
        }
    }

    /// The structure, and the union its pointer refers to.
    fn add_smbus(&mut self, argument: u64) {
        let at = self.add(argument, 8 + POINTER_BYTES);
        let pointer = at.map_or(0, |at| self.pointer(at + 8));
        if pointer != 0 {
            let _ = self.add(pointer, SMBUS_DATA_BYTES);
        }
    }

    fn add_messages(&mut self, argument: u64) {
        const MESSAGE_BYTES: usize = 8 + POINTER_BYTES;
        let Some(at) = self.add(argument, 2 * POINTER_BYTES) else {
            return;
        };
        let count = usize::try_from(u32_at(self.buffer, at + POINTER_BYTES)).unwrap_or(0);
        if count > MESSAGES_MAX {
            return;
        }
        let Some(first) = self.add(self.pointer(at), count * MESSAGE_BYTES) else {
            return;
        };
        for message in 0..count {
            let at = first + message * MESSAGE_BYTES;
            let [low, high, ..] = u32_at(self.buffer, at + 4).to_ne_bytes();
            let length = usize::from(u16::from_ne_bytes([low, high]));
            if self.add(self.pointer(at + 8), length).is_none() {
                return;
            }
        }
    }

    /// The position of the bytes in the buffer; `None` if they are not readable or do not fit.
    fn add(&mut self, address: u64, length: usize) -> Option<usize> {
        let start = self.used + REGION_BYTES;
        let end = start.checked_add(length)?;
        system::peek(address, self.buffer.get_mut(start..end)?).ok()?;
        let header = region_header(address, u64::try_from(length).ok()?);
        let place = self.buffer.get_mut(self.used..start)?;
        place.copy_from_slice(&header);
        self.used = end;
        Some(start)
    }

    fn pointer(&self, at: usize) -> u64 {
        if POINTER_BYTES == 8 {
            u64_at(self.buffer, at)
        } else {
            u32_at(self.buffer, at).into()
        }
    }
}

/// Answers the emulator's requests until it is done. Unwritable memory turns the call's result into EFAULT.
fn listen(descriptor: c_int, buffer: &mut [u8; REQUEST_BYTES_MAX]) -> Result<i64, Errno> {
    let mut inbox = Inbox {
        descriptor,
        buffer,
        start: 0,
        end: 0,
    };
    let mut written = Ok(());
    loop {
        let header = inbox.take(ANSWER_BYTES)?;
        match header.first_chunk().and_then(Answer::parse) {
            Some(Answer::Peek { address, length }) => show(descriptor, address, length)?,
            Some(Answer::Poke { address, length }) => {
                let bytes = inbox.take(usize::try_from(length).unwrap_or(0))?;
                written = written.and_then(|()| system::poke(address, bytes));
            }
            Some(Answer::Done(result)) => {
                return Ok(written.map_or_else(|errno| -i64::from(errno), |()| result));
            }
            None => return Err(ENOTCONN),
        }
    }
}

/// Bytes that have arrived but were not processed.
struct Inbox<'a> {
    descriptor: c_int,
    buffer: &'a mut [u8; REQUEST_BYTES_MAX],
    start: usize,
    end: usize,
}

impl Inbox<'_> {
    fn take(&mut self, length: usize) -> Result<&[u8], Errno> {
        if self.start > 0 && self.start == self.end {
            (self.start, self.end) = (0, 0);
        }
        if self.start + length > self.buffer.len() {
            self.buffer.copy_within(self.start..self.end, 0);
            (self.start, self.end) = (0, self.end - self.start);
        }
        while self.end - self.start < length {
            let room = self.buffer.get_mut(self.end..).ok_or(ENOTCONN)?;
            self.end += system::receive(self.descriptor, room)?;
        }
        let taken = self.buffer.get(self.start..self.start + length);
        self.start += length;
        taken.ok_or(ENOTCONN)
    }
}

#[inline(never)]
fn show(descriptor: c_int, address: u64, length: u32) -> Result<(), Errno> {
    let mut bytes = [0; 1 + CHUNK_BYTES_MAX];
    let length = usize::try_from(length).unwrap_or(0);
    let there = bytes
        .get_mut(1..=length)
        .ok_or(EFAULT)
        .and_then(|room| system::peek(address, room));
    let said = match there {
        Ok(()) => {
            bytes[0] = 1;
            bytes.get(..=length)
        }
        Err(_) => bytes.get(..1),
    };
    system::send(descriptor, said.unwrap_or(&[]))
}
