//! A strict i2c-dev layer: the kernel's `i2c-dev.c` and `i2c-core-smbus.c`, errno by errno, over any
//! [`EmulatedAdapter`](crate::adapter::EmulatedAdapter) and any [`CallerMemory`]. It differs on purpose in three ways:
//!
//! * Retries belong to the open file. The kernel keeps them with the adapter, for all programs. A timeout has no
//!   effect.
//! * An operation that I2C_FUNCS does not offer returns EOPNOTSUPP. A Raspberry Pi answers an SMBus block read with
//!   garbage instead.
//! * Repeated arbitration losses end after [`RETRIES_DONE_MAX`] retries. The kernel limits them by time.

mod mode;
mod open_file;
mod segment;
mod smbus;
#[cfg(test)]
mod tests;
mod uapi;

pub use rustix::io::Errno;

pub use mode::{AdapterMode, UnknownName};
pub use open_file::{OpenFile, RETRIES_DONE_MAX};
pub(crate) use segment::Segment;
pub use uapi::{
    CallerMemory, MESSAGE_BYTES_MAX, PointerWidth, RDWR_MESSAGES_MAX, SMBUS_BLOCK_MAX,
    functionality, message_flag, request, smbus_size,
};
pub(crate) use uapi::{SMBUS_DATA_BYTES, SmbusArgument};
