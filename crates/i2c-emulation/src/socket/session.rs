//! One client's requests and answers: packets in, packets out, no socket.

use super::conversation::{Conversation, Step};
use super::wire::{
    ByeReason, Judge, MAGIC, Request, VERSION, append_bye, append_packet, fault_number, kind,
    parse, put_u16, smbus_flag,
};
use crate::adapter::{EmulatedAdapter, Fault, Message, TransferError};
use crate::ioctl::{AdapterMode, Errno, MESSAGE_BYTES_MAX, OpenFile, RDWR_MESSAGES_MAX, Segment};
use crate::rack::{Awaited, Rack, SharedAdapter};
use std::time::Duration;

/// The longest time that one request lets pass.
pub const PASS_MAX: Duration = Duration::from_secs(1);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Next {
    Serve,
    Close,
}

/// A client's conversation with the buses of a rack, without a socket: for a client in the same process.
pub struct Session {
    rack: Rack,
    mode: AdapterMode,
    greeted: bool,
    /// The client's transaction that has not stopped yet.
    open: Option<Conversation>,
}

impl Session {
    /// A conversation that begins with the client's hello.
    #[must_use]
    pub fn new(rack: Rack, mode: AdapterMode) -> Self {
        Self {
            rack,
            mode,
            greeted: false,
            open: None,
        }
    }

    /// Answers one packet (without its length) with a packet (with its length).
    #[must_use]
    pub fn exchange(&mut self, packet: &[u8]) -> Vec<u8> {
        let mut out = Vec::new();
        // Who breaks the protocol is told so, and may begin again.
        self.answer(packet, &mut out);
        out
    }

    /// Answers one packet (without its length) by appending a packet to `out`.
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
            Request::Transfer { bus, .. } | Request::Smbus { bus, .. } => {
                // It would wait for itself.
                self.stop();
                match self.rack.get(bus) {
                    Some(adapter) => self.carry_out(request, adapter, out),
                    None => append_no_bus(out, bus),
                }
            }
            Request::Step { bus, address, step } => self.step(bus, address, step, out),
            Request::Stop => {
                self.stop();
                append_done(out, 0, &[]);
            }
            Request::Pass { most, awaited } => self.pass(most, awaited, out),
            Request::TooManyMessages | Request::Hello { .. } => {
                let text = format!("a transfer has at most {RDWR_MESSAGES_MAX} messages");
                append_refusal(out, Errno::INVAL, &text);
            }
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
            let numbers = || self.rack.iter().take(usize::from(u16::MAX));
            put_u16(out, numbers().count());
            for (number, _) in numbers() {
                out.extend_from_slice(&number.to_le_bytes());
            }
        });
        Next::Serve
    }

    /// Carries out one step of the open transaction, or of a new one if that is with another target.
    fn step(&mut self, bus: u32, address: u16, step: Step, out: &mut Vec<u8>) {
        let goes_on = |open: &Conversation| (open.bus, open.address) == (bus, address);
        if !self.open.as_ref().is_some_and(goes_on) {
            self.stop();
            let Some(adapter) = self.rack.get(bus) else {
                return append_no_bus(out, bus);
            };
            self.open = Conversation::begin(adapter, bus, address, step.reads());
        }
        let gone = || Err(Fault::Gone);
        let outcome = self.open.as_ref().map_or_else(gone, |open| open.step(step));
        match outcome {
            Ok(read) => append_done(out, 1, &read),
            Err(fault) => {
                if !matches!(fault, Fault::NackAddress | Fault::NackData) {
                    self.stop();
                }
                let error = TransferError {
                    completed: 0,
                    fault,
                };
                append_fault(out, error, self.mode.errno(fault), &[]);
            }
        }
    }

    fn stop(&mut self) {
        if let Some(open) = self.open.take() {
            open.stop();
        }
    }

    fn pass(&self, most: Duration, awaited: Option<Awaited>, out: &mut Vec<u8>) {
        let Some(surroundings) = &self.rack.surroundings else {
            return append_refusal(out, Errno::OPNOTSUPP, "this server has buses alone");
        };
        if most > PASS_MAX {
            let text = format!("one request lets pass at most {PASS_MAX:?}");
            return append_refusal(out, Errno::INVAL, &text);
        }
        // A transaction that is open holds its bus, so nobody can look at the pins.
        let is_free = self.open.is_none();
        let now = surroundings.pass(most, awaited.filter(|_| is_free));
        let pins = match is_free {
            true => surroundings.pins(),
            false => Vec::new(),
        };
        append_packet(out, kind::PASSED, |out| {
            let now_ns = u64::try_from(now.as_nanos()).unwrap_or(u64::MAX);
            out.extend_from_slice(&now_ns.to_le_bytes());
            put_u16(out, pins.len());
            out.extend(pins.iter().map(|high| u8::from(*high)));
        });
    }

    fn carry_out(&self, request: Request, adapter: SharedAdapter, out: &mut Vec<u8>) {
        let mut bus = Witness {
            adapter,
            last: None,
        };
        let outcome = match request {
            Request::Transfer {
                judge,
                mut messages,
                ..
            } => {
                let outcome = match (judge, &mut messages[..]) {
                    (Judge::Bus, messages) => return self.plain(bus, messages, out),
                    (Judge::File, [message]) => self.file(message, &mut bus),
                    (Judge::File, _) => {
                        let text = "read() and write() are one message each";
                        return append_refusal(out, Errno::INVAL, text);
                    }
                    (Judge::Rdwr, messages) => self.rdwr(messages, &mut bus),
                };
                outcome.map(|completed| (completed, read_bytes(&messages, completed)))
            }
            Request::Smbus {
                address,
                flags,
                call,
                mut data,
                ..
            } => self
                .open(address, flags)
                .and_then(|file| file.smbus_call(&call, &mut data, &mut bus))
                .map(|()| (1, data.to_vec())),
            _ => return,
        };
        match (outcome, bus.last) {
            (Ok((completed, read)), _) => append_done(out, completed, &read),
            // Either the bus failed, or nothing reached it.
            (Err(errno), Some(error)) => append_fault(out, error, Some(errno), &[]),
            (Err(errno), None) => append_refusal(out, errno, &errno.to_string()),
        }
    }

    /// Passes the messages to the bus unchanged.
    fn plain(&self, mut bus: Witness, messages: &mut [Segment], out: &mut Vec<u8>) {
        if messages.iter().any(Segment::is_too_long) {
            let text = format!("a message has at most {MESSAGE_BYTES_MAX} bytes");
            return append_refusal(out, Errno::INVAL, &text);
        }
        let mut transfer: Vec<Message<'_>> = messages.iter_mut().map(Segment::as_message).collect();
        let outcome = bus.transfer(&mut transfer);
        let completed = outcome.map_or_else(|error| error.completed, |()| messages.len());
        let read = read_bytes(messages, completed);
        match outcome {
            Ok(()) => append_done(out, completed, &read),
            Err(error) => append_fault(out, error, self.mode.errno(error.fault), &read),
        }
    }

    /// Acts as I2C_RDWR.
    fn rdwr(&self, messages: &mut [Segment], bus: &mut Witness) -> Result<usize, Errno> {
        if messages.is_empty() {
            return Err(Errno::INVAL);
        }
        OpenFile::new(self.mode).rdwr(messages, bus)
    }

    /// Acts as I2C_SLAVE and one read() or write().
    fn file(&self, message: &mut Segment, bus: &mut Witness) -> Result<usize, Errno> {
        let mut file = OpenFile::selecting(self.mode, message.address, message.ten_bit, false)?;
        if message.read {
            let arrived = file.read(&mut message.bytes, bus)?;
            message.bytes.truncate(arrived);
        } else {
            file.write(&message.bytes, bus)?;
        }
        // Mode `virtio` hides a fault in a count of zero bytes.
        Ok(usize::from(bus.last.is_none()))
    }

    /// Acts as I2C_SLAVE, before I2C_SMBUS.
    fn open(&self, address: u16, flags: u16) -> Result<OpenFile, Errno> {
        let [ten_bit, force, pec] =
            [smbus_flag::TEN_BIT, smbus_flag::FORCE, smbus_flag::PEC].map(|flag| flags & flag != 0);
        let mut file = OpenFile::selecting(self.mode, address, ten_bit, force)?;
        file.pec = pec;
        Ok(file)
    }
}

fn read_bytes(messages: &[Segment], completed: usize) -> Vec<u8> {
    let completed = messages.iter().take(completed);
    let read = completed.filter(|message| message.read);
    read.flat_map(|message| &message.bytes).copied().collect()
}

/// Appends the number of completed messages, then the bytes they read.
fn append_done(out: &mut Vec<u8>, completed: usize, read: &[u8]) {
    append_packet(out, kind::DONE, |out| {
        put_u16(out, completed);
        out.extend_from_slice(read);
    });
}

fn append_fault(out: &mut Vec<u8>, error: TransferError, errno: Option<Errno>, read: &[u8]) {
    append_packet(out, kind::FAULT, |out| {
        out.push(fault_number(error.fault));
        put_errno(out, errno);
        put_u16(out, error.completed);
        out.extend_from_slice(read);
    });
}

fn append_no_bus(out: &mut Vec<u8>, bus: u32) {
    append_refusal(out, Errno::NODEV, &format!("there is no bus {bus}"));
}

fn append_refusal(out: &mut Vec<u8>, errno: Errno, text: &str) {
    append_packet(out, kind::REFUSED, |out| {
        put_errno(out, Some(errno));
        out.extend_from_slice(text.as_bytes());
    });
}

fn put_errno(out: &mut Vec<u8>, errno: Option<Errno>) {
    let number = errno.map_or(0, Errno::raw_os_error);
    put_u16(out, usize::try_from(number).unwrap_or(usize::MAX));
}

/// A bus that remembers its last fault, which the errno alone does not reveal.
struct Witness {
    adapter: SharedAdapter,
    last: Option<TransferError>,
}

impl EmulatedAdapter for Witness {
    fn transfer(&mut self, messages: &mut [Message<'_>]) -> Result<(), TransferError> {
        let outcome = self.adapter.transfer(messages);
        self.last = outcome.err();
        outcome
    }
}

#[cfg(test)]
mod tests {
    use super::super::wire::LENGTH_BYTES;
    use super::*;
    use crate::adapter::ByFunction;
    use proptest::prelude::*;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// A session after the hello, on a bus that loses arbitration at some addresses and counts transfers.
    fn session(mode: AdapterMode) -> (Session, Arc<AtomicUsize>) {
        let mut rack = Rack::new();
        let count = Arc::new(AtomicUsize::new(0));
        let transfers = Arc::clone(&count);
        let bus = ByFunction(move |messages: &mut [Message<'_>]| {
            transfers.fetch_add(1, Ordering::Relaxed);
            let fault = Fault::ArbitrationLost;
            let lost = messages.iter().position(|message| message.address % 8 == 5);
            lost.map_or(Ok(()), |completed| Err(TransferError { completed, fault }))
        });
        rack.insert(1, SharedAdapter::new(bus));
        let mut session = Session::new(rack, mode);
        let hello = [&[kind::HELLO][..], &MAGIC, &VERSION.to_le_bytes()].concat();
        assert_eq!(session.answer(&hello, &mut Vec::new()), Next::Serve);
        (session, count)
    }

    /// Packets of a faulty client: a valid kind followed by anything.
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
            let (mut session, _) = session(AdapterMode::ALL[mode]);
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

    /// An adapter that keeps losing arbitration stops after I2C_RETRIES attempts.
    #[test]
    fn a_lost_arbitration_is_retried_by_the_adapter_and_not_by_the_bare_bus() {
        for (judge, tries) in [(0, 1), (1, 4)] {
            let (mut session, count) = session(AdapterMode::Pi5);
            let mut out = Vec::new();
            session.answer(&[2, 1, 0, 0, 0, judge, 1, 0, 0x6D, 0, 1, 0, 1, 0], &mut out);
            assert_eq!(out, [6, 0, 0, 0, kind::FAULT, 4, 11, 0, 0, 0]);
            assert_eq!(count.load(Ordering::Relaxed), tries);
        }
    }
}
