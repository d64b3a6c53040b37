//! The USB side of the adapter: what an i2c-tiny-usb answers to each control transfer.

use super::wire::{Described, Setup};
use crate::adapter::{EmulatedAdapter, Fault, Message, TransferError};
use crate::ioctl::{AdapterMode, MESSAGE_BYTES_MAX, RDWR_MESSAGES_MAX, message_flag};
use embedded_hal::i2c::Operation;

/// Most messages that are held until the transfer they belong to is complete, as many as one I2C_RDWR may have.
pub const HELD_MESSAGES_MAX: usize = RDWR_MESSAGES_MAX;

/// The vendor and product that the kernel's i2c-tiny-usb knows as its first one.
const VENDOR: u16 = 0x0403;
const PRODUCT: u16 = 0xC631;
/// Release 2.00, in binary-coded decimal.
const RELEASE: u16 = 0x0200;
/// USB_SPEED_LOW of `linux/usb/ch9.h`, as the original has it. vhci-hcd complains in the kernel's log about full speed.
pub(super) const SPEED_LOW: u32 = 1;

const ENGLISH: u16 = 0x0409;

/// Standard requests (USB 2.0, table 9-4).
mod standard {
    pub(super) const GET_STATUS: u8 = 0;
    pub(super) const CLEAR_FEATURE: u8 = 1;
    pub(super) const SET_FEATURE: u8 = 3;
    pub(super) const GET_DESCRIPTOR: u8 = 6;
    pub(super) const GET_CONFIGURATION: u8 = 8;
    pub(super) const SET_CONFIGURATION: u8 = 9;
    pub(super) const GET_INTERFACE: u8 = 10;
    pub(super) const SET_INTERFACE: u8 = 11;
}

/// Kinds of descriptor (USB 2.0, table 9-5).
mod descriptor {
    pub(super) const DEVICE: u8 = 1;
    pub(super) const CONFIGURATION: u8 = 2;
    pub(super) const STRING: u8 = 3;
    pub(super) const INTERFACE: u8 = 4;
}

/// The adapter's own requests, as the kernel's `i2c-tiny-usb.c` sends them.
mod vendor {
    pub(super) const ECHO: u8 = 0;
    pub(super) const GET_FUNCTIONALITY: u8 = 1;
    pub(super) const SET_DELAY: u8 = 2;
    pub(super) const GET_STATUS: u8 = 3;
    /// One message: bit 0 begins a transfer, bit 1 ends it.
    pub(super) const IO: u8 = 4;
    pub(super) const IO_LAST: u8 = 7;
    pub(super) const BEGIN: u8 = 1;
    pub(super) const END: u8 = 2;
}

/// What GET_STATUS tells of the last message.
mod status {
    pub(super) const IDLE: u8 = 0;
    pub(super) const ADDRESS_ACKNOWLEDGED: u8 = 1;
    pub(super) const ADDRESS_NOT_ACKNOWLEDGED: u8 = 2;
}

/// A control transfer that was not carried out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ControlFault {
    /// The device refuses, by a stalled endpoint.
    Stall,
    /// The device is no longer there.
    Gone,
}

impl ControlFault {
    /// The status of the reply: EPIPE and ENODEV of Linux, negative.
    pub(super) const fn status(self) -> i32 {
        match self {
            Self::Stall => -libc::EPIPE,
            Self::Gone => -libc::ENODEV,
        }
    }
}

/// A message to a target that has been acknowledged to the host, but not yet been sent.
struct HeldWrite {
    address: u16,
    ten_bit: bool,
    bytes: Vec<u8>,
}

/// One emulated adapter with its bus.
pub(super) struct Device<A> {
    bus: A,
    identity: Described,
    configuration: u8,
    status: u8,
    held: Vec<HeldWrite>,
}

impl<A: EmulatedAdapter> Device<A> {
    /// An adapter as it is after it was plugged in.
    pub(super) const fn new(bus: A, identity: Described) -> Self {
        Self {
            bus,
            identity,
            configuration: 0,
            status: status::IDLE,
            held: Vec::new(),
        }
    }

    /// Carries out one control transfer. `sent` are the host's bytes; what comes back are the device's, at most as many
    /// as the host asked for.
    pub(super) fn control(&mut self, setup: Setup, sent: &[u8]) -> Result<Vec<u8>, ControlFault> {
        let mut answer = match setup.request_type & 0x60 {
            0x00 => self.standard_request(setup),
            0x40 => self.vendor_request(setup, sent),
            _ => Err(ControlFault::Stall),
        }?;
        answer.truncate(setup.length.into());
        Ok(answer)
    }

    fn standard_request(&mut self, setup: Setup) -> Result<Vec<u8>, ControlFault> {
        let [kind_index, kind] = setup.value.to_le_bytes();
        match (setup.request, setup.is_in()) {
            (standard::GET_STATUS, true) => Ok(vec![0, 0]),
            (standard::GET_DESCRIPTOR, true) => self.descriptor(kind, kind_index),
            (standard::GET_CONFIGURATION, true) => Ok(vec![self.configuration]),
            (standard::SET_CONFIGURATION, false) if setup.value <= 1 => {
                self.configuration = kind_index;
                Ok(Vec::new())
            }
            (standard::GET_INTERFACE, true) => Ok(vec![0]),
            (standard::SET_INTERFACE, false) if setup.value == 0 && setup.index == 0 => {
                Ok(Vec::new())
            }
            (standard::CLEAR_FEATURE | standard::SET_FEATURE, false) => Ok(Vec::new()),
            _ => Err(ControlFault::Stall),
        }
    }

    fn descriptor(&self, kind: u8, index: u8) -> Result<Vec<u8>, ControlFault> {
        match (kind, index) {
            (descriptor::DEVICE, 0) => Ok(self.identity.descriptor.to_vec()),
            (descriptor::CONFIGURATION, 0) => Ok(configuration_descriptor()),
            (descriptor::STRING, 0) => Ok(string_descriptor([ENGLISH])),
            (descriptor::STRING, 1) => Ok(string_descriptor("emulated".encode_utf16())),
            (descriptor::STRING, 2) => Ok(string_descriptor("i2c-tiny-usb".encode_utf16())),
            (descriptor::STRING, 3) => Ok(string_descriptor(self.identity.bus_id.encode_utf16())),
            _ => Err(ControlFault::Stall),
        }
    }

    fn vendor_request(&mut self, setup: Setup, sent: &[u8]) -> Result<Vec<u8>, ControlFault> {
        match (setup.request, setup.is_in()) {
            (vendor::ECHO, true) => Ok(setup.value.to_le_bytes().to_vec()),
            (vendor::GET_FUNCTIONALITY, true) => {
                Ok(AdapterMode::Usb.functionality().to_le_bytes().to_vec())
            }
            // The length of a bit is the emulated bus's own affair.
            (vendor::SET_DELAY, false) => Ok(Vec::new()),
            (vendor::GET_STATUS, true) => Ok(vec![self.status]),
            (vendor::IO..=vendor::IO_LAST, _) => self.message(setup, sent),
            _ => Err(ControlFault::Stall),
        }
    }

    /// One message of a transfer.
    ///
    /// The host wants to hear of each message at once whether it was acknowledged. A message to a target that does not
    /// end its transfer is acknowledged unseen and held, so that it and the read after it are one transaction on the
    /// emulated bus; if nobody answers, the host learns it from the read, with the same errno.
    fn message(&mut self, setup: Setup, sent: &[u8]) -> Result<Vec<u8>, ControlFault> {
        let is_read = setup.value & message_flag::READ != 0;
        let length = usize::from(setup.length);
        if setup.request & vendor::BEGIN != 0 {
            // Whatever a host that broke off has left behind never reached its stop.
            self.held.clear();
        }
        if is_read != setup.is_in() || length > MESSAGE_BYTES_MAX {
            self.held.clear();
            return Err(ControlFault::Stall);
        }
        let ten_bit = setup.value & message_flag::TEN_BIT != 0;
        if is_read {
            let mut buffer = vec![0; length];
            let read = Message {
                address: setup.index,
                ten_bit,
                operation: Operation::Read(&mut buffer),
            };
            let outcome = transfer(&mut self.bus, &self.held, Some(read));
            self.settle(outcome)?;
            return Ok(buffer);
        }
        self.hold(HeldWrite {
            address: setup.index,
            ten_bit,
            bytes: sent.to_vec(),
        })?;
        if setup.request & vendor::END != 0 {
            let outcome = transfer(&mut self.bus, &self.held, None);
            self.settle(outcome)?;
        }
        Ok(Vec::new())
    }

    fn hold(&mut self, write: HeldWrite) -> Result<(), ControlFault> {
        if self.held.len() >= HELD_MESSAGES_MAX {
            self.held.clear();
            return Err(ControlFault::Stall);
        }
        self.held.push(write);
        self.status = status::ADDRESS_ACKNOWLEDGED;
        Ok(())
    }

    /// Keeps what the host will ask for next. The adapter's status has a value for a missing target only: every other
    /// fault stalls, which the kernel's driver makes EIO.
    fn settle(&mut self, outcome: Result<(), TransferError>) -> Result<(), ControlFault> {
        self.held.clear();
        self.status = status::ADDRESS_ACKNOWLEDGED;
        match outcome.map_err(|error| error.fault) {
            Ok(()) => Ok(()),
            Err(Fault::NackAddress) => {
                self.status = status::ADDRESS_NOT_ACKNOWLEDGED;
                Ok(())
            }
            Err(Fault::Gone) => Err(ControlFault::Gone),
            Err(_) => Err(ControlFault::Stall),
        }
    }
}

/// Carries out the held messages, and the read behind them, as one transfer.
fn transfer(
    bus: &mut impl EmulatedAdapter,
    held: &[HeldWrite],
    read: Option<Message<'_>>,
) -> Result<(), TransferError> {
    let writes = held.iter().map(|write| Message {
        address: write.address,
        ten_bit: write.ten_bit,
        operation: Operation::Write(&write.bytes),
    });
    let mut messages: Vec<Message<'_>> = writes.chain(read).collect();
    bus.transfer(&mut messages)
}

/// USB 2.0, table 9-8: USB 1.1, a class of its own, eight bytes at a time, three strings, one configuration.
pub(super) fn device_descriptor() -> [u8; 18] {
    let [vendor_low, vendor_high] = VENDOR.to_le_bytes();
    let [product_low, product_high] = PRODUCT.to_le_bytes();
    let [release_low, release_high] = RELEASE.to_le_bytes();
    [
        18,
        descriptor::DEVICE,
        0x10,
        0x01,
        0xFF,
        0,
        0,
        8,
        vendor_low,
        vendor_high,
        product_low,
        product_high,
        release_low,
        release_high,
        1,
        2,
        3,
        1,
    ]
}

/// USB 2.0, tables 9-10 and 9-12: one interface without an endpoint beside the control endpoint, 100 mA from the bus.
fn configuration_descriptor() -> Vec<u8> {
    let configuration = [9, descriptor::CONFIGURATION, 18, 0, 1, 1, 0, 0x80, 50];
    let interface = [9, descriptor::INTERFACE, 0, 0, 0, 0xFF, 0, 0, 0];
    [configuration, interface].concat()
}

fn string_descriptor(text: impl IntoIterator<Item = u16>) -> Vec<u8> {
    let mut bytes = vec![0, descriptor::STRING];
    bytes.extend(text.into_iter().flat_map(u16::to_le_bytes));
    bytes[0] = u8::try_from(bytes.len()).unwrap_or(u8::MAX);
    bytes
}
