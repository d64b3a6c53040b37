//! The strict i2c-dev layer: what `/dev/i2c-N` does, without knowing how a caller reaches it.
//!
//! It follows the kernel's `i2c-dev.c` and `i2c-core-smbus.c` errno by errno, over any [`EmulatedAdapter`](crate::adapter::EmulatedAdapter) and any
//! [`CallerMemory`]. Three things differ from the kernel, each on purpose:
//!
//! * Retries and timeout belong to the open file. The kernel keeps them with the adapter, so that one program changes
//!   them for all others.
//! * What an adapter does not offer in I2C_FUNCS it refuses with EOPNOTSUPP. A Raspberry Pi answers an SMBus block read
//!   with rubbish instead.
//! * Repeated arbitration losses end after [`RETRIES_DONE_MAX`] retries. The kernel ends them by its clock, and this
//!   layer has none.

mod errno;
mod memory;
mod mode;
mod open_file;
mod segment;
mod smbus;
#[cfg(test)]
mod tests;
mod uapi;

pub use errno::Errno;
pub use memory::CallerMemory;
pub use mode::{AdapterMode, UnknownMode};
pub use open_file::{OpenFile, RETRIES_DONE_MAX};
pub use uapi::{
    MESSAGE_BYTES_MAX, PointerWidth, RDWR_MESSAGES_MAX, SMBUS_BLOCK_MAX, functionality,
    message_flag, request, smbus_size,
};
