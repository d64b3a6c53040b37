//! Other processes reach the emulated buses over a Unix socket, with the packets of [`protocol`].
//!
//! A client addresses either the bare bus, as this crate's [`EmulatedAdapter`](crate::adapter::EmulatedAdapter), or the
//! adapter that a program finds at `/dev/i2c-N`: the [`ioctl`](crate::ioctl) layer then rejects what a real adapter
//! rejects and reports each fault by its errno.

mod conversation;
mod error;
mod inbox;
mod place;
pub mod protocol;
mod server;
mod session;
mod wire;

pub use conversation::STEP_WAIT_MAX;
pub use error::{PATH_BYTES_MAX, SocketError};
pub use server::{
    CLIENTS_MAX, IDLE_WAIT_MAX, Options, PACKET_WAIT_MAX, STOP_WAIT_MAX, Server, StopHandle,
};
pub use session::{PASS_MAX, Session};
pub use wire::{PACKET_BYTES_MAX, VERSION};
