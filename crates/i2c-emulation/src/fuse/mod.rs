//! Way 3: `/dev/i2c-N` for one program, by FUSE on a single file in a private mount namespace.
//!
//! A helper thread makes the namespace, mounts FUSE on the device, and starts the program there. The calling thread
//! answers every request and accesses the program's buffers with process_vm_readv and process_vm_writev, because
//! i2c-dev's ioctl numbers carry no size and the kernel passes only the raw pointer. The crate's page lists what a
//! program can notice. In addition, children that outlive the program get ENOTCONN, and a program that may not be
//! inspected (set-user-ID, `PR_SET_DUMPABLE`) gets EPERM from ioctl unless the server is root.

mod caller;
mod namespace;
mod run;
mod session;
mod wire;

pub use namespace::DEV_ENTRIES_MAX;
pub(crate) use run::{Device, probe_with, run_devices};
pub use run::{Options, probe, run};
pub use session::OPEN_FILES_MAX;
