//! What one client may ask and what it is told: packets in, packets out, no socket.

use embedded_hal::i2c::Operation;

use super::wire::{
    ByeReason, Judge, MAGIC, Request, SMBUS_DATA_BYTES, SmbusCall, VERSION, WireMessage,
    append_bye, append_packet, fault_number, kind, parse, smbus_flag,
};
use crate::adapter::{EmulatedAdapter, Message, TransferError};
use crate::ioctl::{
    AdapterMode, CallerMemory, Errno, MESSAGE_BYTES_MAX, OpenFile, RDWR_MESSAGES_MAX, message_flag,
    request,
};
use crate::rack::{Rack, SharedAdapter};

/// Whether the client may go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Next {
    Serve,
    Close,
}

/// One connected client.
pub(super) struct Session {
    rack: Rack,
    mode: AdapterMode,
    greeted: bool,
}

impl Session {
    pub(super) fn new(rack: Rack, mode: AdapterMode) -> Self {
        Self {
            rack,
            mode,
            greeted: false,
        }
    }

    /// Answers one packet, its length already taken off, by appending a packet to `out`.
    pub(super) fn answer(&mut self, packet: &[u8], out: &mut Vec<u8>) -> Next {
        let request = match parse(packet) {
            Ok(request) => request,
            Err(malformed) => {
                append_bye(out, ByeReason::Malformed, &malformed.to_string());
                return Next::Close;
            }
        };
        if let Request::Hello { version } = request {
            return self.greet(version, out);
        }
        if !self.greeted {
            append_bye(out, ByeReason::Malformed, "a request before the hello");
            return Next::Close;
        }
        match request {
            Request::Transfer {
                bus,
                judge,
                messages,
            } => self.transfer(bus, judge, &messages, out),
            Request::Smbus { bus, call } => self.smbus(bus, &call, out),
            Request::TooManyMessages | Request::Hello { .. } => append_refusal(
                out,
                Errno::EINVAL,
                &format!("a transfer has at most {RDWR_MESSAGES_MAX} messages"),
            ),
        }
        Next::Serve
    }

    fn greet(&mut self, version: u16, out: &mut Vec<u8>) -> Next {
        if version != VERSION {
            let text = format!("this server speaks version {VERSION}, not {version}");
            append_bye(out, ByeReason::Version, &text);
            return Next::Close;
        }
        self.greeted = true;
        append_packet(out, kind::WELCOME, |out| {
            out.extend_from_slice(&MAGIC);
            out.extend_from_slice(&VERSION.to_le_bytes());
            out.extend_from_slice(&self.mode.functionality().to_le_bytes());
            let name = self.mode.name().as_bytes();
            out.push(u8::try_from(name.len()).unwrap_or(u8::MAX));
            out.extend_from_slice(name);
            let numbers: Vec<u32> = self
                .rack
                .iter()
                .map(|(number, _)| number)
                .take(usize::from(u16::MAX))
                .collect();
            out.extend_from_slice(
                &u16::try_from(numbers.len())
                    .unwrap_or(u16::MAX)
                    .to_le_bytes(),
            );
            for number in numbers {
                out.extend_from_slice(&number.to_le_bytes());
            }
        });
        Next::Serve
    }

    fn transfer(&self, bus: u32, judge: Judge, messages: &[WireMessage<'_>], out: &mut Vec<u8>) {
        let Some(mut adapter) = self.rack.get(bus) else {
            return append_refusal(out, Errno::ENODEV, &format!("there is no bus {bus}"));
        };
        match judge {
            Judge::Bus => self.plain(&mut adapter, messages, out),
            Judge::Rdwr => self.rdwr(adapter, messages, out),
            Judge::File => self.file(adapter, messages, out),
        }
    }

    /// The messages as they are, on the bus as it is.
    fn plain(&self, adapter: &mut SharedAdapter, messages: &[WireMessage<'_>], out: &mut Vec<u8>) {
        if messages
            .iter()
            .any(|message| message.length > MESSAGE_BYTES_MAX)
        {
            let text = format!("a message has at most {MESSAGE_BYTES_MAX} bytes");
            return append_refusal(out, Errno::EINVAL, &text);
        }
        let mut buffers: Vec<Vec<u8>> = messages.iter().map(read_buffer).collect();
        let outcome = {
            let mut transfer: Vec<Message<'_>> = messages
                .iter()
                .zip(&mut buffers)
                .map(|(message, buffer)| as_message(message, buffer))
                .collect();
            adapter.transfer(&mut transfer)
        };
        match outcome {
            Ok(()) => append_done(out, messages.len(), &buffers),
            Err(error) => {
                let errno = self.mode.errno(error.fault).map_or(0, Errno::raw);
                append_fault(out, error, errno, &buffers);
            }
        }
    }

    /// As I2C_RDWR.
    fn rdwr(&self, adapter: SharedAdapter, messages: &[WireMessage<'_>], out: &mut Vec<u8>) {
        let mut memory = Memory::for_messages(messages);
        let mut bus = Witness::new(adapter);
        let outcome =
            OpenFile::new(self.mode).ioctl(request::I2C_RDWR, Memory::START, &mut memory, &mut bus);
        match outcome {
            Ok(completed) => {
                let completed = usize::try_from(completed).unwrap_or(0);
                append_done(out, completed, &memory.read_buffers(messages));
            }
            Err(errno) => bus.append_failure(errno, out),
        }
    }

    /// As I2C_SLAVE and one read() or write().
    fn file(&self, adapter: SharedAdapter, messages: &[WireMessage<'_>], out: &mut Vec<u8>) {
        let [message] = messages else {
            let text = "read() and write() are one message each";
            return append_refusal(out, Errno::EINVAL, text);
        };
        let mut bus = Witness::new(adapter);
        let mut buffer = read_buffer(message);
        let ten_bit = message.flags & message_flag::TEN_BIT != 0;
        let outcome = self
            .open(message.address, ten_bit, false, &mut bus)
            .and_then(|mut file| {
                if message.flags & message_flag::READ == 0 {
                    file.write(message.bytes, &mut bus)
                } else {
                    file.read(&mut buffer, &mut bus)
                }
            });
        match outcome {
            Ok(bytes) => {
                buffer.truncate(bytes);
                // The mode `virtio` hides a fault in a count of zero bytes.
                append_done(out, usize::from(bus.last.is_none()), &[buffer]);
            }
            Err(errno) => bus.append_failure(errno, out),
        }
    }

    /// As I2C_SLAVE and I2C_SMBUS.
    fn smbus(&self, bus: u32, call: &SmbusCall, out: &mut Vec<u8>) {
        let Some(adapter) = self.rack.get(bus) else {
            return append_refusal(out, Errno::ENODEV, &format!("there is no bus {bus}"));
        };
        let mut bus = Witness::new(adapter);
        let mut memory = Memory::for_smbus(call);
        let ten_bit = call.flags & smbus_flag::TEN_BIT != 0;
        let force = call.flags & smbus_flag::FORCE != 0;
        let outcome = self
            .open(call.address, ten_bit, force, &mut bus)
            .and_then(|mut file| {
                let pec = u64::from(call.flags & smbus_flag::PEC != 0);
                file.ioctl(request::I2C_PEC, pec, &mut memory, &mut bus)?;
                file.ioctl(request::I2C_SMBUS, Memory::START, &mut memory, &mut bus)
            });
        match outcome {
            Ok(_) => append_done(out, 1, &[memory.smbus_data()]),
            Err(errno) => bus.append_failure(errno, out),
        }
    }

    /// A file on which I2C_TENBIT and I2C_SLAVE were called.
    fn open(
        &self,
        address: u16,
        ten_bit: bool,
        force: bool,
        bus: &mut Witness,
    ) -> Result<OpenFile, Errno> {
        let mut file = OpenFile::new(self.mode);
        let mut nothing = Memory(Vec::new());
        let select = if force {
            request::I2C_SLAVE_FORCE
        } else {
            request::I2C_SLAVE
        };
        file.ioctl(request::I2C_TENBIT, u64::from(ten_bit), &mut nothing, bus)?;
        file.ioctl(select, u64::from(address), &mut nothing, bus)?;
        Ok(file)
    }
}

fn read_buffer(message: &WireMessage<'_>) -> Vec<u8> {
    if message.flags & message_flag::READ == 0 {
        Vec::new()
    } else {
        vec![0; message.length]
    }
}

fn as_message<'a>(message: &WireMessage<'a>, buffer: &'a mut [u8]) -> Message<'a> {
    let operation = if message.flags & message_flag::READ == 0 {
        Operation::Write(message.bytes)
    } else {
        Operation::Read(buffer)
    };
    Message {
        address: message.address,
        ten_bit: message.flags & message_flag::TEN_BIT != 0,
        operation,
    }
}

/// `DONE`: how many messages, then the bytes that they read.
fn append_done(out: &mut Vec<u8>, completed: usize, buffers: &[Vec<u8>]) {
    append_packet(out, kind::DONE, |out| {
        append_completed(out, completed);
        append_read(out, completed, buffers);
    });
}

fn append_fault(out: &mut Vec<u8>, error: TransferError, errno: i32, buffers: &[Vec<u8>]) {
    append_packet(out, kind::FAULT, |out| {
        out.push(fault_number(error.fault));
        append_errno(out, errno);
        append_completed(out, error.completed);
        append_read(out, error.completed, buffers);
    });
}

fn append_refusal(out: &mut Vec<u8>, errno: Errno, text: &str) {
    append_packet(out, kind::REFUSED, |out| {
        append_errno(out, errno.raw());
        out.extend_from_slice(text.as_bytes());
    });
}

fn append_errno(out: &mut Vec<u8>, errno: i32) {
    out.extend_from_slice(&u16::try_from(errno).unwrap_or(u16::MAX).to_le_bytes());
}

fn append_completed(out: &mut Vec<u8>, completed: usize) {
    out.extend_from_slice(&u16::try_from(completed).unwrap_or(u16::MAX).to_le_bytes());
}

fn append_read(out: &mut Vec<u8>, completed: usize, buffers: &[Vec<u8>]) {
    for buffer in buffers.iter().take(completed) {
        out.extend_from_slice(buffer);
    }
}

/// A bus that remembers its last fault, which the errno alone does not tell.
struct Witness {
    adapter: SharedAdapter,
    last: Option<TransferError>,
}

impl Witness {
    fn new(adapter: SharedAdapter) -> Self {
        Self {
            adapter,
            last: None,
        }
    }

    /// `FAULT` if the bus failed, `REFUSED` if nothing reached it.
    fn append_failure(&self, errno: Errno, out: &mut Vec<u8>) {
        match self.last {
            Some(error) => append_fault(out, error, errno.raw(), &[]),
            None => append_refusal(out, errno, &errno.to_string()),
        }
    }
}

impl EmulatedAdapter for Witness {
    fn transfer(&mut self, messages: &mut [Message<'_>]) -> Result<(), TransferError> {
        let outcome = self.adapter.transfer(messages);
        self.last = outcome.err();
        outcome
    }
}

/// The memory of a caller of ioctl(): the argument, what it points at, and the buffers, one after the other.
struct Memory(Vec<u8>);

impl Memory {
    /// The address of the first byte; zero would be no pointer.
    const START: u64 = 4096;
    /// Bytes of `struct i2c_rdwr_ioctl_data` and of `struct i2c_smbus_ioctl_data` for pointers of 64 bits.
    const ARGUMENT_BYTES: usize = 16;
    /// Bytes of `struct i2c_msg`.
    const MESSAGE_BYTES: usize = 16;

    fn for_messages(messages: &[WireMessage<'_>]) -> Self {
        let mut memory = Self(Vec::new());
        memory.push(&address_of(Self::ARGUMENT_BYTES).to_ne_bytes());
        let count = u32::try_from(messages.len()).unwrap_or(u32::MAX);
        memory.push(&count.to_ne_bytes());
        memory.push(&[0; 4]);
        let mut buffer = Self::first_buffer(messages);
        for message in messages {
            memory.push(&message.address.to_ne_bytes());
            memory.push(&message.flags.to_ne_bytes());
            let length = u16::try_from(message.length).unwrap_or(u16::MAX);
            memory.push(&length.to_ne_bytes());
            memory.push(&[0; 2]);
            memory.push(&address_of(buffer).to_ne_bytes());
            buffer += message.length;
        }
        for message in messages {
            memory.push(message.bytes);
            let padding = message.length - message.bytes.len();
            memory.0.resize(memory.0.len() + padding, 0);
        }
        memory
    }

    fn for_smbus(call: &SmbusCall) -> Self {
        let mut memory = Self(Vec::new());
        memory.push(&[call.read_write, call.command, 0, 0]);
        memory.push(&u32::from(call.size).to_ne_bytes());
        memory.push(&address_of(Self::ARGUMENT_BYTES).to_ne_bytes());
        memory.push(&call.block);
        memory
    }

    fn first_buffer(messages: &[WireMessage<'_>]) -> usize {
        Self::ARGUMENT_BYTES + messages.len() * Self::MESSAGE_BYTES
    }

    /// What stands in the buffer of each message that reads; nothing for those that write.
    fn read_buffers(&self, messages: &[WireMessage<'_>]) -> Vec<Vec<u8>> {
        let mut rest = self
            .0
            .get(Self::first_buffer(messages)..)
            .unwrap_or_default();
        let mut buffers = Vec::with_capacity(messages.len());
        for message in messages {
            let (buffer, after) = rest.split_at_checked(message.length).unwrap_or_default();
            let read = message.flags & message_flag::READ != 0;
            buffers.push(if read { buffer.to_vec() } else { Vec::new() });
            rest = after;
        }
        buffers
    }

    fn smbus_data(&self) -> Vec<u8> {
        let start = Self::ARGUMENT_BYTES;
        self.0
            .get(start..start + SMBUS_DATA_BYTES)
            .unwrap_or_default()
            .to_vec()
    }

    fn push(&mut self, bytes: &[u8]) {
        self.0.extend_from_slice(bytes);
    }

    fn range(&mut self, address: u64, length: usize) -> Result<&mut [u8], Errno> {
        let start = address
            .checked_sub(Self::START)
            .and_then(|offset| usize::try_from(offset).ok())
            .ok_or(Errno::EFAULT)?;
        let end = start.checked_add(length).ok_or(Errno::EFAULT)?;
        self.0.get_mut(start..end).ok_or(Errno::EFAULT)
    }
}

/// The address of a byte of [`Memory`].
fn address_of(offset: usize) -> u64 {
    Memory::START + u64::try_from(offset).unwrap_or(0)
}

impl CallerMemory for Memory {
    fn read(&mut self, address: u64, into: &mut [u8]) -> Result<(), Errno> {
        into.copy_from_slice(self.range(address, into.len())?);
        Ok(())
    }

    fn write(&mut self, address: u64, bytes: &[u8]) -> Result<(), Errno> {
        self.range(address, bytes.len())?.copy_from_slice(bytes);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::wire::LENGTH_BYTES;
    use super::*;
    use crate::adapter::Fault;
    use proptest::prelude::*;

    /// Fails at one address, in the way that the address says.
    struct Odd;

    impl EmulatedAdapter for Odd {
        fn transfer(&mut self, messages: &mut [Message<'_>]) -> Result<(), TransferError> {
            match messages.iter().position(|message| message.address % 8 == 5) {
                Some(completed) => Err(TransferError {
                    completed,
                    fault: Fault::ArbitrationLost,
                }),
                None => Ok(()),
            }
        }
    }

    fn session(mode: AdapterMode) -> Session {
        let mut rack = Rack::new();
        rack.insert(1, SharedAdapter::new(Odd));
        let mut session = Session::new(rack, mode);
        let hello = [&[kind::HELLO][..], &MAGIC, &VERSION.to_le_bytes()].concat();
        assert_eq!(session.answer(&hello, &mut Vec::new()), Next::Serve);
        session
    }

    /// What a defect in a client would send: the right kind, and anything behind it.
    fn request() -> impl Strategy<Value = Vec<u8>> {
        let anything = proptest::collection::vec(any::<u8>(), 0..64);
        let small = proptest::collection::vec(0_u8..8, 0..64);
        (0_u8..5, prop_oneof![anything, small], any::<bool>()).prop_map(
            |(kind, mut rest, first_bus)| {
                if first_bus {
                    rest.splice(0..rest.len().min(4), [1, 0, 0, 0]);
                }
                rest.insert(0, kind);
                rest
            },
        )
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn each_request_has_exactly_one_answer(packet in request(), mode in 0_usize..7) {
            let mut session = session(AdapterMode::ALL[mode]);
            let mut out = vec![0xEE];
            let next = session.answer(&packet, &mut out);
            let (head, body) = out[1..].split_first_chunk::<LENGTH_BYTES>().unwrap();
            let length = usize::try_from(u32::from_le_bytes(*head)).unwrap();
            prop_assert_eq!(length, body.len());
            let farewell = body[0] == kind::BYE;
            prop_assert!((kind::WELCOME..=kind::BYE).contains(&body[0]));
            prop_assert_eq!(farewell, next == Next::Close);
        }
    }

    /// An adapter that lost arbitration for good ends, as I2C_RETRIES says, and does not try forever.
    #[test]
    fn a_lost_arbitration_is_retried_by_the_adapter_and_not_by_the_bare_bus() {
        use std::sync::Arc;
        use std::sync::atomic::{AtomicUsize, Ordering};

        struct Lost(Arc<AtomicUsize>);
        impl EmulatedAdapter for Lost {
            fn transfer(&mut self, _: &mut [Message<'_>]) -> Result<(), TransferError> {
                self.0.fetch_add(1, Ordering::Relaxed);
                Err(TransferError {
                    completed: 0,
                    fault: Fault::ArbitrationLost,
                })
            }
        }
        for (judge, tries) in [(0, 1), (1, 4)] {
            let count = Arc::new(AtomicUsize::new(0));
            let mut rack = Rack::new();
            rack.insert(1, SharedAdapter::new(Lost(Arc::clone(&count))));
            let mut session = Session::new(rack, AdapterMode::Pi5);
            session.greeted = true;
            let mut out = Vec::new();
            session.answer(&[2, 1, 0, 0, 0, judge, 1, 0, 0x69, 0, 1, 0, 1, 0], &mut out);
            assert_eq!(out, [6, 0, 0, 0, kind::FAULT, 4, 11, 0, 0, 0]);
            assert_eq!(count.load(Ordering::Relaxed), tries);
        }
    }
}
