//! `/dev/i2c-N` for one program and what it starts: this process answers their system calls on that path and on its open
//! files, by a seccomp filter with user notification. The kernel carries out every other call as ever.
//!
//! ```text
//!  program ── openat("/dev/i2c-1") ──▶ filter ──▶ supervisor ──▶ a descriptor from 900 on
//!          ── ioctl(900, 0x07…) ─────▶ filter ──▶ supervisor ──▶ ioctl ──▶ the bus
//!          ── read(3, …) ────────────▶ filter ──▶ the kernel
//! ```
//!
//! A filter sees numbers, not memory. So it asks for every path; for ioctls of type 7; and for other calls on
//! descriptors from [`ASKED_FROM`] on, where the supervisor puts its own. The open file in the program is a file that
//! can neither be read nor written, with a name that tells which it is: the kernel keeps account of copies, forks and
//! closes.

mod attributes;
mod call;
mod caretaker;
mod file;
mod filter;
mod listener;
mod memory;
mod run;
mod session;
mod subject;

pub use filter::ASKED_FROM;
pub(crate) use run::{Rights, probe, run_rack};
pub use session::OPEN_FILES_MAX;
