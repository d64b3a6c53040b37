//! Way 2: another process reaches the emulated buses over a Unix socket, by the packets of [`protocol`].
//!
//! A client asks either the bare bus, as this crate's [`EmulatedAdapter`](crate::adapter::EmulatedAdapter) has it, or the
//! adapter as a program finds it at `/dev/i2c-N`: the layer [`ioctl`](crate::ioctl) then refuses what a real adapter
//! refuses, and names each fault by its errno.

mod client;
mod error;
mod inbox;
mod place;
pub mod protocol;
mod server;
mod session;
mod wire;

pub use client::{Client, ClientError, ClientOptions};
pub use error::{PATH_BYTES_MAX, SocketError};
pub use server::{
    CLIENTS_MAX, IDLE_WAIT_MAX, Options, PACKET_WAIT_MAX, STOP_WAIT_MAX, Server, StopHandle,
};
pub use wire::{ByeReason, PACKET_BYTES_MAX, VERSION};
