//! Way 3: `/dev/i2c-N` for one program, by FUSE on a single file in a private mount namespace.
//!
//! A helper thread makes the namespace, mounts FUSE on the device, and starts the program from there; the calling thread
//! answers every request, and reaches the program's buffers with process_vm_readv and process_vm_writev: the numbers of
//! i2c-dev's ioctls carry no size, so the kernel hands on the raw pointer. The crate's page lists what a program can
//! notice; besides, children that outlive the program get ENOTCONN, and a program that may not be inspected (set-user-ID,
//! `PR_SET_DUMPABLE`) gets EPERM from ioctl unless the server is root.

mod caller;
mod namespace;
mod run;
mod session;
mod wire;

pub use namespace::DEV_ENTRIES_MAX;
pub(crate) use run::{Device, probe_with, run_devices};
pub use run::{Options, probe, run};
pub use session::OPEN_FILES_MAX;
