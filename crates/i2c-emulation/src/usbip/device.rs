//! The USB side of the adapter: an i2c-tiny-usb's answers to control transfers.

use super::wire::{DESCRIPTOR, Identity, Setup};
use crate::adapter::{EmulatedAdapter, Fault, Message, TransferError};
use crate::ioctl::{
    AdapterMode, Errno, MESSAGE_BYTES_MAX, RDWR_MESSAGES_MAX, Segment, message_flag,
};

/// The most messages held until their transfer is complete: as many as one I2C_RDWR may have.
pub const HELD_MESSAGES_MAX: usize = RDWR_MESSAGES_MAX;

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

/// The adapter's own requests, as in the kernel's `i2c-tiny-usb.c`.
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

/// GET_STATUS values about the last message.
mod status {
    pub(super) const IDLE: u8 = 0;
    pub(super) const ADDRESS_ACKNOWLEDGED: u8 = 1;
    pub(super) const ADDRESS_NOT_ACKNOWLEDGED: u8 = 2;
}

/// The device rejects the request by a stalled endpoint.
const STALL: Result<Vec<u8>, Errno> = Err(Errno::PIPE);

pub(super) struct Device<A> {
    bus: A,
    identity: Identity,
    configuration: u8,
    status: u8,
    /// Messages acknowledged to the host but not yet sent.
    held: Vec<Segment>,
}

impl<A: EmulatedAdapter> Device<A> {
    pub(super) const fn new(bus: A, identity: Identity) -> Self {
        Self {
            bus,
            identity,
            configuration: 0,
            status: status::IDLE,
            held: Vec::new(),
        }
    }

    /// Carries out one control transfer. `sent` has the host's bytes; returns the device's, at most as many as
    /// requested.
    pub(super) fn control(&mut self, setup: Setup, sent: &[u8]) -> Result<Vec<u8>, Errno> {
        let mut answer = match setup.request_type & 0x60 {
            0x00 => self.standard_request(setup),
            0x40 => self.vendor_request(setup, sent),
            _ => STALL,
        }?;
        answer.truncate(setup.length.into());
        Ok(answer)
    }

    fn standard_request(&mut self, setup: Setup) -> Result<Vec<u8>, Errno> {
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
            _ => STALL,
        }
    }

    fn descriptor(&self, kind: u8, index: u8) -> Result<Vec<u8>, Errno> {
        match (kind, index) {
            (descriptor::DEVICE, 0) => Ok(DESCRIPTOR.to_vec()),
            (descriptor::CONFIGURATION, 0) => Ok(configuration_descriptor()),
            (descriptor::STRING, 0) => Ok(string_descriptor([ENGLISH])),
            (descriptor::STRING, 1) => Ok(string_descriptor("emulated".encode_utf16())),
            (descriptor::STRING, 2) => Ok(string_descriptor("i2c-tiny-usb".encode_utf16())),
            (descriptor::STRING, 3) => Ok(string_descriptor(self.identity.bus_id.encode_utf16())),
            _ => STALL,
        }
    }

    fn vendor_request(&mut self, setup: Setup, sent: &[u8]) -> Result<Vec<u8>, Errno> {
        match (setup.request, setup.is_in()) {
            (vendor::ECHO, true) => Ok(setup.value.to_le_bytes().to_vec()),
            (vendor::GET_FUNCTIONALITY, true) => {
                Ok(AdapterMode::Usb.functionality().to_le_bytes().to_vec())
            }
            // The emulated bus sets its own bit time.
            (vendor::SET_DELAY, false) => Ok(Vec::new()),
            (vendor::GET_STATUS, true) => Ok(vec![self.status]),
            (vendor::IO..=vendor::IO_LAST, _) => self.message(setup, sent),
            _ => STALL,
        }
    }

    /// One message of a transfer. The host asks right after each message whether it was acknowledged. A write that does
    /// not end its transfer is therefore acknowledged blindly and held. If no target answers, the host learns it from
    /// the read, with the same errno.
    fn message(&mut self, setup: Setup, sent: &[u8]) -> Result<Vec<u8>, Errno> {
        let is_read = setup.value & message_flag::READ != 0;
        let length = usize::from(setup.length);
        if setup.request & vendor::BEGIN != 0 {
            // Messages left by a host that broke off never got their stop.
            self.held.clear();
        }
        let one_too_many = !is_read && self.held.len() >= HELD_MESSAGES_MAX;
        if one_too_many || is_read != setup.is_in() || length > MESSAGE_BYTES_MAX {
            self.held.clear();
            return STALL;
        }
        let ten_bit = setup.value & message_flag::TEN_BIT != 0;
        // For a read, the host sends nothing.
        let mut bytes = sent.to_vec();
        bytes.resize(length, 0);
        let segment = Segment::new(setup.index, ten_bit, is_read, bytes);
        self.held.push(segment);
        self.status = status::ADDRESS_ACKNOWLEDGED;
        if !is_read && setup.request & vendor::END == 0 {
            return Ok(Vec::new());
        }
        let mut held = std::mem::take(&mut self.held);
        let mut messages: Vec<Message<'_>> = held.iter_mut().map(Segment::as_message).collect();
        let outcome = self.bus.transfer(&mut messages);
        self.settle(outcome)?;
        let last = held.pop().filter(|last| last.read);
        Ok(last.map(|last| last.bytes).unwrap_or_default())
    }

    /// Sets the status that the host asks for next. The status has a value only for a missing target: every other fault
    /// stalls, which the kernel's driver turns into EIO.
    fn settle(&mut self, outcome: Result<(), TransferError>) -> Result<(), Errno> {
        match outcome.map_err(|error| error.fault) {
            Ok(()) => Ok(()),
            Err(Fault::NackAddress) => {
                self.status = status::ADDRESS_NOT_ACKNOWLEDGED;
                Ok(())
            }
            Err(Fault::Gone) => Err(Errno::NODEV),
            Err(_) => Err(Errno::PIPE),
        }
    }
}

/// USB 2.0, tables 9-10 and 9-12: one interface with only the control endpoint, 100 mA from the bus.
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
