//! Way 3 where FUSE is not allowed: a preloaded library that answers for `/dev/i2c-N`.
//!
//! The library is in memory, at a path below `/proc` that ends with this process. It opens an abstract socket to this
//! process, which holds the chips and open files, so a forked or started child uses the same ones. The crate's page
//! lists what a program can notice.

mod carried;
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

pub use program_file::SCRIPTS_MAX;
pub(crate) use program_file::find;
pub use run::check;
pub(crate) use run::run_rack;
pub use server::{CHANNELS_MAX, OPEN_FILES_MAX, STRANGERS_MAX};

/// The most buses that preloading can show one program.
pub const BUSES_MAX: usize = protocol::BUSES_MAX;
