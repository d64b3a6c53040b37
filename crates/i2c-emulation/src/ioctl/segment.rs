//! The messages of a transfer: fetched from the caller, carried out, and copied back.

use super::mode::AdapterMode;
use super::uapi::{
    CallerMemory, MESSAGE_BYTES_MAX, RdwrMessage, SMBUS_BLOCK_MAX, functionality, message_flag,
};
use crate::adapter::Message;
use embedded_hal::i2c::Operation;
use rustix::io::Errno;

/// One message with the kernel's copy of the caller's buffer.
#[derive(Debug)]
pub(crate) struct Segment {
    pub(crate) address: u16,
    pub(crate) ten_bit: bool,
    pub(crate) read: bool,
    pub(crate) bytes: Vec<u8>,
    /// Where to copy the bytes read; unused by SMBus transfers.
    pub(crate) buffer: u64,
    /// Bytes besides the block, if the first byte holds the block's length.
    pub(crate) length_first: Option<usize>,
}

impl Segment {
    pub(crate) const fn new(address: u16, ten_bit: bool, read: bool, bytes: Vec<u8>) -> Self {
        Self {
            address,
            ten_bit,
            read,
            bytes,
            buffer: 0,
            length_first: None,
        }
    }

    pub(crate) fn is_too_long(&self) -> bool {
        self.bytes.len() > MESSAGE_BYTES_MAX
    }

    pub(crate) fn as_message(&mut self) -> Message<'_> {
        let operation = if self.read {
            Operation::Read(&mut self.bytes)
        } else {
            Operation::Write(&self.bytes)
        };
        Message {
            address: self.address,
            ten_bit: self.ten_bit,
            operation,
        }
    }

    /// The valid bytes: all, or as many as the first byte says.
    pub(super) fn arrived(&self) -> Result<&[u8], Errno> {
        let Some(extra) = self.length_first else {
            return Ok(&self.bytes);
        };
        match self.bytes.first().copied().map(usize::from) {
            // The buffer only has room for the longest block, so a longer one is not there.
            Some(told) if told > 0 => self.bytes.get(..extra + told).ok_or(Errno::PROTO),
            _ => Err(Errno::PROTO),
        }
    }
}

/// Copies the message's buffer; the kernel does that even for a read.
pub(super) fn fetch_segment(
    message: &RdwrMessage,
    mode: AdapterMode,
    memory: &mut dyn CallerMemory,
) -> Result<Segment, Errno> {
    let length = usize::from(message.length);
    if length > MESSAGE_BYTES_MAX {
        return Err(Errno::INVAL);
    }
    let mut bytes = vec![0; length];
    if length > 0 {
        memory.read(message.buffer, &mut bytes)?;
    }
    let read = message.flags & message_flag::READ != 0;
    let mut length_first = None;
    if message.flags & message_flag::LENGTH_FIRST != 0 {
        let extra = bytes.first().copied().map_or(0, usize::from);
        if !read || extra == 0 || length < extra + SMBUS_BLOCK_MAX {
            return Err(Errno::INVAL);
        }
        if !mode.offers(functionality::SMBUS_READ_BLOCK) {
            return Err(Errno::OPNOTSUPP);
        }
        bytes.truncate(extra + SMBUS_BLOCK_MAX);
        length_first = Some(extra);
    }
    let ten_bit = message.flags & message_flag::TEN_BIT != 0;
    Ok(Segment {
        buffer: message.buffer,
        length_first,
        ..Segment::new(message.address, ten_bit, read, bytes)
    })
}
