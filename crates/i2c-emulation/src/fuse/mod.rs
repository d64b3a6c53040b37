//! Way 3: `/dev/i2c-N` for one program, by FUSE on a single file in a private mount namespace.
//!
//! ```text
//!  calling thread                 helper thread                        the program
//!  ──────────────                 ─────────────                        ───────────
//!  run() ───────────────────────▶ own mount namespace: /dev rebuilt,
//!                                 FUSE mounted on /dev/i2c-N
//!                                 starts the program from there ─────▶ open("/dev/i2c-N"), ioctl(…)
//!  answers every request ◀──────────── /dev/fuse ◀──────────────────── (the kernel waits for the answer)
//!     │  its buffers: process_vm_readv/writev ───────────────────────▶
//!                                 waits for the program's end ◀─────── exit
//!  returns the exit status ◀───── wakes the calling thread
//! ```
//!
//! The numbers of i2c-dev's ioctls carry no size, so the kernel hands on the raw pointer.
//!
//! What a program can notice: `stat` says regular file; there is no `/sys/class/i2c-dev`, so `i2cdetect -l` lists nothing;
//! a `write` or `read` of no bytes never reaches the bus; `lseek` succeeds without effect; the pieces of a `readv` or
//! `writev` are one message; children that outlive the program get ENOTCONN; a program that may not be inspected
//! (set-user-ID, `PR_SET_DUMPABLE`) gets EPERM from ioctl unless the server is root.

mod caller;
mod namespace;
mod run;
mod session;
mod wire;

pub use namespace::DEV_ENTRIES_MAX;
pub(crate) use run::{Device, probe_with, run_devices};
pub use run::{Options, probe, run};
pub use session::OPEN_FILES_MAX;
