//! Both ends of these tests: a target with its bus, and a client written from the protocol's specification.

use crate::adapter::{EmulatedAdapter, Fault, Message, TransferError};
use crate::rack::{Rack, SharedAdapter};
use crate::usbip::device::Device;
use crate::usbip::session;
use crate::usbip::wire::Identity;
use embedded_hal::i2c::Operation;
use std::io;
use std::os::unix::net::UnixStream;
use std::sync::{Arc, Mutex};
use std::thread;

/// A target at 0x69 with registers that hold their own numbers, and a bus that records each transfer as one line.
#[derive(Clone, Default)]
pub(super) struct Registers {
    pub(super) notes: Arc<Mutex<Vec<String>>>,
    pub(super) fault: Arc<Mutex<Option<Fault>>>,
}

impl Registers {
    pub(super) fn notes(&self) -> Vec<String> {
        std::mem::take(&mut *self.notes.lock().unwrap())
    }

    pub(super) fn fail_with(&self, fault: Fault) {
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

/// The start of a request: the protocol version 1.1.1 and one of the two codes (Linux, usbip_protocol.rst).
pub(super) const VERSION: [u8; 2] = [0x01, 0x11];
pub(super) const OP_REQ_IMPORT: [u8; 2] = 0x8003_u16.to_be_bytes();
pub(super) const OP_REQ_DEVLIST: [u8; 2] = 0x8005_u16.to_be_bytes();

/// A request without its body: version, code, status 0.
pub(super) fn operation(version: [u8; 2], code: [u8; 2]) -> Vec<u8> {
    [version, code, [0; 2], [0; 2]].concat()
}

/// Bit 7 of bmRequestType: the device answers with data (USB 2.0, table 9-2).
pub(super) const DEVICE_TO_HOST: u8 = 0x80;

pub(super) fn rack_of(registers: &Registers) -> Rack {
    let mut rack = Rack::new();
    rack.insert(1, SharedAdapter::new(registers.clone()));
    rack
}

/// A client written from the protocol's specification, with its offsets and numbers.
pub(super) struct Client<S>(pub(super) S);

pub(super) struct Reply {
    pub(super) command: u32,
    pub(super) sequence: u32,
    pub(super) status: i32,
    pub(super) actual_length: u32,
    pub(super) data: Vec<u8>,
}

pub(super) const IN: u32 = 1;
pub(super) const OUT: u32 = 0;
pub(super) const EPIPE: i32 = -32;
pub(super) const ENODEV: i32 = -19;

/// A transfer with this sequence number, direction, endpoint and length.
pub(super) fn submit_bytes(
    [seq, direction, endpoint, length]: [u32; 4],
    setup: [u8; 8],
) -> Vec<u8> {
    let words = [1, seq, 0x1_0001, direction, endpoint, 0, length];
    let words = words.map(u32::to_be_bytes);
    [words.as_flattened(), &[0; 12], &setup].concat()
}

pub(super) fn setup(request_type: u8, request: u8, value: u16, index: u16, length: u16) -> [u8; 8] {
    let [v, i, l] = [value, index, length].map(u16::to_le_bytes);
    [request_type, request, v[0], v[1], i[0], i[1], l[0], l[1]]
}

impl<S: io::Read + io::Write> Client<S> {
    pub(super) fn reply(&mut self, expects_data: bool) -> Reply {
        let mut header = [0; 48];
        self.0.read_exact(&mut header).unwrap();
        let word = |at: usize| u32::from_be_bytes(header[at..at + 4].try_into().unwrap());
        let length = if expects_data { word(24) } else { 0 };
        let mut data = vec![0; length.try_into().unwrap()];
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
    pub(super) fn control(&mut self, setup: [u8; 8], sent: &[u8]) -> Reply {
        let length = u32::from(u16::from_le_bytes([setup[6], setup[7]]));
        let direction = u32::from(setup[0] & DEVICE_TO_HOST != 0);
        let mut bytes = submit_bytes([7, direction, 0, length], setup);
        bytes.extend(sent);
        self.0.write_all(&bytes).unwrap();
        let reply = self.reply(direction == IN);
        assert_eq!((reply.command, reply.sequence), (3, 7));
        reply
    }

    /// GET_DESCRIPTOR: kind and index in wValue, language in wIndex.
    pub(super) fn descriptor(&mut self, value: u16, language: u16, length: u16) -> Reply {
        self.control(setup(DEVICE_TO_HOST, 6, value, language, length), &[])
    }

    /// One message as `usb_xfer` of i2c-tiny-usb sends it: bit 0 begins, bit 1 ends, flags in wValue, address in wIndex.
    pub(super) fn write_message(&mut self, begin_end: u8, address: u16, bytes: &[u8]) -> i32 {
        let length = u16::try_from(bytes.len()).unwrap();
        self.control(setup(0x41, 4 | begin_end, 0, address, length), bytes)
            .status
    }

    pub(super) fn read_message(&mut self, begin_end: u8, address: u16, length: u16) -> Reply {
        self.control(setup(0xC1, 4 | begin_end, 1, address, length), &[])
    }

    /// 1 acknowledged, 2 not acknowledged.
    pub(super) fn status(&mut self) -> u8 {
        self.control(setup(0xC1, 3, 0, 0, 1), &[]).data[0]
    }
}

pub(super) const BEGIN: u8 = 1;
pub(super) const END: u8 = 2;
pub(super) const WHOLE: u8 = BEGIN | END;

/// A device served over a socket pair, as for the kernel, and its target.
pub(super) fn plugged_in() -> (Registers, Client<UnixStream>) {
    let (client, served) = UnixStream::pair().unwrap();
    let registers = Registers::default();
    let mut device = device_on(registers.clone());
    thread::spawn(move || session::serve(&served, &served, &mut device));
    (registers, Client(client))
}

pub(super) fn device_on(registers: Registers) -> Device<Registers> {
    Device::new(registers, Identity::new(1, 0))
}
