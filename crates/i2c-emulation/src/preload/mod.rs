//! Way 3 where FUSE is not allowed: a preloaded library that answers for `/dev/i2c-N`.
//!
//! ```text
//!  this process                                                the program, and whatever it starts
//!  ────────────                                                ──────────────────────────────────
//!  the buses, and the one ioctl layer                          LD_PRELOAD: a library of 36 KiB
//!      ▲                                                           open("/dev/i2c-1") ─▶ a socket as descriptor
//!      └── a socket without a path, a secret in the environment ◀──── ioctl, read, write on it
//! ```
//!
//! The library is carried inside this crate and lies in memory, at a path below `/proc` that ends with this process; the
//! socket has no path at all. So nothing is left behind, whatever ends whom. It holds no chip and no open file: those
//! are here, and a forked or started child finds the very same ones.
//!
//! What a program can notice, beside what the crate's page says: `ls /dev` does not list the device; the descriptor is a
//! socket in `/proc/self/fd`; a stream of the C library (`fopen`) is refused with EOPNOTSUPP; system calls that are made
//! without the C library (static programs, Go) find no device. Children that are started with an empty environment, as
//! another user, or in a process-number or network namespace of their own do not find it either.

mod carried;
mod error;
mod program_file;
#[cfg_attr(not(test), expect(dead_code, reason = "each side uses its half"))]
mod protocol;
mod run;
mod server;
#[cfg(test)]
#[expect(
    dead_code,
    reason = "here only what needs no interception can be called"
)]
mod shim;

pub use error::RunError;
pub use program_file::SCRIPTS_MAX;
pub use run::check;
pub(crate) use run::{find, run_rack};
pub use server::{CHANNELS_MAX, OPEN_FILES_MAX, STRANGERS_MAX};

/// Most buses that one program can be shown by preloading.
pub const BUSES_MAX: usize = protocol::BUSES_MAX;
