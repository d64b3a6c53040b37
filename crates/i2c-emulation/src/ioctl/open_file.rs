//! One open file of the device: its system calls, and their transfers.

use super::mode::AdapterMode;
use super::segment::{Segment, fetch_segment};
use super::uapi::{
    CallerMemory, MESSAGE_BYTES_MAX, PointerWidth, RDWR_MESSAGES_MAX, RdwrMessage, functionality,
    pointer_at, request, u32_at,
};
use crate::adapter::{EmulatedAdapter, Message, SEVEN_BIT_ADDRESS_MAX, TransferError};
use embedded_hal::i2c::Operation;
use rustix::io::Errno;

/// The most retries after lost arbitration, whatever I2C_RETRIES sets.
pub const RETRIES_DONE_MAX: u32 = 1000;

const TEN_BIT_ADDRESS_MAX: u16 = 0x3FF;

/// One open file of `/dev/i2c-N`.
#[derive(Clone, Debug)]
pub struct OpenFile {
    pub(super) mode: AdapterMode,
    pub(super) address: u16,
    pub(super) ten_bit: bool,
    pub(crate) pec: bool,
    retries: u32,
}

impl OpenFile {
    /// A file as after open(): address 0, seven bits, no checksum.
    #[must_use]
    pub const fn new(mode: AdapterMode) -> Self {
        Self {
            mode,
            address: 0,
            ten_bit: false,
            pec: false,
            retries: mode.retries_at_first(),
        }
    }

    /// A file after I2C_TENBIT and I2C_SLAVE or, with `force`, I2C_SLAVE_FORCE.
    pub(crate) fn selecting(
        mode: AdapterMode,
        address: u16,
        ten_bit: bool,
        force: bool,
    ) -> Result<Self, Errno> {
        let mut file = Self::new(mode);
        file.ten_bit = ten_bit;
        file.set_address(address.into(), !force && mode == AdapterMode::Busy)?;
        Ok(file)
    }

    /// Acts as ioctl().
    /// # Errors
    /// The kernel's errno, or the bus's according to [`AdapterMode`].
    pub fn ioctl(
        &mut self,
        request: u32,
        argument: u64,
        memory: &mut dyn CallerMemory,
        bus: &mut dyn EmulatedAdapter,
    ) -> Result<i32, Errno> {
        match request {
            request::I2C_SLAVE => self.set_address(argument, self.mode == AdapterMode::Busy),
            request::I2C_SLAVE_FORCE => self.set_address(argument, false),
            request::I2C_TENBIT => {
                self.ten_bit = argument != 0;
                Ok(0)
            }
            request::I2C_PEC => {
                self.pec = argument != 0;
                Ok(0)
            }
            request::I2C_RETRIES => {
                self.retries = signed_argument(argument)?;
                Ok(0)
            }
            // Nothing here waits.
            request::I2C_TIMEOUT => signed_argument(argument).map(|_timeout| 0),
            request::I2C_FUNCS => {
                let bits = self.mode.functionality();
                let told = match memory.pointer_width() {
                    PointerWidth::Bits32 => memory.write(argument, &bits.to_ne_bytes()),
                    PointerWidth::Bits64 => memory.write(argument, &u64::from(bits).to_ne_bytes()),
                };
                told.map(|()| 0)
            }
            request::I2C_RDWR => self.transfer_messages(argument, memory, bus),
            request::I2C_SMBUS => self.smbus(argument, memory, bus),
            _ => Err(Errno::NOTTY),
        }
    }

    /// Acts as read(): one message from the target, of at most [`MESSAGE_BYTES_MAX`] bytes.
    /// # Errors
    /// EOPNOTSUPP without plain I2C, or the errno of the bus; in mode `virtio` a missing target is `Ok(0)`.
    pub fn read(
        &mut self,
        buffer: &mut [u8],
        bus: &mut dyn EmulatedAdapter,
    ) -> Result<usize, Errno> {
        let length = buffer.len().min(MESSAGE_BYTES_MAX);
        self.transfer_one(Operation::Read(&mut buffer[..length]), length, bus)
    }

    /// Acts as write(): one message to the target, of at most [`MESSAGE_BYTES_MAX`] bytes.
    /// # Errors
    /// As [`read`](Self::read).
    pub fn write(&mut self, bytes: &[u8], bus: &mut dyn EmulatedAdapter) -> Result<usize, Errno> {
        let length = bytes.len().min(MESSAGE_BYTES_MAX);
        self.transfer_one(Operation::Write(&bytes[..length]), length, bus)
    }

    fn set_address(&mut self, argument: u64, owned_by_a_driver: bool) -> Result<i32, Errno> {
        let highest = match self.ten_bit {
            true => TEN_BIT_ADDRESS_MAX,
            false => SEVEN_BIT_ADDRESS_MAX,
        };
        let address = u16::try_from(argument).or(Err(Errno::INVAL))?;
        if address > highest {
            return Err(Errno::INVAL);
        }
        if owned_by_a_driver {
            return Err(Errno::BUSY);
        }
        self.address = address;
        Ok(0)
    }

    fn transfer_one(
        &self,
        operation: Operation<'_>,
        length: usize,
        bus: &mut dyn EmulatedAdapter,
    ) -> Result<usize, Errno> {
        self.require_plain_i2c()?;
        let message = Message {
            address: self.address,
            ten_bit: self.ten_bit,
            operation,
        };
        let completed = self.transfer(&mut [message], bus)?;
        Ok(if completed == 1 { length } else { 0 })
    }

    fn transfer_messages(
        &self,
        argument: u64,
        memory: &mut dyn CallerMemory,
        bus: &mut dyn EmulatedAdapter,
    ) -> Result<i32, Errno> {
        let messages = self.fetch_messages(argument, memory)?;
        self.require_plain_i2c()?;
        let fetch = |message: &RdwrMessage| fetch_segment(message, self.mode, memory);
        let mut segments = messages.iter().map(fetch).collect::<Result<Vec<_>, _>>()?;
        let completed = self.rdwr(&mut segments, bus)?;
        // An empty buffer may have any pointer, as in the kernel.
        for segment in segments {
            if segment.read && !segment.bytes.is_empty() {
                memory.write(segment.buffer, segment.arrived()?)?;
            }
        }
        i32::try_from(completed).or(Err(Errno::INVAL))
    }

    /// I2C_RDWR with messages that were already fetched: returns how many completed.
    pub(crate) fn rdwr(
        &self,
        segments: &mut [Segment],
        bus: &mut dyn EmulatedAdapter,
    ) -> Result<usize, Errno> {
        self.require_plain_i2c()?;
        if segments.iter().any(Segment::is_too_long) {
            return Err(Errno::INVAL);
        }
        let bytes = segments.iter().map(|segment| segment.bytes.clone());
        let before: Vec<Vec<u8>> = bytes.collect();
        let completed = self.transfer_segments(segments, bus)?;
        // If the adapter reports no error, the kernel copies back every read buffer, in `virtio` mode even those that
        // never arrived: the caller then finds its own old bytes.
        for (segment, before) in segments.iter_mut().zip(before).skip(completed) {
            segment.bytes = before;
        }
        Ok(completed)
    }

    /// Fetches the message array that the caller's argument points to; checks only its length.
    fn fetch_messages(
        &self,
        argument: u64,
        memory: &mut dyn CallerMemory,
    ) -> Result<Vec<RdwrMessage>, Errno> {
        let width = memory.pointer_width();
        // `struct i2c_rdwr_ioctl_data`: a pointer, then a count; 8 or 16 bytes.
        let mut bytes = vec![0; 2 * width.bytes()];
        memory.read(argument, &mut bytes)?;
        let array = pointer_at(&bytes, 0, width);
        let count = u32_at(&bytes, width.bytes());
        let count = usize::try_from(count).or(Err(Errno::INVAL))?;
        if array == 0 || count == 0 || count > RDWR_MESSAGES_MAX {
            return Err(Errno::INVAL);
        }
        let mut bytes = vec![0; count * RdwrMessage::bytes(width)];
        memory.read(array, &mut bytes)?;
        let messages = bytes.chunks_exact(RdwrMessage::bytes(width));
        let parse = |bytes| RdwrMessage::parse(bytes, width);
        Ok(messages.map(parse).collect())
    }

    pub(super) fn transfer_segments(
        &self,
        segments: &mut [Segment],
        bus: &mut dyn EmulatedAdapter,
    ) -> Result<usize, Errno> {
        let mut messages: Vec<Message<'_>> = segments.iter_mut().map(Segment::as_message).collect();
        self.transfer(&mut messages, bus)
    }

    /// The kernel's `i2c_transfer`: returns how many messages completed, or an errno.
    fn transfer(
        &self,
        messages: &mut [Message<'_>],
        bus: &mut dyn EmulatedAdapter,
    ) -> Result<usize, Errno> {
        self.mode.check(messages)?;
        let mut retries_left = self.retries.min(RETRIES_DONE_MAX);
        loop {
            let TransferError { completed, fault } = match bus.transfer(messages) {
                Ok(()) => return Ok(messages.len()),
                Err(error) => error,
            };
            match self.mode.errno(fault) {
                Some(Errno::AGAIN) if retries_left > 0 => retries_left -= 1,
                Some(errno) => return Err(errno),
                None => return Ok(completed),
            }
        }
    }

    fn require_plain_i2c(&self) -> Result<(), Errno> {
        let offered = self.mode.offers(functionality::I2C);
        offered.then_some(()).ok_or(Errno::OPNOTSUPP)
    }
}

/// In the kernel, retries and timeout are an `int` and must not be negative.
fn signed_argument(argument: u64) -> Result<u32, Errno> {
    i32::try_from(argument)
        .ok()
        .and_then(|value| u32::try_from(value).ok())
        .ok_or(Errno::INVAL)
}
