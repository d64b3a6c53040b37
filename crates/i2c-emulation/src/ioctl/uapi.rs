//! Numbers and layouts of `linux/i2c.h` and `linux/i2c-dev.h`, and access to the calling program's memory.

use rustix::io::Errno;

/// Requests of `ioctl(2)` on `/dev/i2c-N`.
#[expect(missing_docs, reason = "the names are the kernel's")]
pub mod request {
    /// How often to retry after lost arbitration.
    pub const I2C_RETRIES: u32 = 0x0701;
    /// How long to wait, in units of 10 ms.
    pub const I2C_TIMEOUT: u32 = 0x0702;
    pub const I2C_SLAVE: u32 = 0x0703;
    pub const I2C_TENBIT: u32 = 0x0704;
    pub const I2C_FUNCS: u32 = 0x0705;
    /// As [`I2C_SLAVE`], even if a kernel driver owns the address.
    pub const I2C_SLAVE_FORCE: u32 = 0x0706;
    pub const I2C_RDWR: u32 = 0x0707;
    pub const I2C_PEC: u32 = 0x0708;
    pub const I2C_SMBUS: u32 = 0x0720;
}

/// Flags of one message of I2C_RDWR.
#[expect(missing_docs, reason = "the names are the kernel's")]
pub mod message_flag {
    pub const READ: u16 = 0x0001;
    pub const TEN_BIT: u16 = 0x0010;
    /// The first byte read holds the number of bytes that follow.
    pub const LENGTH_FIRST: u16 = 0x0400;
}

/// Bits of I2C_FUNCS.
#[expect(missing_docs, reason = "the names are the kernel's")]
pub mod functionality {
    pub const I2C: u32 = 0x0000_0001;
    pub const TEN_BIT: u32 = 0x0000_0002;
    pub const SMBUS_PEC: u32 = 0x0000_0008;
    pub const SMBUS_QUICK: u32 = 0x0001_0000;
    pub const SMBUS_BYTE: u32 = 0x0006_0000;
    pub const SMBUS_BYTE_DATA: u32 = 0x0018_0000;
    pub const SMBUS_WORD_DATA: u32 = 0x0060_0000;
    pub const SMBUS_PROC_CALL: u32 = 0x0080_0000;
    pub const SMBUS_READ_BLOCK: u32 = 0x0100_0000;
    pub const SMBUS_WRITE_BLOCK: u32 = 0x0200_0000;
    /// A block with a length known to both sides, both ways.
    pub const SMBUS_I2C_BLOCK: u32 = 0x0C00_0000;

    /// The operations that the kernel makes from plain messages.
    pub const SMBUS_EMULATED: u32 = SMBUS_QUICK
        | SMBUS_BYTE
        | SMBUS_BYTE_DATA
        | SMBUS_WORD_DATA
        | SMBUS_PROC_CALL
        | SMBUS_WRITE_BLOCK
        | SMBUS_I2C_BLOCK
        | SMBUS_PEC;
    /// The operations of a controller that can read a length byte itself.
    pub const SMBUS_WITH_BLOCK_READ: u32 = SMBUS_QUICK
        | SMBUS_BYTE
        | SMBUS_BYTE_DATA
        | SMBUS_WORD_DATA
        | SMBUS_READ_BLOCK
        | SMBUS_WRITE_BLOCK
        | SMBUS_I2C_BLOCK;
}

/// Kinds of I2C_SMBUS transfer (its field `size`).
#[expect(missing_docs, reason = "the names are the kernel's")]
pub mod smbus_size {
    /// The address alone; the direction bit is the data.
    pub const QUICK: u32 = 0;
    pub const BYTE: u32 = 1;
    pub const BYTE_DATA: u32 = 2;
    /// Two bytes of a register, low byte first.
    pub const WORD_DATA: u32 = 3;
    pub const PROC_CALL: u32 = 4;
    pub const BLOCK_DATA: u32 = 5;
    /// The old form of [`I2C_BLOCK_DATA`]; it always reads 32 bytes.
    pub const I2C_BLOCK_BROKEN: u32 = 6;
    pub const BLOCK_PROC_CALL: u32 = 7;
    /// A block with a length known to both sides.
    pub const I2C_BLOCK_DATA: u32 = 8;
}

/// The most messages of one I2C_RDWR (I2C_RDWR_IOCTL_MAX_MSGS).
pub const RDWR_MESSAGES_MAX: usize = 42;
/// The most bytes of one message, and of one read() or write().
pub const MESSAGE_BYTES_MAX: usize = 8192;
/// The most bytes of an SMBus block (I2C_SMBUS_BLOCK_MAX).
pub const SMBUS_BLOCK_MAX: usize = 32;
/// Bytes of `union i2c_smbus_data`.
pub(crate) const SMBUS_DATA_BYTES: usize = SMBUS_BLOCK_MAX + 2;

/// The calling program's pointer width; the layouts of I2C_RDWR and I2C_SMBUS depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it")]
pub enum PointerWidth {
    Bits32,
    Bits64,
}

impl PointerWidth {
    /// Bytes of a pointer, and of C's `unsigned long`.
    #[must_use]
    pub const fn bytes(self) -> usize {
        match self {
            Self::Bits32 => 4,
            Self::Bits64 => 8,
        }
    }
}

/// The calling program's memory, wherever it is.
///
/// Addresses come from the caller and can be anything, even unaligned: an implementation returns EFAULT and never
/// trusts them.
pub trait CallerMemory {
    /// Copies bytes from the caller; after an error, none count.
    /// # Errors
    /// EFAULT if the caller has no such memory; EPERM if it may not be read.
    fn read(&mut self, address: u64, into: &mut [u8]) -> Result<(), Errno>;

    /// Copies bytes to the caller. After an error some may have been written, as in the kernel.
    /// # Errors
    /// EFAULT if the caller has no such memory or may not write it; EPERM if it may not be accessed.
    fn write(&mut self, address: u64, bytes: &[u8]) -> Result<(), Errno>;

    /// The caller's pointer width.
    fn pointer_width(&self) -> PointerWidth {
        PointerWidth::Bits64
    }
}

/// `struct i2c_msg`: address, flags, length, padding, pointer; 12 or 16 bytes.
pub(super) struct RdwrMessage {
    pub(super) address: u16,
    pub(super) flags: u16,
    pub(super) length: u16,
    pub(super) buffer: u64,
}

impl RdwrMessage {
    pub(super) const fn bytes(width: PointerWidth) -> usize {
        8 + width.bytes()
    }

    pub(super) fn parse(bytes: &[u8], width: PointerWidth) -> Self {
        Self {
            address: u16_at(bytes, 0),
            flags: u16_at(bytes, 2),
            length: u16_at(bytes, 4),
            buffer: pointer_at(bytes, 8, width),
        }
    }
}

/// `struct i2c_smbus_ioctl_data`: direction, command, padding, size, pointer; 12 or 16 bytes.
#[derive(Debug)]
pub(crate) struct SmbusArgument {
    pub(crate) read_write: u8,
    pub(crate) command: u8,
    pub(crate) size: u32,
    pub(crate) data: u64,
}

impl SmbusArgument {
    pub(super) const fn bytes(width: PointerWidth) -> usize {
        8 + width.bytes()
    }

    pub(super) fn parse(bytes: &[u8], width: PointerWidth) -> Self {
        Self {
            read_write: bytes.first().copied().unwrap_or(0),
            command: bytes.get(1).copied().unwrap_or(0),
            size: u32_at(bytes, 4),
            data: pointer_at(bytes, 8, width),
        }
    }
}

pub(super) fn pointer_at(bytes: &[u8], offset: usize, width: PointerWidth) -> u64 {
    match width {
        PointerWidth::Bits32 => u64::from(u32_at(bytes, offset)),
        PointerWidth::Bits64 => u64::from_ne_bytes(array_at(bytes, offset)),
    }
}

pub(super) fn u32_at(bytes: &[u8], offset: usize) -> u32 {
    u32::from_ne_bytes(array_at(bytes, offset))
}

fn u16_at(bytes: &[u8], offset: usize) -> u16 {
    u16::from_ne_bytes(array_at(bytes, offset))
}

/// The bytes at an offset. Bytes past the end count as zero; callers size their buffers to rule that out.
fn array_at<const N: usize>(bytes: &[u8], offset: usize) -> [u8; N] {
    let mut array = [0; N];
    for (to, from) in array.iter_mut().zip(bytes.iter().skip(offset)) {
        *to = *from;
    }
    array
}
