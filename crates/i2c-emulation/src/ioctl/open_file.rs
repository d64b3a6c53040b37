//! One open file of the device: the system calls on it, and the transfers that they are made of.

use std::time::Duration;

use embedded_hal::i2c::Operation;

use super::errno::Errno;
use super::memory::CallerMemory;
use super::mode::AdapterMode;
use super::segment::{Segment, fetch_segments};
use super::uapi::{
    MESSAGE_BYTES_MAX, PointerWidth, RDWR_MESSAGES_MAX, RdwrArgument, RdwrMessage, functionality,
    request,
};
use crate::adapter::{EmulatedAdapter, Message, SEVEN_BIT_ADDRESS_MAX, TransferError};

/// Most retries after lost arbitration, whatever I2C_RETRIES asks for.
pub const RETRIES_DONE_MAX: u32 = 1000;

const TEN_BIT_ADDRESS_MAX: u16 = 0x3FF;

const TIMEOUT_AT_FIRST: Duration = Duration::from_secs(1);

/// One open file of `/dev/i2c-N`.
#[derive(Clone, Debug)]
pub struct OpenFile {
    pub(super) mode: AdapterMode,
    pub(super) address: u16,
    pub(super) ten_bit: bool,
    pub(super) pec: bool,
    retries: u32,
    timeout: Duration,
}

impl OpenFile {
    /// A file as it is after open(): address 0, seven bits, no checksum.
    #[must_use]
    pub const fn new(mode: AdapterMode) -> Self {
        Self {
            mode,
            address: 0,
            ten_bit: false,
            pec: false,
            retries: mode.retries_at_first(),
            timeout: TIMEOUT_AT_FIRST,
        }
    }

    /// How long a transfer may take, as set by I2C_TIMEOUT; at first one second. It is kept and told, nothing here waits.
    #[must_use]
    pub const fn timeout(&self) -> Duration {
        self.timeout
    }

    /// What ioctl() does. `argument` is the third argument of the system call, as a number.
    ///
    /// # Errors
    /// The errno that the kernel gives: ENOTTY for an unknown request, EFAULT for a pointer that leads nowhere, EINVAL
    /// for a value out of range, EBUSY, EOPNOTSUPP, and the errno of the bus by [`AdapterMode`].
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
            request::I2C_TIMEOUT => {
                self.timeout = Duration::from_millis(10 * u64::from(signed_argument(argument)?));
                Ok(0)
            }
            request::I2C_FUNCS => self.tell_functionality(argument, memory),
            request::I2C_RDWR => self.transfer_messages(argument, memory, bus),
            request::I2C_SMBUS => self.smbus(argument, memory, bus),
            _ => Err(Errno::ENOTTY),
        }
    }

    /// What read() does: one message from the target. At most [`MESSAGE_BYTES_MAX`] bytes are read.
    ///
    /// # Errors
    /// EOPNOTSUPP without plain I2C, and the errno of the bus by [`AdapterMode`]. In mode `virtio` a target that does
    /// not answer is `Ok(0)`.
    pub fn read(
        &mut self,
        buffer: &mut [u8],
        bus: &mut dyn EmulatedAdapter,
    ) -> Result<usize, Errno> {
        let length = buffer.len().min(MESSAGE_BYTES_MAX);
        self.transfer_one(Operation::Read(&mut buffer[..length]), length, bus)
    }

    /// What write() does: one message to the target. At most [`MESSAGE_BYTES_MAX`] bytes are written.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn write(&mut self, bytes: &[u8], bus: &mut dyn EmulatedAdapter) -> Result<usize, Errno> {
        let length = bytes.len().min(MESSAGE_BYTES_MAX);
        self.transfer_one(Operation::Write(&bytes[..length]), length, bus)
    }

    fn set_address(&mut self, argument: u64, owned_by_a_driver: bool) -> Result<i32, Errno> {
        let highest = if self.ten_bit {
            TEN_BIT_ADDRESS_MAX
        } else {
            SEVEN_BIT_ADDRESS_MAX
        };
        let address = u16::try_from(argument)
            .ok()
            .filter(|address| *address <= highest)
            .ok_or(Errno::EINVAL)?;
        if owned_by_a_driver {
            return Err(Errno::EBUSY);
        }
        self.address = address;
        Ok(0)
    }

    fn tell_functionality(
        &self,
        argument: u64,
        memory: &mut dyn CallerMemory,
    ) -> Result<i32, Errno> {
        let bits = self.mode.functionality();
        match memory.pointer_width() {
            PointerWidth::Bits32 => memory.write(argument, &bits.to_ne_bytes()),
            PointerWidth::Bits64 => memory.write(argument, &u64::from(bits).to_ne_bytes()),
        }?;
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
        let mut segments = fetch_segments(&messages, self.mode, memory)?;
        let before: Vec<Vec<u8>> = segments
            .iter()
            .map(|segment| segment.bytes.clone())
            .collect();
        let completed = self.transfer_segments(&mut segments, bus)?;
        // The kernel copies every read buffer back once the adapter reports no error, in `virtio` mode also those that
        // never arrived: the caller then finds its own old bytes.
        for (index, (segment, before)) in segments.iter_mut().zip(before).enumerate() {
            if segment.read && index >= completed {
                segment.bytes = before;
            }
        }
        // An empty buffer may have any pointer, as with the kernel's copies.
        for segment in segments
            .iter()
            .filter(|segment| segment.read && !segment.bytes.is_empty())
        {
            memory.write(segment.buffer, segment.arrived()?)?;
        }
        i32::try_from(completed).or(Err(Errno::EINVAL))
    }

    /// The array of messages that the caller's argument points at, nothing of them checked but their number.
    fn fetch_messages(
        &self,
        argument: u64,
        memory: &mut dyn CallerMemory,
    ) -> Result<Vec<RdwrMessage>, Errno> {
        let width = memory.pointer_width();
        let mut bytes = vec![0; RdwrArgument::bytes(width)];
        memory.read(argument, &mut bytes)?;
        let rdwr = RdwrArgument::parse(&bytes, width);
        let count = usize::try_from(rdwr.count).or(Err(Errno::EINVAL))?;
        if rdwr.messages == 0 || count == 0 || count > RDWR_MESSAGES_MAX {
            return Err(Errno::EINVAL);
        }
        let mut bytes = vec![0; count * RdwrMessage::bytes(width)];
        memory.read(rdwr.messages, &mut bytes)?;
        Ok(bytes
            .chunks_exact(RdwrMessage::bytes(width))
            .map(|bytes| RdwrMessage::parse(bytes, width))
            .collect())
    }

    pub(super) fn transfer_segments(
        &self,
        segments: &mut [Segment],
        bus: &mut dyn EmulatedAdapter,
    ) -> Result<usize, Errno> {
        let mut messages: Vec<Message<'_>> = segments.iter_mut().map(Segment::as_message).collect();
        self.transfer(&mut messages, bus)
    }

    /// The kernel's `i2c_transfer`: how many messages were carried out, or an errno.
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
                Some(Errno::EAGAIN) if retries_left > 0 => retries_left -= 1,
                Some(errno) => return Err(errno),
                None => return Ok(completed),
            }
        }
    }

    fn require_plain_i2c(&self) -> Result<(), Errno> {
        if self.mode.offers(functionality::I2C) {
            Ok(())
        } else {
            Err(Errno::EOPNOTSUPP)
        }
    }
}

/// Retries and timeout are an `int` in the kernel, and must not be negative.
fn signed_argument(argument: u64) -> Result<u32, Errno> {
    i32::try_from(argument)
        .ok()
        .and_then(|value| u32::try_from(value).ok())
        .ok_or(Errno::EINVAL)
}
