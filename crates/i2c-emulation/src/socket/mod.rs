//! Way 2: another process reaches the emulated buses over a Unix socket.
//!
//! ```text
//!  server's process                                         any other process
//!  ────────────────                                         ─────────────────
//!  Rack: bus 1, bus 2 …       /tmp/grideye.sock             Client: embedded_hal::i2c::I2c          (Rust)
//!    ▲                        mode 0600                     grideye_i2c.py: smbus2, busio.I2C       (Python, one file)
//!    └── Server, a thread a client ◀──── packets ────────── anything that speaks PROTOCOL.md
//! ```
//!
//! The protocol is described in [`protocol`], complete enough to write a client from.
//! A client asks either the bare bus, as this crate's [`EmulatedAdapter`](crate::adapter::EmulatedAdapter) has it, or the
//! adapter as a program finds it at `/dev/i2c-N`: the same layer [`ioctl`](crate::ioctl) that stands behind FUSE then
//! refuses what a real adapter refuses, and names each fault by its errno.
//!
//! ```
//! use i2c_emulation::adapter::{EmulatedAdapter, Fault, Message, TransferError};
//! use i2c_emulation::rack::{Rack, SharedAdapter};
//! use i2c_emulation::socket::{Client, Options, Server};
//! use embedded_hal::i2c::I2c;
//!
//! /// A bus on which nobody answers.
//! struct Empty;
//! impl EmulatedAdapter for Empty {
//!     fn transfer(&mut self, _: &mut [Message<'_>]) -> Result<(), TransferError> {
//!         Err(TransferError { completed: 0, fault: Fault::NackAddress })
//!     }
//! }
//!
//! let folder = tempfile::tempdir()?;
//! let path = folder.path().join("bus.sock");
//! let mut rack = Rack::new();
//! rack.insert(1, SharedAdapter::new(Empty));
//! let server = Server::bind(&path, rack, Options::default())?; // clients can connect from here on
//! let stop = server.stop_handle();
//! let serving = std::thread::spawn(move || server.serve());
//!
//! let error = Client::connect(&path, 1)?.write(0x69, &[0x80]).unwrap_err();
//! assert_eq!(error.to_string(), "nobody acknowledged the address");
//!
//! stop.stop();
//! serving.join().unwrap();
//! assert!(!path.exists());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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
