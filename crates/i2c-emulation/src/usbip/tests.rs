//! The protocol against its document, byte by byte, and against hostile bytes; the device against the kernel's driver;
//! sysfs against a folder that looks like it.

use super::*;
use crate::adapter::{Fault, Message, TransferError};
use crate::rack::{Rack, SharedAdapter};
use embedded_hal::i2c::Operation;
use proptest::prelude::*;
use std::fs;
use std::io::{Read as _, Write as _};
use std::net::{Ipv4Addr, TcpStream};
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::thread;

/// A target at 0x69 with registers that hold their own numbers, and a bus that notes each transfer as one line.
#[derive(Clone, Default)]
struct Registers {
    notes: Arc<Mutex<Vec<String>>>,
    fault: Arc<Mutex<Option<Fault>>>,
}

impl Registers {
    fn notes(&self) -> Vec<String> {
        std::mem::take(&mut *self.notes.lock().unwrap())
    }

    fn fail_with(&self, fault: Fault) {
        *self.fault.lock().unwrap() = Some(fault);
    }
}

impl EmulatedAdapter for Registers {
    fn transfer(&mut self, messages: &mut [Message<'_>]) -> Result<(), TransferError> {
        let mut line = String::new();
        let mut register = 0;
        let fault = *self.fault.lock().unwrap();
        for (completed, message) in messages.iter_mut().enumerate() {
            let ten = if message.ten_bit { "ten " } else { "" };
            line += &format!("{ten}{:02x} ", message.address);
            if message.address != 0x69 || fault.is_some() {
                self.notes.lock().unwrap().push(line + "!");
                let fault = fault.unwrap_or(Fault::NackAddress);
                return Err(TransferError { completed, fault });
            }
            match &mut message.operation {
                Operation::Write(bytes) => {
                    register = bytes.first().copied().unwrap_or(0);
                    line += &format!("W{bytes:02x?} ");
                }
                Operation::Read(buffer) => {
                    line += &format!("R{} ", buffer.len());
                    for byte in buffer.iter_mut() {
                        *byte = register;
                        register = register.wrapping_add(1);
                    }
                }
            }
        }
        self.notes.lock().unwrap().push(line.trim_end().to_owned());
        Ok(())
    }
}

/// What a request of the protocol begins with: its version 1.1.1 and one of the two codes (Linux, usbip_protocol.rst).
const VERSION: [u8; 2] = [0x01, 0x11];
const OP_REQ_IMPORT: [u8; 2] = 0x8003_u16.to_be_bytes();
const OP_REQ_DEVLIST: [u8; 2] = 0x8005_u16.to_be_bytes();

/// A request without its body: version, code, status 0.
fn operation(version: [u8; 2], code: [u8; 2]) -> Vec<u8> {
    [version, code, [0; 2], [0; 2]].concat()
}

/// Bit 7 of bmRequestType: the device answers with data (USB 2.0, table 9-2).
const DEVICE_TO_HOST: u8 = 0x80;

fn rack_of(registers: &Registers) -> Rack {
    let mut rack = Rack::new();
    rack.insert(1, SharedAdapter::new(registers.clone()));
    rack
}

/// A client written from the protocol's document: offsets and numbers as printed there.
struct Client<S>(S);

struct Reply {
    command: u32,
    sequence: u32,
    status: i32,
    actual_length: u32,
    data: Vec<u8>,
}

const IN: u32 = 1;
const OUT: u32 = 0;
const EPIPE: i32 = -32;
const ENODEV: i32 = -19;

fn submit_bytes(
    sequence: u32,
    direction: u32,
    endpoint: u32,
    length: u32,
    setup: [u8; 8],
) -> Vec<u8> {
    let words = [
        1, sequence, 0x1_0001, direction, endpoint, 0, length, 0, 0, 0,
    ];
    let mut bytes: Vec<u8> = words.into_iter().flat_map(u32::to_be_bytes).collect();
    bytes.extend(setup);
    bytes
}

fn setup(request_type: u8, request: u8, value: u16, index: u16, length: u16) -> [u8; 8] {
    let mut bytes = [request_type, request, 0, 0, 0, 0, 0, 0];
    bytes[2..4].copy_from_slice(&value.to_le_bytes());
    bytes[4..6].copy_from_slice(&index.to_le_bytes());
    bytes[6..8].copy_from_slice(&length.to_le_bytes());
    bytes
}

impl<S: io::Read + io::Write> Client<S> {
    fn reply(&mut self, expects_data: bool) -> Reply {
        let mut header = [0; 48];
        self.0.read_exact(&mut header).unwrap();
        let word = |at: usize| u32::from_be_bytes(header[at..at + 4].try_into().unwrap());
        let mut data = vec![
            0;
            if expects_data {
                word(24).try_into().unwrap()
            } else {
                0
            }
        ];
        self.0.read_exact(&mut data).unwrap();
        Reply {
            command: word(0),
            sequence: word(4),
            status: i32::from_be_bytes(header[20..24].try_into().unwrap()),
            actual_length: word(24),
            data,
        }
    }

    /// A control transfer as the kernel's vhci sends it.
    fn control(&mut self, setup: [u8; 8], sent: &[u8]) -> Reply {
        let length = u32::from(u16::from_le_bytes([setup[6], setup[7]]));
        let direction = if setup[0] & DEVICE_TO_HOST != 0 {
            IN
        } else {
            OUT
        };
        let mut bytes = submit_bytes(7, direction, 0, length, setup);
        bytes.extend(sent);
        self.0.write_all(&bytes).unwrap();
        let reply = self.reply(direction == IN);
        assert_eq!((reply.command, reply.sequence), (3, 7));
        reply
    }

    /// One message as `usb_xfer` of i2c-tiny-usb sends it: bit 0 begins, bit 1 ends, flags in wValue, address in wIndex.
    fn write_message(&mut self, begin_end: u8, address: u16, bytes: &[u8]) -> i32 {
        let length = u16::try_from(bytes.len()).unwrap();
        self.control(setup(0x41, 4 | begin_end, 0, address, length), bytes)
            .status
    }

    fn read_message(&mut self, begin_end: u8, address: u16, length: u16) -> Reply {
        self.control(setup(0xC1, 4 | begin_end, 1, address, length), &[])
    }

    /// 1 acknowledged, 2 not acknowledged.
    fn status(&mut self) -> u8 {
        self.control(setup(0xC1, 3, 0, 0, 1), &[]).data[0]
    }
}

const BEGIN: u8 = 1;
const END: u8 = 2;
const WHOLE: u8 = BEGIN | END;

/// A device served over a socketpair, as the kernel has it.
fn plugged_in(registers: &Registers) -> Client<std::os::unix::net::UnixStream> {
    let (client, mut served) = std::os::unix::net::UnixStream::pair().unwrap();
    let mut device = device_of(registers.clone(), &identity(1, 0));
    thread::spawn(move || session::serve(&mut served, &mut device));
    Client(client)
}

#[test]
fn the_kernel_finds_an_i2c_tiny_usb() {
    let mut client = plugged_in(&Registers::default());
    let device = client
        .control(setup(DEVICE_TO_HOST, 6, 0x0100, 0, 18), &[])
        .data;
    assert_eq!(device.len(), 18);
    assert_eq!(device[0..2], [18, 1], "USB 2.0, table 9-8");
    assert_eq!(device[8..12], [0x03, 0x04, 0x31, 0xC6], "0403:c631");
    assert_eq!(device[17], 1, "one configuration");
    // The kernel asks for nine bytes first, and then for the length that they tell.
    let start = client
        .control(setup(DEVICE_TO_HOST, 6, 0x0200, 0, 9), &[])
        .data;
    assert_eq!(start.len(), 9);
    let total = u16::from_le_bytes([start[2], start[3]]);
    let all = client
        .control(setup(DEVICE_TO_HOST, 6, 0x0200, 0, total), &[])
        .data;
    assert_eq!(all.len(), usize::from(total));
    assert_eq!(all[..9], start);
    assert_eq!(
        all[9..13],
        [9, 4, 0, 0],
        "interface 0, which alone the driver takes"
    );
    assert_eq!(all[13], 0, "no endpoint beside the control endpoint");
    assert_eq!(client.control(setup(0x00, 9, 1, 0, 0), &[]).status, 0);
    assert_eq!(
        client.control(setup(DEVICE_TO_HOST, 8, 0, 0, 1), &[]).data,
        [1]
    );
}

#[test]
fn strings_are_utf_16_with_their_length_in_front() {
    let mut client = plugged_in(&Registers::default());
    let mut text = |index: u16| {
        let bytes = client
            .control(setup(DEVICE_TO_HOST, 6, 0x0300 | index, 0x0409, 255), &[])
            .data;
        assert_eq!((usize::from(bytes[0]), bytes[1]), (bytes.len(), 3));
        let units: Vec<u16> = bytes[2..]
            .chunks_exact(2)
            .map(|pair| u16::from_le_bytes([pair[0], pair[1]]))
            .collect();
        String::from_utf16(&units).unwrap()
    };
    assert_eq!(
        [text(1), text(2), text(3)],
        ["emulated", "i2c-tiny-usb", "1-1"]
    );
    let languages = client
        .control(setup(DEVICE_TO_HOST, 6, 0x0300, 0, 255), &[])
        .data;
    assert_eq!(languages, [4, 3, 0x09, 0x04]);
    assert_eq!(
        client
            .control(setup(DEVICE_TO_HOST, 6, 0x0304, 0x0409, 255), &[])
            .status,
        EPIPE
    );
}

#[test]
fn it_offers_what_the_kernels_driver_offers() {
    let mut client = plugged_in(&Registers::default());
    let functionality = client.control(setup(0xC1, 1, 0, 0, 4), &[]).data;
    // I2C_FUNC_I2C | I2C_FUNC_SMBUS_EMUL of linux/i2c.h.
    assert_eq!(functionality, 0x0EFF_0009_u32.to_le_bytes());
    assert_eq!(
        client.control(setup(0x41, 2, 10, 0, 0), &[]).status,
        0,
        "delay"
    );
    assert_eq!(
        client.control(setup(0xC1, 0, 0x1234, 0, 2), &[]).data,
        [0x34, 0x12],
        "echo"
    );
    assert_eq!(client.status(), 0, "idle before the first message");
}

#[test]
fn a_register_and_its_value_are_one_transaction() {
    let registers = Registers::default();
    let mut client = plugged_in(&registers);
    assert_eq!(client.write_message(BEGIN, 0x69, &[0x20]), 0);
    assert_eq!(client.status(), 1, "acknowledged before it is sent");
    assert!(registers.notes().is_empty(), "nothing has been sent yet");
    let read = client.read_message(END, 0x69, 128);
    assert_eq!(client.status(), 1);
    assert_eq!(read.data, (0x20..0xA0).collect::<Vec<u8>>());
    assert_eq!(registers.notes(), ["69 W[20] 69 R128"]);
}

#[test]
fn a_single_message_is_sent_at_once() {
    let registers = Registers::default();
    let mut client = plugged_in(&registers);
    assert_eq!(client.write_message(WHOLE, 0x69, &[1, 0x3F]), 0);
    assert_eq!(registers.notes(), ["69 W[01, 3f]"]);
    assert_eq!(client.read_message(WHOLE, 0x69, 2).data, [0, 1]);
    assert_eq!(registers.notes(), ["69 R2"]);
    assert_eq!(client.write_message(WHOLE, 0x69, &[]), 0);
    assert_eq!(
        registers.notes(),
        ["69 W[]"],
        "SMBus quick, as i2cdetect sends it"
    );
    assert_eq!(client.status(), 1);
}

#[test]
fn what_follows_a_read_is_a_transaction_of_its_own() {
    let registers = Registers::default();
    let mut client = plugged_in(&registers);
    client.write_message(BEGIN, 0x69, &[4]);
    assert_eq!(client.read_message(0, 0x69, 1).data, [4]);
    client.write_message(0, 0x69, &[6]);
    assert_eq!(client.read_message(END, 0x69, 1).data, [6]);
    assert_eq!(registers.notes(), ["69 W[04] 69 R1", "69 W[06] 69 R1"]);
}

/// `usb_xfer` makes ENXIO of status 2, but only if as many bytes came back as it asked for.
#[test]
fn a_missing_target_is_told_by_the_status() {
    let registers = Registers::default();
    let mut client = plugged_in(&registers);
    let read = client.read_message(WHOLE, 0x68, 3);
    assert_eq!((read.status, read.actual_length), (0, 3));
    assert_eq!(client.status(), 2);
    assert_eq!(client.write_message(WHOLE, 0x68, &[]), 0);
    assert_eq!(client.status(), 2);
    client.write_message(BEGIN, 0x68, &[0x20]);
    let read = client.read_message(END, 0x68, 128);
    assert_eq!((read.status, read.actual_length), (0, 128));
    assert_eq!(client.status(), 2);
    assert_eq!(client.write_message(WHOLE, 0x69, &[]), 0);
    assert_eq!(client.status(), 1, "the next message begins anew");
}

#[test]
fn every_other_fault_stalls() {
    for (fault, status) in [
        (Fault::NackData, EPIPE),
        (Fault::Bus, EPIPE),
        (Fault::ArbitrationLost, EPIPE),
        (Fault::Timeout, EPIPE),
        (Fault::Gone, ENODEV),
    ] {
        let registers = Registers::default();
        registers.fail_with(fault);
        let mut client = plugged_in(&registers);
        assert_eq!(client.write_message(WHOLE, 0x69, &[1]), status, "{fault:?}");
        let read = client.read_message(WHOLE, 0x69, 1);
        assert_eq!((read.status, read.actual_length), (status, 0), "{fault:?}");
    }
}

#[test]
fn ten_bits_are_passed_on() {
    let registers = Registers::default();
    let mut client = plugged_in(&registers);
    client.control(setup(0x41, 4 | WHOLE, 0x10, 0x169, 1), &[1]);
    assert_eq!(registers.notes(), ["ten 169 !"]);
}

#[test]
fn a_transfer_that_was_broken_off_is_forgotten() {
    let registers = Registers::default();
    let mut client = plugged_in(&registers);
    client.write_message(BEGIN, 0x69, &[0x11]);
    client.write_message(BEGIN, 0x69, &[0x20]);
    assert_eq!(client.read_message(END, 0x69, 1).data, [0x20]);
    assert_eq!(registers.notes(), ["69 W[20] 69 R1"]);
}

#[test]
fn more_messages_are_held_than_one_ioctl_can_bring_but_no_more() {
    let registers = Registers::default();
    let mut client = plugged_in(&registers);
    assert_eq!(
        HELD_MESSAGES_MAX, 42,
        "I2C_RDWR_IOCTL_MAX_MSGS of linux/i2c-dev.h"
    );
    for message in 0..HELD_MESSAGES_MAX {
        let begin = if message == 0 { BEGIN } else { 0 };
        assert_eq!(client.write_message(begin, 0x69, &[1]), 0);
    }
    assert_eq!(client.write_message(0, 0x69, &[1]), EPIPE);
    assert_eq!(client.write_message(END, 0x69, &[2]), 0);
    assert_eq!(
        registers.notes(),
        ["69 W[02]"],
        "nothing of the long one was left"
    );
}

#[test]
fn a_message_is_as_long_as_i2c_dev_allows_and_no_longer() {
    let registers = Registers::default();
    let mut client = plugged_in(&registers);
    assert_eq!(client.write_message(WHOLE, 0x69, &[0; 8192]), 0);
    assert_eq!(client.write_message(WHOLE, 0x69, &[0; 8193]), EPIPE);
    assert_eq!(client.read_message(WHOLE, 0x69, 8192).actual_length, 8192);
    assert_eq!(client.read_message(WHOLE, 0x69, 8193).status, EPIPE);
    assert_eq!(registers.notes().len(), 2);
}

#[test]
fn what_an_adapter_has_no_answer_to_stalls() {
    let mut client = plugged_in(&Registers::default());
    for unknown in [
        setup(0xC1, 8, 0, 0, 1),
        setup(0x41, 1, 0, 0, 0),
        setup(DEVICE_TO_HOST, 6, 0x0600, 0, 10),
        setup(0x00, 9, 2, 0, 0),
        setup(0x01, 11, 1, 0, 0),
        setup(0xA1, 4, 0, 0, 1),
        // A read in the direction of a write, and the other way round.
        setup(0x41, 4 | WHOLE, 1, 0x69, 0),
        setup(0xC1, 4 | WHOLE, 0, 0x69, 1),
    ] {
        assert_eq!(client.control(unknown, &[]).status, EPIPE, "{unknown:02x?}");
    }
    client
        .0
        .write_all(&submit_bytes(9, IN, 1, 8, [0; 8]))
        .unwrap();
    assert_eq!(client.reply(false).status, EPIPE, "there is no endpoint 1");
    // Less room than the request asks for: the kernel never does that.
    client
        .0
        .write_all(&submit_bytes(9, IN, 0, 1, setup(0xC1, 1, 0, 0, 4)))
        .unwrap();
    assert_eq!(client.reply(false).status, EPIPE);
    assert_eq!(client.status(), 0, "and the connection is alive");
}

#[test]
fn what_was_answered_cannot_be_cancelled() {
    let mut client = plugged_in(&Registers::default());
    let mut bytes = vec![];
    for word in [2_u32, 99, 0x1_0001, 0, 0, 7] {
        bytes.extend(word.to_be_bytes());
    }
    bytes.resize(48, 0);
    client.0.write_all(&bytes).unwrap();
    let reply = client.reply(false);
    assert_eq!((reply.command, reply.sequence, reply.status), (4, 99, 0));
}

/// Everything that a client can get wrong about a header ends the session with its name.
#[test]
fn malformed_headers_end_the_session() {
    let good = submit_bytes(1, OUT, 0, 0, [0; 8]);
    let with = |at: usize, word: u32| {
        let mut bytes = good.clone();
        bytes[at..at + 4].copy_from_slice(&word.to_be_bytes());
        bytes
    };
    for (bytes, expected) in [
        (with(0, 5), "unknown command 5"),
        (
            with(24, 65_536),
            "a transfer of 65536 bytes, at most 65535 are possible",
        ),
        (
            with(32, 1),
            "an isochronous transfer of 1 packets to a device that has none",
        ),
    ] {
        let mut stream = Recorded::new(bytes);
        let mut device = device_of(Registers::default(), &identity(1, 0));
        let error = session::serve(&mut stream, &mut device).unwrap_err();
        assert_eq!(error.to_string(), expected);
        assert!(stream.answered.is_empty());
    }
    for length in [0, 1, 47] {
        let mut stream = Recorded::new(good[..length].to_vec());
        let mut device = device_of(Registers::default(), &identity(1, 0));
        let outcome = session::serve(&mut stream, &mut device);
        assert_eq!(outcome.is_ok(), length == 0, "{length} bytes and the end");
    }
}

/// What a client sent, and what it was answered.
struct Recorded {
    sent: io::Cursor<Vec<u8>>,
    answered: Vec<u8>,
}

impl Recorded {
    fn new(sent: Vec<u8>) -> Self {
        Self {
            sent: io::Cursor::new(sent),
            answered: Vec::new(),
        }
    }
}

impl io::Read for Recorded {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.sent.read(buffer)
    }
}

impl io::Write for Recorded {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.answered.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Transfers that are almost right: known commands and requests, arbitrary everything else.
fn almost_a_transfer() -> impl Strategy<Value = Vec<u8>> {
    let request_type =
        prop::sample::select(vec![0x00, 0x01, 0x40, 0x41, 0x80, 0x81, 0xA1, 0xC0, 0xC1]);
    let lengths = (0_u16..40, any::<bool>());
    (
        1_u32..4,
        0_u32..3,
        request_type,
        0_u8..12,
        any::<u16>(),
        any::<u16>(),
        lengths,
    )
        .prop_map(
            |(command, direction, request_type, request, value, index, (length, agrees))| {
                let told = u32::from(length) + u32::from(!agrees);
                let setup = setup(request_type, request, value & 0x0311, index & 0x1FF, length);
                let mut bytes = submit_bytes(3, direction, 0, told, setup);
                bytes[3] = u8::try_from(command).unwrap();
                if direction != IN && command == 1 {
                    bytes.resize(bytes.len() + usize::try_from(told).unwrap(), 0x55);
                }
                bytes
            },
        )
}

proptest! {
    #[test]
    fn arbitrary_bytes_end_in_an_error_and_never_in_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let mut stream = Recorded::new(bytes.clone());
        let mut device = device_of(Registers::default(), &identity(1, 0));
        let outcome = session::serve(&mut stream, &mut device);
        prop_assert!(outcome.is_err() || bytes.is_empty() || bytes[3] == 1 || bytes[3] == 2);
        let mut start = [0; 8];
        start.iter_mut().zip(&bytes).for_each(|(to, from)| *to = *from);
        let is_request = start[..2] == VERSION && [OP_REQ_IMPORT, OP_REQ_DEVLIST].iter().any(|code| start[2..4] == *code);
        prop_assert_eq!(wire::Request::parse(&start).is_ok(), is_request);
    }

    #[test]
    fn every_transfer_is_answered_once_whatever_it_asks(
        transfers in prop::collection::vec(almost_a_transfer(), 0..30)
    ) {
        let known = transfers.iter().take_while(|bytes| bytes[3] != 3).count();
        let mut stream = Recorded::new(transfers.concat());
        let mut device = device_of(Registers::default(), &identity(1, 0));
        let outcome = session::serve(&mut stream, &mut device);
        prop_assert_eq!(outcome.is_ok(), known == transfers.len());
        let mut in_order = transfers[..known].iter();
        let mut answered = stream.answered.as_slice();
        let mut answers = 0;
        while !answered.is_empty() {
            let asked = in_order.next().unwrap();
            let sends = asked[3] == 1 && asked[15] == 1;
            let actual = u32::from_be_bytes(answered[24..28].try_into().unwrap());
            let data = if sends { usize::try_from(actual).unwrap() } else { 0 };
            answered = &answered[48 + data..];
            answers += 1;
        }
        prop_assert_eq!(answers, known);
    }
}

fn loopback() -> SocketAddr {
    (Ipv4Addr::LOCALHOST, 0).into()
}

fn connect(server: &Server) -> TcpStream {
    let stream = TcpStream::connect(server.address()).unwrap();
    // A server that hangs fails the test instead of hanging it.
    stream
        .set_read_timeout(Some(Duration::from_secs(20)))
        .unwrap();
    stream
}

fn import_request(bus_id: &str) -> Vec<u8> {
    let mut bytes = operation(VERSION, OP_REQ_IMPORT);
    bytes.extend(bus_id.as_bytes());
    bytes.resize(40, 0);
    bytes
}

/// Asks for a device; the status of the answer, and the connection.
fn import(server: &Server, bus_id: &str) -> (u32, Client<TcpStream>) {
    let mut stream = connect(server);
    stream.write_all(&import_request(bus_id)).unwrap();
    let mut header = [0; 8];
    stream.read_exact(&mut header).unwrap();
    assert_eq!(header[..4], [0x01, 0x11, 0x00, 0x03]);
    let status = u32::from_be_bytes(header[4..].try_into().unwrap());
    if status == 0 {
        let mut device = [0; 312];
        stream.read_exact(&mut device).unwrap();
        assert!(device[256..].starts_with(bus_id.as_bytes()));
    }
    (status, Client(stream))
}

/// The table "OP_REP_DEVLIST" of the protocol's document, offset by offset.
#[test]
fn the_list_of_devices_is_laid_out_as_documented() {
    let registers = Registers::default();
    let mut rack = rack_of(&registers);
    rack.insert(3, SharedAdapter::new(registers));
    let server = Server::bind(loopback(), &rack).unwrap();
    assert_eq!(
        server.bus_ids().collect::<Vec<_>>(),
        [(1, "1-1"), (3, "1-3")]
    );
    let mut stream = connect(&server);
    stream
        .write_all(&operation(VERSION, OP_REQ_DEVLIST))
        .unwrap();
    let mut reply = Vec::new();
    stream.read_to_end(&mut reply).unwrap();
    assert_eq!(reply[..12], [0x01, 0x11, 0, 5, 0, 0, 0, 0, 0, 0, 0, 2]);
    // 312 bytes of a device and four of its interface.
    assert_eq!(reply.len(), 12 + 2 * 316);
    let (first, second) = reply[12..].split_at(316);
    for (device, name, number) in [(first, "1-1", 1), (second, "1-3", 2)] {
        assert_eq!(device[256..260], *format!("{name}\0").as_bytes());
        assert_eq!(device[0x120..0x124], [0, 0, 0, 1], "bus");
        assert_eq!(device[0x124..0x128], [0, 0, 0, number], "device");
        assert_eq!(device[0x128..0x12C], [0, 0, 0, 1], "low speed");
        assert_eq!(
            device[0x12C..0x130],
            [0x04, 0x03, 0xC6, 0x31],
            "high byte first here"
        );
        assert_eq!(device[0x132..0x135], [0xFF, 0, 0], "a class of its own");
        assert_eq!(
            device[0x136..0x138],
            [1, 1],
            "one configuration, one interface"
        );
        assert_eq!(device[0x138..0x13C], [0xFF, 0, 0, 0], "of the same class");
    }
}

#[test]
fn an_adapter_is_fetched_used_and_free_again() {
    let registers = Registers::default();
    let server = Server::bind(loopback(), &rack_of(&registers)).unwrap();
    let (status, mut client) = import(&server, "1-1");
    assert_eq!(status, 0);
    assert_eq!(client.read_message(WHOLE, 0x69, 2).data, [0, 1]);
    assert_eq!(import(&server, "1-1").0, 2, "ST_DEV_BUSY: somebody has it");
    assert_eq!(import(&server, "1-9").0, 4, "ST_NODEV");
    assert_eq!(import(&server, &"x".repeat(32)).0, 4);
    drop(client);
    let free_again = (0..500).any(|_| {
        thread::sleep(Duration::from_millis(10));
        import(&server, "1-1").0 == 0
    });
    assert!(free_again, "after its user hung up");
}

#[test]
fn stopping_hangs_up_on_all() {
    let server = Server::bind(loopback(), &rack_of(&Registers::default())).unwrap();
    let address = server.address();
    let (_, mut client) = import(&server, "1-1");
    let mut silent = connect(&server);
    server.stop();
    assert_eq!(client.0.read(&mut [0; 1]).unwrap_or(0), 0);
    assert_eq!(silent.read(&mut [0; 1]).unwrap_or(0), 0);
    assert!(TcpStream::connect(address).is_err());
}

#[test]
fn who_says_nothing_is_sent_away() {
    let server = Server::bind_with(
        loopback(),
        &rack_of(&Registers::default()),
        Duration::from_millis(50),
    )
    .unwrap();
    let mut silent = connect(&server);
    assert_eq!(silent.read(&mut [0; 1]).unwrap(), 0);
    let mut slow = connect(&server);
    slow.write_all(&import_request("1-1")[..20]).unwrap();
    assert_eq!(slow.read(&mut [0; 1]).unwrap(), 0);
    let (_, mut user) = import(&server, "1-1");
    thread::sleep(Duration::from_millis(200));
    assert_eq!(user.status(), 0, "who has a device may be silent");
}

#[test]
fn one_connection_too_many_is_closed_at_once() {
    let server = Server::bind(loopback(), &rack_of(&Registers::default())).unwrap();
    let mut waiting: Vec<_> = (0..CONNECTIONS_MAX).map(|_| connect(&server)).collect();
    let mut one_too_many = connect(&server);
    assert_eq!(one_too_many.read(&mut [0; 1]).unwrap_or(0), 0);
    waiting[0]
        .write_all(&operation(VERSION, OP_REQ_DEVLIST))
        .unwrap();
    let mut reply = Vec::new();
    waiting[0].read_to_end(&mut reply).unwrap();
    assert!(!reply.is_empty(), "those who came first are served");
}

#[test]
fn nonsense_on_tcp_ends_its_own_connection_only() {
    let server = Server::bind(loopback(), &rack_of(&Registers::default())).unwrap();
    for nonsense in [
        b"GET / HTTP/1.1\r\n\r\n".to_vec(),
        vec![0xFF; 64],
        operation([0x01, 0x06], OP_REQ_DEVLIST),
        [import_request("1-1"), vec![0xFF; 4096]].concat(),
    ] {
        let mut stream = connect(&server);
        stream.write_all(&nonsense).unwrap();
        let mut reply = Vec::new();
        // Bytes that nobody read make it a reset, which is an end as well.
        let _ = stream.read_to_end(&mut reply);
    }
    let reachable = (0..500).any(|_| {
        thread::sleep(Duration::from_millis(10));
        import(&server, "1-1").0 == 0
    });
    assert!(reachable);
}

#[test]
fn an_address_in_use_and_an_impossible_one_are_told_apart() {
    let rack = rack_of(&Registers::default());
    let server = Server::bind(loopback(), &rack).unwrap();
    let error = Server::bind(server.address(), &rack)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("is in use by another program\nhint: "),
        "{error}"
    );
    let elsewhere = SocketAddr::from((Ipv4Addr::new(192, 0, 2, 1), 0));
    let error = Server::bind(elsewhere, &rack).unwrap_err().to_string();
    assert!(
        error.starts_with("cannot listen on 192.0.2.1:0: "),
        "{error}"
    );
}

#[test]
fn a_rack_has_between_one_bus_and_as_many_as_a_controller_has_ports() {
    let mut rack = Rack::new();
    assert!(matches!(
        Server::bind(loopback(), &rack),
        Err(UsbipError::NoBus)
    ));
    assert!(matches!(
        attach(&rack, &Options::default()),
        Err(UsbipError::NoBus)
    ));
    for number in 0..8 {
        rack.insert(number, SharedAdapter::new(Registers::default()));
    }
    assert!(Server::bind(loopback(), &rack).is_ok());
    rack.insert(8, SharedAdapter::new(Registers::default()));
    let refused = |outcome| matches!(outcome, Some(UsbipError::TooManyBuses { found: 9 }));
    assert!(refused(Server::bind(loopback(), &rack).err()));
    assert!(refused(attach(&rack, &Options::default()).err()));
}

mod sysfs {
    //! A folder that looks like sysfs, with a thread in the kernel's place.
    #![expect(unsafe_code, reason = "the kernel takes a descriptor by its number")]

    use super::*;
    use std::os::fd::BorrowedFd;
    use std::os::unix::net::UnixStream;
    use tempfile::TempDir;

    const HEADER: &str = "hub port sta spd dev      sockfd local_busid\n";

    pub(super) struct Machine {
        folder: TempDir,
    }

    impl Machine {
        /// Ports as (hub, number, state).
        fn new(ports: &[(&str, u32, u32)]) -> Self {
            let machine = Self {
                folder: TempDir::new().unwrap(),
            };
            for folder in [
                "sys/devices/platform/vhci_hcd.0",
                "sys/class/i2c-dev",
                "dev",
            ] {
                fs::create_dir_all(machine.folder.path().join(folder)).unwrap();
            }
            let lines = ports.iter().map(|(hub, port, state)| {
                format!("{hub}  {port:04} {state:03} 000 00000000 000000 0-0\n")
            });
            fs::write(
                machine.controller("status"),
                HEADER.to_owned() + &lines.collect::<String>(),
            )
            .unwrap();
            fs::write(machine.controller("attach"), "").unwrap();
            fs::write(machine.controller("detach"), "").unwrap();
            machine
        }

        fn controller(&self, file: &str) -> PathBuf {
            self.folder
                .path()
                .join("sys/devices/platform/vhci_hcd.0")
                .join(file)
        }

        fn options(&self) -> Options {
            Options {
                sysfs: self.folder.path().join("sys"),
                dev: self.folder.path().join("dev"),
                driver_wait: Duration::from_secs(20),
                detach_wait: Duration::from_secs(20),
            }
        }
    }

    fn wait_for_text(path: &Path) -> String {
        for _ in 0..2000 {
            let text = fs::read_to_string(path).unwrap();
            if !text.is_empty() {
                return text;
            }
            thread::sleep(Duration::from_millis(5));
        }
        String::new()
    }

    /// When the thread in the kernel's place gives its end of the connection up.
    #[derive(Clone, Copy, PartialEq)]
    enum LettingGo {
        WhenUnplugged,
        WhenDetached,
        Never,
    }

    /// What the kernel does with one line for `attach`: takes the socket, asks the device, makes an adapter, and takes
    /// everything away when the socket closes.
    fn kernel(
        machine: &Machine,
        adapter: u32,
        letting_go: LettingGo,
    ) -> thread::JoinHandle<(String, u8)> {
        let [attach, detach, status] =
            ["attach", "detach", "status"].map(|file| machine.controller(file));
        let free = fs::read_to_string(&status).unwrap();
        let interface = machine
            .folder
            .path()
            .join("sys/bus/usb/devices/1-3/1-3:1.0");
        let node = machine.folder.path().join(format!("dev/i2c-{adapter}"));
        thread::spawn(move || {
            let line = wait_for_text(&attach);
            let number = line.split(' ').nth(1).unwrap().parse().unwrap();
            // SAFETY: the descriptor is open: whoever wrote its number keeps it open until the adapter is there.
            let socket = unsafe { BorrowedFd::borrow_raw(number) }
                .try_clone_to_owned()
                .unwrap();
            let mut client = Client(UnixStream::from(socket));
            let vendor = client
                .control(setup(DEVICE_TO_HOST, 6, 0x0100, 0, 18), &[])
                .data[8];
            fs::create_dir_all(interface.join(format!("i2c-{adapter}"))).unwrap();
            let port = line.split(' ').next().unwrap();
            let used = format!("hs  {port:0>4} 006 002 00010001 000003 1-3\n");
            fs::write(&status, HEADER.to_owned() + &used).unwrap();
            fs::write(&node, "").unwrap();
            if letting_go == LettingGo::WhenDetached {
                wait_for_text(&detach);
                client.0.shutdown(std::net::Shutdown::Both).unwrap();
            }
            // The end of the connection is the unplugging of the device.
            let _ = client.0.read(&mut [0; 1]);
            if letting_go == LettingGo::Never {
                return (line, vendor);
            }
            fs::remove_dir_all(interface).unwrap();
            fs::remove_file(node).unwrap();
            fs::write(&status, free).unwrap();
            (line, vendor)
        })
    }

    #[test]
    fn a_bus_becomes_the_adapter_that_the_kernel_names_and_goes_with_its_owner() {
        let machine = Machine::new(&[("ss", 8, 4), ("hs", 0, 6), ("hs", 1, 4), ("hs", 2, 4)]);
        let kernel = kernel(&machine, 7, LettingGo::WhenUnplugged);
        let attached = attach(&rack_of(&Registers::default()), &machine.options()).unwrap();
        assert_eq!(
            attached.buses(),
            [AttachedBus {
                bus: 1,
                port: 1,
                adapter: 7,
                device: machine.folder.path().join("dev/i2c-7"),
            }]
        );
        attached.stop().unwrap();
        let (line, vendor) = kernel.join().unwrap();
        let words: Vec<_> = line.split(' ').collect();
        assert_eq!(words.len(), 4);
        assert_eq!(
            [words[0], words[2], words[3]],
            ["1", "65537", "1"],
            "port, device 1:1, low speed"
        );
        assert_eq!(vendor, 0x03);
        assert!(!machine.folder.path().join("dev/i2c-7").exists());
    }

    #[test]
    fn unplugging_from_the_other_side_ends_the_wait() {
        let machine = Machine::new(&[("hs", 0, 4)]);
        let kernel = kernel(&machine, 0, LettingGo::WhenDetached);
        let mut attached = attach(&rack_of(&Registers::default()), &machine.options()).unwrap();
        fs::write(machine.controller("detach"), "0").unwrap();
        attached.wait().unwrap();
        kernel.join().unwrap();
    }

    #[test]
    fn what_is_missing_is_named_with_the_modules_that_bring_it() {
        let machine = Machine::new(&[("hs", 0, 4)]);
        let rack = rack_of(&Registers::default());
        let fails = |options: &Options| attach(&rack, options).unwrap_err().to_string();
        let modules = "`modprobe -a vhci-hcd i2c-tiny-usb i2c-dev`";
        fs::remove_dir(machine.folder.path().join("sys/class/i2c-dev")).unwrap();
        let error = fails(&machine.options());
        assert!(
            error.contains("i2c-dev is not loaded") && error.contains(modules),
            "{error}"
        );
        let nowhere = Options {
            sysfs: machine.folder.path().join("nowhere"),
            ..machine.options()
        };
        let error = fails(&nowhere);
        assert!(
            error.contains("no virtual USB controller") && error.contains(modules),
            "{error}"
        );
        assert!(error.contains("cloud kernels"), "{error}");
    }

    #[test]
    fn a_controller_without_a_free_port_says_how_to_free_one() {
        let machine = Machine::new(&[("hs", 0, 6), ("hs", 1, 5), ("ss", 8, 4)]);
        let error = attach(&rack_of(&Registers::default()), &machine.options()).unwrap_err();
        assert!(
            matches!(error, UsbipError::NoFreePort { ports: 2 }),
            "{error}"
        );
        assert!(error.to_string().contains("usbip detach -p"), "{error}");
        assert_eq!(
            fs::read_to_string(machine.controller("attach")).unwrap(),
            ""
        );
    }

    #[test]
    fn a_kernel_that_makes_no_adapter_is_told_after_the_wait() {
        let machine = Machine::new(&[("hs", 0, 4)]);
        let options = Options {
            driver_wait: Duration::from_millis(40),
            ..machine.options()
        };
        let error = attach(&rack_of(&Registers::default()), &options).unwrap_err();
        assert!(
            matches!(error, UsbipError::NoAdapter { port: 0, .. }),
            "{error}"
        );
        assert!(error.to_string().contains("within 40ms"), "{error}");
    }

    #[test]
    fn a_port_that_stays_in_use_is_told_when_stopping() {
        let machine = Machine::new(&[("hs", 0, 4)]);
        let kernel = kernel(&machine, 2, LettingGo::Never);
        let options = Options {
            detach_wait: Duration::from_millis(40),
            ..machine.options()
        };
        let attached = attach(&rack_of(&Registers::default()), &options).unwrap();
        let error = attached.stop().unwrap_err();
        assert!(
            matches!(error, UsbipError::StillAttached { port: 0, .. }),
            "{error}"
        );
        assert!(error.to_string().contains("usbip detach -p 0"), "{error}");
        kernel.join().unwrap();
    }

    #[test]
    fn a_file_that_is_no_status_is_quoted() {
        let machine = Machine::new(&[]);
        fs::write(machine.controller("status"), "header\nhs zero\n").unwrap();
        let error = attach(&rack_of(&Registers::default()), &machine.options())
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("status: not a line of ports: \"hs zero\""),
            "{error}"
        );
    }

    #[test]
    fn without_the_right_to_attach_root_is_asked_for() {
        let machine = Machine::new(&[("hs", 0, 4)]);
        // A folder cannot be written to either, and unlike a read-only file it stops root as well.
        fs::remove_file(machine.controller("attach")).unwrap();
        fs::create_dir(machine.controller("attach")).unwrap();
        let error = attach(&rack_of(&Registers::default()), &machine.options()).unwrap_err();
        assert!(matches!(error, UsbipError::Sysfs { .. }), "{error}");
        // The refusal itself is seen in the guests, where the tests have a user who is not root.
        let error = UsbipError::NotRoot {
            path: machine.controller("attach"),
        };
        assert!(error.to_string().contains("run as root"));
    }
}
