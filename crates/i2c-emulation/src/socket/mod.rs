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
mod inbox;
mod place;
pub mod protocol;
mod server;
mod session;
mod wire;

use std::io;
use std::path::PathBuf;

pub use client::{Client, ClientError, ClientOptions};
pub use place::PATH_BYTES_MAX;
pub use server::{
    CLIENTS_MAX, IDLE_WAIT_MAX, Options, PACKET_WAIT_MAX, STOP_WAIT_MAX, Server, StopHandle,
};
pub use wire::{ByeReason, PACKET_BYTES_MAX, VERSION};

/// Why no server could be started.
#[derive(Debug, thiserror::Error)]
pub enum SocketError {
    /// A live server has this socket.
    #[error(
        "{} is in use: another server answers or starts there\nhint: stop that server, or choose another path",
        path.display()
    )]
    InUse {
        /// The socket's path.
        path: PathBuf,
    },
    /// Something else than a socket has this name.
    #[error("{} is there already and is no socket\nhint: choose another path; nothing was changed", path.display())]
    NotASocket {
        /// The path.
        path: PathBuf,
    },
    /// The folder of the socket is missing.
    #[error("there is no folder {}\nhint: make it with `mkdir -p`, or choose another path", folder.display())]
    NoFolder {
        /// The folder.
        folder: PathBuf,
    },
    /// A socket's path must be short.
    #[error(
        "the path is {bytes} bytes long, a socket's may have {PATH_BYTES_MAX}: {}\nhint: choose a shorter one, such as /tmp/grideye.sock",
        path.display()
    )]
    PathTooLong {
        /// The path.
        path: PathBuf,
        /// Its bytes.
        bytes: usize,
    },
    /// The folder, or the socket that is there already, is not for this user.
    #[error(
        "not permitted to make {}: {source}\nhint: choose a folder in which you may make files, such as /tmp or $XDG_RUNTIME_DIR",
        path.display()
    )]
    NotPermitted {
        /// The socket's path.
        path: PathBuf,
        /// What the kernel said.
        source: io::Error,
    },
    /// There is no bus to serve.
    #[error("no bus to serve\nhint: put at least one into the rack")]
    NoBus,
    /// A step failed for another reason.
    #[error(
        "cannot make {}: {source}\nhint: the folder must be on a file system with sockets and links, and /proc must be mounted",
        path.display()
    )]
    Failed {
        /// The socket's path.
        path: PathBuf,
        /// What the kernel said.
        source: io::Error,
    },
}
